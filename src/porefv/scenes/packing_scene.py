"""PackingScene: the packing to make, how, and where to put it; read from a TOML file and checked at the edge."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import AfterValidator

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
from porefv.scenes.errors import refused
from porefv.scenes.material_table import MaterialTable
from porefv.scenes.shared_tables import BoxFromOriginTable
from porefv.scenes.table import MadeFrom, Scene, Table
from porefv.scenes.values import Fraction, Limits, Numbers, ScenePath, Unbalanced, Vector, Whole, key
from porefv.system.atomic_files import locked
from porefv.system.progress import Progress
from porefv.system.version import __version__

METHODS = ("cloud", "growth", "settling")
_WRITTEN = ("csv", "yade", "vtk")  # formats
_SUFFIXES = tuple(suffix for suffix, name in EXTENSIONS.items() if name in _WRITTEN)


def _pulls(gravity: tuple[float, float, float]) -> tuple[float, float, float]:
    if not any(gravity):
        raise ValueError("must not be zero: grains settle by it")
    return gravity


def _of_known_format(path: Path) -> Path:
    if path.suffix.lower() not in _SUFFIXES:
        raise ValueError(f"the extension '{path.suffix}' tells no format to write; use one of {' '.join(_SUFFIXES)}")
    return path


@dataclass(frozen=True)
class Grains:
    """Number and sizes of the grains."""

    number: int
    sizes: UniformSizes | Grading


class GrainsTable(Table):
    """How many grains there are, and of which sizes."""

    number: Annotated[int, Whole(least=1)] = key("number of grains")
    ratio: Annotated[float, Limits(above=0.0, most=1.0)] = key(
        "r_min / r_max, in (0, 1]. Radii are spread evenly between the two, by number", 0.5
    )
    diameters: Annotated[tuple[float, ...], Numbers("a list of finite numbers such as [1.0e-3, 2.0e-3]")] | None = key(
        "instead of `ratio`: diameters of the sieves of a grading curve, positive, none below the one before. "
        "Only their ratios matter, since grains are scaled to fill the box",
        None,
    )
    passing: Annotated[tuple[float, ...], Numbers("a list of finite numbers such as [0.0, 1.0]")] | None = key(
        "with `diameters`: fraction of the mass that passes each sieve, from 0.0 at the first to 1.0 at the last", None
    )

    @classmethod
    def check_keys(cls, keys: Sequence[str]) -> None:
        super().check_keys(keys)
        graded = [name for name in ("diameters", "passing") if name in keys]
        if graded and "ratio" in keys:
            raise refused(f"{graded[0]} and ratio exclude each other: sizes come from the one or the other", graded[0])
        for name in ("diameters", "passing"):
            if graded and name not in keys:
                raise refused("missing; give diameters and passing together in [grains]", name)

    def make(self) -> Grains:
        if self.diameters is None or self.passing is None:
            return Grains(self.number, UniformSizes(self.ratio))
        return Grains(self.number, Grading(self.diameters, self.passing))


class Cloud(Table):
    """Grains apart at random places."""

    porosity: Fraction = key(
        "porosity of the packing, between 0 and 1. About 0.65 is the least that random places reach"
    )


class Growth(Table):
    """Grains that grow until they press on each other."""

    stress: Annotated[float, Limits("must be a positive number of Pa (compression)", above=0.0)] | None = key(
        "mean stress to reach, positive in compression", None, unit="Pa"
    )
    porosity: Fraction | None = key("porosity to reach. `stress`, `porosity` or both are required", None)
    friction_angle: Annotated[float, Limits("must be an angle from 0 to 89 degrees", least=0.0, most=89.0)] | None = (
        key(
            "angle of friction between grains while they grow, 0 to 89. The lower it is, the denser the packing",
            None,
            unit="degrees",
            shown="the material's",
        )
    )
    damping: Fraction = key("local damping, between 0 and 1", 0.2)
    unbalanced: Unbalanced = key(
        "mean resultant force on a grain, over the mean contact force, at which the packing counts as at rest", 1.0e-3
    )

    @classmethod
    def check_keys(cls, keys: Sequence[str]) -> None:
        super().check_keys(keys)
        if not {"stress", "porosity"} & set(keys):
            raise refused("growth needs a stress in Pa, a porosity, or both", "stress")


class Settling(Table):
    """A cloud of grains that falls and comes to rest."""

    porosity: Fraction = key("porosity of the cloud that falls, in the whole box", 0.75)
    gravity: Annotated[Vector, AfterValidator(_pulls)] = key(
        "acceleration of gravity, not zero", (0.0, 0.0, -9.81), unit="m/s²"
    )
    damping: Fraction = key("local damping, between 0 and 1", 0.3)
    unbalanced: Unbalanced = key(
        "mean resultant force on a grain, over the mean contact force, at which the packing counts as at rest", 1.0e-3
    )


class PackingScene(Scene):
    """A packing of spheres to be made.

    Attributes
    ----------
    grains : Grains
        Their number and sizes.
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

    output: Annotated[ScenePath, AfterValidator(_of_known_format)] = key(
        "the packing file to write: .csv, .txt .spheres .yade (Yade's text) or .vtk .vtp .vtu"
    )
    seed: Annotated[int, Whole(least=0)] = key(
        "whole number from which random places and the order of sizes follow. The same seed makes the same packing on "
        "the same kind of machine, with any number of threads",
        0,
    )
    grains: Annotated[Grains, MadeFrom(GrainsTable)] = key("the table `[grains]`: how many, of which sizes", {})
    box: Annotated[Box, MadeFrom(BoxFromOriginTable)] = key("the table `[box]`: the box that is filled", {})
    material: Annotated[Material, MadeFrom(MaterialTable)] = key("the table `[material]`: what grains are made of", {})
    cloud: Cloud | None = key(
        "the table `[cloud]`: grains apart. Exactly one of `[cloud]`, `[growth]` and `[settling]` is required", None
    )
    growth: Growth | None = key("the table `[growth]`: grains that grow until they press", None)
    settling: Settling | None = key("the table `[settling]`: grains that fall and come to rest", None)

    @classmethod
    def check_keys(cls, keys: Sequence[str]) -> None:
        super().check_keys(keys)
        given = [name for name in keys if name in METHODS]
        if not given:
            raise refused("one of the tables [cloud], [growth] and [settling] is needed: it says how to pack", "growth")
        if len(given) > 1:
            raise refused(f"[{given[0]}] and [{given[1]}] exclude each other: a packing is made in one way", given[1])

    @property
    def number(self) -> int:
        """Of grains."""
        return self.grains.number

    @property
    def sizes(self) -> UniformSizes | Grading:
        """Of the grains."""
        return self.grains.sizes

    @property
    def method(self) -> Cloud | Growth | Settling:
        """How the packing is made."""
        method = self.cloud or self.growth or self.settling
        assert method is not None  # the keys have been checked
        return method

    @property
    def stages(self) -> tuple[str, ...]:
        """Stages of `pack`, in order."""
        return ("packing", "writing")

    def pack(self, *, force: bool = False, progress: Progress | None = None) -> Packing:
        """Make the packing, and write its file with what it is and how it was made.

        Parameters
        ----------
        force : bool
            Replace a file that exists.
        progress : Progress, optional
            Its stages are those of `stages`.

        Raises
        ------
        InputError
            If the file cannot be written, before anything is computed; or the packing cannot be made.
        ComputationError
            If the packing does not come out; nothing is written.
        """
        progress = progress or Progress(self.stages, quiet=True)
        _check_folder(self.output)
        with locked(self.output):
            _check_target(self.output, force)
            with progress.stage("packing"):
                packing = self.make(progress)
            with progress.stage("writing"):
                write_packing(packing, self.output)
        return packing

    def make(self, progress: Progress | None = None) -> Packing:
        """The packing, with its metadata; nothing is written."""
        report = None if progress is None or not progress.draws else lambda state: progress.show(_state_text(state))
        method = self.method
        if isinstance(method, Cloud):
            packing = cloud(self.number, self.sizes, self.box, method.porosity, self.seed)
            return _described(packing, {"method": "cloud", "porosity": f"{packing.porosity:.6f}"}, self.seed)
        if isinstance(method, Growth):
            dem = grow(self.number, self.sizes, self.box, self.material, seed=self.seed, report=report, **dict(method))
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
        return _described(packing, found, self.seed)


def _state_text(state: PackingState) -> str:
    return f"n {state.porosity:.4f}  unbalanced {state.unbalanced:.0e}  {state.stress:.4g} Pa  {state.stage}"


def _described(packing: Packing, found: dict[str, str], seed: int) -> Packing:
    metadata = found | {"seed": str(seed), "made_by": f"porefv {__version__}"}
    return Packing(packing.centres, packing.radii, packing.box, metadata=metadata)


def _check_folder(path: Path) -> None:
    """Refuse a file in a directory that is none, or cannot be written to."""
    if not (path.absolute().parent.is_dir() and os.access(path.absolute().parent, os.W_OK)):
        raise InputError(f"cannot write {path}: {path.parent} is not a directory that may be written to")


def _check_target(path: Path, force: bool) -> None:
    """Refuse, before anything is computed, a file that cannot be written or replaced."""
    if EXTENSIONS[path.suffix.lower()] == "vtk":
        vtk_data_model()
    if path.is_dir():
        raise InputError(f"cannot write {path}: it is a directory")
    if path.exists() and not force:
        raise InputError(f"{path} exists. Choose another file, or replace it with {FORCE_OPTION}")
