"""Solute: what a steady flow carries through the pores, how it spreads, and reacts at walls and grains.

Each pore is one mixed volume V. In implicit steps of time, with upwind values c of the pore that the fluid comes from,

    V dc/dt + Σ q c (out) + Σ D g (c - c_j) + (Σ k_wall A_wall + k_grain S) c = Σ q c (in).

Fluid that enters the sample carries the concentration given for it, and nothing diffuses back (Danckwerts 1953); fluid
that leaves has the concentration of its pore.

P. V. Danckwerts: Continuous flow systems. Chem. Eng. Sci. 2, 1-13 (1953).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from porefv.conductance.prism_sections import diffusive_conductances
from porefv.errors import InputError, counted
from porefv.flow.pore_flow import PoreFlow
from porefv.packing.box import WALLS
from porefv.system.number_checks import ensure_finite, is_finite_number
from porefv.transport.balanced_flow import BalancedFlow, balanced_flow
from porefv.transport.flow_order import upstream_of
from porefv.transport.implicit import TOLERANCE, Implicit

INLETS = (*WALLS, "sources", "fixed_pressures")


@dataclass(frozen=True)
class Balance:
    """Solute since the start, in the unit of concentration times m³.

    Attributes
    ----------
    entered, left, reacted : float
        With the fluid that enters and leaves, and at walls and grains.
    stored : float
        What the fluid in the pores has gained.
    largest_imbalance : float
        Of any step: `|entered - left - reacted - stored|` over the larger of what entered in it and what pores hold.
    """

    entered: float = 0.0
    left: float = 0.0
    reacted: float = 0.0
    stored: float = 0.0
    largest_imbalance: float = 0.0


class Solute:
    """A solute in a steady flow.

    Parameters
    ----------
    flow : PoreFlow
    diffusivity : float or (t,) array
        D in the fluid, or of each throat [m²/s].
    inflow : float or dict
        Concentration of the fluid that enters, or of that entering through each wall, with "sources" and at
        "fixed_pressures"; 0 for what a dict does not name.
    initial : float or (n_pores,) array
        Concentration at the start.
    wall_reaction : dict, optional
        Velocity k of a first-order reaction on walls, by name: k c per area [m/s].
    grain_reaction : float
        The same on the surface of the grains, `PoreMesh.pore_surfaces` [m/s].
    tolerance : float
        Of the linear equations (`transport.implicit.Implicit`).

    Attributes
    ----------
    concentration : (n_pores,) array
    time : float
        Since the start [s].
    balance : Balance
    carried : BalancedFlow
        The fluxes, and the pores that no fluid passes.

    Raises
    ------
    InputError
        If nothing flows in, values are of the wrong shape, negative or not finite, or pores have no positive volume.

    Examples
    --------
    >>> from porefv import Fluid, Packing, PoreFlow, Walls
    >>> flow = PoreFlow(Packing.read("data/packings/n25_s1.csv"), Walls.along("y"), Fluid(viscosity=10.0))
    >>> tracer = Solute(flow)
    >>> leaving = tracer.advance(1000.0, 100)
    >>> round(float(leaving[-1]), 3), tracer.balance.largest_imbalance < 1e-14
    (0.99, True)
    """

    def __init__(
        self,
        flow: PoreFlow,
        diffusivity: ArrayLike = 0.0,
        *,
        inflow: float | Mapping[str, float] = 1.0,
        initial: ArrayLike = 0.0,
        wall_reaction: Mapping[str, float] | None = None,
        grain_reaction: float = 0.0,
        tolerance: float = TOLERANCE,
    ):
        if not isinstance(flow, PoreFlow):
            raise InputError(f"flow must be a PoreFlow, not {flow!r}")
        if not (isinstance(tolerance, float) and 0.0 < tolerance < 1.0):
            raise InputError(f"tolerance must lie between 0 and 1, not {tolerance!r}")
        mesh, self._tolerance = flow.mesh, tolerance
        self.flow = flow
        given = _numbers(diffusivity, len(mesh.throats), "diffusivity", "throat")
        concentrations = _by_name(inflow, INLETS, "inflow")
        walls = _by_name({} if wall_reaction is None else wall_reaction, WALLS, "wall_reaction")
        grains = _numbers(grain_reaction, 1, "grain_reaction", "packing")[0]
        self.concentration = _numbers(initial, mesh.n_pores, "initial", "pore")
        self.volumes = mesh.pore_volumes
        empty = np.flatnonzero(self.volumes <= 0.0)
        if len(empty):
            raise InputError(
                f"{counted(len(empty), 'pore')}, the first of them {empty[0]}, would have no void volume: a solute "
                "needs spheres that overlap less"
            )
        faces = mesh.wall_faces
        beside = mesh.cell_pore[faces.cells]
        self.losses = np.bincount(beside, walls[faces.walls] * faces.areas, mesh.n_pores)
        if grains > 0.0:
            surfaces = mesh.pore_surfaces
            below = np.flatnonzero(surfaces < 0.0)
            if len(below):
                raise InputError(
                    f"{counted(len(below), 'pore')}, the first of them {below[0]}, would have a surface of grains "
                    "below zero: a reaction at grains needs spheres that overlap less"
                )
            self.losses = self.losses + grains * surfaces
        self.carried: BalancedFlow = balanced_flow(flow)
        self.diffusion = given * diffusive_conductances(mesh.throats) if given.any() else np.zeros(len(mesh.throats))
        carried = self.carried
        through = [*(np.where(faces.walls == w, carried.face_flux, 0.0) for w in range(6))]
        exchanges = [*(np.bincount(beside, q, mesh.n_pores) for q in through), carried.sources, carried.fixed]
        self.entering = sum(np.maximum(q, 0.0) for q in exchanges)
        self.leaving = sum(np.maximum(-q, 0.0) for q in exchanges)
        self._supply = sum(c * np.maximum(q, 0.0) for c, q in zip(concentrations, exchanges, strict=True))
        self.upstream = upstream_of(mesh.throats.pores, carried.flux, mesh.n_pores)
        fed = np.repeat(np.arange(mesh.n_pores), np.diff(self.upstream.starts))
        self.passing = self.entering + np.bincount(fed, self.upstream.fluxes, mesh.n_pores)
        self.time, self.balance = 0.0, Balance()
        self._ready: tuple[float, Implicit] | None = None

    def advance(self, dt: float, steps: int = 1) -> np.ndarray:
        """Take implicit steps of time.

        Parameters
        ----------
        dt : float
            Of each step [s].
        steps : int

        Returns
        -------
        (steps,) array
            Mean concentration of the fluid that leaves, after each step.

        Raises
        ------
        InputError
            For a dt that is not positive, or a number of steps below 1.
        ComputationError
            If the equations are not solved to the tolerance.
        """
        if not (is_finite_number(dt) and dt > 0.0):
            raise InputError(f"dt must be a positive time in seconds, not {dt!r}")
        if not (isinstance(steps, int) and steps >= 1):
            raise InputError(f"steps must be a whole number of at least 1, not {steps!r}")
        if self._ready is None or self._ready[0] != dt:
            self._ready = (dt, self.equations(self.volumes / dt))
        found = np.empty(steps)
        for step in range(steps):
            before = self.concentration
            after = self._ready[1].solve(self.volumes / dt * before + self._supply, before)
            self.concentration = ensure_finite(after, "concentrations")
            self._count(dt, before)
            found[step] = self.outlet
        return found

    @property
    def outlet(self) -> float:
        """Mean concentration of the fluid that leaves."""
        return float(self.leaving @ self.concentration / self.leaving.sum())

    def steady(self) -> np.ndarray:
        """(n_pores,): the concentration after a long time; time and `concentration` stay as they are.

        Pores that no inflow reaches, and where nothing reacts, keep the mean of what they and those that they
        exchange with have now.
        """
        losing = self._parts[self.losses > 0.0]
        cut = ~self.reached & ~np.isin(self._parts, losing)
        held = np.bincount(self._parts, self.volumes * self.concentration) / np.bincount(self._parts, self.volumes)
        return self.steady_with(self._supply, np.where(cut, held[self._parts], np.nan))

    def steady_with(self, supply: np.ndarray, held: np.ndarray) -> np.ndarray:
        """(n_pores,): steady c with a supply (n_pores,) [mol/s] in each pore, except where values are held, not NaN."""
        cut = ~np.isnan(held)
        known = np.where(cut, held, 0.0)
        weights = np.where(cut, self.entering.sum(), 0.0)
        equations = self.equations(weights, cut=cut)
        rhs = np.where(cut, (weights + self.losses) * known, supply)
        return ensure_finite(equations.solve(rhs, known), "concentrations")

    def equations(self, storage: np.ndarray, cut: np.ndarray | None = None) -> Implicit:
        """The equations with V/dt (n_pores,) of each pore, without what diffuses into pores that are cut off."""
        pairs = self.flow.mesh.throats.pores
        diffusion = self.diffusion if cut is None else np.where(cut[pairs].any(axis=1), 0.0, self.diffusion)
        return Implicit(self.upstream, storage + self.passing + self.losses, pairs, diffusion, self._tolerance)

    @property
    def _parts(self) -> np.ndarray:
        """(n_pores,) int: number of the part of the network, by flow and diffusion, that each pore is in."""
        joined = (self.carried.flux != 0.0) | (self.diffusion > 0.0)
        (i, j), n = self.flow.mesh.throats.pores[joined].T, self.flow.mesh.n_pores
        return connected_components(coo_array((np.ones(len(i)), (i, j)), shape=(n, n)), directed=False)[1]

    @property
    def reached(self) -> np.ndarray:
        """(n_pores,) bool: pores that the fluid passes, or into which the solute diffuses from such."""
        parts = self._parts
        return np.isin(parts, parts[self.entering > 0.0])

    def _count(self, dt: float, before: np.ndarray) -> None:
        now, old = self.concentration, self.balance
        entered, left = dt * float(self._supply.sum()), dt * float(self.leaving @ now)
        reacted, stored = dt * float(self.losses @ now), float(self.volumes @ (now - before))
        scale = max(entered, float(self.volumes @ now))
        lost = abs(entered - left - reacted - stored) / scale if scale > 0.0 else 0.0
        self.time += dt
        self.balance = Balance(
            old.entered + entered, old.left + left, old.reacted + reacted, old.stored + stored,
            max(old.largest_imbalance, lost),
        )  # fmt: skip


def _numbers(values: ArrayLike, n: int, name: str, each: str) -> np.ndarray:
    """(n,): values as given for each, or one for all; finite and not negative."""
    found = np.asarray(values, float)
    if found.shape not in ((), (n,)):
        raise InputError(f"{name} must be a number, or one for each {each}, ({n},), not of shape {found.shape}")
    wrong = ~(np.isfinite(found) & (found >= 0.0))
    if wrong.any():
        raise InputError(f"{name} must be finite and not negative, not {np.atleast_1d(found)[np.atleast_1d(wrong)][0]}")
    return np.broadcast_to(found, (n,)).copy()


def _by_name(values: float | Mapping[str, float], names: tuple[str, ...], what: str) -> np.ndarray:
    """One value for each name."""
    if not isinstance(values, Mapping):
        return _numbers(values, 1, what, "inlet").repeat(len(names))
    for name in values:
        if name not in names:
            raise InputError(f"{what} has no {name!r}: it may have {', '.join(names)}")
    return np.array([_numbers(values.get(name, 0.0), 1, f"{what} of {name}", "name")[0] for name in names])
