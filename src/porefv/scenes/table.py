"""Table: a table of a scene file, read key by key; errors name the file, the line, the key and the remedy."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Iterable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any, Self

from porefv.errors import InputError
from porefv.packing.box import Box
from porefv.system.number_checks import is_finite_number

_REQUIRED: Any = object()


class Table:
    """A table of a scene.

    Parameters
    ----------
    data : dict
        Its keys and values.
    source : str
        The scene file, to be named in errors.
    text : str
        The file's text, to find the lines of keys in.
    name : str
        The table's name, empty for the whole file.
    """

    def __init__(self, data: dict[str, Any], source: str, text: str = "", name: str = ""):
        self.data, self.source, self.text, self.name = data, source, text, name

    @classmethod
    def read(cls, path: Path) -> Table:
        """The whole of a TOML file."""
        try:
            text = path.read_text(encoding="utf-8-sig")
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is not a text file in UTF-8"
            raise InputError(f"cannot read the scene {path}: {reason}") from None
        try:
            return cls(tomllib.loads(text), str(path), text)
        except tomllib.TOMLDecodeError as error:
            raise InputError(_unreadable(path, text, str(error))) from None
        except RecursionError:
            raise InputError(f"{path}: not TOML that can be read: it is nested too deeply") from None

    def only(self, *known: str, noun: str = "key") -> Table:
        """This table, whose keys are all among those known."""
        for key in self.data:
            if key not in known:
                raise self.error(key, f"unknown {noun} '{key}'{suggestion(key, known)}")
        return self

    def table(self, key: str) -> Table:
        """The table of that name, empty if there is none."""
        value = self.data.get(key, {})
        if not isinstance(value, Mapping):
            raise self.error(key, f"expected a table [{self._full(key)}], not {value!r}")
        return Table(dict(value), self.source, self.text, self._full(key))

    def tables(self, key: str) -> list[Table]:
        """The tables [[key]] of a list, the first called `key 1`."""
        values = self.data.get(key, [])
        if not isinstance(values, list | tuple) or not all(isinstance(value, Mapping) for value in values):
            raise self.error(key, f"expected a list of tables [[{self._full(key)}]], not {values!r}")
        return [
            Table(dict(value), self.source, self.text, f"{self._full(key)} {number}")
            for number, value in enumerate(values, 1)
        ]

    def string(self, key: str, default: Any = _REQUIRED, choices: Iterable[str] = ()) -> Any:
        """A text, one of the choices if there are any."""
        value = self._get(key, default)
        if value is default:
            return value
        if not isinstance(value, str):
            raise self.error(key, f"expected a text in quotes, not {value!r}")
        if "\0" in value:
            raise self.error(key, f"a zero byte stands in {value!r}, which no name can hold")
        choices = tuple(choices)
        if choices and value not in choices:
            raise self.error(key, f"unknown {key} '{value}'{suggestion(value, choices)}")
        return value

    def strings(self, key: str, default: Any, choices: Iterable[str]) -> tuple[str, ...]:
        """A list of different texts among the choices, in the order of these."""
        values = self._get(key, default)
        choices = tuple(choices)
        if not isinstance(values, list | tuple) or not all(isinstance(value, str) for value in values):
            raise self.error(key, f'expected a list such as ["{choices[0]}"], not {values!r}')
        for value in values:
            if value not in choices:
                raise self.error(key, f"'{value}' is unknown{suggestion(value, choices)}")
        return tuple(choice for choice in choices if choice in values)

    def flag(self, key: str, default: bool) -> bool:
        """True or false."""
        value = self._get(key, default)
        if not isinstance(value, bool):
            raise self.error(key, f"expected true or false, not {value!r}")
        return value

    def number(self, key: str, default: Any = _REQUIRED) -> Any:
        """A finite number."""
        value = self._get(key, default)
        if value is not default and not is_finite_number(value):
            raise self.error(key, f"expected a finite number, not {value!r}")
        return value if value is default else float(value)

    def whole(self, key: str, least: int, default: int | None = None) -> int:
        """A whole number, `least` or more."""
        value = self.number(key) if default is None else self.number(key, default)
        if value != int(value) or value < least:
            raise self.error(key, f"expected a whole number, {least} or more, not {self.data[key]!r}")
        return int(value)

    def make(self, kind: Any, **values: Any) -> Any:
        """An object of a kind from values of keys; what it refuses is an error of the key it names."""
        try:
            return kind(**values)
        except InputError as error:
            key = next((key for key in values if str(error).startswith(key)), next(iter(values)))
            raise self.error(key, str(error)) from None

    def numbers(self, key: str) -> tuple[float, ...]:
        """A list of finite numbers."""
        values = self._get(key, _REQUIRED)
        if not isinstance(values, list | tuple) or not all(is_finite_number(x) for x in values):
            raise self.error(key, f"expected a list of finite numbers such as [0.0, 1.0], not {values!r}")
        return tuple(float(x) for x in values)

    def vector(self, key: str, default: Any = _REQUIRED) -> tuple[float, float, float]:
        """Three finite numbers."""
        value = self._get(key, default)
        if not isinstance(value, list | tuple) or len(value) != 3 or not all(is_finite_number(x) for x in value):
            raise self.error(key, f"expected three finite numbers such as [0.0, 0.0, 1.0], not {value!r}")
        return float(value[0]), float(value[1]), float(value[2])

    def box(self, lower: Any = _REQUIRED) -> Box:
        """The box that `lower`, with this default, and `upper` give."""
        self.only("lower", "upper")
        corners = self.vector("lower", lower), self.vector("upper")
        try:
            return Box(*corners)
        except InputError as error:
            raise self.error("upper", str(error)) from None

    def error(self, key: str, message: str) -> InputError:
        """An error about a key of this table: where, and what."""
        line = line_of(self.text, self.name, key)
        where = self.source if line is None else f"{self.source}, line {line}"
        return InputError(f"{where}: {f'[{self.name}] ' if self.name else ''}{message_of(key, message)}")

    def _get(self, key: str, default: Any) -> Any:
        if key not in self.data and default is _REQUIRED:
            table = f"in [{self.name}]" if self.name else "at the top of the file"
            raise self.error(key, f"missing; give it {table}")
        return self.data.get(key, default)

    def _full(self, key: str) -> str:
        return f"{self.name}.{key}" if self.name else key


class SceneFile:
    """A scene that is read from a TOML file, or from the same as plain data."""

    @classmethod
    def from_table(cls, top: Table, directory: Path, path: Path | None = None) -> Self:
        raise NotImplementedError

    @classmethod
    def read(cls, path: str | PathLike[str]) -> Self:
        """Read a scene file; relative paths in it are relative to its directory.

        Raises
        ------
        InputError
            If the file cannot be read, or says something that is unknown, of the wrong kind, or impossible.
        """
        path = Path(path)
        return cls.from_table(Table.read(path), path.parent, path)

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any], directory: str | PathLike[str] = ".") -> Self:
        """A scene from plain data, keys as in the file; relative paths are relative to `directory`."""
        return cls.from_table(Table(dict(data), source="scene"), Path(directory))


def message_of(key: str, message: str) -> str:
    """The message, after the key unless it names the key itself."""
    return message if f"'{key}'" in message or message.startswith(key) else f"{key}: {message}"


def suggestion(word: str, known: Iterable[str]) -> str:
    """The end of a sentence about an unknown word: the nearest known one, or all of them."""
    known = tuple(known)
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    return f"; did you mean '{near[0]}'?" if near else f"; known: {', '.join(known)}"


def line_of(text: str, table: str, key: str) -> int | None:
    """Line of a key of a table in TOML text, counted from 1; else of the innermost table around it; else None."""
    wanted = f"{table}.{key}" if table else key
    current, lists = "", dict[str, int]()
    nearest, length = None, 0
    for number, line in enumerate(text.splitlines(), 1):
        if header := re.match(r"\s*(\[\[?)\s*([^\[\]]+?)\s*\]", line):
            name = header[2].replace('"', "").replace(" ", "")
            if header[1] == "[[":
                lists[name] = lists.get(name, 0) + 1
            # What follows [[stages]] for the second time is in the table `stages 2`.
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
