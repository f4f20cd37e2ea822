"""VTK point sets (.vtk, .vtp, .vtu): points with a radius each. XML files go through pyvista.

The radius is point data named radius, radii or r, or diameter, in any case. Field data ``box_lower`` and
``box_upper`` give the box. Cells are not read.
"""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from porefv.errors import InputError
from porefv.packing.box import Box
from porefv.packing.files.text import AnyPath, make_box, quoted, read_bytes
from porefv.packing.files.vtk_legacy import LegacyMesh
from porefv.packing.packing import Packing, Source
from porefv.system.atomic_files import atomic_write
from porefv.system.optional_imports import load

_HALVES = {"radius": 1.0, "radii": 1.0, "r": 1.0, "diameter": 0.5, "diameters": 0.5}
_CORNERS = ("box_lower", "box_upper")

# Reads a file in no more memory than an honest one of its size takes.
_TRIAL = """
import os, sys
from vtkmodules.vtkIOXML import vtkXMLGenericDataObjectReader
try:
    import resource
    room = 2**32 + 100 * os.path.getsize(sys.argv[1])
    resource.setrlimit(resource.RLIMIT_AS, (room, room))
except (ImportError, OSError, ValueError):
    pass
reader = vtkXMLGenericDataObjectReader()
reader.SetFileName(sys.argv[1])
reader.Update()
"""


def read(path: AnyPath) -> Packing:
    """Read a VTK file; errors name the file and the sphere."""
    mesh = _read_mesh(path)
    names = [name for name in mesh.point_data if name.lower() in _HALVES]
    if len(names) != 1:
        raise InputError(
            f"{path}: one array of point data named radius (or radii, r, diameter) is needed, and there are "
            f"{len(names)}. Point data: {', '.join(map(quoted, mesh.point_data)) or 'none'}."
        )
    radii = np.asarray(mesh.point_data[names[0]])
    if radii.ndim != 1:
        raise InputError(f"{path}: point data {quoted(names[0])} must have one component a point.")
    return Packing(mesh.points, radii * _HALVES[names[0].lower()], _box(path, mesh), Source(path))


def write(packing: Packing, path: AnyPath) -> None:
    """Write points with point data ``radius``, and the box as field data: .vtp, .vtu, or legacy .vtk (binary)."""
    points = load("pyvista", "Writing VTK files").PolyData(np.array(packing.centres))
    points.point_data["radius"] = np.array(packing.radii)
    if packing.box is not None:
        for name, corner in zip(_CORNERS, (packing.box.lower, packing.box.upper), strict=True):
            points.field_data[name] = np.array(corner)
    with atomic_write(path) as temporary:
        temporary.write_bytes(_serialised(points, Path(path).suffix.lower()))


def _serialised(points: Any, suffix: str) -> bytes:
    """The content of the file. Made in memory: on a full disk VTK crashes, and Python with it."""
    writer: Any
    if suffix == ".vtk":
        from vtkmodules.vtkIOLegacy import vtkPolyDataWriter

        writer = vtkPolyDataWriter()
        writer.SetFileTypeToBinary()
    elif suffix == ".vtu":
        from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

        writer, points = vtkXMLUnstructuredGridWriter(), points.cast_to_unstructured_grid()
        writer.SetDataModeToBinary()
    else:
        from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

        writer = vtkXMLPolyDataWriter()
        writer.SetDataModeToBinary()
    writer.SetInputData(points)
    writer.SetWriteToOutputString(True)
    if not writer.Write():
        raise OSError("VTK could not write the points")
    content = writer.GetOutputStdString() if suffix == ".vtk" else writer.GetOutputString()
    return content if isinstance(content, bytes) else content.encode()  # text, where its bytes happen to be UTF-8


def _read_mesh(path: AnyPath) -> Any:
    """The data set in a file: a pyvista mesh or a LegacyMesh."""
    content = read_bytes(path)
    if content.startswith(b"# vtk DataFile"):
        return LegacyMesh(path, content)
    if not content[:100].lstrip().startswith((b"<?xml", b"<VTKFile")):
        raise InputError(f"{path}: not a VTK file (legacy .vtk, or XML .vtp or .vtu).")
    pyvista = load("pyvista", "Reading VTK files")
    # A damaged size makes VTK ask for more memory than there is, and that ends the process: let it be another one.
    trial = subprocess.run([sys.executable, "-c", _TRIAL, os.fspath(path)], capture_output=True, check=False)
    if trial.returncode != 0:
        raise InputError(f"{path}: cannot be read as VTK (its reader breaks down). Is the file damaged?")
    # pyvista.read would repeat on the terminal what VTK says about a bad file.
    from vtkmodules.vtkIOXML import vtkXMLGenericDataObjectReader

    reader = vtkXMLGenericDataObjectReader()
    reader.SetFileName(str(path))
    with pyvista.vtk_verbosity("off"), pyvista.VtkErrorCatcher(send_to_logging=False) as caught:
        reader.Update()
    if caught.events:
        # Of several lines the last says what is wrong; those before say where in VTK's source.
        reason = caught.events[0].alert.strip().splitlines()[-1].rstrip(".!")
        raise InputError(f"{path}: cannot be read as VTK ({reason[:100]}). Is the file damaged?")
    mesh = reader.GetOutput()
    if not (hasattr(mesh, "GetPointData") and mesh.GetNumberOfPoints()):
        raise InputError(f"{path}: no points can be read from it. Is the file damaged?")
    return pyvista.wrap(mesh)


def _box(path: AnyPath, mesh: Any) -> Box | None:
    if not any(name in mesh.field_data for name in _CORNERS):
        return None
    missing = [name for name in _CORNERS if name not in mesh.field_data]
    if missing:
        raise InputError(f"{path}: field data {missing[0]} is missing.")
    return make_box(path, *(np.ravel(mesh.field_data[name]) for name in _CORNERS))
