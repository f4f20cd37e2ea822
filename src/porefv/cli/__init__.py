"""The command line."""

from porefv.cli.program import command, main

__all__ = ["command", "main"]
