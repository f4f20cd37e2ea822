"""Meshes, fields and runs for other programs: VTK, ParaView, PyVista, meshio, and pictures."""

from porefv.export.meshio_mesh import to_meshio
from porefv.export.pictures import flow_picture, picture
from porefv.export.trajectories import Trajectory
from porefv.export.vtk_datasets import cells_grid, spheres_polydata, throats_polydata, to_pyvista

__all__ = [
    "Trajectory", "cells_grid", "flow_picture", "picture", "spheres_polydata", "throats_polydata", "to_meshio",
    "to_pyvista",
]  # fmt: skip
