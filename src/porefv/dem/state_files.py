"""States on disk: dataclasses of arrays and numbers, as .npz files with checksums and without pickled objects.

A state is a dataclass. Its fields are arrays, `Annotated` with an `ArrayOf`; numbers, truth values and text; and groups
of these, which are named tuples, as compiled kernels take them. What a file holds follows from the fields: an array for
each array, and the rest in `header`, JSON text. A field of a group is called by both names, `pairs_shear`.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from types import NoneType
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from porefv.errors import InputError
from porefv.system.atomic_files import atomic_write
from porefv.system.version import __version__

State = TypeVar("State")
Arrays = dict[str, np.ndarray]


@dataclass(frozen=True)
class ArrayOf:
    """What an array of a state is like.

    Parameters
    ----------
    dtype : str
        NumPy's code, such as 'f8'.
    shape : tuple of int or str
        Sizes: numbers, or names that stand for the same number throughout a state. 'n + 1' is one more than 'n'.

    Examples
    --------
    >>> import numpy as np
    >>> from dataclasses import dataclass
    >>> from typing import Annotated
    >>> @dataclass
    ... class Heat:
    ...     temperatures: Annotated[np.ndarray, ArrayOf("f8", ("n", 3))]
    ...     time: float
    >>> arrays, numbers = stored(Heat(np.zeros((2, 3)), 1.5))
    >>> arrays["temperatures"].shape, numbers
    ((2, 3), {'time': 1.5})
    >>> restored(Heat, arrays, numbers).time
    1.5
    """

    dtype: str
    shape: tuple[int | str, ...]

    def check(self, name: str, array: np.ndarray, sizes: dict[str, int]) -> np.ndarray:
        """The array; ValueError if it is another kind. Sizes that are not known yet are learned from it."""
        if array.ndim == len(self.shape):
            for size, found in zip(self.shape, array.shape, strict=True):
                if isinstance(size, str) and "+" not in size:
                    sizes.setdefault(size, found)
        shape = tuple(self._size(size, sizes) for size in self.shape)
        if array.dtype != np.dtype(self.dtype) or array.shape != shape:
            raise ValueError(f"{name} is {array.dtype} {array.shape}, not {np.dtype(self.dtype)} {shape}")
        return array

    @staticmethod
    def _size(size: int | str, sizes: dict[str, int]) -> int:
        if isinstance(size, int):
            return size
        letter, _, more = size.partition(" + ")
        return sizes.get(letter, 0) + int(more or 0)


# ---- a state and its entries ------------------------------------------------------------------------------------


def stored(state: Any) -> tuple[Arrays, dict[str, Any]]:
    """The arrays of a state, or a group, by name, and the numbers, truth values and text."""
    arrays: Arrays = {}
    numbers: dict[str, Any] = {}
    for name, hint in get_type_hints(type(state), include_extras=True).items():
        value = getattr(state, name)
        if get_origin(hint) is Annotated:
            arrays[name] = value
        elif _is_group(hint):
            group_arrays, group_numbers = stored(value)
            arrays |= {f"{name}_{key}": array for key, array in group_arrays.items()}
            numbers |= {f"{name}_{key}": number for key, number in group_numbers.items()}
        else:
            numbers[name] = value
    return arrays, numbers


def restored(
    kind: type[State],
    arrays: Arrays,
    numbers: dict[str, Any],
    sizes: dict[str, int] | None = None,
    prefix: str = "",
) -> State:
    """The state, or group, of a kind whose entries are in a file.

    Parameters
    ----------
    kind : type
        Of the state.
    arrays, numbers : dict
        As of `stored`; others are left out.
    sizes : dict of str to int, optional
        Numbers that names in shapes stand for, as far as they are known. The others are added.
    prefix : str
        In front of the names of the entries.

    Raises
    ------
    KeyError
        If an entry is missing.
    ValueError
        If an array has another dtype or shape, or a number another type, than its field says.
    """
    sizes = sizes if sizes is not None else {}
    values = {}
    for name, hint in get_type_hints(kind, include_extras=True).items():
        key = prefix + name
        if get_origin(hint) is Annotated:
            values[name] = get_args(hint)[1].check(key, arrays[key], sizes)
        elif _is_group(hint):
            values[name] = restored(hint, arrays, numbers, sizes, f"{key}_")
        else:
            values[name] = _checked_number(key, numbers[key], hint)
    return kind(**values)


def _is_group(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, tuple)


def _checked_number(name: str, value: Any, hint: Any) -> Any:
    kinds = get_args(hint) or (hint,)
    if type(value) not in kinds:
        expected = " or ".join("nothing" if kind is NoneType else kind.__name__ for kind in kinds)
        raise ValueError(f"{name} is {value!r}, not {expected}")
    return value


# ---- files ------------------------------------------------------------------------------------------------------


def write(path: str | PathLike[str], content: Arrays) -> None:
    """Write a file; one that exists is replaced, when the new one is complete. InputError if it cannot be written."""
    with atomic_write(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **content)  # type: ignore[arg-type]


def header(name: str, version: int, entries: dict[str, Any]) -> np.ndarray:
    """The header of a file: format, version, the porefv that writes it, and further entries for JSON."""
    return np.array(json.dumps({"format": name, "version": version, "porefv": __version__, **entries}))


def read(path: str | PathLike[str], name: str) -> Arrays:
    """Everything in a file of the format of that name, whose checksums hold.

    Raises
    ------
    InputError
        If the file cannot be read, or is damaged.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            # What is written is not packed: what is might unpack to any size.
            if any(entry.compress_type != zipfile.ZIP_STORED for entry in archive.infolist()):
                raise zipfile.BadZipFile("its arrays are packed")
            damaged = archive.testzip()
        if damaged is not None:
            raise zipfile.BadZipFile(f"{damaged} is damaged")
        with np.load(path, allow_pickle=False) as file:
            return {key: file[key] for key in file.files}
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"cannot read {path}: {reason}. Give a checkpoint that {name} saved") from None
    except MemoryError:
        raise
    except Exception as error:  # damage may surface anywhere in zipfile, zlib or numpy
        raise _unreadable(path, str(error) or type(error).__name__, name) from None


