"""VTK point sets (.vtk, .vtp, .vtu): points with a radius each. XML files are read by VTK, in a process of its own.

The radius is point data named radius, radii, r, diameter and the like. Field data ``box_lower`` and ``box_upper``
give the box. Cells are not read.
"""

import io
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from porefv.errors import InputError
from porefv.packing.files.column_names import Column, chosen_columns, roles, spheres
from porefv.packing.files.content import FileContent, missing_radius
from porefv.packing.files.frames import chosen_frame
from porefv.packing.files.length_units import agreed_unit, stated_unit
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.text import AnyPath, Corners, quoted
from porefv.packing.files.vtk_legacy import LegacyMesh
from porefv.packing.packing import Packing
from porefv.system.atomic_files import atomic_write
from porefv.system.optional_imports import ensure_installed, load

_CORNERS = ("box_lower", "box_upper")

# The program that reads XML files, in a process of its own.
_READER = Path(__file__).with_name("vtk_xml_process.py")


@dataclass(frozen=True)
class _XmlMesh:
    """What an XML file holds, under the names of `LegacyMesh`."""

    points: np.ndarray
    point_data: dict[str, np.ndarray]
    field_data: dict[str, np.ndarray]


def read(path: AnyPath, content: bytes, options: ReadOptions) -> FileContent:
    """Read a VTK file; errors name the file and the sphere."""
    chosen_frame(path, 1, options)
    if options.columns.keys() & set("xyz"):
        raise InputError(f"{path}: the points of a VTK file are the centres. Map radius or diameter only.")
    mesh = _read_mesh(path, content)
    arrays = list(mesh.point_data)
    if options.radius is None and not roles(arrays, options) & {"radius", "diameter"}:
        missing_radius(path, f"point data: {', '.join(map(quoted, arrays)) or 'none'}, and ")
    columns, values = [Column(axis, k, axis) for k, axis in enumerate("xyz")], [mesh.points]
    for column in chosen_columns(path, 0, arrays, options, wanted=("radius", "diameter")):
        found = np.asarray(mesh.point_data[arrays[column.position]])
        if found.ndim != 1:
            raise InputError(f"{path}: point data {quoted(column.name)} must have one component a point.")
        columns.append(column)
        values.append(found[:, None])
    points = np.concatenate(values, axis=1)
    centres, radii, unit, names = spheres(f"{path}", columns, points.astype(np.float64), options)
    if isinstance(mesh, LegacyMesh):
        unit = agreed_unit(unit, stated_unit(f"{path}, line 2", mesh.title), options)
    corners = _corners(path, mesh)
    kind = "legacy VTK" if isinstance(mesh, LegacyMesh) else "VTK XML"
    names = {"centres": "points"} | ({"radius": names["radius"]} if "radius" in names else {})
    return FileContent(kind, centres, radii, corners, "field data box_lower, box_upper", unit, columns=names)


def write(packing: Packing, path: AnyPath) -> None:
    """Write points with point data ``radius``, and the box as field data: .vtp, .vtu, or legacy .vtk (binary)."""
    points = load("pyvista", "Writing VTK files").PolyData(np.array(packing.centres))
    points.point_data["radius"] = np.array(packing.radii)
    if packing.walled_box is not None:
        for name, corner in zip(_CORNERS, (packing.walled_box.lower, packing.walled_box.upper), strict=True):
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


def _read_mesh(path: AnyPath, content: bytes) -> LegacyMesh | _XmlMesh:
    if content.startswith(b"# vtk DataFile"):
        return LegacyMesh(path, content)
    if not content[:100].lstrip().startswith((b"<?xml", b"<VTKFile")):
        raise InputError(f"{path}: not a VTK file (legacy .vtk, or XML .vtp or .vtu).")
    ensure_installed("vtkmodules", "pyvista", "Reading VTK files")
    if Path(path).suffix.lower() != ".gz":
        return _read_xml(path, path)
    with tempfile.TemporaryDirectory() as folder:
        decompressed = Path(folder, "decompressed.vtp")
        decompressed.write_bytes(content)
        return _read_xml(path, decompressed)


def _read_xml(path: AnyPath, file: AnyPath) -> _XmlMesh:
    """The content of an XML file; errors name `path`."""
    # -P: modules beside the program do not hide those of Python.
    command = [sys.executable, "-P", os.fspath(_READER), os.fspath(file)]
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


def _corners(path: AnyPath, mesh: LegacyMesh | _XmlMesh) -> Corners | None:
    if not any(name in mesh.field_data for name in _CORNERS):
        return None
    missing = [name for name in _CORNERS if name not in mesh.field_data]
    if missing:
        raise InputError(f"{path}: field data {missing[0]} is missing.")
    lower, upper = (np.ravel(mesh.field_data[name]).astype(np.float64) for name in _CORNERS)
    return lower, upper
