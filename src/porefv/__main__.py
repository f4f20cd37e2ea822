"""`python -m porefv` is the command `porefv`."""

import sys

from porefv.cli.program import main

if __name__ == "__main__":
    sys.exit(main())
