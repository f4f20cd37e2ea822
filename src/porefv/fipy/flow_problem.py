"""A solved flow in FiPy: its flux as a velocity on faces, its pressure equation, and the way back."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from porefv.fipy.faces import CLOSED
from porefv.fipy.fipy_import import load_fipy
from porefv.fipy.fluid_mesh import FluidMesh
from porefv.flow.pore_flow import PoreFlow
from porefv.solvers.pressure_equation import reached, solve_isolated

fipy = load_fipy()

# A face on a wall has this many times the conductance of its pore's throats. The pore then has the wall's pressure
# within a part of 1e-7 of its drop to its neighbours. The flux at the wall, a difference of two pressures that are so
# close, keeps as many digits.
AT_WALLS = 1e7


@dataclass(frozen=True, eq=False)
class FlowProblem:
    """A flow in FiPy's words: what equations on its fluid need, and its own equation.

    Parameters
    ----------
    flow : PoreFlow
    without : collection of str
        Walls whose pores are left out of the mesh (see `FluidMesh`).

    Examples
    --------
    A solute that comes with the fluid through y_max, at a Péclet number that D sets:

    >>> import fipy
    >>> flow = PoreFlow(Packing.read("data/packings/n25_s1.csv"), Walls.along("y"), Fluid(viscosity=10.0))
    >>> fluid = flow.to_fipy()
    >>> c = fipy.CellVariable(mesh=fluid.mesh)
    >>> c.constrain(1.0, where=fluid.inlet)
    >>> c.faceGrad.constrain(0.0 * fluid.mesh.faceNormals, where=fluid.outlet)
    >>> (fipy.UpwindConvectionTerm(coeff=fluid.velocity) == fipy.DiffusionTerm(coeff=1e-7)).solve(var=c)
    >>> bool(np.allclose(c.value, 1.0, atol=1e-6))
    True
    """

    flow: PoreFlow
    without: Collection[str] = ()

    @cached_property
    def mesh(self) -> FluidMesh:
        """Mesh of the fluid."""
        return FluidMesh(self.flow.mesh, self.without)

    @cached_property
    def _flux(self) -> np.ndarray:
        """(f,): flux through each face, outwards or from its first cell to its second; zero through the null face."""
        mesh, flow = self.mesh, self.flow
        throats = mesh.throats >= 0
        found = np.zeros(mesh.numberOfFaces)
        # A face towards a pore left out may have been turned.
        sense = np.where(
            mesh.pores[mesh.faceCellIDs[0][throats]] == flow.mesh.throats.pores[mesh.throats[throats], 0], 1.0, -1.0
        )
        found[throats] = sense * flow.flux[mesh.throats[throats]]
        faces = flow.mesh.wall_faces
        entering = np.zeros((flow.mesh.n_pores, 6))
        np.add.at(entering, (flow.mesh.cell_pore[faces.cells], faces.walls), flow.face_flux)
        on_walls = np.flatnonzero(~throats & (mesh.walls >= 0))
        found[on_walls] = -entering[mesh.pores[mesh.faceCellIDs[0][on_walls]], mesh.walls[on_walls]]
        return found

    @cached_property
    def velocity(self) -> Any:
        """Rank-1 `fipy.FaceVariable` (q / A) n [m/s]: it carries the flux q of each throat, and through walls.

        Its divergence is that of the solved flow, zero to the solver's tolerance but for sources.
        """
        mesh = self.mesh
        speeds = self._flux / np.asarray(mesh._faceAreas)
        return fipy.FaceVariable(mesh=mesh, rank=1, value=speeds * mesh.faceNormals, name="velocity")

    @cached_property
    def inlet(self) -> Any:
        """Exterior faces through which fluid enters, as a `fipy.FaceVariable` of bool."""
        return fipy.FaceVariable(mesh=self.mesh, value=self.mesh.exteriorFaces.value & (self._flux < 0.0))

    @cached_property
    def outlet(self) -> Any:
        """Exterior faces through which fluid leaves, as a `fipy.FaceVariable` of bool."""
        return fipy.FaceVariable(mesh=self.mesh, value=self.mesh.exteriorFaces.value & (self._flux > 0.0))

    @cached_property
    def mobility(self) -> Any:
        """`fipy.FaceVariable` K L / A [m²/(Pa s)], with which `DiffusionTerm(mobility)` has the conductances K.

        A closed throat has 2.2e-16 of the mean conductance for its area, so that isolated pores take a pressure among
        those that surround them; `equation` does without. Faces on walls have 1e7 times the conductance of their
        pore's throats.
        """
        return self._mobility_of(self._open_conductances)

    def _mobility_of(self, conductances: np.ndarray) -> Any:
        """K L / A of each face, from those of the throats (t,)."""
        mesh = self.mesh
        first = mesh.pores[mesh.faceCellIDs[0]]
        on_walls = AT_WALLS * self._conductance_of_pores[first]
        values = np.where(mesh.throats >= 0, conductances[mesh.throats], on_walls)
        values[-1] = 0.0
        return fipy.FaceVariable(
            mesh=mesh, value=values * mesh._cellDistances / np.asarray(mesh._faceAreas), name="mobility"
        )

    @cached_property
    def _isolated(self) -> np.ndarray:
        """(n_pores,) bool: pores that no open throat joins to a pore of imposed pressure."""
        held = ~np.isnan(self.flow.imposed_pressures)
        return ~reached(self.flow.mesh.throats.pores, self.flow.conductances, held)

    @cached_property
    def _open_conductances(self) -> np.ndarray:
        """(t,): K of each throat, of a closed one too little to pass anything [m³/(Pa s)]."""
        areas, conductances = np.abs(self.flow.mesh.throats.areas), self.flow.conductances
        return np.maximum(conductances, CLOSED * conductances.mean() / areas.mean() * areas)

    @cached_property
    def _conductance_of_pores(self) -> np.ndarray:
        """(n_pores,): sum over the throats of each pore [m³/(Pa s)]."""
        mesh, conductances = self.flow.mesh, self._open_conductances
        return np.bincount(mesh.throats.pores.ravel(), np.repeat(conductances, 2), mesh.n_pores)

    @cached_property
    def pressure(self) -> Any:
        """`fipy.CellVariable` of piezometric pressure, constrained where walls have a pressure [Pa].

        A wall of imposed flow has the pressure that porefv has found for it.
        """
        mesh, imposed = self.mesh, self.flow.imposed_pressures
        pressure = fipy.CellVariable(name="pressure", mesh=mesh, value=float(np.nanmean(imposed)))
        held = self._held_faces
        values = np.zeros(mesh.numberOfFaces)
        values[held] = imposed[self._beyond[held]]
        pressure.constrain(fipy.FaceVariable(mesh=mesh, value=values), where=fipy.FaceVariable(mesh=mesh, value=held))
        return pressure

    @cached_property
    def _held_faces(self) -> np.ndarray:
        """(f,) bool: exterior faces on walls that have a pressure."""
        mesh = self.mesh
        return mesh.exteriorFaces.value & np.isin(mesh.walls, np.flatnonzero(self.flow.walls_at_pressures.held))

    @cached_property
    def _beyond(self) -> np.ndarray:
        """(f,): pore at the far end of each face; on a wall, the face's own."""
        mesh = self.mesh
        first = mesh.pores[mesh.faceCellIDs[0]]
        ends = self.flow.mesh.throats.pores[mesh.throats]
        return np.where(mesh.throats >= 0, np.where(ends[:, 0] == first, ends[:, 1], ends[:, 0]), first)

    @cached_property
    def equation(self) -> Any:
        """`fipy.DiffusionTerm(mobility) == 0`, with sources, and fixed pressures inside: solved with `var=pressure`.

        Closed throats pass nothing at all. Isolated pores, whose pressure the equation then does not determine, are
        tied to the mean of the imposed pressures.
        """
        mesh, flow = self.mesh, self.flow
        diffusion = fipy.DiffusionTerm(coeff=self._mobility_of(flow.conductances))
        sources = fipy.CellVariable(mesh=mesh, value=flow.flow_of_sources[mesh.pores] / mesh.cellVolumes)
        on_walls = flow.mesh.pore_walls & sum(1 << wall for wall in np.flatnonzero(flow.walls_at_pressures.held))
        fixed = (~np.isnan(flow.imposed_pressures) & (on_walls == 0))[mesh.pores]
        isolated = self._isolated[mesh.pores]
        if not (fixed | isolated).any():
            return diffusion == -sources
        leak = np.where(fixed, AT_WALLS * self._conductance_of_pores[mesh.pores], 0.0)
        leak = np.where(isolated, flow.conductances.mean(), leak) / mesh.cellVolumes
        imposed = np.where(fixed, flow.imposed_pressures[mesh.pores], np.nanmean(flow.imposed_pressures))
        leak, imposed = (fipy.CellVariable(mesh=mesh, value=values) for values in (leak, imposed))
        return diffusion - fipy.ImplicitSourceTerm(coeff=leak) == -sources - leak * imposed

    def velocity_with(self, mobility: Any) -> Any:
        """Velocity of `pressure` with a mobility, as a rank-1 `fipy.FaceVariable` that follows both [m/s].

        For equations in which the mobility depends on what the fluid carries. -mobility · pressure.faceGrad is the same
        but on walls of given pressure, where it is a difference of nearly equal pressures: here, what a pore on such a
        wall gives to its neighbours comes through the wall. The fluid must not be compressible.

        Parameters
        ----------
        mobility : FaceVariable
            Such as `mobility` over a viscosity on faces [m²/(Pa s)].
        """
        return _VelocityOfPressure(self.pressure, mobility, self._held_faces)

    def solve(self, **options: object) -> np.ndarray:
        """Solve the pressure equation; the pressure of each pore, (n_pores,), those left out included [Pa].

        Isolated pores have the pressures that porefv gives them (`porefv.solvers.solve_network`).

        Parameters
        ----------
        **options
            Of FiPy's `solve`, such as `solver`.
        """
        self.equation.solve(var=self.pressure, **options)
        found = self.flow.imposed_pressures.copy()
        found[self.mesh.pores] = self.pressure.value
        throats, held = self.flow.mesh.throats, ~np.isnan(self.flow.imposed_pressures)
        if self._isolated.any():
            rest = np.zeros(len(found))
            solve_isolated(throats.pores, self._isolated, held, found, rest, links=lambda: throats.areas)
        return found


