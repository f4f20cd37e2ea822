"""The text of a scene: a TOML file that is read, and the lines on which its keys stand."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from porefv.errors import InputError

# Most bytes of a scene file.
_LARGEST = 2**26


@dataclass(frozen=True)
class SceneSource:
    """Where a scene comes from: a TOML file, or plain data of the same structure.

    Attributes
    ----------
    data : dict
        The keys and values at the top.
    name : str
        The file, to be named in errors.
    text : str
        The text of the file; empty for plain data.
    """

    data: dict[str, Any]
    name: str = "scene"
    text: str = ""

    @classmethod
    def read(cls, path: Path) -> SceneSource:
        """Read a TOML file.

        Raises
        ------
        InputError
            If the file cannot be read, or is not TOML.
        """
        try:
            with path.open("rb") as file:
                content = file.read(_LARGEST + 1)  # devices have no end
            if len(content) > _LARGEST:
                raise InputError(f"cannot read the scene {path}: it has more than {_LARGEST >> 20} MiB; is it a scene?")
            text = content.decode("utf-8-sig").replace("\r\n", "\n")
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is not a text file in UTF-8"
            raise InputError(f"cannot read the scene {path}: {reason}") from None
        try:
            return cls(tomllib.loads(text), str(path), text)
        except tomllib.TOMLDecodeError as error:
            raise InputError(_unreadable(path, text, str(error))) from None
        except ValueError as error:  # a number of more digits than Python reads
            raise InputError(f"{path}: not TOML that can be read: {str(error).partition(';')[0]}") from None
        except RecursionError:
            raise InputError(f"{path}: not TOML that can be read: it is nested too deeply") from None


def line_of(text: str, table: str, key: str) -> int | None:
    """Line of a key of a table in TOML text, counted from 1; else of the innermost table around it; else None.

    The table that follows [[stages]] for the second time is called `stages 2`.
    """
    wanted = f"{table}.{key}" if table else key
    current, lists = "", dict[str, int]()
    nearest, length = None, 0
    for number, line in enumerate(text.splitlines(), 1):
        if header := re.match(r"\s*(\[\[?)\s*([^\[\]]+?)\s*\]", line):
            name = header[2].replace('"', "").replace(" ", "")
            if header[1] == "[[":
                lists[name] = lists.get(name, 0) + 1
            current = path = re.sub(r"^[^.]+", lambda found: _element(found[0], lists), name)
        elif assignment := re.match(r"\s*([\w.\"'-]+)\s*=", line):
            path = ".".join(filter(None, [current, re.sub("[\"']", "", assignment[1])]))
        else:
            continue
        if path == wanted:
            return number
        if wanted.startswith(f"{path}.") and len(path) > length:
            nearest, length = number, len(path)
    return nearest


def _element(name: str, lists: Mapping[str, int]) -> str:
    return f"{name} {lists[name]}" if name in lists else name


def _unreadable(path: Path, text: str, message: str) -> str:
    """A TOML error with the line it is on."""
    found = re.search(r"\(at line (\d+), column (\d+)\)", message)
    if not found:
        return f"{path}: not TOML: {message}"
    number, column = int(found[1]), int(found[2])
    start = max(column - 100, 0)
    line = text.split("\n")[number - 1].rstrip("\r")[start : column + 100]
    pointer = " " * (column - 1 - start) + "^"
    return f"{path}, line {number}: not TOML: {message[: found.start()].strip()}\n    {line}\n    {pointer}"
