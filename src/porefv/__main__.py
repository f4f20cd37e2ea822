"""`python -m porefv` is the command `porefv`."""

from porefv.cli.program import command

if __name__ == "__main__":
    command()
