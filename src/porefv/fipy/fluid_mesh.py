"""FluidMesh: the fluid in the pores as a FiPy mesh.

A cell is the void of a pore, a face is a throat with the area of its diffusive section, or what a pore has of a wall.
Equations in FiPy then read as in a textbook, without factors of geometry in their coefficients.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from porefv.errors import InputError, OutOfRangeWarning, counted
from porefv.fipy.faces import CLOSED, faces_of_cells, faces_of_fluid, walls_left_out
from porefv.fipy.fipy_import import load_fipy
from porefv.fipy.fipy_patches import install
from porefv.fipy.gradient import LeastSquaresGradient
from porefv.fipy.pore_solver import Factors, PoreSolver
from porefv.fipy.term_checks import check_terms
from porefv.mesh.cell_mesh import ensure_walls
from porefv.mesh.polyhedra import polygons
from porefv.packing.box import WALLS

if TYPE_CHECKING:
    from porefv.mesh.pore_mesh import PoreMesh

fipy = load_fipy()

# Void volume of a pore that has none, as a part of its cells' volume.
NO_VOID = 1e-12


class _Topology(fipy.meshes.topologies.meshTopology._MeshTopology):  # type: ignore[name-defined]
    """Centres of cells lie on normals of their faces: FiPy's orthogonal terms are exact."""

    @property
    def _isOrthogonal(self) -> bool:
        return True


class _Recipe(fipy.meshes.representations.abstractRepresentation._AbstractRepresentation):  # type: ignore[name-defined]
    """A mesh is pickled as the packing it is made of."""

    def getstate(self) -> dict[str, Any]:
        return {"recipe": self.mesh.recipe, "_RepresentationClass": _Recipe}

    @staticmethod
    def setstate(mesh: FluidMesh, state: dict[str, Any]) -> None:
        from porefv.mesh.pore_mesh import PoreMesh

        packing, unite_tolerance, wall_tolerance, without = state["recipe"]
        pore_mesh = PoreMesh(packing, unite_tolerance=unite_tolerance, wall_tolerance=wall_tolerance)
        FluidMesh.__init__(mesh, pore_mesh, without)

    def repr(self) -> str:
        mesh = self.mesh
        left_out = f", without {', '.join(mesh.without)}" if mesh.without else ""
        return f"FluidMesh({mesh.numberOfCells} pores, {np.count_nonzero(mesh.throats >= 0)} throats{left_out})"


