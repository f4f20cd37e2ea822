"""Meshes, fields and runs for other programs: VTK, ParaView, PyVista, meshio, OpenPNM, and pictures.

Names are imported when they are first used: to write a steady flow takes no grains that move.
"""

from typing import TYPE_CHECKING

from porefv.system.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from porefv.export.meshio_mesh import to_meshio
    from porefv.export.openpnm_network import openpnm_network
    from porefv.export.pictures import picture
    from porefv.export.pore_viewer import PoreViewer
    from porefv.export.trajectories import Trajectory
    from porefv.export.vtk_datasets import (
        cells_grid,
        paths_polydata,
        spheres_polydata,
        throats_polydata,
        to_pyvista,
        write_paths,
    )

__all__ = [
    "PoreViewer", "Trajectory", "cells_grid", "openpnm_network", "paths_polydata", "picture", "spheres_polydata",
    "throats_polydata", "to_meshio", "to_pyvista", "write_paths",
]  # fmt: skip
__getattr__, __dir__ = lazy_exports(
    __name__,
    {
        "PoreViewer": "porefv.export.pore_viewer",
        "Trajectory": "porefv.export.trajectories",
        "cells_grid": "porefv.export.vtk_datasets",
        "openpnm_network": "porefv.export.openpnm_network",
        "paths_polydata": "porefv.export.vtk_datasets",
        "picture": "porefv.export.pictures",
        "spheres_polydata": "porefv.export.vtk_datasets",
        "throats_polydata": "porefv.export.vtk_datasets",
        "to_meshio": "porefv.export.meshio_mesh",
        "to_pyvista": "porefv.export.vtk_datasets",
        "write_paths": "porefv.export.vtk_datasets",
    },
)
