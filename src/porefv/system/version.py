"""The version of the package, for the files it writes and the packages built of it."""

__version__ = "0.2.0"
