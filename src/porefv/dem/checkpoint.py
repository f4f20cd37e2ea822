"""State of a DEM on disk: a run that is loaded goes on to the last bit as if it had never been stopped.

A checkpoint is one .npz file (`porefv.dem.state_files`): the entries of the `GrainState` and of the `Settings`, and in
the header the material and the plates. Nothing in it is pickled.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from os import PathLike
from typing import Annotated, Any

import numpy as np

from porefv.dem import state_files
from porefv.dem.dem import DEM
from porefv.dem.grain_state import GrainState
from porefv.dem.material import Material
from porefv.dem.pair_listing import divide_into_ranges, ranges_for
from porefv.dem.plate import Plate
from porefv.dem.state_files import ArrayOf, Arrays
from porefv.errors import ComputationError, InputError

FORMAT, VERSION = "porefv.dem", 5

# What entries are called in files of version 3, in which each thread had a range of contacts ...
_NAMES_OF_VERSION_3 = {"ranges": "threads"}
# ... what others are called in files of version 2 ...
_NAMES_OF_VERSION_2 = {
    "grains_motion": "state",
    "grains_inverse_mass": "inverse_mass",
    "grains_inverse_inertia": "inverse_inertia",
    "pairs_grains": "pairs",
    "pairs_starts": "starts",
    "pairs_others": "others",
    "pairs_stiffness": "stiffness",
    "pairs_shear": "shear",
    "pairs_touching": "touching",
    "pairs_ranges": "grain_ranges",
    "wall_pairs_members": "wall_pairs",
    "wall_pairs_stiffness": "wall_pair_stiffness",
    "wall_pairs_shear": "wall_pair_shear",
    "wall_pairs_touching": "wall_pair_touching",
    "wall_pairs_ranges": "wall_pair_ranges",
    "walls_places": "places",
    "walls_velocities": "wall_velocities",
    "walls_targets": "targets",
    "walls_top_speeds": "top_speeds",
    "walls_friction": "wall_friction",
    "walls_forces": "wall_forces",
    "walls_yields": "wall_yields",
    "listing_centres": "start",
    "listing_walls": "wall_start",
    "listing_slack": "slack",
}
# ... and, where they differ from those, in files of version 1.
_NAMES_OF_VERSION_1 = {
    "pairs_ranges": "shares",
    "wall_pairs_members": "rims",
    "wall_pairs_stiffness": "rim_stiffness",
    "wall_pairs_shear": "rim_shear",
    "wall_pairs_touching": "rim_touching",
    "wall_pairs_ranges": "rim_shares",
}


@dataclass
class Settings:
    """Parameters of a DEM besides its material and plates.

    Attributes
    ----------
    gravity : (3,) array
        [m/s²]
    damping : float
    step : float
        [s]
    ranges : int
        Into how many the contacts are divided.
    """

    gravity: Annotated[np.ndarray, ArrayOf("f8", (3,))]
    damping: float
    step: float
    ranges: int

    def __post_init__(self) -> None:
        if not (np.isfinite(self.gravity).all() and 0.0 <= self.damping < 1.0 and 1e-60 < self.step < 1e60):
            raise ValueError("gravity, damping or step is out of range")


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
    state_files.write(path, pack(dem, path))


def pack(dem: DEM, path: str | PathLike[str]) -> Arrays:
    """The content of a checkpoint, for `path`; errors as `save`."""
    if dem.halfway:
        raise InputError("a step is half taken: finish it with `correct` before its state is saved")
    _refuse_runaway(dem, path)
    settings = Settings(dem.gravity, float(dem.damping), float(dem.step), ranges_for(len(dem)))
    entries = [state_files.stored(part) for part in (settings, dem.state)]
    header = {
        "material": asdict(dem.material),
        "plates": {
            name: asdict(plate) | {"velocity": [float(v) for v in plate.velocity]} for name, plate in dem.plates.items()
        },
        "numbers": entries[0][1] | entries[1][1],
    }
    return {"header": state_files.header(FORMAT, VERSION, header), **entries[0][0], **entries[1][0]}


def load(path: str | PathLike[str]) -> DEM:
    """The DEM that was saved.

    Going on is exact, to the last bit, with the same porefv and numba on the same kind of processor.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged, of another program, or of a newer format.
    """
    return unpack(state_files.read(path, FORMAT), path)


def unpack(content: Arrays, path: str | PathLike[str]) -> DEM:
    """The DEM whose content `pack` gave, read from `path`; errors as `load`."""
    header = state_files.header_of(content, path, FORMAT, VERSION)
    with state_files.damage_refused(path, FORMAT):
        if header["version"] < VERSION:
            header, content = _renamed(header, content)
        numbers = header["numbers"]
        settings = state_files.restored(Settings, content, numbers)
        state = state_files.restored(GrainState, content, numbers, {"s": settings.ranges})
        state.check()
        divide_into_ranges(state)
        material = Material(**header["material"])
        plates = {
            name: Plate(**(plate | {"velocity": tuple(plate["velocity"])})) for name, plate in header["plates"].items()
        }
        return DEM.from_state(
            state, material, plates, gravity=settings.gravity.tolist(), damping=settings.damping, step=settings.step
        )


def _renamed(header: dict[str, Any], content: Arrays) -> tuple[dict[str, Any], Arrays]:
    """Header and content of an older file, with the names of version 5."""
    old = _NAMES_OF_VERSION_3 if header["version"] <= 3 else {}
    if header["version"] <= 2:
        old = old | _NAMES_OF_VERSION_2
    if header["version"] == 1:
        old = old | _NAMES_OF_VERSION_1
    numbers, arrays = (
        entries | {new: entries[name] for new, name in old.items() if name in entries}
        for entries in (header["numbers"], content)
    )
    numbers = numbers | {"stride": 1}  # version 5 has long steps
    return header | {"numbers": numbers}, arrays


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


def _refuse_runaway(dem: DEM, path: str | PathLike[str]) -> None:
    motion = dem.state.grains.motion
    speeds = np.sqrt((motion[:, 4:7] ** 2).sum(axis=1))
    good = np.isfinite(motion).all(axis=1) & (speeds <= dem.fastest)
    if not good.all():
        worst = int(np.argmin(good))
        raise ComputationError(
            f"the motion runs away at step {dem.steps}: grain {dem.state.order[worst]} moves at {speeds[worst]:.3g} "
            f"m/s. Such a state is not saved; {path} is as it was"
        )
