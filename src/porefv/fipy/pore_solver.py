"""PoreSolver: the linear solver for FiPy's equations on a FluidMesh.

FiPy's default tolerance is relative to the right-hand side, which values given on walls make 10⁶ times larger: time
steps then leave the answer as it was, without a word. A PoreSolver measures what the pores fail to conserve against
what passes through them, and has an error where that is not small.
"""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import LinearOperator, SuperLU, bicgstab, spilu, splu

from porefv.errors import ComputationError, InputError, PorefvWarning, counted
from porefv.fipy.fipy_import import load_fipy
from porefv.solvers.approximate_cholesky import ApproximateCholesky
from porefv.solvers.conjugate_gradients import conjugate_gradients, refined
from porefv.solvers.direct import DirectFactor
from porefv.solvers.network import Network
from porefv.solvers.solver import DIRECT_LIMIT, PRESSURE_TOLERANCE, TOLERANCE

fipy = load_fipy()

# Up to so many unknowns an unsymmetric matrix is factored; beyond, BiCGStab with an incomplete factor costs less
# (benchmarks/fipy_solvers.py).
FACTOR_LIMIT = 20_000
# Entries of the incomplete factor below this part of their column are dropped.
DROP = 1e-3
# A sum over a row of the matrix below this part of its diagonal is rounding.
ROUNDING = 1e-14
# Matrices whose factors are kept: two equations that are solved in turn.
KEPT = 2
# Leaks that are too small to be told from rounding may be this part of all.
UNCERTAIN = 1e-6
_EPSILON = float(np.finfo(float).eps)
_RESTARTS = 20
_CORRECTIONS = 5


class Factors:
    """The last `KEPT` matrices, made ready to be solved: equal matrices are found again. Threads may share it."""

    def __init__(self) -> None:
        self._kept: list[tuple[Any, _Symmetric | _General]] = []
        self._lock = threading.Lock()

    def of(self, matrix: Any, n_cells: int) -> _Symmetric | _General:
        """A matrix made ready, or what is kept of it.

        Parameters
        ----------
        matrix : (n, n) csr_array
        n_cells : int
            Of the mesh: an equation for several unknowns has as many blocks of rows.
        """
        for kept, ready in self._kept:
            if (
                kept.nnz == matrix.nnz
                and np.array_equal(kept.indptr, matrix.indptr)
                and np.array_equal(kept.indices, matrix.indices)
                and np.array_equal(kept.data, matrix.data)
            ):
                return ready
        if not np.isfinite(matrix.data).all():
            raise ComputationError("the matrix of the equation is not finite: look at its coefficients")
        ready = _made_ready(matrix.copy(), n_cells)
        with self._lock:
            self._kept = [(matrix.copy(), ready), *self._kept[: KEPT - 1]]
        return ready