class _VelocityOfPressure(fipy.FaceVariable):  # type: ignore[name-defined]
    """As `FlowProblem.velocity_with`."""

    def __init__(self, pressure: Any, mobility: Any, held: np.ndarray):
        super().__init__(mesh=pressure.mesh, rank=1, name="velocity")
        self._pressure, self._mobility = self._requires(pressure), self._requires(mobility)
        self._held = held

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled as the values that it has."""
        return _on_faces, (self.mesh, self.value.copy(), self.name)

    def _calcValue(self) -> np.ndarray:
        mesh = self.mesh
        areas = np.asarray(mesh._faceAreas)
        first, second = np.asarray(mesh.faceCellIDs)
        pressure, inside = self._pressure.numericValue, mesh.interiorFaces.value
        beyond = np.where(inside, pressure[second], np.asarray(self._pressure.faceValue.numericValue))
        conductance = self._mobility.numericValue * areas / mesh._cellDistances
        flux = np.where(inside | self._held, conductance * (pressure[first] - beyond), 0.0)
        given = np.bincount(first[inside], flux[inside], mesh.numberOfCells)
        given -= np.bincount(second[inside], flux[inside], mesh.numberOfCells)
        on_walls = np.flatnonzero(self._held & (mesh.throats < 0))
        shares = areas[on_walls] / np.bincount(first[on_walls], areas[on_walls], mesh.numberOfCells)[first[on_walls]]
        flux[on_walls] = -shares * given[first[on_walls]]
        return flux / areas * mesh.faceNormals


def _on_faces(mesh: FluidMesh, value: np.ndarray, name: str) -> Any:
    return fipy.FaceVariable(mesh=mesh, rank=1, value=value, name=name)
