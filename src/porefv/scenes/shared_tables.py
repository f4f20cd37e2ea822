"""Tables that several kinds of scene have: the packing file, the fluid, the conductance model, the grains' material."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from porefv.conductance.model import ConductanceModel
from porefv.conductance.registry import MODELS, conductance_model
from porefv.dem.material import Material
from porefv.errors import InputError
from porefv.flow.fluid import Fluid
from porefv.scenes.table import Table


@dataclass(frozen=True)
class PackingFile:
    """The packing file; `format` as in `porefv.packing.files.read_packing`, by the extension if None."""

    file: Path
    format: str | None = None


def read_packing_file(top: Table, directory: Path, *others: str) -> PackingFile:
    """The key `packing`: a path, or a table that may have other keys."""
    if isinstance(top.data.get("packing"), Mapping):
        table = top.table("packing").only("file", "format", *others)
        found = PackingFile(directory / table.string("file"), table.string("format", None))
        key = "file"
    else:
        table, key = top, "packing"
        found = PackingFile(directory / top.string("packing"))
    try:
        if not found.file.is_file():
            what = "is not a file" if found.file.exists() else "does not exist"
            raise table.error(key, f"{found.file} {what}; paths are relative to the scene file")
    except OSError as error:
        raise table.error(key, f"{found.file} cannot be read: {error.strerror}") from None
    return found


def read_fluid(table: Table) -> Fluid:
    """The table [fluid]."""
    table.only("viscosity", "density")
    given = {key: table.number(key) for key in table.data}
    try:
        return Fluid(**given)
    except InputError as error:
        key = next((key for key in given if key in str(error)), "viscosity")
        raise table.error(key, str(error)) from None


def read_conductance(table: Table) -> ConductanceModel:
    """The keys `conductance` and `alpha`."""
    model = table.string("conductance", "auto", choices=("auto", *MODELS))
    try:
        return conductance_model(model, **({"alpha": table.number("alpha")} if "alpha" in table.data else {}))
    except InputError as error:
        raise table.error("alpha", str(error)) from None


def read_material(table: Table) -> Material:
    """The table [material]."""
    table.only("young", "stiffness_ratio", "friction_angle", "density")
    return table.make(Material, **{key: table.number(key) for key in table.data})
