"""RunRecord: what has been done of a simulation, in simulation.json, so that a stopped run can be resumed."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

from porefv.conductance.model import ConductanceModel
from porefv.coupling import checkpoint as coupled_checkpoint
from porefv.coupling.coupling import Coupling
from porefv.dem import checkpoint as dry_checkpoint
from porefv.dem.dem import DEM
from porefv.errors import FORCE_OPTION, RESUME_OPTION, InputError
from porefv.simulation.series import FILES
from porefv.system.atomic_files import atomic_write
from porefv.system.version import __version__

RECORD, FORMAT, VERSION = "simulation.json", "porefv.simulation", 1
FRAMES = "frames"

_CHECKPOINT = re.compile(r"checkpoint_\d+\.npz")
_FRAME = re.compile(r"(grains|walls|contacts|pores)(\.pvd|_\d+\.vt[pu])")


@dataclass
class StageSpan:
    """A stage that has begun: at which step and time, and where it ended [s]."""

    name: str
    begin_step: int
    begin: float
    end: float | None = None


@dataclass
class CheckpointRecord:
    """A state on disk, and what belongs to it.

    Attributes
    ----------
    file : str
        The state, beside this record.
    coupled : bool
        Whether it is that of a coupling, or of grains alone.
    step, time
        Of the state; the time in s.
    ended : bool
        Whether the last stage that has begun has reached its end.
    sizes : dict
        Bytes of the series by file.
    frames : dict
        Time of each frame of the pores by its step.
    """

    file: str
    coupled: bool
    step: int
    time: float
    ended: bool
    sizes: dict[str, int]
    frames: dict[int, float]


@dataclass
class RunRecord:
    """What has been done of a simulation.

    Attributes
    ----------
    scene : dict
        As plain data.
    path : str or None
        Of the scene file.
    status : str
        running, interrupted, failed or complete.
    box : list
        Sizes of the box at the start, which strains refer to [m].
    spans : list of StageSpan
    permeability : list of dict
        Stage, `before` or `after`, time [s], axis, and the permeability [m²].
    seconds : float
        By the clock.
    checkpoint : CheckpointRecord or None
    """

    scene: Mapping[str, Any]
    path: str | None
    box: list[float]
    status: str = "running"
    spans: list[StageSpan] = field(default_factory=list)
    permeability: list[dict[str, Any]] = field(default_factory=list)
    seconds: float = 0.0
    checkpoint: CheckpointRecord | None = None

    def write(self, directory: Path) -> None:
        """Write simulation.json; the one there was is replaced when this one is complete."""
        text = json.dumps({"format": FORMAT, "version": VERSION, "porefv": __version__, **asdict(self)}, indent=1)
        with atomic_write(directory / RECORD) as temporary:
            temporary.write_text(text + "\n", encoding="utf-8")

    def save(
        self, directory: Path, dem: DEM, coupling: Coupling | None, ended: bool, sizes: dict[str, int],
        frames: dict[int, float],
    ) -> None:  # fmt: skip
        """Write a checkpoint. Until all of it is there, the record tells of the one before.

        Parameters
        ----------
        directory : Path
            Of the results. Older checkpoints there are removed.
        dem : DEM
        coupling : Coupling or None
            None: the state is that of the grains alone.
        ended, sizes, frames
            As the attributes of `CheckpointRecord`; those of `frames` are times [s].
        """
        file = f"checkpoint_{dem.steps:09d}.npz"
        if coupling is not None:
            coupled_checkpoint.save(coupling, directory / file)
        else:
            dry_checkpoint.save(dem, directory / file)
        self.checkpoint = CheckpointRecord(file, coupling is not None, dem.steps, dem.time, ended, sizes, dict(frames))
        self.write(directory)
        for name in os.listdir(directory):
            if _CHECKPOINT.fullmatch(name) and name != file:
                with suppress(OSError):
                    (directory / name).unlink()

    def load(self, directory: Path, conductance: ConductanceModel | None = None) -> tuple[DEM, Coupling | None]:
        """The state of the checkpoint; the conductance model, of a coupling, as for its `checkpoint.load`."""
        assert self.checkpoint is not None
        path = directory / self.checkpoint.file
        if not self.checkpoint.coupled:
            return dry_checkpoint.load(path), None
        coupling = coupled_checkpoint.load(path, conductance)
        assert isinstance(coupling.grains, DEM)  # no other can be saved
        return coupling.grains, coupling


def read_record(directory: str | PathLike[str]) -> RunRecord:
    """The record of a results directory.

    Raises
    ------
    InputError
        If there is none, or it is damaged.
    """
    path = Path(directory) / RECORD
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if content.pop("format") != FORMAT:
            raise ValueError("it is another program's")
        version = content.pop("version")
        writer = content.pop("porefv")
        if version > VERSION:
            raise InputError(f"{path} has format {version}, of porefv {writer}; this one reads formats to {VERSION}")
        point = content.pop("checkpoint")
        if point is not None:
            frames = {int(step): time for step, time in point.pop("frames").items()}
            point = CheckpointRecord(**point, frames=frames)
        spans = [StageSpan(**span) for span in content.pop("spans")]
        return RunRecord(**content, spans=spans, checkpoint=point)
    except OSError as error:
        raise InputError(f"{directory} holds no results of porefv simulate: {error.strerror}") from None
    except InputError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"{path} is damaged ({error}). Start the run anew, with {FORCE_OPTION}") from None


# ---- the directory ----------------------------------------------------------------------------------------------


def is_simulation(directory: str | PathLike[str]) -> bool:
    """Whether a directory holds results of a simulation."""
    return (Path(directory) / RECORD).is_file()


def check_directory(directory: Path, force: bool) -> None:
    """Refuse a directory that cannot be written, that holds results unless forced, or other files.

    Raises
    ------
    InputError
        Before anything is computed.
    """
    try:
        content = os.listdir(directory) if directory.is_dir() else []
        existing = next(path for path in (directory, *directory.absolute().parents) if path.exists())
    except OSError as error:
        raise InputError(f"cannot write {directory}: {error.strerror}") from None
    if directory.exists() and not directory.is_dir():
        raise InputError(f"cannot write the directory {directory}: a file of that name exists")
    if content and RECORD not in content:
        raise InputError(f"{directory} holds files that are not results of porefv simulate. Choose another directory")
    if content and not force:
        raise InputError(
            f"{directory} already holds results. Go on with them with {RESUME_OPTION}, replace them with "
            f"{FORCE_OPTION}, or choose another directory"
        )
    if not (existing.is_dir() and os.access(existing, os.W_OK)):
        raise InputError(f"cannot write {directory}: {existing} is not a directory that may be written to")


def clear(directory: Path) -> None:
    """Make the directory, or remove what a simulation has written there, and nothing else; the record goes last."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for path in sorted((directory / FRAMES).glob("*")):
            if _FRAME.fullmatch(path.name):
                path.unlink()
        names = [name for name in os.listdir(directory) if _CHECKPOINT.fullmatch(name)]
        for name in (*names, *FILES, RECORD):
            (directory / name).unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"cannot write {directory}: {error.strerror}") from None