class PoreSolver(fipy.solvers.scipy.scipySolver.ScipySolver):  # type: ignore[name-defined]
    """Solves FiPy's equations to a bound on what the pores fail to conserve.

    Symmetric M-matrices (diffusion, pressure, with or without time) are solved by conjugate gradients with an
    approximate Cholesky factor, others (convection, coupled equations) by a sparse factor, or by BiCGStab with an
    incomplete one where there are more than `FACTOR_LIMIT` unknowns. Factors are kept as long as the matrix stays the
    same, for the last `KEPT` matrices.

    Parameters
    ----------
    tolerance : float
        Largest Σ|b - A x|, relative to the flow: half of what enters and leaves the unknowns, ½ Σ|e x - b| with e the
        sums of the matrix's columns.
    factors : Factors, optional
        Where factors are kept; solvers may share them.
    iterations : int
        Most iterations. Where BiCGStab needs more, a warning (`PorefvWarning`) says so, and the matrix is factored.

    Raises
    ------
    InputError
        For a tolerance that is not in (0, 1).
    ComputationError
        On solving: if the tolerance is not reached, values are not finite, or some unknowns are not determined.

    Examples
    --------
    >>> import fipy
    >>> mesh = PoreMesh(Packing.read("data/packings/n25_s1.csv")).to_fipy()
    >>> c = fipy.CellVariable(mesh=mesh)
    >>> c.constrain(1.0, where=mesh.facesBottom)
    >>> fipy.DiffusionTerm(coeff=1.0).solve(var=c, solver=PoreSolver(tolerance=1e-12))
    >>> bool(np.allclose(c.value, 1.0))
    True
    """

    def __init__(
        self, tolerance: float = TOLERANCE, iterations: int = 1000, factors: Factors | None = None, **_: object
    ):
        if not (isinstance(tolerance, (int, float)) and 0.0 < tolerance < 1.0):
            raise InputError(f"the solver's tolerance must lie between 0 and 1, not {tolerance!r}")
        super().__init__(tolerance=tolerance, iterations=iterations, criterion="unscaled", precon=None)
        self._factors = Factors() if factors is None else factors

    @property
    def _Lxb(self) -> Any:  # FiPy's name
        processes = self.var.mesh.communicator.Nproc
        if processes > 1:
            raise InputError(
                f"PoreSolver solves in one process, and there are {processes}: every one of them would solve the whole "
                "problem. Start Python without mpirun"
            )
        return super()._Lxb

    def _solve_(self, L: Any, x: np.ndarray, b: np.ndarray) -> np.ndarray:  # FiPy's names
        matrix = sp.csr_array(L)
        x = np.ascontiguousarray(x, float)
        if not (np.isfinite(b).all() and np.isfinite(x).all()):
            raise ComputationError("the right-hand side, or the value that the variable has, is not finite")
        ready = self._factors.of(matrix, self.var.mesh.numberOfCells)
        with ready.lock:
            x, iterations = ready.solve(ready.sign * np.asarray(b, float), x, self.tolerance, self.iterations)
            lost, flow, floor = ready.imbalance(ready.sign * b, x)
        wrong = np.flatnonzero(~(lost <= np.maximum(self.tolerance * flow, floor)))
        if len(wrong):
            k = wrong[0]
            raise ComputationError(
                f"the solver stopped after {iterations} iterations with Σ|b - A x| at {_ratio(lost[k], flow[k]):.1e} "
                f"of the flow (asked: {self.tolerance:.1e}); try smaller time steps, or FiPy's LinearLUSolver"
            )
        unit = abs(ready.sign)
        self._setConvergence(
            suite="scipy", code=0, iterations=iterations, residual=lost.sum() / unit, tolerance_scale=flow.sum() / unit
        )
        return x

    def _canSolveAsymmetric(self) -> bool:
        return True


@contextmanager
def use_pore_solver(tolerance: float = TOLERANCE) -> Iterator[PoreSolver]:
    """Within a `with` block, FiPy's equations on any mesh are solved by a PoreSolver unless another is named.

    Equations on a `FluidMesh` are so without. Replaces `fipy.solvers.DefaultSolver` and `DefaultAsymmetricSolver` of
    the whole process, and puts them back on leaving the block.

    Examples
    --------
    >>> import fipy
    >>> grid = fipy.Grid1D(nx=4)
    >>> c = fipy.CellVariable(mesh=grid)
    >>> c.constrain(1.0, where=grid.facesLeft)
    >>> with use_pore_solver() as solver:
    ...     fipy.DiffusionTerm(coeff=1.0).solve(var=c)
    >>> bool(np.allclose(c.value, 1.0))
    True
    """
    solver = PoreSolver(tolerance)
    names = ("DefaultSolver", "DefaultAsymmetricSolver")
    before = {name: getattr(fipy.solvers, name) for name in names}
    for name in names:
        setattr(fipy.solvers, name, lambda *_, **__: solver)
    try:
        yield solver
    finally:
        for name, value in before.items():
            setattr(fipy.solvers, name, value)


