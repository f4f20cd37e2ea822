"""State of a coupled run on disk: a run that is loaded goes on to the last bit as if it had never been stopped.

A checkpoint is one .npz file (`porefv.dem.state_files`): that of the grains (`porefv.dem.checkpoint`), its arrays
called `dem_...`; the entries of the `CouplingState`, with the packing from which the same mesh is made again; and in
the header the walls, the fluid, the settings and the conductance model. Of a model that is not one of the package, the
file has the name and the class alone: who loads it gives the model.
"""

from __future__ import annotations

from dataclasses import asdict
from os import PathLike
from typing import Any

import numpy as np

from porefv.conductance.model import ConductanceModel, ensure_model
from porefv.conductance.registry import MODELS, conductance_model
from porefv.coupling.coupling import Coupling
from porefv.coupling.coupling_settings import CouplingSettings, Effort
from porefv.coupling.coupling_state import CouplingState
from porefv.dem import checkpoint as grains_checkpoint
from porefv.dem import state_files
from porefv.dem.dem import DEM
from porefv.errors import InputError
from porefv.flow.fluid import Fluid
from porefv.flow.walls import Walls
from porefv.packing.box import WALLS

FORMAT, VERSION = "porefv.coupling", 4


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
    arrays, numbers = state_files.stored(coupling.state)
    header = {
        "walls": {name: asdict(wall) for name, wall in zip(WALLS, coupling.walls, strict=True)},
        "fluid": asdict(coupling.fluid),
        "conductance": _described(coupling.conductance),
        "settings": asdict(coupling.settings),
        "effort": asdict(coupling.effort),
        "numbers": numbers,
    }
    grains = grains_checkpoint.pack(coupling.grains, path)
    content = {"header": state_files.header(FORMAT, VERSION, header), **arrays}
    state_files.write(path, content | {f"dem_{name}": array for name, array in grains.items()})


def load(path: str | PathLike[str], conductance: ConductanceModel | None = None) -> Coupling:
    """The coupling that was saved.

    Going on is exact, to the last bit, with the same porefv and numba on the same kind of processor.

    Parameters
    ----------
    path : path
    conductance : ConductanceModel, optional
        The model that the run was started with. It is needed where that is not one of
        `porefv.conductance.MODELS`; models of the package are in the file. Of another model the file has the name,
        which is compared, but not the parameters.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged, of another program, or of a newer format; if the run has a model that
        is not one of the package and none is given, or if another is given.
    """
    content = state_files.read(path, FORMAT)
    header = state_files.header_of(content, path, FORMAT, VERSION)
    with state_files.damage_refused(path, FORMAT):
        prefix = "dem_"
        if header["version"] == 1:
            header, prefix = _renamed(header), "grains_"
        if header["version"] < 3:  # without pair resistance
            header["effort"] = _with_pairs(header["effort"])
            content |= {
                "pair_centres": np.zeros((0, 3)),
                "pair_places": np.zeros(0),
                "pair_velocities": np.zeros((0, 6)),
            }
        if header["version"] < 4:  # without long steps
            header["numbers"] = header["numbers"] | {"stride": 1, "longest": 1, "calm": 0}
        grains = {name.removeprefix(prefix): array for name, array in content.items() if name.startswith(prefix)}
        described = {"name": str(header["conductance"]["name"])} | header["conductance"]
        saved = _of_package(described)
        walls, fluid = Walls.from_mapping(header["walls"]), Fluid(**header["fluid"])
        settings, effort = CouplingSettings(**header["settings"]), Effort(**header["effort"])
        state = state_files.restored(CouplingState, content, header["numbers"])
    model = _chosen(saved, described, conductance, path)
    dem = grains_checkpoint.unpack(grains, path)
    try:
        return Coupling.from_state(state, dem, walls, fluid, model, settings, effort)
    except InputError as error:
        raise InputError(f"the run in {path} cannot go on: {error}") from None


def _renamed(header: dict[str, Any]) -> dict[str, Any]:
    """The header of a file of version 1, with the names of version 2."""
    parameters = dict(header["conductance"])
    conductance = {"name": parameters.pop("name")}
    conductance |= {"parameters": parameters} if conductance["name"] in MODELS else {"class": None}
    numbers = {name: header[name] for name in ("scheme", "drag_number", "fresh")}
    return header | {"conductance": conductance, "settings": header["options"], "numbers": numbers}


def _with_pairs(effort: dict[str, Any]) -> dict[str, Any]:
    """The effort of a file without pair resistance."""
    return effort | {"seconds": effort["seconds"] | {"pairs": 0.0}}


# ---- the conductance model --------------------------------------------------------------------------------------


def _described(model: ConductanceModel) -> dict[str, Any]:
    """What a file says of a model: its name, with the parameters of one of the package, or the class of another."""
    kind = type(model)
    if kind is MODELS.get(model.name):
        return {"name": model.name, "parameters": vars(model)}
    return {"name": model.name, "class": f"{kind.__module__}.{kind.__qualname__}"}


def _of_package(described: dict[str, Any]) -> ConductanceModel | None:
    """The model of a file, if it is one of the package."""
    if "parameters" in described:
        return conductance_model(described["name"], **described["parameters"])
    return None


def _chosen(
    saved: ConductanceModel | None, described: dict[str, Any], given: ConductanceModel | None, path: str | PathLike[str]
) -> ConductanceModel:
    """The model to go on with: that of the file, or the one that is given, which must be of the same name."""
    name = described["name"]
    if given is None:
        if saved is not None:
            return saved
        of_class = f" (class {described['class']})" if described.get("class") else ""
        raise InputError(
            f"the run in {path} has the conductance model {name!r}{of_class}, which is not one of porefv and not in "
            "the file. Give the model: porefv.coupling.checkpoint.load(path, conductance=model)"
        )
    if ensure_model(given).name != name:
        raise InputError(
            f"the run in {path} has the conductance model {name!r}, not {given.name!r}. Give the model that it was "
            "started with"
        )
    if saved is not None and given != saved:
        raise InputError(f"the run in {path} has the conductance model {saved!r}, not {given!r}. Leave it out")
    return given
