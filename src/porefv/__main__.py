"""`python -m porefv` is the command `porefv`."""

import sys

from porefv.cli import main

if __name__ == "__main__":
    sys.exit(main())
