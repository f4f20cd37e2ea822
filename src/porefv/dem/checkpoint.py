"""State of a DEM on disk: a run that is loaded goes on to the last bit as if it had never been stopped.

A checkpoint is one .npz file: `header`, JSON text with the format, its version and all single values, and an array for
each of `_ARRAYS`, in the inside numbering that `order` turns into ids. Nothing in it is pickled.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from dataclasses import asdict
from os import PathLike
from typing import Any, TypeVar

import numpy as np

from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.plate import Plate
from porefv.errors import ComputationError, InputError
from porefv.system.atomic_files import atomic_write
from porefv.system.version import __version__

FORMAT, VERSION = "porefv.dem", 2
State = TypeVar("State")

# What a DEM holds between two runs, by attribute. Shapes: n grains, p pairs of grains, k pairs of a grain and a wall,
# s threads.
_NUMBERS = {
    "damping": float, "step": float, "time": float, "_slack": float, "_applied_work": float,
    "steps": int, "threads": int,
}  # fmt: skip
_ARRAYS: dict[str, tuple[str, tuple[str | int, ...]]] = {
    "gravity": ("f8", (3,)),
    "places": ("f8", (6,)),
    "wall_velocities": ("f8", (6, 3)),
    "_order": ("i8", ("n",)),
    "_rank": ("i8", ("n",)),
    "_state": ("f8", ("n", 10)),
    "_applied": ("f8", ("n", 3)),
    "_inverse_mass": ("f8", ("n",)),
    "_inverse_inertia": ("f8", ("n",)),
    "_wall_forces": ("f8", (6, 3)),
    "_wall_yields": ("f8", (6,)),
    "_targets": ("f8", (6,)),
    "_top_speeds": ("f8", (6,)),
    "_wall_friction": ("f8", (6,)),
    "_pairs": ("i4", ("p", 2)),
    "_starts": ("i8", ("n + 1",)),
    "_others": ("i4", ("p",)),
    "_grain_ranges": ("i8", ("s + 1",)),
    "_stiffness": ("f8", ("p",)),
    "_shear": ("f8", ("p", 3)),
    "_touching": ("?", ("p",)),
    "_wall_pairs": ("i4", ("k", 2)),
    "_wall_pair_ranges": ("i8", ("s + 1",)),
    "_wall_pair_stiffness": ("f8", ("k",)),
    "_wall_pair_shear": ("f8", ("k", 3)),
    "_wall_pair_touching": ("?", ("k",)),
    "_start": ("f8", ("n", 3)),
    "_wall_start": ("f8", (6,)),
    "_work": ("f8", (3,)),
}
# Arrays that version 1 of the format calls by another name.
_NAMES_OF_VERSION_1 = {
    "grain_ranges": "shares", "wall_pairs": "rims", "wall_pair_ranges": "rim_shares",
    "wall_pair_stiffness": "rim_stiffness", "wall_pair_shear": "rim_shear", "wall_pair_touching": "rim_touching",
}  # fmt: skip
# Zero between two steps, and made anew.
_LOADS = ("_loads", "_wall_loads", "_halfway")

# Every attribute of a DEM; tests compare it with what there is.
ATTRIBUTES = frozenset(("material", "plates", *_NUMBERS, *_ARRAYS, *_LOADS))


def save(dem: DEM, path: str | PathLike[str]) -> None:
    """Write the state; a file that exists is replaced, when the new one is complete.

    Parameters
    ----------
    dem : DEM
    path : path
        File to write, as it is called: no extension is added.

    Raises
    ------
    ComputationError
        If the motion runs away: it is not put in place of a state that was good.
    InputError
        If the file cannot be written.
    """
    content = pack(dem, path)
    with atomic_write(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **content)


def pack(dem: DEM, path: str | PathLike[str]) -> dict[str, Any]:
    """The arrays of a checkpoint, for `path`; errors as `save`."""
    if dem._halfway:
        raise InputError("a step is half taken: finish it with `correct` before its state is saved")
    _refuse_runaway(dem, path)
    header = {
        "format": FORMAT,
        "version": VERSION,
        "porefv": __version__,
        "material": asdict(dem.material),
        "plates": {
            name: asdict(plate) | {"velocity": [float(v) for v in plate.velocity]} for name, plate in dem.plates.items()
        },
        "numbers": {_key(name): kind(getattr(dem, name)) for name, kind in _NUMBERS.items()},
    }
    return {"header": np.array(json.dumps(header)), **{_key(name): getattr(dem, name) for name in _ARRAYS}}


def load(path: str | PathLike[str]) -> DEM:
    """The DEM that was saved, with the number of threads it was saved with.

    Going on is exact, to the last bit, with the same porefv and numba on the same kind of processor.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged, of another program, or of a newer format.
    """
    return unpack(read(path), path)


def unpack(content: dict[str, np.ndarray], path: str | PathLike[str]) -> DEM:
    """The DEM whose arrays `pack` gave, read from `path`; errors as `load`."""
    return build(content, path, FORMAT, VERSION, _build)


def build(
    content: dict[str, np.ndarray],
    path: str | PathLike[str],
    name: str,
    newest: int,
    make: Callable[[dict[str, Any], dict[str, np.ndarray]], State],
) -> State:
    """What `make` makes of the header and the arrays of a checkpoint of that format, up to its newest version."""
    try:
        header = json.loads(str(content["header"]))
        if header["format"] != name:
            raise ValueError(f"its format is {header['format']!r}")
        version = int(header["version"])
        if version <= newest:
            return make(header, content)
    except (KeyError, TypeError, ValueError) as error:
        reason = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise _unreadable(path, reason, name) from None
    raise InputError(
        f"{path} has format {version}, written by porefv {header.get('porefv', '(unknown)')}; this one, porefv "
        f"{__version__}, reads formats to {newest}. Install the newer porefv to load it"
    )


def run_saving(dem: DEM, steps: int, path: str | PathLike[str], every: int) -> None:
    """Take so many steps, and save the state at the start and after every so many.

    Parameters
    ----------
    dem : DEM
    steps : int
    path : path
        Checkpoint, replaced each time.
    every : int
        Steps between two checkpoints.

    Raises
    ------
    ComputationError
        If the motion runs away. The checkpoint then holds the last state saved before; the message says which.
    KeyboardInterrupt
        When interrupted, likewise. `dem` may have moved without counting its last steps: go on from the checkpoint.
    InputError
        If the checkpoint cannot be written (before the first step, where possible), or steps are not whole numbers.
    """
    for name, value, least in (("steps", steps, 0), ("every", every, 1)):
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise InputError(f"{name} must be a whole number, {least} or more, not {value!r}")
    save(dem, path)
    saved, end = dem.steps, dem.steps + steps
    try:
        while dem.steps < end:
            dem.run(min(every, end - dem.steps))
            save(dem, path)
            saved = dem.steps
    except ComputationError as error:
        raise ComputationError(f"{error}. Last good state, step {saved}, in {path}") from error
    except KeyboardInterrupt:
        # The file knows better which state it holds, if the interrupt came while it was written.
        raise KeyboardInterrupt(f"interrupted. Last good state, step {load(path).steps}, in {path}") from None


def _key(attribute: str) -> str:
    """Name in the file."""
    return attribute.lstrip("_")


def _refuse_runaway(dem: DEM, path: str | PathLike[str]) -> None:
    state = dem._state
    speeds = np.sqrt((state[:, 4:7] ** 2).sum(axis=1))
    good = np.isfinite(state).all(axis=1) & (speeds <= dem.fastest)
    if not good.all():
        worst = int(np.argmin(good))
        raise ComputationError(
            f"the motion runs away at step {dem.steps}: grain {dem._order[worst]} moves at {speeds[worst]:.3g} m/s. "
            f"Such a state is not saved; {path} is as it was"
        )


def read(path: str | PathLike[str]) -> dict[str, np.ndarray]:
    """Everything in the file, whose checksums hold."""
    try:
        with zipfile.ZipFile(path) as archive:
            damaged = archive.testzip()
        if damaged is not None:
            raise zipfile.BadZipFile(f"{damaged} is damaged")
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except OSError as error:
        raise InputError(
            f"cannot read {path}: {error.strerror or error}. Give a checkpoint that porefv.dem saved"
        ) from None
    except MemoryError:
        raise
    except Exception as error:  # damage may surface anywhere in zipfile, zlib or numpy
        raise _unreadable(path, str(error) or type(error).__name__) from None


def _unreadable(path: str | PathLike[str], reason: str, name: str = FORMAT) -> InputError:
    return InputError(
        f"{path} is not a checkpoint of {name}, or it is damaged ({reason}). Give another checkpoint, or start the "
        "run anew"
    )


def _build(header: dict[str, Any], content: dict[str, np.ndarray]) -> DEM:
    """The DEM, past its constructor, which would list pairs anew and forget what contacts hold.

    Raises
    ------
    KeyError, TypeError, ValueError
        If something is missing, or is not what it should be.
    """
    if header["version"] == 1:
        content = content | {name: content[old] for name, old in _NAMES_OF_VERSION_1.items()}
    dem = DEM.__new__(DEM)
    dem.material = Material(**header["material"])
    dem.plates = {
        name: Plate(**(plate | {"velocity": tuple(plate["velocity"])})) for name, plate in header["plates"].items()
    }
    for name, kind in _NUMBERS.items():
        setattr(dem, name, kind(header["numbers"][_key(name)]))
    n = len(content["state"])
    sizes: dict[str | int, int] = {
        "n": n, "n + 1": n + 1, "s + 1": dem.threads + 1, "p": len(content["pairs"]), "k": len(content["wall_pairs"])
    }  # fmt: skip
    for name, (dtype, shape) in _ARRAYS.items():
        array = content[_key(name)]
        expected = tuple(sizes.get(size, size) for size in shape)
        if array.dtype != np.dtype(dtype) or array.shape != expected:
            raise ValueError(f"{_key(name)} is {array.dtype} {array.shape}, not {np.dtype(dtype)} {expected}")
        setattr(dem, name, array)
    dem._loads = np.zeros((dem.threads, n, 6))
    dem._wall_loads = np.zeros((dem.threads, 6, 4))
    dem._halfway = False
    return dem
