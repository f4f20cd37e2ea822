"""The regular (weighted Delaunay) triangulation of a packing, in a box with ideal walls or in a periodic cell."""

from porefv.tessellation.torus import TorusTriangulation
from porefv.tessellation.triangulation import RegularTriangulation

__all__ = ["RegularTriangulation", "TorusTriangulation"]
