"""The regular (weighted Delaunay) triangulation of a packing in a box with ideal walls."""

from porefv.tessellation.triangulation import RegularTriangulation

__all__ = ["RegularTriangulation"]
