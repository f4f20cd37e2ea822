"""RunRecord: what has been done of a simulation, in simulation.json, so that a stopped run can be resumed."""

from __future__ import annotations

import json
import math
import os
import re
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
from porefv.simulation.series import FILES, PROFILES, SERIES, SeriesMark
from porefv.system.atomic_files import atomic_write, check_is_no_root, finished_name, sync_directory
from porefv.system.number_checks import must
from porefv.system.version import __version__

RECORD, FORMAT, VERSION = "simulation.json", "porefv.simulation", 2
FRAMES = "frames"

# How a run is: files of an earlier one may still be there; it goes on; or how it has ended.
STARTING, RUNNING = "starting", "running"
STATUSES = (STARTING, RUNNING, "interrupted", "failed", "complete")

_CHECKPOINT = re.compile(r"checkpoint_\d+\.npz")
_FRAME = re.compile(r"(grains|walls|contacts|pores|throats)(\.pvd|_\d+\.vt[pu])")


@dataclass
class StageSpan:
    """A stage that has begun: at which step and time, and where it ended [s]."""

    name: str
    begin_step: int
    begin: float
    end: float | None = None

    def __post_init__(self) -> None:
        must(self.begin_step >= 0 and math.isfinite(self.begin), "a stage begins at no time")


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
    series : dict
        How far each series was written, by its file.
    frames : dict
        Time of each frame of the pores by its step.
    """

    file: str
    coupled: bool
    step: int
    time: float
    ended: bool
    series: dict[str, SeriesMark]
    frames: dict[int, float]

    def __post_init__(self) -> None:
        must(_CHECKPOINT.fullmatch(self.file) is not None, f"no checkpoint is called {self.file!r}")
        must(self.step >= 0 and math.isfinite(self.time), "the checkpoint is of no time")
        must(set(self.series) <= {SERIES, PROFILES}, "there is no such series")
        must(SERIES in self.series and all(mark.size >= 0 for mark in self.series.values()), "a series has no size")


@dataclass
class PermeabilityRecord:
    """A permeability that was measured [m²]: in which stage, `before` or `after` it, when [s], along which axis."""

    stage: str
    when: str
    time: float
    axis: str
    porosity: float
    permeability: float


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
        Of `STATUSES`.
    box : list
        Sizes of the box at the start, which strains refer to [m].
    spans : list of StageSpan
    permeability : list of PermeabilityRecord
    seconds : float
        By the clock.
    checkpoint : CheckpointRecord or None
    reading : dict or None
        What was understood of the packing file, as plain data of `porefv.packing.reading.Reading`.
    end_correction : dict
        Depth that the end correction added at each wall where it acted, at the last row of the series [m].
    validity : dict
        Largest `reynolds_max` and `reynolds_mean` and least `stokes_number` of the rows of the series.
    """

    scene: dict[str, Any]
    path: str | None
    box: list[float]
    status: str = RUNNING
    spans: list[StageSpan] = field(default_factory=list)
    permeability: list[PermeabilityRecord] = field(default_factory=list)
    seconds: float = 0.0
    checkpoint: CheckpointRecord | None = None
    reading: dict[str, Any] | None = None
    end_correction: dict[str, float] = field(default_factory=dict)
    validity: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        must(self.status in STATUSES, f"no run is {self.status!r}")
        must(len(self.box) == 3 and all(math.isfinite(size) and size > 0.0 for size in self.box), "the box is none")
        must(isinstance(self.scene.get("stages", []), list), "the scene has no stages")
        must(len(self.spans) <= len(self.scene.get("stages", [])), "more stages have begun than there are")
        must(self.checkpoint is None or bool(self.spans), "there is a checkpoint, and no stage has begun")

    def write(self, directory: Path) -> None:
        """Write simulation.json; the one there was is replaced when this one is complete."""
        text = json.dumps({"format": FORMAT, "version": VERSION, "porefv": __version__, **asdict(self)}, indent=1)
        with atomic_write(directory / RECORD) as temporary:
            temporary.write_text(text + "\n", encoding="utf-8")

    def save(
        self, directory: Path, dem: DEM, coupling: Coupling | None, ended: bool, series: dict[str, SeriesMark],
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
        ended, series, frames
            As the attributes of `CheckpointRecord`; those of `frames` are times [s].
        """
        file = f"checkpoint_{dem.steps:09d}.npz"
        if coupling is not None:
            coupled_checkpoint.save(coupling, directory / file)
        else:
            dry_checkpoint.save(dem, directory / file)
        self.checkpoint = CheckpointRecord(file, coupling is not None, dem.steps, dem.time, ended, series, dict(frames))
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
    from pydantic import TypeAdapter, ValidationError

    path = Path(directory) / RECORD
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if content.pop("format") != FORMAT:
            raise ValueError("it is another program's")
        version = content.pop("version")
        writer = content.pop("porefv")
        if version > VERSION:
            raise InputError(f"{path} has format {version}, of porefv {writer}; this one reads formats to {VERSION}")
        point = content.get("checkpoint")
        if version == 1 and point is not None:
            point["series"] = {name: {"size": size} for name, size in point.pop("sizes").items()}
        elif point is not None and not all(mark["digest"] for mark in point["series"].values()):
            raise ValueError("a series has no digest")
        # As JSON: there a dataclass may be a table, where types are taken strictly.
        return TypeAdapter(RunRecord).validate_json(json.dumps(content), strict=True)
    except OSError as error:
        raise InputError(f"{directory} holds no results of porefv simulate: {error.strerror}") from None
    except ValidationError as errors:
        first = errors.errors(include_url=False, include_context=False, include_input=False)[0]
        reason = f"{'.'.join(map(str, first['loc'])) or 'it'}: {first['msg']}"
        raise InputError(f"{path} is damaged ({reason}). Start the run anew, with {FORCE_OPTION}") from None
    except InputError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"{path} is damaged ({error}). Start the run anew, with {FORCE_OPTION}") from None


# ---- the directory ----------------------------------------------------------------------------------------------


def is_simulation(directory: str | PathLike[str]) -> bool:
    """Whether a directory holds results of a simulation."""
    return os.path.isfile(Path(directory) / RECORD)


def content_of(directory: Path) -> list[str]:
    """Names in a directory, without those that a process that was killed has left; none if there is no directory.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    try:
        return [name for name in os.listdir(directory) if not _is_left_over(name)] if directory.is_dir() else []
    except OSError as error:
        raise InputError(f"cannot read {directory}: {error.strerror}") from None


def check_directory(directory: Path, force: bool) -> None:
    """Refuse a directory that cannot be written, that holds results unless forced, or other files.

    Raises
    ------
    InputError
        Before anything is computed.
    """
    check_is_no_root(directory)
    content = content_of(directory)
    try:
        existing = next(path for path in (directory, *directory.absolute().parents) if path.exists())
    except OSError as error:
        raise InputError(f"cannot write {directory}: {error.strerror}") from None
    if directory.exists() and not directory.is_dir():
        raise InputError(f"cannot write the directory {directory}: a file of that name exists")
    if content and not (RECORD in content and _is_ours(directory / RECORD)):
        raise InputError(f"{directory} holds files that are not results of porefv simulate. Choose another directory")
    if content and not force:
        raise InputError(
            f"{directory} already holds results. Go on with them with {RESUME_OPTION}, replace them with "
            f"{FORCE_OPTION}, or choose another directory"
        )
    if not (existing.is_dir() and os.access(existing, os.W_OK)):
        raise InputError(f"cannot write {directory}: {existing} is not a directory that may be written to")


def _is_ours(record: Path) -> bool:
    """Whether a record is of porefv, damaged or not."""
    try:
        return FORMAT.encode() in record.read_bytes()
    except OSError:
        return False


def begin(directory: Path, record: RunRecord) -> None:
    """Make the directory, or remove what an earlier run has written there, and nothing else.

    The record is replaced first. Whoever finds it until all is removed knows that nothing beside it is this run's.
    """
    directory, frames = Path(os.path.realpath(directory)), directory / FRAMES
    try:
        if not directory.exists():
            directory.mkdir()
            sync_directory(directory.parent)
        if frames.is_symlink() or (frames.exists() and not frames.is_dir()):
            raise InputError(f"cannot write {frames}: it is a link, or no directory. Remove it")
        old = [path for path in sorted(frames.glob("*")) if _FRAME.fullmatch(path.name)]
        old += [directory / name for name in os.listdir(directory) if _CHECKPOINT.fullmatch(name) or name in FILES]
        for path in old:
            if path.is_dir() and not path.is_symlink():
                raise InputError(f"cannot write {path}: it is a directory. Move it")
        record.status = STARTING
        record.write(directory)
        for path in old:
            path.unlink()
    except OSError as error:
        raise InputError(f"cannot write {directory}: {error.strerror}") from None


def tidy(directory: Path, checkpoint: CheckpointRecord | None) -> None:
    """Remove what a process that was killed has left: files that are not complete, and checkpoints of no record."""
    for folder in (directory, directory / FRAMES):
        with suppress(OSError):  # what stays does no harm
            for name in os.listdir(folder) if not folder.is_symlink() or folder == directory else ():
                stale = _CHECKPOINT.fullmatch(name) and checkpoint is not None and name != checkpoint.file
                if (stale and folder == directory) or _is_left_over(name):
                    (folder / name).unlink()


def _is_left_over(name: str) -> bool:
    """Whether a name is the temporary one of a file of a run."""
    finished = finished_name(name)
    return finished is not None and any(
        (finished == RECORD, finished in FILES, _CHECKPOINT.fullmatch(finished), _FRAME.fullmatch(finished))
    )
