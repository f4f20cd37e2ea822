"""Meshes of the void: cells that fill the box, facets between them, and pores joined by throats."""

from porefv.mesh.cell_mesh import CellMesh, WallFaces
from porefv.mesh.facets import Facets
from porefv.mesh.inscribed_spheres import InscribedSpheres
from porefv.mesh.periodic_mesh import PeriodicMesh
from porefv.mesh.pore_mesh import PoreMesh
from porefv.mesh.throats import Throats

__all__ = ["CellMesh", "Facets", "InscribedSpheres", "PeriodicMesh", "PoreMesh", "Throats", "WallFaces"]
