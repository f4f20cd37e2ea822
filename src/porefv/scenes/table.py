"""Table and Scene: the bases of the pydantic models of scene files, and fields that are made from tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, ClassVar, Protocol, Self

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, PrivateAttr, ValidationError, model_validator
from pydantic_core import core_schema

from porefv.errors import InputError
from porefv.scenes.errors import input_error, refused, refused_keys, suggestion, tag
from porefv.scenes.toml_file import SceneSource
from porefv.scenes.units import has_text, in_unit


class Table(BaseModel):
    """A table of a scene file. Its fields are the keys, described by `porefv.scenes.values.key`."""

    # The models of tables are built as parts of that of their scene, which is built when a scene is read.
    model_config = ConfigDict(
        strict=True, extra="forbid", frozen=True, allow_inf_nan=False, validate_default=True, defer_build=True
    )

    # What a key of the table is called.
    noun: ClassVar[str] = "key"
    # What is said of keys that somebody may look for here.
    advice: ClassVar[Mapping[str, str]] = {}

    @classmethod
    def check_keys(cls, keys: Sequence[str]) -> None:
        """Refuse unknown keys; in derived classes also those that exclude each other, and what is missing then.

        The keys are in the order of the file.
        """
        for key in keys:
            if key in cls.advice:
                raise refused(cls.advice[key], key)
            if key not in cls.model_fields:
                raise refused(f"unknown {cls.noun} '{key}'{suggestion(key, cls.model_fields)}", key)

    @model_validator(mode="before")
    @classmethod
    def _with_known_keys(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        # TOML has no null: in plain data from Python, None stands for a key that is left out.
        given = {str(key): value for key, value in data.items() if value is not None}
        cls.check_keys(list(given))
        return cls._in_units_of_keys(given)

    @classmethod
    def _in_units_of_keys(cls, given: dict[str, Any]) -> dict[str, Any]:
        """The values, with texts such as "1 mm" as numbers in the units of their keys."""
        refusals = []
        for key, value in given.items():
            extra = cls.model_fields[key].json_schema_extra
            unit = extra["unit"] if isinstance(extra, dict) else ""
            if not (unit and has_text(value)):
                continue
            try:
                given[key] = in_unit(value, str(unit))
            except ValueError as error:
                refusals.append((str(error), key))
        if refusals:
            raise refused_keys(refusals)
        return given


class Scene(Table):
    """A scene that is read from a TOML file, or from the same as plain data."""

    _path: Path | None = PrivateAttr(None)
    _data: Mapping[str, Any] = PrivateAttr(default_factory=dict)

    @property
    def path(self) -> Path | None:
        """The scene file; None for a scene from plain data."""
        return self._path

    @property
    def data(self) -> Mapping[str, Any]:
        """What the scene says, as plain data."""
        return self._data

    @classmethod
    def read(cls, path: str | PathLike[str]) -> Self:
        """Read a scene file; relative paths in it are relative to its directory.

        Raises
        ------
        InputError
            If the file cannot be read, or says something that is unknown, of the wrong kind, or impossible.
        """
        path = Path(path)
        return cls._validated(SceneSource.read(path), path.parent, path)

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any], directory: str | PathLike[str] = ".") -> Self:
        """A scene from plain data, keys as in the file; relative paths are relative to `directory`.

        Raises
        ------
        InputError
            As `read`.
        """
        return cls._validated(SceneSource(dict(data)), Path(directory), None)

    @classmethod
    def from_record(cls, data: Mapping[str, Any]) -> Self:
        """The scene of a run, from the record in its results: its files need not exist any more.

        Raises
        ------
        InputError
            As `read`.
        """
        return cls._validated(SceneSource(dict(data)), Path(), None, recorded=True)

    @classmethod
    def _validated(cls, source: SceneSource, directory: Path, path: Path | None, *, recorded: bool = False) -> Self:
        try:
            scene = cls.model_validate(source.data, context={"directory": directory, "recorded": recorded})
        except ValidationError as errors:
            raise input_error(errors, source) from None
        scene._path, scene._data = path, source.data
        return scene


class Maker(Protocol):
    """A table that an object is made from."""

    def make(self) -> Any: ...


class MadeFrom:
    """A field whose value is an object that a table makes.

    What the object refuses is an error of the key that the message names.
    """

    def __init__(self, table: type[Maker]):
        self.table = table

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_after_validator_function(_made, handler.generate_schema(self.table))


class OneOf:
    """A field whose value is of one of some kinds.

    Parameters
    ----------
    choose : callable
        Name of the kind of a value.
    **kinds : type
        By name.
    """

    def __init__(self, choose: Callable[[Any], str], **kinds: Any):
        self.choose, self.kinds = choose, kinds

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.tagged_union_schema(
            {tag(name): handler.generate_schema(kind) for name, kind in self.kinds.items()},
            discriminator=lambda value: tag(self.choose(value)),
        )


def _made(table: Any) -> Any:
    try:
        return table.make()
    except InputError as error:
        raise refused(str(error), _named(str(error), table)) from None


def _named(message: str, table: Table) -> str:
    """The key of a table that a message is about: the one it starts with, else the last that it mentions."""
    keys = [key for key in type(table).model_fields if key in table.model_fields_set]
    starts = [key for key in keys if message.startswith(key)]
    mentioned = [key for key in reversed(keys) if key in message]
    return next(iter([*starts, *mentioned, *keys, *type(table).model_fields]))