class FluidMesh(fipy.meshes.mesh.Mesh):  # type: ignore[name-defined]
    """The fluid in the pores as a FiPy mesh, on which equations are written as in a textbook.

    `TransientTerm() + PowerLawConvectionTerm(coeff=u) == DiffusionTerm(coeff=D)` is right as it stands. A cell is a
    pore with its void as volume and its Laguerre vertex as centre. Faces are throats, one each, and one for each pore
    and wall that it touches. A throat's face has the area A = g L of its diffusive section and the distance L, so that
    DiffusionTerm(D) passes D g (c_1 - c_2) (`porefv.conductance.prism_sections`).

    Parameters
    ----------
    pore_mesh : PoreMesh
    without : collection of str
        Walls whose pores are left out: where a value is given on a wall, that of the pores themselves. The throats
        towards them become exterior faces at the distance L.

    Attributes
    ----------
    pores : (c,) int array
        Pore of each cell.
    throats : (f,) int array
        Throat of each face, -1 on walls.
    walls : (f,) int array
        Wall of each exterior face, 0 ... 5 (x_min, x_max, y_min, ...), -1 elsewhere.
    closed_throats : int
        Throats between cells that nothing passes: their faces have 2.2e-16 of their facets' area.
    pores_without_void : int
        Cells whose void volume is not positive; they have 1e-12 of their cells' volume.

    Raises
    ------
    InputError
        For an unknown wall, or if no pore is left.

    Warns
    -----
    On making, FiPy is patched (`porefv.fipy.fipy_patches`); meshes of FiPy's own are not affected.

    Notes
    -----
    The last face of FiPy's arrays, with no area and no cells of its own, pads the lists of faces of cells: FiPy handles
    masked lists badly. It is in no mask.

    A pore on a wall has its centre on the wall. Its face there is at 1e-6 of the mean radius.

    What FiPy has that is not right on this mesh (`docs/fipy.md`): `VanLeerConvectionTerm`,
    `CentralDifferenceConvectionTerm` at an inlet, velocities interpolated from cells or uniform, tensor diffusion.

    Examples
    --------
    >>> import fipy
    >>> mesh = PoreMesh(Packing.read("data/packings/n25_s1.csv")).to_fipy()
    >>> c = fipy.CellVariable(mesh=mesh)
    >>> c.constrain(1.0, where=mesh.facesBottom)
    >>> c.constrain(0.0, where=mesh.facesTop)
    >>> _ = fipy.DiffusionTerm(coeff=1.0).solve(var=c)
    >>> bool((c.value >= 0.0).all() and (c.value <= 1.0).all())
    True
    """

    def __init__(self, pore_mesh: PoreMesh, without: Collection[str] = ()):
        ensure_walls(pore_mesh)
        install()
        left_out = walls_left_out(without)
        kept = (pore_mesh.pore_walls & sum(1 << wall for wall in left_out)) == 0
        if not kept.any():
            raise InputError("every pore is on a wall left out: nothing is left to solve for")
        self.pore_mesh = pore_mesh
        self._gradients: dict[bytes, LeastSquaresGradient] = {}
        self._factors = Factors()
        self.without = tuple(WALLS[wall] for wall in left_out)
        self.pores = np.flatnonzero(kept)
        self._given = given = faces_of_fluid(pore_mesh, kept, left_out)
        n = self._n_faces = len(given)
        self.throats = np.append(given.throats, -1)
        self.walls = np.append(given.walls, -1)
        floor = CLOSED * np.abs(pore_mesh.throats.areas)
        between = given.throats[given.throats >= 0]
        self.closed_throats = int(np.count_nonzero(given.areas[given.throats >= 0] <= floor[between]))

        cell_volumes = np.bincount(pore_mesh.cell_pore, pore_mesh.cell_volumes, pore_mesh.n_pores)[kept]
        volumes = pore_mesh.pore_volumes[kept]
        self.pores_without_void = int(np.count_nonzero(volumes <= NO_VOID * cell_volumes))
        self._void = np.maximum(volumes, NO_VOID * cell_volumes)
        if self.pores_without_void:
            warnings.warn(
                f"{counted(self.pores_without_void, 'pore')} of {len(volumes)} would have no void volume, for spheres "
                f"overlap much: they have {NO_VOID:g} of their cells' volume, and the mesh "
                f"{self._void.sum() / volumes.sum() - 1.0:.2g} more than the void",
                OutOfRangeWarning, stacklevel=2,
            )  # fmt: skip

        fipy.meshes.abstractMesh.AbstractMesh.__init__(
            self, fipy.tools.serialComm, _RepresentationClass=_Recipe, _TopologyClass=_Topology
        )
        self.dim = 3
        self.numberOfCells = self.globalNumberOfCells = len(self.pores)
        self.numberOfFaces = self.globalNumberOfFaces = n + 1
        self.cellFaceIDs = faces_of_cells(given.cells, len(self.pores), n).astype(fipy.solvers.INDEX_TYPE)
        # FiPy's mask of second cells tells exterior faces.
        first, second = np.append(given.cells, [[0, -1]], axis=0).astype(fipy.solvers.INDEX_TYPE).T
        self.faceCellIDs = np.ma.MaskedArray([first, np.where(second < 0, 0, second)], [[False] * (n + 1), second < 0])
        self._setTopology()
        self._setGeometry(scaleLength=1.0)

    @property
    def recipe(self) -> tuple[Any, float, float, tuple[str, ...]]:
        """What the mesh is made of: packing, unite_tolerance, wall_tolerance and `without`."""
        mesh = self.pore_mesh
        return mesh.packing, mesh.unite_tolerance, mesh.wall_tolerance, self.without

    # ---- what FiPy would derive from vertices, given ------------------------------------------------------------

    def _calcInteriorAndExteriorFaceIDs(self) -> tuple[Any, Any]:
        interior = np.append(self._given.cells[:, 1] >= 0, False)
        exterior = np.append(self._given.cells[:, 1] < 0, False)
        return fipy.FaceVariable(mesh=self, value=interior), fipy.FaceVariable(mesh=self, value=exterior)

    def _calcFaceAreas(self) -> np.ndarray:
        return np.append(self._given.areas, 1e-300)

    def _calcFaceCenters(self) -> np.ndarray:
        return np.append(self._given.centres, [self._given.centres[0]], axis=0).T

    def _calcCellCenters(self) -> np.ndarray:
        return self.pore_mesh.pore_centres[self.pores].T.copy()

    def _calcCellVolumes(self) -> np.ndarray:
        return self._void

    def _calcFaceNormals(self) -> np.ndarray:
        return np.append(self._given.normals, np.zeros((1, 3)), axis=0).T

    def _calcFaceCellToCellNormals(self) -> np.ndarray:
        return self.faceNormals

    def _calcFaceTangents(self) -> tuple[np.ndarray, np.ndarray]:
        normals = self._given.normals
        # Away from the axis that the normal has least of.
        aside = np.eye(3)[np.abs(normals).argmin(axis=1)]
        first = np.cross(normals, aside)
        first /= np.linalg.norm(first, axis=1)[:, None]
        null = np.zeros((1, 3))
        return np.append(first, null, axis=0).T, np.append(np.cross(normals, first), null, axis=0).T

    def _calcFaceToCellDistAndVec(self) -> tuple[Any, Any]:
        given = self._given
        to_first = np.append(given.ratios * given.distances, 1.0)
        to_second = np.append((1.0 - given.ratios) * given.distances, 1.0)
        mask = np.ma.getmaskarray(self.faceCellIDs)
        distances = np.ma.MaskedArray([to_first, to_second], mask)
        normals = self._calcFaceNormals()
        vectors = np.ma.MaskedArray(
            np.stack([to_first * normals, -to_second * normals], axis=1), np.broadcast_to(mask, (3, *mask.shape))
        )
        return distances, vectors

    def _calcCellDistAndVec(self) -> tuple[np.ndarray, np.ndarray]:
        distances = np.append(self._given.distances, 1.0)
        return distances, distances * self._calcFaceNormals()

    def _calcFaceToCellDistanceRatio(self) -> np.ndarray:
        return np.append(self._given.ratios, 1.0)

    # For `leastSquaresGrad` alone: the way to each neighbour's centre, which for united pores is not quite L n.

    @cached_property
    def _ways(self) -> np.ndarray:
        """(3, most, c): from each cell's centre to its neighbour's, or to its face, for each of its faces [m]."""
        given, centres = self._given, self._calcCellCenters()
        both = given.cells[:, 1] >= 0
        ways = (given.distances[:, None] * given.normals).T
        ways[:, both] = centres[:, given.cells[both, 1]] - centres[:, given.cells[both, 0]]
        return np.append(ways, np.zeros((3, 1)), axis=1)[:, self.cellFaceIDs] * self._cellToFaceOrientations

    def _calcCellToCellDist(self) -> np.ndarray:
        return np.linalg.norm(self._ways, axis=0)

    def _calcCellNormals(self) -> np.ndarray:
        return self._ways / np.maximum(np.linalg.norm(self._ways, axis=0), np.finfo(float).tiny)

    # ---- polygons, when a viewer or a file asks for them ---------------------------------------------------------

    @cached_property
    def _polygons(self) -> tuple[np.ndarray, Any]:
        mesh, given = self.pore_mesh, self._given
        on_walls = np.flatnonzero(given.throats < 0)
        facets = mesh.throats.first_facets[given.throats[given.throats >= 0]]
        walls = mesh.wall_faces
        keys = mesh.cell_pore[walls.cells].astype(np.int64) * len(WALLS) + walls.walls
        _, first = np.unique(keys, return_index=True)
        of_key = {int(key): int(place) for key, place in zip(keys[first], first, strict=True)}
        asked = self.pores[given.cells[on_walls, 0]].astype(np.int64) * len(WALLS) + given.walls[on_walls]
        rows = np.array([of_key[int(key)] for key in asked], int)
        points, corners = polygons(mesh, facets, walls.cells[rows], walls.walls[rows])
        corners = np.append(corners, corners[:1], axis=0)
        return points.T, np.ma.masked_values(corners.T, -1)

    @property
    def vertexCoords(self) -> np.ndarray:  # FiPy's name
        """(3, v): corners of the faces' polygons [m]; a throat of several facets has its first one's."""
        return self._polygons[0]

    @property
    def faceVertexIDs(self) -> Any:  # FiPy's name
        """(4, f) masked: corners of each face."""
        return self._polygons[1]

    # ---- masks of faces -------------------------------------------------------------------------------------------

    def on_wall(self, *names: str) -> Any:
        """Faces on the walls of those names, as a `fipy.FaceVariable` of bool; towards pores left out, if they are."""
        return fipy.FaceVariable(mesh=self, value=np.isin(self.walls, walls_left_out(names)))

    @property
    def facesLeft(self) -> Any:
        """Faces on x_min."""
        return self.on_wall("x_min")

    @property
    def facesRight(self) -> Any:
        """Faces on x_max."""
        return self.on_wall("x_max")

    @property
    def facesBottom(self) -> Any:
        """Faces on y_min."""
        return self.on_wall("y_min")

    facesDown = facesBottom

    @property
    def facesTop(self) -> Any:
        """Faces on y_max."""
        return self.on_wall("y_max")

    facesUp = facesTop

    @property
    def facesFront(self) -> Any:
        """Faces on z_min."""
        return self.on_wall("z_min")

    @property
    def facesBack(self) -> Any:
        """Faces on z_max."""
        return self.on_wall("z_max")

    # ---- fluxes, surfaces, gradients -------------------------------------------------------------------------------

    def flux(self, vector: Any) -> np.ndarray:
        """(f,): what a rank-1 FaceVariable carries through each face, A v·n, outwards or from first to second cell."""
        value = np.asarray(vector.value if hasattr(vector, "value") else vector)
        if value.shape != (3, self.numberOfFaces):
            raise InputError(f"flux needs a vector for each face, (3, {self.numberOfFaces}), not {value.shape}")
        return np.einsum("ij,ij->j", value, np.asarray(self._orientedAreaProjections))

    def through(self, vector: Any, where: Any) -> float:
        """What a rank-1 FaceVariable carries out through the exterior faces of a mask."""
        mask = np.asarray(where.value if hasattr(where, "value") else where, bool) & self.exteriorFaces.value
        return float(self.flux(vector)[mask].sum())

    @cached_property
    def specific_surface(self) -> Any:
        """Surface of grains per void volume of each pore, as a `fipy.CellVariable` [1/m]."""
        surfaces = self.pore_mesh.pore_surfaces[self.pores]
        below = int(np.count_nonzero(surfaces < 0.0))
        if below:
            warnings.warn(
                f"{counted(below, 'pore')} of {len(surfaces)} would have a surface below zero, for spheres overlap "
                "much: their specific surface is zero, and the sum over all pores is too large",
                OutOfRangeWarning, stacklevel=2,
            )  # fmt: skip
        return fipy.CellVariable(mesh=self, value=np.maximum(surfaces, 0.0) / self._void, name="specific surface")

    def gradient(self, variable: Any) -> np.ndarray:
        """(3, ..., c): gradient of a CellVariable by least squares over neighbouring pores; exact for linear fields.

        It is what `variable.grad` gives. Values that are given on faces towards pores left out count as neighbours.
        Where they are not given, and the neighbours that are left do not span space, the gradient has no part normal to
        them.
        """
        value = np.asarray(variable.numericValue, float)
        on_faces = np.asarray(variable.arithmeticFaceValue.numericValue)[..., : self._n_faces]
        outer = (self._given.throats >= 0) & (self._given.cells[:, 1] < 0)
        if outer.any():
            mask = variable.arithmeticFaceValue.constraintMask
            given = np.asarray(mask.value if hasattr(mask, "value") else mask, bool)
            given = np.broadcast_to(given, (*value.shape[:-1], self.numberOfFaces)).reshape(-1, self.numberOfFaces)
            outer &= given[:, : self._n_faces].all(axis=0)
        return self._least_squares(outer.tobytes()).of(value, on_faces)

    def _least_squares(self, outer: bytes) -> LeastSquaresGradient:
        """The gradient with these faces (f,) bool, as bytes, for neighbours besides the cells."""
        if outer not in self._gradients:
            given, centres = self._given, self.pore_mesh.pore_centres[self.pores]
            both = given.cells[:, 1] >= 0
            faces = np.flatnonzero(both | np.frombuffer(outer, bool))
            first, second = given.cells[faces].T
            ways = np.where(
                both[faces, None], centres[second] - centres[first], given.distances[faces, None] * given.normals[faces]
            )
            self._gradients[outer] = LeastSquaresGradient(given.cells[faces], ways, len(centres), faces)
        return self._gradients[outer]

    # ---- what FiPy asks for an equation, once patched ---------------------------------------------------------------

    def solver_for(self, equation: Any, variable: Any, named: Any) -> Any:
        """The solver named, or a PoreSolver that shares the mesh's factors; the equation's terms are looked at."""
        check_terms(equation, variable)
        return named or PoreSolver(factors=self._factors)

    # ---- what FiPy's meshes of vertices can do -----------------------------------------------------------------------

    def _refuse(self, *_: Any) -> NoReturn:
        raise TypeError(
            "a FluidMesh is the fluid of a packing: it cannot be moved, scaled or joined to another mesh. "
            "Change the packing (Packing.scaled) and make its mesh anew"
        )

    __add__ = __radd__ = __sub__ = __mul__ = __rmul__ = __truediv__ = _translate = _connectFaces = _refuse
