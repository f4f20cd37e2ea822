"""A results directory read back."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import InputError
from porefv.results.force_table import FORCE_FILES, read_forces
from porefv.results.quantity_tables import TABLES, read_quantity
from porefv.system.atomic_files import put_back
from porefv.system.html_table import html_table
from porefv.system.optional_imports import load

if TYPE_CHECKING:
    import pyvista


@dataclass(frozen=True)
class Results:
    """A results directory.

    Attributes
    ----------
    directory : Path
    summary : dict
        The content of summary.json.
    """

    directory: Path
    summary: dict[str, Any]

    @cached_property
    def forces(self) -> np.ndarray:
        """Structured array of the table of forces: a row per sphere, then per wall, whose radius is NaN.

        Raises
        ------
        InputError
            If forces were not asked for, or the table is damaged.
        """
        written = (name for name in FORCE_FILES.values() if (self.directory / name).is_file())
        return read_forces(self._file(next(written, FORCE_FILES["csv"]), 'add "forces" to the quantities'))

    @cached_property
    def profile(self) -> np.ndarray:
        """Structured array of profile.csv: `lower`, `upper`, `porosity` and `pressure` of each layer.

        Like the tables below, it raises an InputError if the quantity was not asked for, or the table is damaged.
        """
        return self._read_quantity("profile")

    @cached_property
    def pore_sizes(self) -> np.ndarray:
        """Structured array of pore_sizes.csv: a row per pore, `x`, `y`, `z` and `radius` of its inscribed sphere."""
        return self._read_quantity("pore_sizes")

    @cached_property
    def constriction_sizes(self) -> np.ndarray:
        """Structured array of constriction_sizes.csv: a row per throat, with `radius` and `flux`."""
        return self._read_quantity("constriction_sizes")

    @cached_property
    def planes(self) -> np.ndarray:
        """Structured array of planes.csv: `place` and `flux` of each plane."""
        return self._read_quantity("planes")

    @property
    def tortuosity(self) -> float | None:
        """Hydraulic tortuosity; None if nothing flows."""
        return self._of_summary("tortuosity")  # type: ignore[no-any-return]

    @property
    def diffusion(self) -> dict[str, Any]:
        """`axis`, `relative_diffusivity`, `formation_factor`, `diffusive_tortuosity`; None where nothing diffuses."""
        return self._of_summary("diffusion")  # type: ignore[no-any-return]

    @property
    def darcy_velocity(self) -> np.ndarray:
        """(3,): mean velocity over the box, grains included [m/s]."""
        return np.array(self._of_summary("velocity")["darcy"])

    @property
    def interstitial_velocity(self) -> np.ndarray:
        """(3,): mean velocity of the fluid [m/s]."""
        return np.array(self._of_summary("velocity")["interstitial"])

    @cached_property
    def pores(self) -> pyvista.UnstructuredGrid:
        """The mesh of pores.vtu; InputError without VTK files, as for `spheres` and `throats`."""
        return self._read_vtk("pores.vtu")

    @cached_property
    def spheres(self) -> pyvista.PolyData:
        """The points of spheres.vtp; `fluid_force` has this name in files of porefv 0.2.0 and before, too."""
        spheres = self._read_vtk("spheres.vtp")
        if "total_force" in spheres.point_data:
            spheres.rename_array("total_force", "fluid_force", preference="point")
        return spheres

    @cached_property
    def throats(self) -> pyvista.PolyData:
        """The network of throats.vtp."""
        return self._read_vtk("throats.vtp")

    def _repr_html_(self) -> str:
        summary = self.summary
        rows = [("directory", str(self.directory))]
        if summary.get("scene"):
            rows.append(("scene", str(summary["scene"])))
        rows += [("spheres", str(summary["packing"]["spheres"])), ("porosity", f"{summary['packing']['porosity']:.4g}")]
        if "permeability" in summary:
            rows.append(("permeability", f"{summary['permeability']:.6g} m²"))
        rows.append(("files", ", ".join(sorted(path.name for path in self.directory.iterdir()))))
        return html_table("Results", rows)

    def _read_quantity(self, quantity: str) -> np.ndarray:
        path = self._file(TABLES[quantity].file, f'add "{quantity}" to the quantities')
        return read_quantity(quantity, path)

    def _of_summary(self, quantity: str) -> Any:
        if quantity not in self.summary:
            raise InputError(
                f"{self.directory} has no {quantity}: add it to the quantities in the scene's [output], and solve "
                "again."
            )
        return self.summary[quantity]

    def _file(self, name: str, remedy: str) -> Path:
        path = self.directory / name
        if not path.is_file():
            raise InputError(f"{self.directory} has no {name}: {remedy} in the scene's [output], and solve again.")
        return path

    def _read_vtk(self, name: str) -> Any:
        path = self._file(name, "set vtk = true")
        return load("pyvista", f"Reading {name}").read(path)


def read(directory: str | PathLike[str]) -> Results:
    """Read a results directory: its summary now, the rest when asked for.

    Raises
    ------
    InputError
        If it is not a results directory, or its summary is damaged.
    """
    directory = Path(directory)
    put_back(directory)
    path = directory / "summary.json"
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        if directory.suffix == ".toml":
            raise InputError(f"{directory} is a scene: solve it first, and give its results directory") from None
        reason = error.strerror if isinstance(error, OSError) else f"summary.json is damaged ({error})"
        if isinstance(error, FileNotFoundError) and directory.is_dir():
            reason = "it has no summary.json"
        raise InputError(f"{directory} holds no results of porefv solve: {reason}") from None
    if not isinstance(summary, dict) or "packing" not in summary:
        raise InputError(f"{directory} holds no results of porefv solve: its summary.json is another program's")
    return Results(directory, summary)
