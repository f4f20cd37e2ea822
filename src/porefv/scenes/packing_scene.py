"""PackingScene: the packing to make, how, and where to put it; read from a TOML file and checked at the edge."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from porefv.dem.dem import DEM
from porefv.dem.growth import grow
from porefv.dem.material import Material
from porefv.dem.plate import Plate
from porefv.dem.random_placement import cloud
from porefv.dem.settling import settle
from porefv.dem.sizes import Grading, UniformSizes
from porefv.dem.strided_run import PackingState, mean_stress
from porefv.errors import FORCE_OPTION, InputError, vector
from porefv.export.vtk_files import vtk_data_model
from porefv.packing.box import WALLS, Box
from porefv.packing.files.registry import EXTENSIONS, write_packing
from porefv.packing.packing import Packing
from porefv.scenes.shared_tables import read_material
from porefv.scenes.table import SceneFile, Table
from porefv.system.progress import Progress
from porefv.system.version import __version__

METHODS = ("cloud", "growth", "settling")
_WRITTEN = ("csv", "yade", "vtk")  # formats


@dataclass(frozen=True)
class Cloud:
    """As the parameters of `porefv.dem.cloud`."""

    porosity: float


@dataclass(frozen=True)
class Growth:
    """As the parameters of `porefv.dem.grow`."""

    stress: float | None
    porosity: float | None
    friction_angle: float | None
    damping: float
    unbalanced: float


@dataclass(frozen=True)
class Settling:
    """Porosity of the cloud that falls; gravity and damping of the DEM, and `unbalanced` as for `settle`."""

    porosity: float
    gravity: tuple[float, float, float]
    damping: float
    unbalanced: float


class PackingProgress(Progress):
    """Progress that shows the state of the grains, once there is one, in the place of the bar."""

    state: PackingState | None = None

    def show(self, state: PackingState) -> None:
        """Take a state to be drawn."""
        self.state = state

    def line(self, name: str, seconds: float) -> str:
        now = self.state
        if now is None:
            return super().line(name, seconds)
        # Not above 80 columns: what is beyond is cut off.
        state = f"stress {now.stress:.4g} Pa  porosity {now.porosity:.4f}  unbalanced {now.unbalanced:.2g}"
        return f"porefv: {now.stage}  {seconds:.1f} s  {state}"


@dataclass(frozen=True)
class PackingScene(SceneFile):
    """A packing to be made.

    Attributes
    ----------
    number : int
        Of grains.
    sizes : UniformSizes or Grading
    box : Box
    material : Material
    method : Cloud, Growth or Settling
    seed : int
    output : Path
        The packing file to write.
    path : Path or None
        The scene file.

    Examples
    --------
    >>> scene = PackingScene.read("data/scenes/pack_dense.toml")  # doctest: +SKIP
    >>> scene.make().porosity  # doctest: +SKIP
    """

    number: int
    sizes: UniformSizes | Grading
    box: Box
    material: Material
    method: Cloud | Growth | Settling
    seed: int
    output: Path
    path: Path | None = None

    @classmethod
    def from_table(cls, top: Table, directory: Path, path: Path | None = None) -> PackingScene:
        """The scene that a table says; relative paths in it are relative to `directory`."""
        return _scene(top, directory, path)

    @property
    def stages(self) -> tuple[str, ...]:
        """Stages of `pack`, in order."""
        return ("packing", "writing")

    def pack(self, *, force: bool = False, progress: PackingProgress | None = None) -> Packing:
        """Make the packing, and write its file with what it is and how it was made.

        Parameters
        ----------
        force : bool
            Replace a file that exists.
        progress : PackingProgress, optional
            Its stages are those of `stages`.

        Raises
        ------
        InputError
            If the file cannot be written, before anything is computed; or the packing cannot be made.
        ComputationError
            If the packing does not come out; nothing is written.
        """
        _check_target(self.output, force)
        progress = progress or PackingProgress(self.stages, quiet=True)
        with progress.stage("packing"):
            packing = self.make(progress)
        progress.state = None
        with progress.stage("writing"):
            write_packing(packing, self.output)
        return packing

    def make(self, progress: PackingProgress | None = None) -> Packing:
        """The packing, with its metadata; nothing is written."""
        report = progress.show if progress else None
        method = self.method
        if isinstance(method, Cloud):
            packing = cloud(self.number, self.sizes, self.box, method.porosity, self.seed)
            return _described(packing, {"method": "cloud", "porosity": f"{packing.porosity:.6f}"}, self.seed)
        if isinstance(method, Growth):
            dem = grow(
                self.number, self.sizes, self.box, self.material, seed=self.seed, report=report, **asdict(method)
            )
            return self._measured(dem, "growth")
        start = cloud(self.number, self.sizes, self.box, method.porosity, self.seed)
        # As rough as the grains: on smooth walls a bed slides about long before it rests.
        plates = {name: Plate(friction_angle=self.material.friction_angle) for name in WALLS}
        dem = DEM(start, self.material, plates, gravity=method.gravity, damping=method.damping)
        return self._measured(settle(dem, unbalanced=method.unbalanced, report=report), "settling")

    def _measured(self, dem: DEM, name: str) -> Packing:
        packing, material = dem.packing, self.material
        found = {
            "method": name,
            "porosity": f"{packing.porosity:.6f}",
            "mean_stress": f"{mean_stress(dem):.5g} Pa",
            "coordination": f"{dem.coordination:.4f}",
            "unbalanced": f"{dem.unbalanced:.2e}",
            "young": f"{material.young:g} Pa",
            "stiffness_ratio": f"{material.stiffness_ratio:g}",
            "friction_angle": f"{material.friction_angle:g} degrees",
            "density": f"{material.density:g} kg/m³",
        }
        if isinstance(self.method, Growth) and self.method.friction_angle is not None:
            found["growth_friction_angle"] = f"{self.method.friction_angle:g} degrees"
        if isinstance(self.method, Settling):
            up = -dem.gravity / np.linalg.norm(dem.gravity)
            heights = packing.centres @ up
            height = (heights + packing.radii).max() - (heights - packing.radii).min()
            found["gravity"] = f"{vector(self.method.gravity)} m/s²"
            found["bed_height"] = f"{height:.6g} m"
        # The seed makes the same packing only on as many threads.
        return _described(packing, found | {"threads": str(dem.threads)}, self.seed)


def _described(packing: Packing, found: dict[str, str], seed: int) -> Packing:
    metadata = found | {"seed": str(seed), "made_by": f"porefv {__version__}"}
    return Packing(packing.centres, packing.radii, packing.box, metadata=metadata)


def _check_target(path: Path, force: bool) -> None:
    """Refuse, before anything is computed, a file that cannot be written or replaced."""
    if EXTENSIONS[path.suffix.lower()] == "vtk":
        vtk_data_model()
    if path.is_dir():
        raise InputError(f"cannot write {path}: it is a directory")
    if path.exists() and not force:
        raise InputError(f"{path} exists. Choose another file, or replace it with {FORCE_OPTION}")
    if not (path.absolute().parent.is_dir() and os.access(path.absolute().parent, os.W_OK)):
        raise InputError(f"cannot write {path}: {path.parent} is not a directory that may be written to")


# ---- reading ----------------------------------------------------------------------------------------------------


def _scene(top: Table, directory: Path, path: Path | None) -> PackingScene:
    top.only("output", "seed", "grains", "box", "material", *METHODS)
    given = [name for name in top.data if name in METHODS]
    if not given:
        raise top.error("growth", "one of the tables [cloud], [growth] and [settling] is needed: it says how to pack")
    if len(given) > 1:
        raise top.error(given[1], f"[{given[0]}] and [{given[1]}] exclude each other: a packing is made in one way")
    grains = top.table("grains").only("number", "ratio", "diameters", "passing")
    return PackingScene(
        number=grains.whole("number", least=1),
        sizes=_sizes(grains),
        box=top.table("box").box(lower=(0.0, 0.0, 0.0)),
        material=read_material(top.table("material")),
        method=_METHODS[given[0]](top.table(given[0])),
        seed=top.whole("seed", least=0, default=0),
        output=_output(top, directory),
        path=path,
    )


def _sizes(table: Table) -> UniformSizes | Grading:
    graded = [key for key in ("diameters", "passing") if key in table.data]
    if graded and "ratio" in table.data:
        raise table.error(graded[0], f"{graded[0]} and ratio exclude each other: sizes come from the one or the other")
    if not graded:
        return table.make(UniformSizes, ratio=table.number("ratio", 0.5))
    return table.make(Grading, diameters=_numbers(table, "diameters"), passing=_numbers(table, "passing"))


def _cloud(table: Table) -> Cloud:
    table.only("porosity")
    return Cloud(_part(table, "porosity"))


def _growth(table: Table) -> Growth:
    table.only("stress", "porosity", "friction_angle", "damping", "unbalanced")
    stress, angle = table.number("stress", None), table.number("friction_angle", None)
    if stress is None and "porosity" not in table.data:
        raise table.error("stress", "growth needs a stress in Pa, a porosity, or both")
    if stress is not None and stress <= 0.0:
        raise table.error("stress", f"must be a positive number of Pa (compression), not {stress!r}")
    if angle is not None and not 0.0 <= angle <= 89.0:
        raise table.error("friction_angle", f"must be an angle from 0 to 89 degrees, not {angle!r}")
    return Growth(
        stress=stress,
        porosity=_part(table, "porosity") if "porosity" in table.data else None,
        friction_angle=angle,
        damping=_part(table, "damping", 0.2),
        unbalanced=_unbalanced(table),
    )


def _settling(table: Table) -> Settling:
    table.only("porosity", "gravity", "damping", "unbalanced")
    gravity = table.vector("gravity", (0.0, 0.0, -9.81))
    if gravity == (0.0, 0.0, 0.0):
        raise table.error("gravity", "must not be zero: grains settle by it")
    return Settling(_part(table, "porosity", 0.75), gravity, _part(table, "damping", 0.3), _unbalanced(table))


_METHODS: dict[str, Callable[[Table], Cloud | Growth | Settling]] = {
    "cloud": _cloud,
    "growth": _growth,
    "settling": _settling,
}


def _output(top: Table, directory: Path) -> Path:
    path = directory / top.string("output")
    if EXTENSIONS.get(path.suffix.lower()) not in _WRITTEN:
        extensions = " ".join(suffix for suffix, name in EXTENSIONS.items() if name in _WRITTEN)
        raise top.error("output", f"the extension '{path.suffix}' tells no format to write; use one of {extensions}")
    return path


def _part(table: Table, key: str, *default: float) -> float:
    value = table.number(key, *default)
    if not 0.0 < value < 1.0:
        raise table.error(key, f"must lie between 0 and 1, not {value!r}")
    return value


def _unbalanced(table: Table) -> float:
    value = table.number("unbalanced", 1.0e-3)
    if not 1.0e-8 <= value < 1.0:
        raise table.error("unbalanced", f"must lie between 1e-8 and 1, not {value!r}")
    return value


def _numbers(table: Table, key: str) -> tuple[float, ...]:
    values = table.data.get(key)
    if values is None:
        raise table.error(key, f"missing; give diameters and passing together in [{table.name}]")
    if not isinstance(values, list | tuple):
        raise table.error(key, f"expected a list of numbers, not {values!r}")
    return tuple(values)
