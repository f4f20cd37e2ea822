"""The types of a kernel's arguments as text, as they are recorded for the build, and back.

Each is an expression of Python:

* `int64`, `bool`;
* `float64[:, ::1]`: an array in C order; `float64[::1, :]`: in Fortran's; `float64[:, :]`: in any;
* `const(float64[::1])`: one that is read-only;
* `record(weight=float64, other=int32)`: an entry of a structured array without gaps; `npy_rng`: a generator;
* `(int64, float64)`: a tuple;
* `porefv.mesh.facet_kernels.FacetTopology(cells=int32[:, ::1], ...)`: a named one.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from importlib import import_module
from typing import Any

import numba
import numpy as np

# numba says less of its types than is so.
types: Any = numba.types


def types_text(kinds: Sequence[Any]) -> str:
    """Types of numba as text, separated by commas."""
    return ", ".join(_text(kind) for kind in kinds)


def types_from_text(text: str) -> tuple[Any, ...]:
    """The types that `types_text` has written. ValueError, or ImportError, for what names no type."""
    expression = ast.parse(f"({text},)" if text else "()", mode="eval").body
    assert isinstance(expression, ast.Tuple)
    return tuple(_type(element) for element in expression.elts)


def _text(kind: Any) -> str:
    if isinstance(kind, types.Array):
        slices = [":"] * kind.ndim
        if kind.layout != "A":
            slices[-1 if kind.layout == "C" else 0] = "::1"
        text = f"{_text(kind.dtype)}[{', '.join(slices)}]"
        return text if kind.mutable else f"const({text})"
    if isinstance(kind, types.BaseNamedTuple):
        fields = ", ".join(f"{name}={_text(field)}" for name, field in zip(kind.fields, kind, strict=True))
        return f"{kind.instance_class.__module__}.{kind.instance_class.__qualname__}({fields})"
    if isinstance(kind, types.BaseTuple):
        return f"({', '.join(_text(field) for field in kind)},)"
    if isinstance(kind, types.Record) and kind.size == sum(field.type.bitwidth // 8 for field in kind.fields.values()):
        return f"record({', '.join(f'{name}={_text(field.type)}' for name, field in kind.fields.items())})"
    return "npy_rng" if kind == types.npy_rng else str(kind)


def _type(node: ast.expr) -> Any:
    if isinstance(node, ast.Name):
        return types.boolean if node.id == "bool" else getattr(types, node.id)
    if isinstance(node, ast.Subscript):
        slices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        whole = [ast.unparse(part) == "::1" for part in slices]
        layout = "C" if whole[-1] else ("F" if whole[0] else "A")
        return types.Array(_type(node.value), len(slices), layout)
    if isinstance(node, ast.Tuple):
        return types.Tuple([_type(element) for element in node.elts])
    if isinstance(node, ast.Call) and ast.unparse(node.func) == "record":
        return numba.from_dtype(np.dtype([(str(field.arg), ast.unparse(field.value)) for field in node.keywords]))
    if isinstance(node, ast.Call) and node.args:
        array = _type(node.args[0])
        return types.Array(array.dtype, array.ndim, array.layout, readonly=True)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        module, name = ast.unparse(node.func).rsplit(".", 1)
        fields = [_type(field.value) for field in node.keywords]
        kind = getattr(import_module(module), name)
        if [field.arg for field in node.keywords] != list(kind._fields):
            raise ValueError(f"{module}.{name} has other fields than are recorded")
        if len(set(fields)) == 1:
            return types.NamedUniTuple(fields[0], len(fields), kind)
        return types.NamedTuple(fields, kind)
    raise ValueError(f"{ast.unparse(node)} names no type")
