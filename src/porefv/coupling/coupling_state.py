"""CouplingState: what a coupling holds between two steps, besides its grains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from porefv.dem.state_files import ArrayOf
from porefv.packing.box import Box
from porefv.packing.packing import Packing


@dataclass
class CouplingState:
    """What a coupling holds between two steps, besides its grains.

    Sizes: n grains, f free pores, g = f or 0, w = 6 or 0.

    Attributes
    ----------
    mesh_centres, mesh_radii : (n, 3), (n,) arrays
        Of the grains when the mesh was made [m].
    mesh_box : (2, 3) array
        Lower and upper corner of the box then [m].
    scheme : str
        Of the current mesh, `auto` resolved.
    drag_number : float or None
        Of the current mesh, where the scheme needs it.
    pressure : (f,) array
        Of the free pores over the last step [Pa].
    rate : (f,) array
        What the last step has changed the pressure by [Pa].
    products : (2, g) array
        Products of both with the matrix, where that stays from step to step [m³/s].
    fresh : bool
        Whether the pressures are still to be found on this mesh.
    factor_mobilities : (w,) array
        What walls yielded when the preconditioner was made [m/(s N)]; none before.
    pair_centres, pair_places : (k, 3), (q,) arrays
        Of grains, by id, and walls, when the resistance of pairs was last worked out [m]; none without it.
    pair_velocities : (v, 6) array
        Velocities and spins of grains, by row, and walls that pairs resisted over the last step [m/s, rad/s].
    stride : int
        Length of the last step, in steps of the grains.
    longest : int
        Length that a step may have now, see `porefv.coupling.long_steps`.
    calm : int
        Steps since it was changed last, or since the error of one was noticeable.
    """

    mesh_centres: Annotated[np.ndarray, ArrayOf("f8", ("n", 3))]
    mesh_radii: Annotated[np.ndarray, ArrayOf("f8", ("n",))]
    mesh_box: Annotated[np.ndarray, ArrayOf("f8", (2, 3))]
    scheme: str
    drag_number: float | None
    pressure: Annotated[np.ndarray, ArrayOf("f8", ("f",))]
    rate: Annotated[np.ndarray, ArrayOf("f8", ("f",))]
    products: Annotated[np.ndarray, ArrayOf("f8", (2, "g"))]
    fresh: bool
    factor_mobilities: Annotated[np.ndarray, ArrayOf("f8", ("w",))]
    pair_centres: Annotated[np.ndarray, ArrayOf("f8", ("k", 3))]
    pair_places: Annotated[np.ndarray, ArrayOf("f8", ("q",))]
    pair_velocities: Annotated[np.ndarray, ArrayOf("f8", ("v", 6))]
    stride: int
    longest: int
    calm: int

    def __post_init__(self) -> None:
        for name, found, most in (
            ("products", self.products.shape[1], len(self.pressure)),
            ("factor_mobilities", len(self.factor_mobilities), 6),
        ):
            if found not in (0, most):
                raise ValueError(f"{name} is of {found}, not of 0 or {most}")
        if self.scheme not in ("implicit-drag", "semi-implicit"):
            raise ValueError(f"there is no scheme {self.scheme!r}")
        if not (self.stride >= 1 and self.longest >= 1 and self.calm >= 0):
            raise ValueError("stride, longest or calm is out of range")
        for name in (
            "mesh_centres", "mesh_radii", "mesh_box", "pressure", "rate", "products", "factor_mobilities",
            "pair_centres", "pair_places", "pair_velocities",
        ):  # fmt: skip
            if not np.isfinite(getattr(self, name)).all():
                raise ValueError(f"{name} is not finite")

    @classmethod
    def of(cls, packing: Packing, free: int, scheme: str, drag_number: float | None) -> CouplingState:
        """The state on the fresh mesh of a packing, with so many free pores whose pressure is zero.

        Parameters
        ----------
        packing : Packing
            The grains and the box that the mesh is made from.
        free : int
            Number of free pores, f.
        scheme, drag_number
            As the attributes of the class.
        """
        assert packing.walled_box is not None  # a mesh has seen to it
        corners = np.stack([packing.walled_box.lower, packing.walled_box.upper])
        pressure, rate = np.zeros((2, free))
        return cls(
            packing.centres, packing.radii, corners, scheme, drag_number, pressure, rate, np.zeros((2, 0)), True,
            np.zeros(0), np.zeros((0, 3)), np.zeros(0), np.zeros((0, 6)), 1, 1, 0,
        )  # fmt: skip

    def start_anew(self, pressure: np.ndarray) -> None:
        """Look for the pressures of this mesh once more, from these (f,) [Pa]."""
        self.pressure, self.rate = pressure, np.zeros_like(pressure)
        self.products, self.fresh = np.zeros((2, 0)), True

    @property
    def mesh_packing(self) -> Packing:
        """What the mesh was made from."""
        return Packing(self.mesh_centres, self.mesh_radii, Box(*self.mesh_box))
