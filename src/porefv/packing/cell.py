"""The periodic cell: three lattice vectors, by which the spheres in it are repeated without end, and no walls."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from porefv.errors import InputError, vector
from porefv.packing.box import Box, Floats, read_only

# Volume over the product of the lengths of the three vectors, at or below which they lie in a plane but for rounding.
_FLATTEST = 1e-10


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Cell:
    """Periodic cell, a parallelepiped: what is in it is repeated along three lattice vectors, without end.

    Parameters
    ----------
    vectors : (3, 3) or (3,) array, m
        One lattice vector in each row; or the lengths of three vectors along the axes.
    origin : (3,) array, m
        Corner from which the vectors lead.

    Raises
    ------
    InputError
        If the numbers are not finite or not so many, or the vectors span no volume.

    Examples
    --------
    >>> Cell([1, 1, 2])
    Cell(1×1×2 m)
    >>> Cell([[1, 0, 0], [0.25, 1, 0], [0, 0, 1]]).volume
    1.0
    """

    vectors: Floats
    origin: Floats

    def __init__(self, vectors: ArrayLike, origin: ArrayLike = (0.0, 0.0, 0.0)):
        given = read_only(vectors, "the vectors of a periodic cell")
        if given.shape == (3,):
            given = read_only(np.diag(given), "the vectors of a periodic cell")
        if given.shape != (3, 3) or not np.isfinite(given).all():
            raise InputError(
                f"the vectors of a periodic cell must be three rows of three finite numbers, or three lengths, "
                f"not {vectors!r}."
            )
        corner = read_only(origin, "the origin of a periodic cell")
        if corner.shape != (3,) or not np.isfinite(corner).all():
            raise InputError(f"the origin of a periodic cell must be three finite numbers, not {origin!r}.")
        object.__setattr__(self, "vectors", given)
        object.__setattr__(self, "origin", corner)
        with np.errstate(over="ignore", under="ignore"):
            least = _FLATTEST * float(np.prod(self.lengths))
        if not least < self.volume < np.inf:
            rows = ", ".join(vector(row) for row in given)
            raise InputError(
                f"the periodic cell has no volume: its vectors {rows} m lie in a plane, or are too short or too long "
                "for numbers. Give three vectors that span a volume."
            )

    @classmethod
    def of(cls, box: Box) -> Cell:
        """The periodic cell with the sides of a box."""
        return cls(np.diag(box.size), box.lower)

    @cached_property
    def lengths(self) -> Floats:
        """(3,): length of each vector, m."""
        with np.errstate(over="ignore", under="ignore"):
            return np.linalg.norm(self.vectors, axis=1)

    @cached_property
    def volume(self) -> float:
        """Volume, m³."""
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            a, b, c = self.vectors
            return float(abs(a @ np.cross(b, c)))

    def scaled(self, factor: float) -> Cell:
        """The cell with all lengths multiplied by a factor."""
        return Cell(self.vectors * factor, self.origin * factor)

    def steps(self, points: Floats) -> NDArray[np.int64]:
        """(n, 3): how many of each vector lead from the cell to the image of it that holds each point (n, 3)."""
        return np.floor(np.linalg.solve(self.vectors.T, (points - self.origin).T).T).astype(np.int64)

    def wrapped(self, points: Floats) -> Floats:
        """(n, 3): the image in the cell of each point (n, 3), m."""
        return points - self.steps(points) @ self.vectors

    @cached_property
    def shortest(self) -> float:
        """How near the next image of a point is: length of the shortest sum of whole numbers of the vectors, m."""
        reduced = reduced_basis(self.vectors)
        steps = np.array([step for step in product((-1, 0, 1), repeat=3) if any(step)])
        return float(np.linalg.norm(steps @ reduced, axis=1).min())

    @property
    def is_orthogonal(self) -> bool:
        """Whether each vector lies along an axis of its own."""
        return bool((np.count_nonzero(self.vectors, axis=0) == 1).all())

    @property
    def sides(self) -> str:
        """Lengths of the vectors as text, ``1×2×1 m``; for a cell that is not orthogonal with the vectors."""
        lengths = "×".join(f"{length:.6g}" for length in self.lengths) + " m"
        if self.is_orthogonal:
            return lengths
        return f"{lengths}, vectors " + ", ".join(f"({vector(row)})" for row in self.vectors)

    def __repr__(self) -> str:
        corner = f", origin ({vector(self.origin)})" if self.origin.any() else ""
        return f"Cell({self.sides}{corner})"


def reduced_basis(vectors: Floats) -> Floats:
    """(3, 3): three short vectors of the same lattice, sums of whole numbers of those given (Semaev 2001).

    They change as little as a step, if at all, where the cell is shifted by a multiple of another of its vectors. On
    vectors that are multiples of one power of two, not many bits long, no operation rounds.
    """
    basis = np.array(vectors, float)
    while True:
        basis = basis[np.argsort((basis**2).sum(axis=1), kind="stable")]
        a, b, c = basis
        across = np.rint(a @ b / (a @ a))
        if across != 0.0 and ((b - across * a) ** 2).sum() < (b**2).sum():
            basis[1] = b - across * a
            continue
        # The lattice point of the plane of a and b that is nearest to c, or next to it.
        gram = np.array([[a @ a, a @ b], [a @ b, b @ b]])
        middle = np.rint(np.linalg.solve(gram, [a @ c, b @ c]))
        tries = [c - (middle[0] + i) * a - (middle[1] + j) * b for i, j in product((-1, 0, 1), repeat=2)]
        best = min(tries, key=lambda v: float(v @ v))
        if not best @ best < (c @ c) * (1.0 - 1e-12):
            return basis
        basis[2] = best
