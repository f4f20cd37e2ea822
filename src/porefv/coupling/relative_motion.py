"""RelativeMotion: how far neighbours have moved past each other since the mesh was made.

A mesh moves on with its grains: common translation changes no pore, and costs none. What changes pores, throats and
conductances is the motion of neighbours relative to each other, and of grains relative to walls along the normals.
"""

from __future__ import annotations

import numpy as np

from porefv.dem.grain_model import GrainModel
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES
from porefv.system.kernels import kernel

# Part of the edges that may have moved by more than the bound, and by how many times it at most.
_PART, _MOST = 0.01, 5.0


class RelativeMotion:
    """Relative displacements along the edges of a mesh's triangulation.

    Called with the grains, it returns the 99th percentile of |Δx_i - Δx_j| over the edges, or a fifth of the largest
    if that is more, over the mean radius. A wall's displacement counts along its normal alone.

    Parameters
    ----------
    mesh : PoreMesh
    """

    def __init__(self, mesh: PoreMesh):
        n = mesh.n_spheres
        ends = np.concatenate([mesh.cells[:, [a, b]] for a in range(4) for b in range(a)])
        ends = np.sort(ends[(ends < n).any(axis=1)], axis=1)
        ends = np.stack(np.divmod(np.unique(ends @ np.array([n + 6, 1])), n + 6), axis=1)
        walled = ends[:, 1] >= n
        self._pairs, self._walled = (part.astype(np.uint32) for part in (ends[~walled], ends[walled] - [0, n]))
        self._centres, self._places = np.array(mesh.packing.centres), mesh.box.wall_places
        self._mean_radius = float(mesh.packing.radii.mean())

    def __call__(self, grains: GrainModel) -> float:
        """How far neighbours have moved past each other, over the mean radius."""
        both = np.empty(len(self._pairs) + len(self._walled))
        if not len(both):
            return 0.0
        walls = grains.box.wall_places - self._places
        _squares(self._pairs, self._walled, grains.positions - self._centres, walls, both)
        rank = min(int((1.0 - _PART) * len(both)), len(both) - 1)
        both.partition(rank)
        return float(np.sqrt(max(both[rank], both[rank:].max() / _MOST**2))) / self._mean_radius


@kernel
def _squares(pairs, walled, moved, walls, squares):
    """Fill in the squares of how far the members of pairs, and of grains and walls, have moved past each other."""
    count = pairs.shape[0]
    for c in range(count):
        i, j = pairs[c, 0], pairs[c, 1]
        x, y, z = moved[i, 0] - moved[j, 0], moved[i, 1] - moved[j, 1], moved[i, 2] - moved[j, 2]
        squares[c] = x * x + y * y + z * z
    for c in range(walled.shape[0]):
        wall = walled[c, 1]
        along = moved[walled[c, 0], WALL_AXES[wall]] - walls[wall]
        squares[count + c] = along * along
