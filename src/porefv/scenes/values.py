"""Kinds of values in scenes: what is checked of a value, and what the JSON Schema says about it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from porefv.scenes.errors import CHOICE, EXPECTED, LIMITS, REFUSED, suggestion
from porefv.system.number_checks import is_finite_number

CoreSchema = core_schema.CoreSchema
JsonSchema = dict[str, Any]
_REQUIRED: Any = ...


def key(meaning: str, default: Any = _REQUIRED, *, unit: str = "", shown: str = "") -> Any:
    """A key of a table, described for the JSON Schema and for the reference pages.

    Parameters
    ----------
    meaning : str
        In Markdown; links are relative to the folder of the pages.
    default : optional
        As it would stand in the file; {} for a table. Without it the key is required.
    unit : str
        Of a number.
    shown : str
        In place of the default value, where that alone does not say what happens.
    """
    return Field(default, description=meaning, json_schema_extra={"unit": unit, "shown": shown})


class Limits:
    """A finite number between limits.

    Parameters
    ----------
    must : str
        What is said of a number beyond them, as in "must lie between 0 and 1". Without it the limits are only
        documented: the object that is made from the table checks them.
    above, least, most, below : float, optional
        The limits; `above` and `below` are excluded.
    """

    def __init__(
        self,
        must: str = "",
        *,
        above: float | None = None,
        least: float | None = None,
        most: float | None = None,
        below: float | None = None,
    ):
        self.must = must
        self.bounds = {"gt": above, "ge": least, "le": most, "lt": below}

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        if not self.must:
            return _number()
        return core_schema.custom_error_schema(
            _number(**self.bounds), custom_error_type=LIMITS, custom_error_message=self.must
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchema:
        names = {"gt": "exclusiveMinimum", "ge": "minimum", "le": "maximum", "lt": "exclusiveMaximum"}
        bounds = {names[name]: bound for name, bound in self.bounds.items() if bound is not None}
        return {"type": "number"} | bounds


class Numbers:
    """A list of finite numbers, as a tuple.

    Parameters
    ----------
    expected : str
        What is expected, as in "three finite numbers".
    count : int, optional
        How many there must be.
    holds : callable, optional
        What must hold for them.
    """

    def __init__(self, expected: str, count: int | None = None, holds: Callable[[Sequence[float]], bool] | None = None):
        self.expected, self.count, self.holds = expected, count, holds

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        # Not strict: plain data from Python may have tuples, too.
        numbers = core_schema.list_schema(_number(), min_length=self.count, max_length=self.count, strict=False)
        return core_schema.custom_error_schema(
            core_schema.no_info_after_validator_function(self._checked, numbers),
            custom_error_type=EXPECTED, custom_error_message=self.expected,
        )  # fmt: skip

    def _checked(self, values: list[float]) -> tuple[float, ...]:
        if self.holds is not None and not self.holds(values):
            raise ValueError
        return tuple(values)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchema:
        counts = {} if self.count is None else {"minItems": self.count, "maxItems": self.count}
        return {"type": "array", "items": {"type": "number"}} | counts


class Whole:
    """A whole number, `least` or more, and `most` or less; 2.0 is one."""

    def __init__(self, least: int, most: int | None = None):
        self.least, self.most = least, most

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        number = core_schema.int_schema(strict=True, ge=self.least, le=self.most)
        bounds = f"{self.least} or more" if self.most is None else f"{self.least} to {self.most}"
        return core_schema.custom_error_schema(
            core_schema.no_info_before_validator_function(_without_fraction, number),
            custom_error_type=EXPECTED, custom_error_message=f"a whole number, {bounds}",
        )  # fmt: skip


class AnyWhole:
    """A whole number, of any sign; 2.0 is one."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.custom_error_schema(
            core_schema.no_info_before_validator_function(_without_fraction, core_schema.int_schema(strict=True)),
            custom_error_type=EXPECTED, custom_error_message="a whole number such as 0 or -1",
        )  # fmt: skip


class Choice:
    """One of some texts."""

    def __init__(self, choices: Sequence[str]):
        self.choices = list(choices)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        # One text: early versions of pydantic have no lists there.
        context = {"choices": " ".join(self.choices)}
        return core_schema.custom_error_schema(
            core_schema.literal_schema(self.choices),
            custom_error_type=CHOICE, custom_error_message=CHOICE, custom_error_context=context,
        )  # fmt: skip

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchema:
        return {"type": "string", "enum": self.choices}


class Choices:
    """A list of some of the texts, as a tuple in their order."""

    def __init__(self, choices: Sequence[str]):
        self.choices = list(choices)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        texts = core_schema.custom_error_schema(
            core_schema.list_schema(core_schema.str_schema(strict=True), strict=False),
            custom_error_type=EXPECTED, custom_error_message=f'a list such as ["{self.choices[0]}"]',
        )  # fmt: skip
        return core_schema.no_info_after_validator_function(self._in_order, texts)

    def _in_order(self, texts: list[str]) -> tuple[str, ...]:
        for text in texts:
            if text not in self.choices:
                message = f"{text!r} is unknown{suggestion(text, self.choices)}"
                raise PydanticCustomError(REFUSED, "{message}", {"message": message})
        return tuple(choice for choice in self.choices if choice in texts)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchema:
        return {"type": "array", "items": {"type": "string", "enum": self.choices}}


class InFolder:
    """A path, relative to the folder of the scene; `~` at its start is the home directory."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_after_validator_function(_in_folder, handler.generate_schema(Text))


def _number(
    gt: float | None = None, ge: float | None = None, le: float | None = None, lt: float | None = None
) -> CoreSchema:
    return core_schema.float_schema(strict=True, allow_inf_nan=False, gt=gt, ge=ge, le=le, lt=lt)


def _without_fraction(value: object) -> object:
    if isinstance(value, int | float) and not is_finite_number(value):
        raise ValueError
    return int(value) if isinstance(value, float) and value == int(value) else value


def _in_folder(text: str, info: core_schema.ValidationInfo) -> Path:
    try:
        return (info.context or {}).get("directory", Path()) / Path(text).expanduser()
    except RuntimeError:
        raise ValueError(f"the home directory in {text!r} is not known; write it out") from None


def _without_zero_byte(text: str) -> str:
    if "\0" in text:
        raise ValueError(f"a zero byte stands in {text!r}, which no name can hold")
    if "\n" in text or "\r" in text:
        raise ValueError(f"a line break stands in {text!r}; give a name in one line")
    return text


Text = Annotated[str, AfterValidator(_without_zero_byte)]
ScenePath = Annotated[Path, InFolder()]
Vector = Annotated[tuple[float, float, float], Numbers("three finite numbers such as [0.0, 0.0, 1.0]", count=3)]
Seconds = Annotated[float, Limits("must be a positive number of s", above=0.0)]
Integer = Annotated[int, AnyWhole()]
Fraction = Annotated[float, Limits("must lie between 0 and 1", above=0.0, below=1.0)]
Unbalanced = Annotated[float, Limits("must lie between 1e-8 and 1", least=1.0e-8, below=1.0)]
