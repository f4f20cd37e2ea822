"""A simulation: stages, one after the other, recorded on the way, and taken up again where it was stopped."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from porefv.coupling.coupling import Coupling
from porefv.coupling.validity import Validity
from porefv.dem.dem import DEM
from porefv.errors import FORCE_OPTION, ComputationError, InertiaWarning, InputError, LooseStateWarning, printable
from porefv.export.vtk_files import vtk_data_model
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS
from porefv.packing.overlaps import sphere_volumes
from porefv.packing.packing import Packing
from porefv.scenes.simulation_scene import AXES, ROW_STEPS, ROWS, SimulationScene
from porefv.scenes.stage import Rest, Stage
from porefv.simulation import measurements
from porefv.simulation.frames import FrameContent, Frames
from porefv.simulation.run_record import (
    FRAMES,
    RUNNING,
    PermeabilityRecord,
    RunRecord,
    StageSpan,
    begin,
    check_directory,
    content_of,
    is_simulation,
    read_record,
    tidy,
)
from porefv.simulation.series import PROFILES, SERIES, Series, copy_tables
from porefv.system import locks, signals
from porefv.system.atomic_files import locked
from porefv.system.progress import Progress
from porefv.system.signals import Terminated
from porefv.system.tables import check_table_format

# Most steps at once, and between two looks at whether grains are at rest.
_STRIDE = 100
# Steps after which grains that are not at rest will not be, as for `DEM.run_to_rest`.
_MOST = 200_000
# Porosity beyond which grains do not make a skeleton, and need the resistance of pairs.
_LOOSE = 0.55


def run(scene: SimulationScene, *, force: bool = False, resume: bool = False, progress: Progress | None = None) -> Path:
    """Go through the stages of a scene.

    Parameters
    ----------
    scene : SimulationScene
    force : bool
        Replace results that exist.
    resume : bool
        Go on from the last checkpoint, as if the run had not been stopped: to the last bit, on the same kind of
        processor with the same versions. A run that is complete is left as it is. Stages that had not begun may
        have been changed in the scene, or added.
    progress : Progress, optional

    Returns
    -------
    Path
        The results directory.

    Raises
    ------
    InputError
        Before anything is computed or overwritten, where possible.
    ComputationError
        If the motion runs away, or grains do not come to rest. What was recorded, and the last checkpoint, stay.
    KeyboardInterrupt, Terminated
        When interrupted, or at SIGTERM: at the end of some steps, after a checkpoint; at once at the second time.
    """
    progress = progress or Progress(quiet=True)
    directory = scene.output.directory
    _check_packages(scene)
    with locked(directory):
        _run(scene, force, resume, progress)
    return directory


def _run(scene: SimulationScene, force: bool, resume: bool, progress: Progress) -> None:
    """`run`, while no other process writes the results."""
    directory = scene.output.directory
    record = _to_resume(scene) if resume else None
    if record is not None and record.status == "complete" and len(record.spans) == len(scene.stages):
        return
    if record is None:
        check_directory(directory, force or resume)
        packing = scene.read_packing()
        dem = scene.grains(packing)
        reading = None if packing.reading is None else packing.reading.as_data()
        record = RunRecord(dict(scene.data), _path_of(scene), dem.box.size.tolist(), reading=reading)
        running = _Run(scene, record, dem, None, progress)
    else:
        dem, coupling = record.load(directory, scene.coupling.conductance)
        record.scene, record.path, record.status = dict(scene.data), _path_of(scene), RUNNING
        running = _Run(scene, record, dem, coupling, progress)
    try:
        with _interruptions(running):
            running.go()
    except (KeyboardInterrupt, Terminated) as interruption:
        raise type(interruption)(f"interrupted. {running.stop('interrupted')}") from None
    except (ComputationError, InputError, OSError) as error:
        kind = ComputationError if isinstance(error, ComputationError) else InputError
        reason = f"cannot write {directory}: {error.strerror}" if isinstance(error, OSError) else str(error).rstrip(".")
        raise kind(f"{reason}. {running.stop('failed')}") from error
    finally:
        running.close()


def _path_of(scene: SimulationScene) -> str | None:
    """The path of the scene file, as text that a record can hold whatever bytes it has."""
    return printable(str(scene.path)) if scene.path else None


def check(scene: SimulationScene, packing: Packing | None = None) -> DEM:
    """Read and validate everything `run` would, moving nothing; the grains at the start.

    Parameters
    ----------
    scene : SimulationScene
    packing : Packing, optional
        Of the scene, if it has been read. Default: it is read.

    Raises
    ------
    InputError
        As `run`, save that results may exist.
    """
    _check_packages(scene)
    check_directory(scene.output.directory, force=True)
    grains = scene.grains(packing)
    if any(stage.fluid for stage in scene.stages):
        PoreMesh(grains.packing)
    return grains


def _check_packages(scene: SimulationScene) -> None:
    """MissingExtraError if the output needs a package that is not installed."""
    check_table_format(scene.output.table_format, "series")
    if scene.output.frames is not None:
        vtk_data_model()


def _to_resume(scene: SimulationScene) -> RunRecord | None:
    """The record of the run to go on with; None to begin, where no checkpoint has been written yet."""
    directory = scene.output.directory
    if not is_simulation(directory):
        if content_of(directory):
            raise InputError(f"{directory} holds no results of porefv simulate to go on with. Choose another directory")
        return None
    record = read_record(directory)
    if record.checkpoint is None:
        return None
    was, now, begun = dict(record.scene), dict(scene.data), len(record.spans)
    keys = sorted({*was, *now} - {"stages", "checkpoint"})
    changed = [f"[{key}]" for key in keys if was.get(key) != now.get(key)]
    for k in range(begun):
        if was["stages"][k] != (now["stages"][k] if k < len(now["stages"]) else None):
            changed.append(f"stage {k + 1}")
    if changed:
        raise InputError(
            f"{scene.path or 'the scene'} differs from the one that the run in {directory} was started with, in "
            f"{changed[0]}. Only stages that have not begun may be changed; start the run anew with {FORCE_OPTION}, or "
            "give the changed scene another directory"
        )
    return record


@contextmanager
def _interruptions(running: _Run) -> Iterator[None]:
    """The first Ctrl-C, or SIGTERM, asks the run to stop at the end of some steps; the second stops it at once."""

    def ask(number: int, _: Any) -> None:
        if running.asked_to_stop:
            signals.end(number)
        running.asked_to_stop = number

    with signals.handled(ask, *signals.ENDING):
        yield


class _Times:
    """Steps at which something is due: every so many from one on, and at the ends of stages; or given ones alone."""

    def __init__(self, moments: float | tuple[float, ...] | None, dt: float, begin: int = 0):
        self.begin, self.every, self.steps = begin, 0, np.zeros(0, int)
        if isinstance(moments, tuple):
            self.steps = np.unique(np.rint(np.array(moments) / dt).astype(int))
        elif moments is not None:
            self.every = max(1, round(moments / dt))

    def due(self, step: int, ended: bool) -> bool:
        if self.every:
            return ended or (step - self.begin) % self.every == 0
        return bool((self.steps == step).any())

    def next(self, step: int) -> float:
        """The first step after this one."""
        if self.every:
            return step + self.every - (step - self.begin) % self.every
        later = self.steps[self.steps > step]
        return int(later[0]) if len(later) else math.inf


class _Run:
    """Grains, fluid and records of a run."""

    def __init__(
        self,
        scene: SimulationScene,
        record: RunRecord,
        dem: DEM,
        coupling: Coupling | None,
        progress: Progress,
    ):
        self.scene, self.record, self.dem, self.coupling, self.progress = scene, record, dem, coupling, progress
        self.directory = scene.output.directory
        self.asked_to_stop = 0  # the signal that did
        self._clock = time.perf_counter() - record.seconds
        self._warned: set[int] = set()  # stages of which a warning has been given
        self._saved = dem.steps, time.perf_counter()
        self._axis = AXES.index(scene.output.axis)
        self._walls = scene.walls_in_time(span.begin for span in record.spans)
        point, output = record.checkpoint, scene.output
        if point is None:
            begin(self.directory, record)
        tidy(self.directory, point)
        columns = measurements.GRAIN_COLUMNS + (measurements.FLUID_COLUMNS if scene.fluid else ())
        columns += measurements.gauge_columns(len(output.gauges or ()))
        series = point.series if point else {}
        self._series = Series(self.directory / SERIES, columns, series.get(SERIES))
        self._profiles: Series | None = None
        if output.profiles is not None:
            self._profiles = Series(self.directory / PROFILES, measurements.PROFILE_COLUMNS, series.get(PROFILES))
        self._frames: Frames | None = None
        if output.frames is not None:
            content = FrameContent(output.contacts, output.velocity, output.throats, scene.fluid, record.path)
            self._frames = Frames(self.directory / FRAMES, dem, content, point.frames if point else {})
        if point is None:
            record.status = RUNNING
            record.write(self.directory)
        self._profile_times, self._frame_times = (_Times(x, dem.step) for x in (output.profiles, output.frames))

    # ---- stages -------------------------------------------------------------------------------------------------

    def go(self) -> None:
        """Go through the stages, from where the run is."""
        record, stages = self.record, self.scene.stages
        begun = len(record.spans)
        if record.checkpoint is not None and not record.checkpoint.ended:
            with self.progress.stage(stages[begun - 1].name):
                self._follow(begun - 1)
        for k in range(begun, len(stages)):
            with self.progress.stage(stages[k].name):
                self._enter(k)
                self._follow(k)
        if self.scene.output.table_format != "csv":
            copy_tables(self.directory, self.scene.output.table_format)
        record.status = "complete"
        self._save(ended=True)

    def _enter(self, k: int) -> None:
        """Begin a stage: what it changes."""
        stage, dem = self.scene.stages[k], self.dem
        self.record.spans.append(StageSpan(stage.name, dem.steps, dem.time))
        self.record.status = RUNNING
        self._walls.set(stage.walls, dem.time)
        if stage.plates:
            dem.set_plates({**dem.plates, **stage.plates})
        if stage.friction_angle is not None:
            dem.set_material(replace(dem.material, friction_angle=stage.friction_angle))
        dem.damping = stage.damping
        if stage.fluid:
            self._wet()
        elif self.coupling is not None:
            self.coupling = None
            dem.apply(np.zeros((len(dem), 3)))
        if stage.permeameter:
            self._measure_permeability(k, "before")
        if dem.steps == 0:
            self._record(k, math.nan, row=True, ended=False)

    def _wet(self) -> None:
        """Bring the fluid, or change its walls."""
        dem, fluid, options = self.dem, self.scene.fluid, self.scene.coupling
        assert fluid is not None  # the scene has seen to it
        walls = self._walls.at(dem.time)
        if self.coupling is not None:
            self.coupling.set_walls(walls)
            return
        # Pressures are piezometric: the hydrostatic part of the fluid's force is that on the volume of a grain.
        volumes = sphere_volumes(dem.radii)
        dem.apply(-fluid.density * volumes[:, None] * dem.gravity)
        if dem.porosity > _LOOSE and not options.parameters.get("pair_resistance"):
            warnings.warn(
                f"the porosity is {dem.porosity:.2f}, and pair_resistance is off: grains that move past each other "
                "meet next to no resistance, and move too fast. Set pair_resistance = true in [coupling]",
                LooseStateWarning, stacklevel=2,
            )  # fmt: skip
        self.coupling = Coupling(dem, walls, fluid, options.conductance, **options.parameters)

    def _follow(self, k: int) -> None:
        """Take a stage's steps to its end."""
        stage, dem, span = self.scene.stages[k], self.dem, self.record.spans[k]
        last = span.begin_step + self._most_steps(stage)
        rows = _Times(self._every(stage), dem.step, span.begin_step)
        strides = _Times(_STRIDE * dem.step, dem.step, span.begin_step)
        ended = False
        while not ended:
            times = (rows, strides, self._profile_times, self._frame_times)
            target = int(min(last, *(each.next(dem.steps) for each in times)))
            while (left := target - dem.steps) > self._stride:  # it may change on the way
                self._advance(left - self._stride)
            before = measurements.momentum(dem)
            self._advance(left)
            residual = measurements.momentum_residual(dem, self.coupling, before)
            ended = self._ended(stage, last, look=strides.due(target, ended=False))
            self._record(k, residual, row=rows.due(target, ended), ended=ended)
            self._show(k, residual)
            locks.touch()
            if ended:
                span.end = dem.time
                if stage.permeameter:
                    self._measure_permeability(k, "after")
            if ended or self.asked_to_stop or self._saving_due:
                self._save(ended)
            if self.asked_to_stop:
                signals.end(self.asked_to_stop)

    def _most_steps(self, stage: Stage) -> int:
        duration = stage.end.limit if isinstance(stage.end, Rest) else stage.end
        return _MOST if duration is None else max(1, math.ceil(duration / self.dem.step - 1e-9))

    def _every(self, stage: Stage) -> float:
        """Time between rows [s]."""
        default = ROW_STEPS * self.dem.step if isinstance(stage.end, Rest) else stage.end / ROWS
        return stage.every or self.scene.output.every or default

    @property
    def _stride(self) -> int:
        """Steps that the next one may be long."""
        return 1 if self.coupling is None else self.coupling.stride

    def _advance(self, steps: int) -> None:
        coupling = self.coupling
        if coupling is None:
            self.dem.run(steps)
        elif self._walls.steady:
            coupling.run(steps)
        else:
            end = self.dem.steps + steps
            while self.dem.steps < end:
                # Pressures act over a step: they are those of its middle.
                one = min(coupling.stride, end - self.dem.steps)
                coupling.set_walls(self._walls.at(self.dem.time + 0.5 * one * self.dem.step))
                coupling.run(one)

    def _ended(self, stage: Stage, last: int, look: bool) -> bool:
        """Whether a stage is at its end; `look` whether grains are at rest.

        Raises
        ------
        ComputationError
            If they should be, and are not.
        """
        rest = stage.end
        if not isinstance(rest, Rest):
            return self.dem.steps >= last
        if not (look or self.dem.steps >= last):
            return False
        unbalanced = measurements.unbalanced(self.dem, self.coupling)
        stresses = measurements.total_stresses(self.dem, self.coupling)
        targets = {name: plate.stress for name, plate in self.dem.plates.items() if plate.stress is not None}
        short = [name for name, stress in targets.items() if abs(stresses[name] - stress) > rest.stress * stress]
        if unbalanced <= rest.unbalanced and not short:
            return True
        if self.dem.steps >= last:
            wall = ""
            if short:
                name = short[0]
                wall = f"wall {name} presses with {stresses[name]:.4g} Pa, not {targets[name]:.4g}; "
            raise ComputationError(
                f"stage '{stage.name}' does not come to rest in {last - self.record.spans[-1].begin_step} steps: {wall}"
                f"the unbalanced force is {unbalanced:.2g} of the mean contact force, {rest.unbalanced:.2g} asked. "
                "Damping, or friction, is what brings dry grains to rest; a plate needs grains to press on, and speed"
            )
        return False

    # ---- records ------------------------------------------------------------------------------------------------

    def _record(self, k: int, residual: float, *, row: bool, ended: bool) -> None:
        dem, coupling = self.dem, self.coupling
        if row:
            numbers = measurements.grain_row(dem, coupling, np.array(self.record.box), residual)
            if coupling is not None:
                validity = coupling.validity
                numbers |= measurements.fluid_row(coupling, dem, validity)
                self._note_validity(k, coupling, validity)
            if self.scene.output.gauges is not None:
                numbers |= measurements.gauge_row(dem, coupling, self._axis, self.scene.output.gauges)
            self._series.add(numbers | {"stage": k + 1})
        if self._profiles is not None and self._profile_times.due(dem.steps, ended):
            for layer in measurements.profile_rows(dem, coupling, self._axis, self.scene.output.layers):
                self._profiles.add(layer | {"stage": k + 1})
        if self._frames is not None and self._frame_times.due(dem.steps, ended):
            self._frames.write(dem, coupling, self._walls.at(dem.time).slip)

    def _note_validity(self, k: int, coupling: Coupling, found: Validity) -> None:
        """Note where the end correction acts and the extremes of the numbers of validity; warn once a stage."""
        record = self.record
        record.end_correction = {
            wall: float(depth) for wall, depth in zip(WALLS, coupling.end_depths, strict=True) if depth > 0.0
        }
        noted = record.validity
        for name, choose in (("reynolds_max", max), ("reynolds_mean", max), ("stokes_number", min)):
            value = getattr(found, name)
            if math.isfinite(value):
                noted[name] = choose(noted.get(name, value), value)
        if found.warning is not None and k not in self._warned:
            self._warned.add(k)
            said = f"stage '{self.scene.stages[k].name}' at {self.dem.time:.4g} s: {found.warning}"
            warnings.warn(said, InertiaWarning, stacklevel=2)

    def _measure_permeability(self, k: int, when: str) -> None:
        found = measurements.permeability(
            self.dem, self._axis, self._walls.at(self.dem.time).slip, self.scene.coupling.conductance
        )
        self.record.permeability.append(
            PermeabilityRecord(
                self.scene.stages[k].name, when, self.dem.time, self.scene.output.axis, self.dem.porosity, found
            )
        )

    def _show(self, k: int, residual: float) -> None:
        if not self.progress.draws:
            return
        stage, span, energies = self.scene.stages[k], self.record.spans[k], self.dem.energies
        imbalance = self.coupling.power.imbalance if self.coupling else residual
        state, part = "", None
        if isinstance(stage.end, Rest):
            state = f"unbalanced {measurements.unbalanced(self.dem, self.coupling):.0e}  "
        else:
            part = (self.dem.time - span.begin) / stage.end
        state += f"kinetic {energies.kinetic / energies.stored if energies.stored else 0.0:.0e}"
        self.progress.show(state if math.isnan(imbalance) else f"{state}  imbalance {imbalance:.0e}", part)

    # ---- checkpoints --------------------------------------------------------------------------------------------

    @property
    def _saving_due(self) -> bool:
        saving, (step, moment) = self.scene.saving, self._saved
        if saving.steps is not None:
            return self.dem.steps - step >= saving.steps
        return saving.seconds is not None and time.perf_counter() - moment >= saving.seconds

    def _save(self, ended: bool) -> None:
        self.record.seconds = time.perf_counter() - self._clock
        series = {SERIES: self._series.mark()}
        if self._profiles is not None:
            series[PROFILES] = self._profiles.mark()
        frames = self._frames.pores if self._frames is not None else {}
        self.record.save(self.directory, self.dem, self.coupling, ended, series, frames)
        self._saved = self.dem.steps, time.perf_counter()

    def stop(self, status: str) -> str:
        """Note how the run ended, and tell what there is; what came after the last checkpoint is not noted."""
        record = read_record(self.directory)
        record.status = status
        with suppress(InputError):  # the disk may be full: the record of the last checkpoint then stays as it is
            record.write(self.directory)
        if record.checkpoint is None:
            return f"The series so far is in {self.directory}; there is no checkpoint yet to go on from"
        return (
            f"The series so far and the state at {record.checkpoint.time:.6g} s are in {self.directory}; go on from "
            f"there with: porefv simulate {self.scene.path or 'SCENE.toml'} --resume"
        )

    def close(self) -> None:
        self._series.close()
        if self._profiles is not None:
            self._profiles.close()
