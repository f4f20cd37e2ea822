"""The widest pores of a packing in the unit cube, and grains put into them."""

import numpy as np

from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.packing import Packing


def widest_pores(packing: Packing, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Places and radii of the largest spheres that fit at Laguerre vertices, no two of them in one void."""
    places = PoreMesh(packing).vertices
    places = places[((places > 0.0) & (places < 1.0)).all(axis=1)]
    room = np.minimum(places, 1.0 - places).min(axis=1)
    for centre, radius in zip(packing.centres, packing.radii, strict=True):
        room = np.minimum(room, np.linalg.norm(places - centre, axis=1) - radius)
    kept: list[int] = []
    for k in np.argsort(-room, kind="stable"):
        if len(kept) < count and all(np.linalg.norm(places[k] - places[other]) > 0.5 * room[k] for other in kept):
            kept.append(k)
    return places[kept], room[kept]


def with_grain(packing: Packing, place: np.ndarray, radius: float) -> Packing:
    """The packing and one grain more."""
    return Packing(np.vstack([packing.centres, place]), np.append(packing.radii, radius), packing.box)
