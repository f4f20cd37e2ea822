"""State of a coupled run on disk: a run that is loaded goes on to the last bit as if it had never been stopped.

A checkpoint is one .npz file: that of the grains (`porefv.dem.checkpoint`), its arrays called `grains_...`, and what
the fluid adds: the packing its mesh was made from, from which the same mesh is made again, and the pressures on it.
"""

from __future__ import annotations

from dataclasses import asdict
from os import PathLike
from typing import Any

import numpy as np

from porefv.conductance.registry import conductance_model
from porefv.coupling.coupling import Coupling, Effort
from porefv.dem import checkpoint as grains_checkpoint
from porefv.dem import state_files
from porefv.dem.dem import DEM
from porefv.errors import InputError
from porefv.flow.fluid import Fluid
from porefv.flow.walls import Walls
from porefv.packing.box import WALLS, Box
from porefv.packing.packing import Packing

FORMAT, VERSION = "porefv.coupling", 1


def save(coupling: Coupling, path: str | PathLike[str]) -> None:
    """Write the state; a file that exists is replaced, when the new one is complete.

    Raises
    ------
    ComputationError
        If the motion runs away: it is not put in place of a state that was good.
    InputError
        If the file cannot be written, or the grains are not a `porefv.dem.DEM`.
    """
    if not isinstance(coupling.grains, DEM):
        raise InputError("only a coupling with a porefv.dem.DEM can be saved")
    packing = coupling.mesh.packing
    assert packing.box is not None  # a mesh has seen to it
    header = {
        "walls": {name: asdict(wall) for name, wall in zip(WALLS, coupling.walls, strict=True)},
        "fluid": asdict(coupling.fluid),
        "conductance": {"name": coupling.conductance.name, **vars(coupling.conductance)},
        "options": coupling.options,
        "effort": asdict(coupling.effort),
        "fresh": coupling._fresh,
        "scheme": coupling.scheme,
        "drag_number": coupling.drag_number,
    }
    grains = grains_checkpoint.pack(coupling.grains, path)
    content = {
        "header": state_files.header(FORMAT, VERSION, header),
        **{f"grains_{name}": array for name, array in grains.items()},
        "mesh_centres": packing.centres,
        "mesh_radii": packing.radii,
        "mesh_box": np.stack([packing.box.lower, packing.box.upper]),
        "factor_mobilities": coupling.equation.factor_mobilities,
        "pressure": coupling._pressure,
        "rate": coupling._rate,
        "products": coupling._products,
    }
    state_files.write(path, content)


def load(path: str | PathLike[str]) -> Coupling:
    """The coupling that was saved.

    Going on is exact, to the last bit, with the same porefv and numba on the same kind of processor.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged, of another program, or of a newer format.
    """
    content = state_files.read(path, FORMAT)
    header = state_files.header_of(content, path, FORMAT, VERSION)
    with state_files.damage_refused(path, FORMAT):
        return _build(header, content, path)


def _build(header: dict[str, Any], content: dict[str, np.ndarray], path: str | PathLike[str]) -> Coupling:
    conductance = dict(header["conductance"])
    grains = {name.removeprefix("grains_"): array for name, array in content.items() if name.startswith("grains_")}
    box = Box(*content["mesh_box"])
    coupling = Coupling(
        grains_checkpoint.unpack(grains, path),
        Walls.from_mapping(header["walls"]),
        Fluid(**header["fluid"]),
        conductance_model(conductance.pop("name"), **conductance),
        start=Packing(content["mesh_centres"], content["mesh_radii"], box),
        **header["options"],
    )
    coupling.effort = Effort(**header["effort"])
    coupling.scheme, coupling.drag_number = header["scheme"], header["drag_number"]
    for name, array in (("_pressure", content["pressure"]), ("_rate", content["rate"])):
        if array.shape != coupling._pressure.shape:
            raise ValueError(f"{name[1:]} has {array.shape} values, not {coupling._pressure.shape}")
        setattr(coupling, name, array)
    if content["products"].shape not in ((2, 0), (2, len(coupling._pressure))):
        raise ValueError(f"products have shape {content['products'].shape}")
    coupling._products = content["products"]
    coupling._fresh = bool(header["fresh"])
    coupling.equation.factor_mobilities = content["factor_mobilities"]
    return coupling
