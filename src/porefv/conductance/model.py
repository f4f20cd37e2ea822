"""ConductanceModel: what a conductance model is, with all that a flow, its forces and a coupling take from it.

A new model derives from it, and takes ten lines::

    from porefv.conductance.model import ConductanceModel

    class Slits(ConductanceModel):
        name = "slits"

        def conductivity(self, throats, slip):
            return throats.fluid_areas * (throats.volumes / throats.wetted_surfaces(slip)) ** 2 / 3
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Literal

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
    """

    name: str
    force_split: ForceSplit = "surface"

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


def ensure_model(model: ConductanceModel) -> ConductanceModel:
    """The model; InputError if it is not a ConductanceModel."""
    if not isinstance(model, ConductanceModel):
        given = model.__name__ if isinstance(model, type) else type(model).__name__
        raise InputError(
            f"conductance must be an object of a class that derives from porefv.ConductanceModel, not {given}: "
            f"write class {given}(ConductanceModel), with a name and a method conductivity(throats, slip)"
        )
    return model
