"""ConductanceModel: what a conductance model is, with all that a flow, its forces and a coupling take from it.

A new model derives from it, and takes ten lines::

    from porefv.conductance.model import ConductanceModel

    class Slits(ConductanceModel):
        name = "slits"

        def conductivity(self, throats, slip):
            return throats.fluid_areas * (throats.volumes / throats.wetted_surfaces(slip)) ** 2 / 3
"""

from __future__ import annotations

import difflib
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from porefv.errors import InputError
from porefv.mesh.throats import Throats

ForceSplit = Literal["surface", "drag"]
FORCE_SPLITS: tuple[ForceSplit, ...] = ("surface", "drag")


@dataclass(frozen=True, eq=False)
class DropBeyondVertices:
    """Throats that begin beyond the Laguerre vertex of a pore, and the part of their pressure drop that lies there.

    Attributes
    ----------
    throats : (u,) int array
        Few as a rule.
    parts : (u, 2) array
        Part of the throat's pressure drop between the Laguerre vertex and the pore centre of its first pore, and of its
        second; zero where the centre is not beyond the vertex.
    """

    throats: np.ndarray
    parts: np.ndarray


class ConductanceModel(ABC):
    """A conductance model: how much flows through a throat per unit of pressure gradient.

    Attributes
    ----------
    name : str
        By which results and messages call the model.
    force_split : {'surface', 'drag'}
        How the pressure drop of a throat acts on the spheres and walls around it: see `porefv.flow.grain_forces`.

    Notes
    -----
    Theory, method: :eq:`eq-conductance`.
    """

    name: str
    force_split: ForceSplit = "surface"

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        _refuse_unknown_attributes(cls)

    @abstractmethod
    def conductivity(self, throats: Throats, slip: np.ndarray) -> np.ndarray:
        """(t,): conductivity g of each throat [m⁴], such that q = g (p_i - p_j) / (μ L).

        `slip`, (6,) bool, marks the walls of symmetry. Values that are not positive mean a closed throat.
        """

    def drop_beyond_vertices(self, throats: Throats, slip: np.ndarray) -> DropBeyondVertices | None:
        """The part of each throat's drop that is lost beyond a pore's Laguerre vertex; None if throats end there.

        A model whose throats begin at pore centres other than the Laguerre vertices gives it: the pressure that acts on
        the grains around a pore is nearer to that at the vertex.
        """
        return None


def _refuse_unknown_attributes(model: type[ConductanceModel]) -> None:
    """TypeError for an attribute of a class that is none of the model's: mistyped, it would be another physics."""
    known = {name for name in (*vars(ConductanceModel), *ConductanceModel.__annotations__) if not name.startswith("_")}
    own = {name: value for name, value in vars(model).items() if not name.startswith("_") and name not in known}
    for name, value in own.items():
        parameter = name in vars(model).get("__annotations__", {})
        plain = not (callable(value) or isinstance(value, property | staticmethod | classmethod | cached_property))
        near = difflib.get_close_matches(name, known, n=1, cutoff=0.7)
        if (plain and not parameter) or near:
            meant = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(sorted(known))}"
            raise TypeError(
                f"{model.__name__}.{name} is no attribute of a conductance model; {meant} A parameter of the model "
                "is a field with a type (of a dataclass); the name of anything else that is its own begins with an "
                "underscore"
            )
    split = model.force_split
    if split not in FORCE_SPLITS:
        raise TypeError(f"{model.__name__}.force_split must be one of {', '.join(FORCE_SPLITS)}, not {split!r}")


def ensure_model(model: ConductanceModel) -> ConductanceModel:
    """The model; InputError if it is not a ConductanceModel."""
    if isinstance(model, str):
        raise InputError(
            f"conductance must be a ConductanceModel, not a text: use porefv.conductance.conductance_model({model!r})"
        )
    if isinstance(model, type):
        raise InputError(f"conductance must be an object, not a class: write {model.__name__}()")
    if not isinstance(model, ConductanceModel):
        given = type(model).__name__
        raise InputError(
            f"conductance must be an object of a class that derives from porefv.ConductanceModel, not {given}: "
            f"write class {given}(ConductanceModel), with a name and a method conductivity(throats, slip)"
        )
    if not isinstance(getattr(model, "name", None), str):
        raise InputError(f"the conductance model {type(model).__name__} has no name; give the class one, a text")
    return model
