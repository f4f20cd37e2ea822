"""Quantities of the sample besides permeability, pressure and forces: their tables, and what the summary says."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from porefv.errors import InputError
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.profile import axis_number
from porefv.flow.sizes import Distribution
from porefv.flow.walls import Walls
from porefv.packing.box import Box
from porefv.packing.layers import layer_edges
from porefv.results.csv_table import read_csv, write_csv
from porefv.system.number_checks import known
from porefv.transport.diffusion import EffectiveDiffusion, effective_diffusion

# Fractions of the quantiles in the summary.
QUANTILES = (0.1, 0.5, 0.9)


@dataclass(frozen=True)
class Sections:
    """Where a sample is cut into layers and by planes.

    Parameters
    ----------
    axis : {"x", "y", "z"}, optional
        Normal to the planes; the axis of flow by default.
    layers : int
        Number of layers of the profile.
    planes : sequence of float, optional
        Places along the axis, inside the box; by default those between the layers [m].

    Raises
    ------
    InputError
        For an unknown axis, or fewer layers than one.
    """

    axis: str | None = None
    layers: int = 10
    planes: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if self.axis not in (None, "x", "y", "z"):
            raise InputError(f"axis must be 'x', 'y' or 'z', not {self.axis!r}")
        if isinstance(self.layers, bool) or not isinstance(self.layers, int) or self.layers < 1:
            raise InputError(f"layers must be a whole number, 1 or more, not {self.layers!r}")

    def check(self, quantities: Collection[str], walls: Walls, box: Box) -> None:
        """InputError, before anything is computed, if a quantity cannot be computed with these walls and this box."""
        if "tortuosity" in quantities and walls.axis is None:
            raise InputError("tortuosity needs exactly two pressure walls, opposite each other")
        if {"profile", "planes", "diffusion"} & set(quantities):
            axis = axis_number(self.axis, walls)
            lower, upper = float(box.lower[axis]), float(box.upper[axis])
            for place in self.planes or ():
                if "planes" in quantities and not lower < place < upper:
                    raise InputError(
                        f"planes must lie inside the box, between {lower:.6g} and {upper:.6g} m along "
                        f"{'xyz'[axis]}: {place:.6g} m does not"
                    )

    def places(self, box: Box, axis: int) -> np.ndarray:
        """(p,): places of the planes along the axis [m]."""
        return layer_edges(box, axis, self.layers)[1:-1] if self.planes is None else np.array(self.planes, float)


TEN_LAYERS = Sections()


@dataclass(frozen=True)
class QuantityTable:
    """The table of a quantity: its file, its columns, and how a flow fills them.

    Attributes
    ----------
    file : str
    columns : dict of str to type
        int or float, by name.
    values : callable
        Takes a flow and the sections, and returns a column for each name.
    """

    file: str
    columns: dict[str, type]
    values: Callable[[PoreFlow, Sections], list[np.ndarray]]

    def compute(self, flow: PoreFlow, sections: Sections) -> np.ndarray:
        """The table of a flow, a structured array."""
        values = self.values(flow, sections)
        table = np.empty(len(values[0]), dtype=list(self.columns.items()))
        for name, column in zip(self.columns, values, strict=True):
            table[name] = column
        return table


def _profile(flow: PoreFlow, sections: Sections) -> list[np.ndarray]:
    found = flow.profile(sections.layers, sections.axis)
    return [found.edges[:-1], found.edges[1:], found.porosity, found.pressure]


def _pore_sizes(flow: PoreFlow, sections: Sections) -> list[np.ndarray]:
    sizes = flow.pore_sizes
    return [np.arange(len(sizes.radii)), *sizes.centres.T, sizes.void_volumes, sizes.radii]


def _constriction_sizes(flow: PoreFlow, sections: Sections) -> list[np.ndarray]:
    sizes = flow.constriction_sizes
    return [np.arange(len(sizes.radii)), *flow.mesh.throats.pores.T, sizes.radii, sizes.flux]


def _planes(flow: PoreFlow, sections: Sections) -> list[np.ndarray]:
    places = sections.places(flow.mesh.box, axis_number(sections.axis, flow.walls))
    return [places, flow.plane_fluxes(places, sections.axis)]


TABLES = {
    "profile": QuantityTable(
        "profile.csv", {"lower": float, "upper": float, "porosity": float, "pressure": float}, _profile
    ),
    "pore_sizes": QuantityTable(
        "pore_sizes.csv",
        {"pore": int, "x": float, "y": float, "z": float, "void_volume": float, "radius": float},
        _pore_sizes,
    ),
    "constriction_sizes": QuantityTable(
        "constriction_sizes.csv",
        {"throat": int, "first_pore": int, "second_pore": int, "radius": float, "flux": float},
        _constriction_sizes,
    ),
    "planes": QuantityTable("planes.csv", {"place": float, "flux": float}, _planes),
}
SAMPLE_QUANTITIES = ("profile", "pore_sizes", "constriction_sizes", "tortuosity", "diffusion", "velocity", "planes")


def compute_tables(flow: PoreFlow, quantities: Collection[str], sections: Sections) -> dict[str, np.ndarray]:
    """The tables that are asked for, by quantity."""
    return {name: table.compute(flow, sections) for name, table in TABLES.items() if name in quantities}


def write_tables(tables: Mapping[str, np.ndarray], folder: Path) -> None:
    """Write a file for each of the tables."""
    for quantity, table in tables.items():
        write_csv(table, folder / TABLES[quantity].file)


def read_quantity(quantity: str, path: Path) -> np.ndarray:
    """The table of a quantity from its file, as a structured array; InputError if it is damaged."""
    return read_csv(path, TABLES[quantity].columns)


def quantity_summaries(
    flow: PoreFlow, quantities: Collection[str], tables: Mapping[str, np.ndarray], sections: Sections
) -> dict[str, Any]:
    """What the summary says of the quantities of the sample that are asked for, and of their tables."""
    found: dict[str, Any] = {}
    if "profile" in tables:
        axis, porosity = axis_number(sections.axis, flow.walls), tables["profile"]["porosity"]
        found["profile"] = {
            "axis": "xyz"[axis], "layers": len(porosity), "porosity": [porosity.min(), porosity.max()]
        }  # fmt: skip
    if "pore_sizes" in tables:
        pores = flow.pore_sizes
        found["pore_sizes"] = {
            "by_number": _radii(pores.by_number),
            "by_volume": _radii(pores.by_volume),
            "without_sphere": int(np.count_nonzero(pores.radii == 0.0)),
        }
    if "constriction_sizes" in tables:
        throats = flow.constriction_sizes
        found["constriction_sizes"] = {
            "by_number": _radii(throats.by_number),
            "by_flux": _radii(throats.by_flux),
            "without_circle": int(np.count_nonzero(throats.radii == 0.0)),
        }
    if "planes" in tables:
        axis, through = axis_number(sections.axis, flow.walls), tables["planes"]["flux"]
        found["planes"] = {
            "axis": "xyz"[axis], "planes": len(through), "flux": [through.min(), through.max()] if len(through) else []
        }  # fmt: skip
    for quantity in tables:
        found[quantity]["table"] = TABLES[quantity].file
    if "tortuosity" in quantities:
        found["tortuosity"] = known(flow.tortuosity)
    if "diffusion" in quantities:
        along = "xyz"[axis_number(sections.axis, flow.walls)]
        found["diffusion"] = _diffusion(effective_diffusion(flow.mesh, along, tolerance=flow.tolerance))
    if "velocity" in quantities:
        found["velocity"] = {"darcy": flow.darcy_velocity, "interstitial": flow.interstitial_velocity}
    return found


def _diffusion(found: EffectiveDiffusion) -> dict[str, Any]:
    """The numbers; None for those that are not finite, as nothing passes."""
    passes = found.relative_diffusivity > 0.0
    return {
        "axis": found.axis,
        "relative_diffusivity": found.relative_diffusivity,
        "formation_factor": found.formation_factor if passes else None,
        "diffusive_tortuosity": found.diffusive_tortuosity if passes else None,
    }


def _radii(found: Distribution) -> dict[str, float | None]:
    """Mean and quantiles of radii; None where there are none."""
    quantiles = {f"r{100 * fraction:.0f}": known(found.quantile(fraction)) for fraction in QUANTILES}
    return {"mean": known(found.mean), **quantiles}
