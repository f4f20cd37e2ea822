"""The command line."""

from porefv.cli.program import main

__all__ = ["main"]