def _ratio(lost: float, flow: float) -> float:
    return lost / flow if flow > 0.0 else np.inf


def _made_ready(matrix: Any, n_cells: int) -> _Symmetric | _General:
    matrix.sum_duplicates()
    diagonal = matrix.diagonal()
    sign = -1.0 if diagonal.sum() < 0.0 else 1.0
    matrix, diagonal = sign * matrix, sign * diagonal
    off = sp.csr_array(matrix - sp.diags_array(diagonal))
    off.eliminate_zeros()
    sums = matrix.sum(axis=1)
    m_matrix = (diagonal > 0.0).all() and (off.data <= 0.0).all() and (sums >= -ROUNDING * diagonal).all()
    difference = abs(off - off.T)
    if m_matrix and (difference.nnz == 0 or difference.max() <= ROUNDING * abs(off).max()):
        return _Symmetric(matrix, off, _certain(matrix, sums, diagonal), sign)
    return _General(matrix, sign, n_cells)


def _certain(matrix: Any, sums: np.ndarray, diagonal: np.ndarray) -> np.ndarray:
    """(n,): sums of rows, zero where they are at the level of rounding; ComputationError if those are much of all."""
    count, part = connected_components(matrix, directed=False)
    known = sums > ROUNDING * diagonal
    kept = np.bincount(part, np.where(known, sums, 0.0), count)
    lost = np.bincount(part, np.where(known, 0.0, np.maximum(sums, 0.0)), count)
    vague = np.flatnonzero((kept > 0.0) & (lost > UNCERTAIN * kept))
    if len(vague):
        members = np.flatnonzero(part == vague[0])
        raise ComputationError(
            f"{counted(len(members), 'unknown')}, the first of them {members[0]}, are tied down by sinks or steps of "
            f"time, of which rounding of the matrix hides {lost[vague[0]] / kept[vague[0]]:.0e}: take smaller steps of "
            "time, or give a value on a wall"
        )
    return np.where(known, sums, 0.0)


def _ensure_determined(matrix: Any, leaks: np.ndarray) -> None:
    """ComputationError if some part of the unknowns is joined to nothing that is known."""
    count, part = connected_components(matrix, directed=False)
    leaking = np.bincount(part, np.abs(leaks), count) > 0.0
    if not leaking.all():
        members = np.flatnonzero(~leaking[part])
        raise ComputationError(
            f"{counted(len(members), 'unknown')} of {len(part)}, the first of them {members[0]}, "
            f"{'is' if len(members) == 1 else 'are'} determined up to a constant only: no value, no outflow, no sink "
            "and no time step ties them down. Constrain the variable on a wall, or add a TransientTerm"
        )


