"""VTK point sets (.vtk, .vtp, .vtu): points with a radius each. XML files are read by VTK, in a process of its own.

The radius is point data named radius, radii or r, or diameter, in any case. Field data ``box_lower`` and
``box_upper`` give the box. Cells are not read.
"""

import io
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from porefv.errors import InputError
from porefv.packing.box import Box
from porefv.packing.files.text import AnyPath, make_box, quoted, read_bytes
from porefv.packing.files.vtk_legacy import LegacyMesh
from porefv.packing.packing import Packing, Source
from porefv.system.atomic_files import atomic_write
from porefv.system.optional_imports import ensure_installed, load

_HALVES = {"radius": 1.0, "radii": 1.0, "r": 1.0, "diameter": 0.5, "diameters": 0.5}
_CORNERS = ("box_lower", "box_upper")

# The program that reads XML files, in a process of its own.
_READER = Path(__file__).with_name("vtk_xml_process.py")


@dataclass(frozen=True)
class _XmlMesh:
    """What an XML file holds, under the names of `LegacyMesh`."""

    points: np.ndarray
    point_data: dict[str, np.ndarray]
    field_data: dict[str, np.ndarray]


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


def _read_mesh(path: AnyPath) -> LegacyMesh | _XmlMesh:
    content = read_bytes(path)
    if content.startswith(b"# vtk DataFile"):
        return LegacyMesh(path, content)
    if not content[:100].lstrip().startswith((b"<?xml", b"<VTKFile")):
        raise InputError(f"{path}: not a VTK file (legacy .vtk, or XML .vtp or .vtu).")
    ensure_installed("vtkmodules", "pyvista", "Reading VTK files")
    # -P: modules beside the program do not hide those of Python.
    command = [sys.executable, "-P", os.fspath(_READER), os.fspath(path)]
    done = subprocess.run(command, capture_output=True, check=False)
    if done.returncode != 0:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        reason = said[-1][:100] if done.returncode == 1 and said else "its reader breaks down"
        raise InputError(f"{path}: cannot be read as VTK ({reason}). Is the file damaged?")
    with np.load(io.BytesIO(done.stdout)) as arrays:
        kinds: dict[str, dict[str, np.ndarray]] = {"point": {}, "field": {}}
        for key in arrays.files:
            if key != "points":
                kind, name = key.split("/", 1)
                kinds[kind][name] = arrays[key]
        return _XmlMesh(arrays["points"], kinds["point"], kinds["field"])


def _box(path: AnyPath, mesh: LegacyMesh | _XmlMesh) -> Box | None:
    if not any(name in mesh.field_data for name in _CORNERS):
        return None
    missing = [name for name in _CORNERS if name not in mesh.field_data]
    if missing:
        raise InputError(f"{path}: field data {missing[0]} is missing.")
    return make_box(path, *(np.ravel(mesh.field_data[name]) for name in _CORNERS))
