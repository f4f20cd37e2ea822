"""Packing: spheres in a box or in a periodic cell; what they fill, where they overlap, and whether they fit."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from porefv.errors import InputError, PackingFileWarning, counted, vector
from porefv.packing.box import WALLS, Box, Floats, read_only
from porefv.packing.cell import Cell
from porefv.packing.overlaps import Overlaps, cap_volume, lens_volume, sphere_volumes
from porefv.packing.reading import Reading
from porefv.system.html_table import html_table, range_text
from porefv.system.number_checks import is_finite_number

if TYPE_CHECKING:
    from porefv.packing.periodic_overlaps import PeriodicOverlaps

_MOST_SHOWN = 5  # culprits listed in one error

# Spheres that differ by less, relative to the radius of the smaller, are at one place.
_WITHIN = 1e-9
_NEARLY_WITHIN = 0.02  # likewise, of which a warning says that they may be the same sphere

# Lengths whose sixth powers a double holds, which is what the geometry of throats multiplies; and the smallest radius,
# relative to the box, whose place in it rounding leaves.
SHORTEST, LONGEST, FINEST = 1e-30, 1e30, 1e-15


@dataclass(frozen=True, eq=False)
class Source:
    """The file a packing was read from, so that errors can name the line of a sphere.

    Parameters
    ----------
    path : path
    lines : (n,) integer array, optional
        Line of each sphere, counted from 1; None for binary formats.
    reading : Reading, optional
        What the reader understood of the file.
    """

    path: str | PathLike[str]
    lines: NDArray[np.integer] | None = None
    reading: Reading | None = None

    def name(self, sphere: int) -> str:
        """``line 7 (sphere 5)``, or ``sphere 5`` if there are no lines."""
        return f"sphere {sphere}" if self.lines is None else f"line {self.lines[sphere]} (sphere {sphere})"


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Packing:
    """Spheres, and the box whose six walls confine them, or the periodic cell that repeats them.

    Spheres are known by their position in `centres`. The arrays are copied, converted to float64, and
    read-only.

    Parameters
    ----------
    centres : (n, 3) array, m
    radii : (n,) array, m
    box : Box or Cell, optional
        Needed by everything about porosity and flow. In a periodic `Cell`, each sphere may be given by any of its
        images.
    source : Source, optional
        File the spheres come from, to be named in errors.
    metadata : dict, optional
        Texts found in the file.

    Raises
    ------
    InputError
        If there is no sphere, a shape is wrong, a value is not finite, or a radius is not positive. Whether
        the spheres fit one another and the box is left to `validate`.

    Examples
    --------
    >>> Packing(centres=[[0.5, 0.5, 0.5]], radii=[0.5], box=Box([0, 0, 0], [1, 1, 1]))
    Packing(1 sphere, radius 0.5 m, box 1×1×1 m)
    """

    centres: Floats
    radii: Floats
    box: Box | Cell | None
    source: Source | None
    metadata: dict[str, str]

    def __init__(
        self,
        centres: ArrayLike,
        radii: ArrayLike,
        box: Box | Cell | None = None,
        source: Source | None = None,
        metadata: dict[str, str] | None = None,
    ):
        centres, radii = read_only(centres, "centres"), read_only(radii, "radii")
        if box is not None and not isinstance(box, Box | Cell):
            try:
                box = Box(*box)
            except TypeError:
                raise InputError(f"box must be a Box, its two corners, or a Cell, not {box!r}") from None
        given = {"centres": centres, "radii": radii, "box": box, "source": source, "metadata": metadata or {}}
        for name, value in given.items():
            object.__setattr__(self, name, value)
        if centres.ndim != 2 or centres.shape[1] != 3 or radii.shape != centres.shape[:1]:
            raise InputError(
                f"{self._path()}centres must have shape (n, 3) and radii (n,), not {centres.shape} and {radii.shape}."
            )
        if len(radii) == 0:
            raise InputError(f"{self._path()}there is no sphere. Give at least one.")
        self._refuse(
            np.flatnonzero(~(np.isfinite(centres).all(axis=1) & np.isfinite(radii))),
            "values that are not finite",
            "sphere",
            lambda i: f"{self._name(i)}: centre {vector(centres[i])}, radius {radii[i]:.9g}",
            "Correct or remove these spheres.",
        )
        self._refuse(
            np.flatnonzero(radii <= 0),
            "radius not positive",
            "sphere",
            lambda i: f"{self._name(i)}: radius {radii[i]:.9g}",
            "Correct or remove these spheres.",
        )

    @classmethod
    def read(
        cls,
        path: str | PathLike[str],
        format: str | None = None,
        box: Box | Cell | None = None,
        *,
        columns: Mapping[str, str] | None = None,
        radius: float | None = None,
        scale: float | None = None,
        frame: int | None = None,
        periodic: str | None = None,
    ) -> Packing:
        """Read a packing file: see `porefv.packing.read_packing`."""
        from porefv.packing.files.registry import read_packing

        return read_packing(
            path, format, box, columns=columns, radius=radius, scale=scale, frame=frame, periodic=periodic
        )

    def write(self, path: str | PathLike[str], format: str | None = None) -> None:
        """Write a packing file: see `porefv.packing.write_packing`."""
        from porefv.packing.files.registry import write_packing

        write_packing(self, path, format=format)

    def with_box(self, box: Box | Cell) -> Packing:
        """The same spheres in another box, or in a periodic cell."""
        return replace(self, box=box)

    def wrapped(self) -> Packing:
        """The packing of a periodic cell with every centre in the cell; `metadata` says how many were outside."""
        cell = self.require_cell()
        outside = int(np.count_nonzero(cell.steps(self.centres).any(axis=1)))
        metadata = self.metadata | ({"wrapped": str(outside)} if outside else {})
        return replace(self, centres=cell.wrapped(self.centres), metadata=metadata)

    def scaled(self, factor: float) -> Packing:
        """The packing with all lengths, those of its box included, multiplied by a factor."""
        if not (is_finite_number(factor) and factor > 0.0):
            raise InputError(f"the factor of lengths must be a positive number, not {factor!r}")
        box = None if self.box is None else self.box.scaled(factor)
        return replace(self, centres=self.centres * factor, radii=self.radii * factor, box=box)

    def cropped(self, box: Box) -> Packing:
        """The spheres whose centres lie in a box, in that box; of a packing in a periodic cell, all their images.

        Spheres that reach beyond its walls are cut by them: the part inside stays. Such a packing needs a
        `wall_tolerance` of the mesh that is large enough; 1 is for any crop. Of spheres whose centres are outside, the
        caps that reach into the box are lost, which leaves voids along its walls; `metadata` says how many they were.

        Raises
        ------
        InputError
            If no centre is in the box.
        """
        if isinstance(self.box, Cell):
            return self._images_around(box, self.box).cropped(box)
        distances = box.wall_distances(self.centres)
        inside = (distances > 0.0).all(axis=1)
        if not inside.any():
            raise InputError(f"{self._path()}no centre lies in the box {vector(box.lower)} to {vector(box.upper)}.")
        lost = int(np.count_nonzero(~inside & (distances > -self.radii[:, None]).all(axis=1)))
        metadata = self.metadata | ({"caps_lost": str(lost)} if lost else {})
        return Packing(self.centres[inside], self.radii[inside], box, metadata=metadata)

    def _images_around(self, box: Box, cell: Cell) -> Packing:
        """All images of the spheres of a periodic cell in a box and around it."""
        reach = self.radii.max()
        corners = np.stack(np.meshgrid(*zip(box.lower - reach, box.upper + reach, strict=True)), axis=-1).reshape(-1, 3)
        steps = cell.steps(corners)
        ranges = [np.arange(least, most + 1) for least, most in zip(steps.min(axis=0), steps.max(axis=0), strict=True)]
        moves = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3) @ cell.vectors
        points = (cell.wrapped(self.centres)[:, None] + moves).reshape(-1, 3)
        near = ((points > box.lower - reach) & (points < box.upper + reach)).all(axis=1)
        if not near.any():
            raise InputError(f"{self._path()}no centre lies in the box {vector(box.lower)} to {vector(box.upper)}.")
        return Packing(points[near], np.repeat(self.radii, len(moves))[near], metadata=self.metadata)

    @property
    def bounding_box(self) -> Box:
        """The smallest box, with corners of few digits, that holds every sphere."""
        around = Box.around(self)
        lower, upper = around.lower, around.upper
        digit = 10.0 ** (np.floor(np.log10((upper - lower).max())) - 5)
        # What rounding adds to a bound does not push it to the next digit.
        return Box(np.floor(lower / digit + 1e-6) * digit, np.ceil(upper / digit - 1e-6) * digit)

    @property
    def reading(self) -> Reading | None:
        """What the reader understood of the file; None if the spheres come from no file."""
        return self.source.reading if self.source else None

    @cached_property
    def overlaps(self) -> Overlaps:
        """Pairs of spheres that overlap, and spheres that cross walls (none without a box)."""
        if isinstance(self.box, Cell):
            return self._periodic.overlaps
        # Not at the top: it loads numba and scipy, which a script that only reads a packing does not need.
        from porefv.packing.neighbours import neighbour_pairs

        try:
            pairs = neighbour_pairs(self.centres, self.radii)
        except InputError as error:
            raise InputError(f"{self._path()}{error}") from None
        i, j = pairs.T
        depths = self.radii[i] + self.radii[j] - np.linalg.norm(self.centres[j] - self.centres[i], axis=1)
        wall_depths = self.radii[:, None] - self._wall_distances()
        spheres, walls = np.nonzero(wall_depths > 0)
        return Overlaps(pairs, depths, spheres.astype(np.int32), walls.astype(np.int32), wall_depths[spheres, walls])

    @cached_property
    def _periodic(self) -> PeriodicOverlaps:
        from porefv.packing.periodic_overlaps import periodic_overlaps

        try:
            return periodic_overlaps(self.centres, self.radii, self.require_cell())
        except InputError as error:
            raise InputError(f"{self._path()}{error}") from None

    @cached_property
    def solid_volume(self) -> float:
        """Volume of the union of the spheres, inside the box if there is one, m³.

        Balls, less the lens shared by each overlapping pair, less the cap beyond each wall. Where a point belongs to
        three of these at once, the spheres' shares of their Laguerre cells, which is exact for any overlap.

        Raises
        ------
        InputError
            If there are such points, and the packing is not one that cells can be made of (see `validate`).
        """
        if self.triple_overlaps:
            return self._union_volume
        found = self.overlaps
        i, j = found.pairs.T
        balls = sphere_volumes(self.radii)
        lenses = lens_volume(self.radii[i], self.radii[j], self.radii[i] + self.radii[j] - found.depths)
        caps = cap_volume(self.radii[found.wall_spheres], found.wall_depths)
        return float(balls.sum() - lenses.sum() - caps.sum())

    @property
    def _union_volume(self) -> float:
        if isinstance(self.box, Cell):
            from porefv.mesh.periodic_mesh import PeriodicMesh

            return float(PeriodicMesh(self).facets.solids.sum())
        from porefv.mesh.cell_mesh import CellMesh

        packing = self
        if self.box is None:  # one that cuts nothing off
            reach = 2.0 * self.radii.max()
            packing = self.with_box(Box(self.centres.min(axis=0) - reach, self.centres.max(axis=0) + reach))
        return float(CellMesh(packing, wall_tolerance=np.inf).facets.solids.sum())

    @cached_property
    def triple_overlaps(self) -> int:
        """Number of triples, of spheres or of spheres and walls, with a point in common."""
        if isinstance(self.box, Cell):
            return self._periodic.triples
        found = self.overlaps
        if len(found.pairs) + len(found.wall_ids) == 0:
            return 0
        from porefv.packing.triple_overlaps import triple_overlaps

        crossings = np.zeros((len(self), 6))
        crossings[found.wall_spheres, found.wall_ids] = found.wall_depths
        return int(triple_overlaps(found.pairs, self.centres, self.radii, crossings))

    @cached_property
    def porosity(self) -> float:
        """Fraction of the box outside the union of the spheres; errors as of `solid_volume`."""
        return 1.0 - self.solid_volume / self._require_box().volume

    def validate(self, wall_tolerance: float = 0.05) -> Packing:
        """Check that the spheres fit one another and the box, or the periodic cell.

        Overlap (cemented or compressed grains, clumps) is legitimate, as long as no sphere lies within another one. A
        sphere may reach beyond a wall by a fraction of its radius. Centres lie strictly inside the box. In a periodic
        cell, no sphere holds the centre of an image of itself.

        Parameters
        ----------
        wall_tolerance : float
            Largest accepted reach beyond a wall, as a fraction of the radius.

        Returns
        -------
        Packing
            This one.

        Raises
        ------
        InputError
            Names up to five culprits, and counts them all.
        """
        if not wall_tolerance >= 0:
            raise InputError(f"wall_tolerance must be a number >= 0, not {wall_tolerance}.")
        box = self._require_box()
        sides = box.lengths if isinstance(box, Cell) else box.size
        if not (sides.min() >= SHORTEST and sides.max() <= LONGEST):
            raise InputError(
                f"{self._path()}the box has sides {vector(sides)} m; they must lie between {SHORTEST:g} and "
                f"{LONGEST:g} m. Give lengths in another unit."
            )
        finest = FINEST * sides.max()
        self._refuse(
            np.flatnonzero((self.radii < finest) | (self.radii > LONGEST)),
            f"radius not between {finest:.3g} m, which is {FINEST:g} of the box, and {LONGEST:g} m",
            "sphere",
            lambda i: f"{self._name(i)}: radius {self.radii[i]:.9g}",
            "Correct or remove these spheres.",
        )
        if isinstance(box, Cell):
            self._refuse_own_images(box)
        else:
            self._refuse_beyond_walls(box, wall_tolerance)
        pairs = self.overlaps.pairs
        self._refuse(
            np.flatnonzero(self.overlaps.depths >= (2.0 - _WITHIN) * self.radii[pairs].min(axis=1)),
            "one sphere lies within another",
            "pair",
            lambda k: self._describe_within(pairs[k, 0], pairs[k, 1]),
            "Remove the inner sphere of each pair, or correct centres and radii.",
        )
        self._warn_nearly_within()
        return self

    def _refuse_own_images(self, cell: Cell) -> None:
        self._refuse(
            np.flatnonzero(self.radii >= cell.shortest),
            "sphere holds the centre of its own image",
            "sphere",
            lambda i: f"{self._name(i)}: radius {self.radii[i]:.9g} m, next image {cell.shortest:.9g} m away",
            "Correct these radii, or give a larger periodic cell.",
        )

    def _refuse_beyond_walls(self, box: Box, wall_tolerance: float) -> None:
        distances = self._wall_distances()
        nearest = distances.argmin(axis=1)
        beyond = self.radii - distances.min(axis=1)
        enlarge = (
            f"Correct or remove these spheres, or give a box larger than {vector(box.lower)} to {vector(box.upper)}."
        )
        if self.reading and self.reading.periodicity:
            enlarge = (
                "These spheres cross the boundaries of a periodic cell, whose other side porefv does not know. "
                "Remove them, which leaves voids along the walls, or make the packing between walls."
            )
        self._refuse(
            np.flatnonzero((distances <= 0).any(axis=1)),
            "centre not inside the box",
            "sphere",
            lambda i: f"{self._name(i)}: centre {vector(self.centres[i])} is on or beyond {WALLS[nearest[i]]}",
            enlarge,
        )
        self._refuse(
            np.flatnonzero(beyond > wall_tolerance * self.radii),
            f"sphere reaches beyond a wall by more than {wall_tolerance:.6g} of its radius",
            "sphere",
            lambda i: (
                f"{self._name(i)}: {beyond[i]:.6g} m beyond {WALLS[nearest[i]]}, "
                f"{beyond[i] / self.radii[i]:.3g} of its radius {self.radii[i]:.6g} m"
            ),
            enlarge,
        )

    def _warn_nearly_within(self) -> None:
        """Warn of spheres that lie within another but for a small part: most are the same sphere, given twice."""
        pairs = self.overlaps.pairs
        nearly = np.flatnonzero(self.overlaps.depths >= (2.0 - _NEARLY_WITHIN) * self.radii[pairs].min(axis=1))
        if len(nearly):
            shown = "; ".join(f"{self._name(i)} and {self._name(j)}" for i, j in pairs[nearly[:_MOST_SHOWN]])
            more = f"; and {len(nearly) - _MOST_SHOWN} more" if len(nearly) > _MOST_SHOWN else ""
            warnings.warn(
                f"{self._path()}one sphere lies within another but for less than {_NEARLY_WITHIN:g} of its radius, in "
                f"{counted(len(nearly), 'pair')}: {shown}{more}. If they are the same sphere, remove one of each pair.",
                PackingFileWarning,
                stacklevel=3,
            )

    def __len__(self) -> int:
        return len(self.radii)

    def __repr__(self) -> str:
        smallest, largest = self.radii.min(), self.radii.max()
        radii = f"radius {smallest:.3g}" if smallest == largest else f"radii {smallest:.3g}...{largest:.3g}"
        box = "no box" if self.box is None else f"{self._kind_of_box} {self.box.sides}"
        return f"Packing({counted(len(self), 'sphere')}, {radii} m, {box})"

    def _repr_html_(self) -> str:
        rows = [("spheres", str(len(self))), ("radii", range_text(self.radii, "m"))]
        if self.box is None:
            rows.append(("box", "none"))
        elif isinstance(self.box, Cell):
            rows.append(("periodic cell", self.box.sides))
        else:
            box = self.box
            rows += [("box", f"{vector(box.lower)} to {vector(box.upper)} m"), ("sides", box.sides)]
        if self.source is not None:
            rows.append(("file", str(self.source.path)))
        return html_table("Packing", rows)

    def _wall_distances(self) -> Floats:
        """(n, 6) distance of each centre from each wall, m, positive inside; (n, 0) without walls."""
        return self.box.wall_distances(self.centres) if isinstance(self.box, Box) else np.empty((len(self), 0))

    @property
    def _kind_of_box(self) -> str:
        return "periodic cell" if isinstance(self.box, Cell) else "box"

    @property
    def walled_box(self) -> Box | None:
        """The box, None without one, for what needs walls.

        Raises
        ------
        InputError
            If the packing is in a periodic cell.
        """
        if isinstance(self.box, Cell):
            raise InputError(
                f"{self._path()}the packing is in a periodic cell, which has no walls: porefv has PeriodicMesh and "
                "PeriodicFlow for it, and packing.with_box(Box(lower, upper)) puts the spheres between walls."
            )
        return self.box

    def require_cell(self) -> Cell:
        """The periodic cell; InputError if the packing is in none."""
        if not isinstance(self.box, Cell):
            raise InputError(
                f"{self._path()}the packing is in no periodic cell. Give it one: packing.with_box(Cell(vectors))."
            )
        return self.box

    def _require_box(self) -> Box | Cell:
        if self.box is None:
            raise InputError(
                f"{self._path()}the packing has no box. Give one: lines '# box_lower = x y z' and "
                "'# box_upper = x y z' in a CSV or Yade file, [box] with lower and upper in a scene, "
                "or packing.with_box(Box(lower, upper)) in Python."
            )
        return self.box

    def _refuse(self, culprits: NDArray, what: str, kind: str, describe: Callable[[int], str], remedy: str) -> None:
        """Raise an InputError that shows some of the culprits, if there are any."""
        if len(culprits) == 0:
            return
        lines = [f"{self._path()}{what} ({counted(len(culprits), kind)}):"]
        lines += [f"  {describe(culprit)}" for culprit in culprits[:_MOST_SHOWN]]
        if len(culprits) > _MOST_SHOWN:
            lines.append(f"  ... and {len(culprits) - _MOST_SHOWN} more")
        raise InputError("\n".join([*lines, remedy]))

    def _describe_within(self, i: int, j: int) -> str:
        """A pair of which one sphere lies within the other."""
        small, big = (i, j) if self.radii[i] < self.radii[j] else (j, i)
        how = f"sphere {small} lies inside sphere {big}"
        if (self.centres[i] == self.centres[j]).all():
            how = f"same centre {vector(self.centres[i])}"
        return f"{self._name(i)} and {self._name(j)}: {how}"

    def _name(self, sphere: int) -> str:
        return (self.source or Source("")).name(sphere)

    def _path(self) -> str:
        return f"{self.source.path}: " if self.source else ""
