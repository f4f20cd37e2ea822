"""Options that several commands have."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


def add_command(commands: Any, name: str, summary: str, examples: str, page: str) -> argparse.ArgumentParser:
    """Add a command; its help ends with examples, one a line, and the page of the documentation that says more."""
    lines = "\n".join(f"  {line}" for line in examples.splitlines())
    parser: argparse.ArgumentParser = commands.add_parser(
        name, help=summary, description=f"{summary[0].upper()}{summary[1:]}.",
        epilog=f"examples:\n{lines}\n\nMore in the documentation: docs/{page}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    return parser


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
