"""Options that several commands have."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_run_options(parser: argparse.ArgumentParser, force: str) -> None:
    """Options of the commands that compute from a scene; `force` is the help of --force."""
    parser.add_argument("scene", metavar="SCENE.toml", type=Path)
    parser.add_argument("--force", action="store_true", help=force)
    parser.add_argument("--threads", metavar="N", type=_count, help="compute with at most N threads")
    parser.add_argument("--quiet", action="store_true", help="print errors only")


def _count(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"expected a number of threads, 1 or more, not '{text}'")
    return int(text)