class _Symmetric:
    """A symmetric M-matrix, as the network that it is."""

    def __init__(self, matrix: Any, off: Any, leaks: np.ndarray, sign: float):
        _ensure_determined(matrix, leaks)
        self.sign, self.lock = sign, threading.Lock()
        links = sp.csr_array(-0.5 * (off + off.T))
        links.sort_indices()
        weights = np.ascontiguousarray(links.data)
        self._network = Network(
            links.indptr.astype(np.int64), links.indices.astype(np.int32), weights, np.ascontiguousarray(leaks),
            leaks + links.sum(axis=1),
        )  # fmt: skip

    @cached_property
    def _factor(self) -> DirectFactor | ApproximateCholesky:
        return DirectFactor(self._network) if len(self._network) <= DIRECT_LIMIT else self._approximate

    @cached_property
    def _approximate(self) -> ApproximateCholesky:
        return ApproximateCholesky.of(self._network)

    def solve(self, b: np.ndarray, x: np.ndarray, tolerance: float, limit: int) -> tuple[np.ndarray, int]:
        x, iterations = conjugate_gradients(self._network, b, self._factor, tolerance, x, limit)
        if iterations >= limit:
            return x, iterations
        error = np.empty(len(x))
        self._factor.apply(np.abs(self._network.residual(b, x)), error)
        accuracy = PRESSURE_TOLERANCE * max(float(np.ptp(x)), np.finfo(float).tiny)
        if error.max() <= accuracy:
            return x, iterations
        # Unknowns behind nearly closed faces may be far from their values while next to nothing is lost.
        leaks = self._network.leaks
        held = np.divide(b, leaks, out=np.zeros(len(b)), where=leaks > 0.0)
        sources = np.where(leaks > 0.0, 0.0, b)
        found = refined(self._network, held, sources, self._approximate, tolerance, accuracy)
        if not found.error <= accuracy:
            raise ComputationError(
                f"values are uncertain by {PRESSURE_TOLERANCE * found.error / accuracy:.1e} of their range: some pores "
                "are joined to the rest by coefficients too many decades below the others"
            )
        return found.x + found.rest, iterations + found.iterations

    def imbalance(self, b: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Σ|b - A x|, the flow, and what rounding of x alone may lose, (1,) each."""
        network = self._network
        lost = np.abs(network.residual(b, x)).sum(keepdims=True)
        flow = 0.5 * np.abs(network.leaks * x - b).sum(keepdims=True)
        return lost, flow, 2.0 * _EPSILON * (network.diagonal * np.abs(x)).sum(keepdims=True)


class _General:
    """Any other matrix: a sparse factor, or an incomplete one and BiCGStab."""

    def __init__(self, matrix: Any, sign: float, n_cells: int):
        self._sizes, self._n_cells, self.lock = abs(matrix), n_cells, threading.Lock()
        empty = np.flatnonzero(self._sizes.sum(axis=1) == 0.0)
        if len(empty):
            raise ComputationError(
                f"nothing determines {counted(len(empty), 'unknown')} of {matrix.shape[0]}, the first of them "
                f"{empty[0]}: its row of the matrix is empty"
            )
        # Sizes near 1: SciPy's BiCGStab takes products below 1e-32 for a breakdown, whatever the units.
        scale = 2.0 ** -float(np.rint(np.log2(self._sizes.max())))
        self.sign = sign * scale
        self._matrix, self._sizes = scale * matrix, scale * self._sizes
        self._leaks = self._matrix.sum(axis=0)
        # Where all columns of a part sum to nothing, nothing leaves it; where all rows do, constants are solutions.
        for axis in (0, 1):
            sums = self._matrix.sum(axis=axis)
            _ensure_determined(matrix, np.where(np.abs(sums) > ROUNDING * self._sizes.sum(axis=axis), sums, 0.0))
        self._direct = matrix.shape[0] <= FACTOR_LIMIT
        self._insufficient = False

    @cached_property
    def _factor(self) -> SuperLU:
        if self._direct:
            return self._lu(diag_pivot_thresh=0.0, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        return spilu(
            self._matrix.tocsc(), drop_tol=DROP, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )  # fmt: skip

    @cached_property
    def _pivoted(self) -> SuperLU:
        """A factor with partial pivoting, for matrices that are not diagonally dominant."""
        return self._lu(permc_spec="COLAMD")

    def _lu(self, **options: Any) -> SuperLU:
        try:
            return splu(self._matrix.tocsc(), **options)
        except RuntimeError:
            raise ComputationError(
                "the matrix of the equation is singular: some unknowns are not determined. Constrain the variable, or "
                "add a TransientTerm"
            ) from None

    def solve(self, b: np.ndarray, x: np.ndarray, tolerance: float, limit: int) -> tuple[np.ndarray, int]:
        iterations = 0
        if not self._insufficient:
            first = self._by_factor if self._direct else self._by_iteration
            x, iterations = first(b, x, tolerance, limit)
            if self._excess(b, x, tolerance) <= 1.0:
                return x, iterations
            self._insufficient = True
            if not self._direct:
                warnings.warn(
                    f"BiCGStab did not reach a tolerance of {tolerance:.1e} in {iterations} iterations: the matrix of "
                    f"{counted(len(b), 'unknown')} is factored, which takes longer. Smaller time steps, or upwind in "
                    "place of central differences, make it easier",
                    PorefvWarning,
                    stacklevel=2,
                )
        x, more = self._refine(b, x, tolerance, self._pivoted)
        return x, iterations + more

    def _by_factor(self, b: np.ndarray, x: np.ndarray, tolerance: float, limit: int) -> tuple[np.ndarray, int]:
        return self._refine(b, self._factor.solve(b), tolerance, self._factor)

    def _refine(self, b: np.ndarray, x: np.ndarray, tolerance: float, factor: SuperLU) -> tuple[np.ndarray, int]:
        """Corrections by a factor until the tolerance is met, or rounding allows no more; at least one."""
        best, least, count = x, np.inf, 0
        while count < _CORRECTIONS:
            count += 1
            x = x + factor.solve(b - self._matrix @ x)
            excess = self._excess(b, x, 0.01 * tolerance)
            if not excess < 0.5 * least:
                break
            best, least = x, excess
            if excess <= 1.0:
                break
        return best, count

    def _by_iteration(self, b: np.ndarray, x: np.ndarray, tolerance: float, limit: int) -> tuple[np.ndarray, int]:
        done = [0]

        def count(_: np.ndarray) -> None:
            done[0] += 1

        before = np.inf
        for _ in range(_RESTARTS):
            excess = self._excess(b, x, tolerance)
            if excess <= 1.0 or not excess < 0.9 * before or done[0] >= limit:
                break
            before = excess
            # Each unknown in the unit of what its block may lose: a trace counts as much as what it is a trace of.
            _, flow, floor = self.imbalance(b, x)
            allowed = np.maximum(tolerance * flow, floor)
            unit = np.repeat(np.where(allowed > 0.0, allowed, allowed.max()), len(b) // len(allowed))
            scale = sp.diags_array(unit)
            matrix = sp.diags_array(1.0 / unit) @ self._matrix @ scale
            preconditioner = LinearOperator(
                matrix.shape, lambda v, unit=unit: self._factor.solve(unit * v.ravel()) / unit
            )
            r = (b - self._matrix @ x) / unit
            size = float(np.linalg.norm(r))
            # What is lost is a sum over the unknowns, of which BiCGStab's norm knows the root of the squares.
            part = max(0.5 / np.sqrt(len(b)) / size, 1e-12)
            dx, _code = bicgstab(
                matrix, r / size, rtol=part, atol=0.0, maxiter=limit - done[0], M=preconditioner, callback=count
            )
            if not np.isfinite(dx).all():
                break
            x = x + size * unit * dx
        return x, done[0]

    def _excess(self, b: np.ndarray, x: np.ndarray, tolerance: float) -> float:
        """What a block loses over what it may lose, of the worst block; 1 or less if all is well."""
        lost, flow, floor = self.imbalance(b, x)
        allowed = np.maximum(tolerance * flow, floor)
        excess = np.divide(lost, allowed, out=np.where(lost > 0.0, np.inf, 0.0), where=allowed > 0.0)
        return float(excess.max())

    def imbalance(self, b: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Σ|b - A x|, the flow, and what rounding of x alone may lose, (k,) each: of each variable of the equation."""
        blocks = len(b) // self._n_cells if len(b) % self._n_cells == 0 else 1
        lost, flow, size = np.abs(b - self._matrix @ x), np.abs(self._leaks * x - b), self._sizes @ np.abs(x)
        lost, flow, size = (values.reshape(blocks, -1).sum(axis=1) for values in (lost, flow, size))
        return lost, 0.5 * flow, 2.0 * _EPSILON * size