def header_of(content: Arrays, path: str | PathLike[str], name: str, newest: int) -> dict[str, Any]:
    """The header of a file of the format of that name, up to its newest version.

    Parameters
    ----------
    content : dict of str to array
        Everything in the file, as `read` returns it.
    path : path
        Of the file, for the messages of errors.
    name : str
        Of the format.
    newest : int
        The newest version of the format that can be read.

    Returns
    -------
    dict
        Entries of the header by name: format, version, porefv and those that were given to `header`.

    Raises
    ------
    InputError
        If the file has another format or a newer version.
    """
    with damage_refused(path, name):
        found = json.loads(str(content["header"]))
        if found["format"] != name:
            raise ValueError(f"its format is {found['format']!r}")
        version = int(found["version"])
    if version > newest:
        raise InputError(
            f"{path} has format {version}, written by porefv {found.get('porefv', '(unknown)')}; this one, porefv "
            f"{__version__}, reads formats to {newest}. Install the newer porefv to load it"
        )
    return found


@contextmanager
def damage_refused(path: str | PathLike[str], name: str) -> Iterator[None]:
    """Turn the errors of entries that are missing or wrong, in this block, into an InputError that names the file."""
    try:
        yield
    except KeyError as error:
        raise _unreadable(path, f"{error} is missing", name) from None
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        raise _unreadable(path, str(error), name) from None


def _unreadable(path: str | PathLike[str], reason: str, name: str) -> InputError:
    return InputError(
        f"{path} is not a checkpoint of {name}, or it is damaged ({reason}). Give another checkpoint, or start the "
        "run anew"
    )
