"""Errors of scenes: what pydantic finds wrong, in words that name the file, the line, the key and the remedy."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pydantic import ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from porefv.errors import InputError
from porefv.scenes.toml_file import SceneSource, line_of
from porefv.system.number_checks import is_finite_number

# Types of our own errors (pydantic's are in its documentation). Their messages are completed here with the value.
REFUSED, EXPECTED, LIMITS, CHOICE = "refused", "expected", "limits", "choice"
# Most errors in one message, and most characters of a value in it.
_MOST, _LENGTH = 5, 80
_EXPECTED = {
    "float_type": "a finite number",
    "finite_number": "a finite number",
    "bool_type": "true or false",
    "string_type": "a text in quotes",
}


def refused(message: str, *path: str | int) -> ValidationError:
    """What a validator raises: a message about the key at a path from the table that the validator is about."""
    return ValidationError.from_exception_data("scene", [_refusal(message, *path)])


def refused_keys(refusals: Iterable[tuple[str, str]]) -> ValidationError:
    """As `refused`, of several keys of the table: a message and a key each."""
    return ValidationError.from_exception_data("scene", [_refusal(message, key) for message, key in refusals])


def _refusal(message: str, *path: str | int) -> InitErrorDetails:
    error = PydanticCustomError(REFUSED, "{message}", {"message": message})
    return InitErrorDetails(type=error, loc=path, input=None)


def suggestion(word: str, known: Iterable[str]) -> str:
    """The end of a sentence about an unknown word: the nearest known one, or all of them."""
    known = tuple(known)
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    return f"; did you mean '{near[0]}'?" if near else f"; known: {', '.join(known)}"


def tag(name: str) -> str:
    """How a kind of value is called in the locations of pydantic's errors, where it is no key of the file."""
    return f"<{name}>"


def input_error(errors: ValidationError, source: SceneSource) -> InputError:
    """The errors in a scene in the order of their lines, a few at most."""
    found = [_described(error, source) for error in errors.errors(include_url=False)]
    found.sort(key=lambda problem: problem[0])
    lines = [message for _, message in found[:_MOST]]
    if len(found) > _MOST:
        lines.append(f"... and {len(found) - _MOST} more")
    return InputError("\n".join(lines))


def _described(error: Mapping[str, Any], source: SceneSource) -> tuple[int, str]:
    """Line of an error, 0 if it has none, and its message."""
    path = [step for step in error["loc"] if isinstance(step, int) or step != tag(step[1:-1])]
    if path and isinstance(path[-1], int):  # an element of [[stages]] that is no table
        path.pop()
    table, key = _table_name(path[:-1]), str(path[-1]) if path else ""
    message = _message(error, table, key)
    if not path:
        return 0, f"{source.name}: {message}"
    if f"'{key}'" not in message and not message.startswith(key):
        message = f"{key}: {message}"
    line = line_of(source.text, table, key)
    where = source.name if line is None else f"{source.name}, line {line}"
    return line or 0, f"{where}: {f'[{table}] ' if table else ''}{message}"


def _table_name(path: Sequence[str | int]) -> str:
    """The name of a table, its number in a list counted from 1: `stages 2.plates`."""
    return "".join(f" {step + 1}" if isinstance(step, int) else f".{step}" for step in path).removeprefix(".")


def _message(error: Mapping[str, Any], table: str, key: str) -> str:
    """What is wrong with the value of a key."""
    kind, value, context = error["type"], error["input"], error.get("ctx", {})
    name = f"{table}.{key}" if table else key
    if kind == REFUSED:
        return context["message"]
    if kind == "value_error":
        return str(context["error"])
    if kind == "missing":
        return f"missing; give it in [{table}]" if table else "missing; give it at the top of the file"
    if kind == EXPECTED:
        return f"expected {error['msg']}, not {_shown(value)}"
    if kind == LIMITS:
        what = error["msg"] if is_finite_number(value) else f"expected {_EXPECTED['float_type']}"
        return f"{what}, not {_shown(float(value) if is_finite_number(value) else value)}"
    if kind == CHOICE:
        if not isinstance(value, str):
            return f"expected {_EXPECTED['string_type']}, not {_shown(value)}"
        return f"unknown {key} {_shown(value)}{suggestion(value, context['choices'].split())}"
    if kind == "model_type":
        expected = f"tables [[{name}]]" if isinstance(error["loc"][-1], int) else f"a table [{name}]"
        return f"expected {expected}, not {_shown(value)}"
    if kind == "tuple_type":
        return f"expected a list of tables [[{name}]], not {_shown(value)}"
    if kind == "too_short":
        return f"at least one is needed: a table [[{name}]]"
    if kind in _EXPECTED:
        return f"expected {_EXPECTED[kind]}, not {_shown(value)}"
    return f"{error['msg']}, not {_shown(value)}"


def _shown(value: object) -> str:
    """A value as Python writes it, cut where it is long."""
    text = repr(value)
    return text if len(text) <= _LENGTH else f"{text[:_LENGTH]}..."
