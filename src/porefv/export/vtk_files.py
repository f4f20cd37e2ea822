"""VTK's data structures from arrays, and VTK files from them, without PyVista."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import InputError, printable
from porefv.system.optional_imports import load
from porefv.system.version import __version__

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkUnstructuredGrid

# Of the names and fields of the files: 1 had no field data but the box.
FORMAT_VERSION = 2
UNITS = {
    "radius": "m", "length": "m", "hydraulic_radius": "m", "neck_radius": "m", "inscribed_radius": "m",
    "area": "m2", "fluid_area": "m2", "volume": "m3", "pressure": "Pa", "velocity": "m/s", "speed": "m/s",
    "spin": "rad/s", "flux": "m3/s", "flux_magnitude": "m3/s", "conductance": "m3/(Pa s)",
    "fluid_force": "N", "pressure_force": "N", "viscous_force": "N", "buoyancy_force": "N",
    "contact_force": "N", "force": "N", "normal_force": "N",
}  # fmt: skip


def vtk_data_model() -> Any:
    """VTK's data structures; MissingExtraError if VTK is not installed."""
    return _vtk("vtkCommonDataModel")


def _vtk(module: str) -> Any:
    # vtkmodules loads in half the time of pyvista, which is not needed to write files.
    return load(f"vtkmodules.{module}", "Writing VTK files")


def write_xml(dataset: vtkUnstructuredGrid | vtkPolyData, path: Path) -> None:
    """Write a .vtu or .vtp file: appended, binary, compressed.

    LZ4 makes files hardly larger than zlib does, ten times as quickly.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    writers = _vtk("vtkIOXML")
    writer = writers.vtkXMLUnstructuredGridWriter() if path.suffix == ".vtu" else writers.vtkXMLPolyDataWriter()
    writer.SetInputData(dataset)
    writer.SetFileName(str(path))
    writer.SetDataModeToAppended()
    writer.SetEncodeAppendedData(False)
    writer.SetHeaderTypeToUInt64()
    writer.SetCompressorTypeToLZ4()
    with _silence():
        written = writer.Write()
    if not written:
        reason = _vtk("vtkCommonMisc").vtkErrorCode.GetStringFromErrorCode(writer.GetErrorCode())
        raise OSError(f"VTK could not write {path.name}: {reason}")


@contextmanager
def _silence() -> Iterator[None]:
    """What VTK says of errors, in lines of its own, is not printed."""
    core = _vtk("vtkCommonCore")
    window, before = core.vtkOutputWindow, core.vtkOutputWindow.GetInstance()
    verbosity = core.vtkLogger.GetCurrentVerbosityCutoff()
    window.SetInstance(core.vtkStringOutputWindow())
    core.vtkLogger.SetStderrVerbosity(core.vtkLogger.VERBOSITY_OFF)
    try:
        yield
    finally:
        window.SetInstance(before)
        core.vtkLogger.SetStderrVerbosity(verbosity)


def attach_provenance(dataset: vtkUnstructuredGrid | vtkPolyData, provenance: Mapping[str, Any]) -> None:
    """Add field data that say where a dataset comes from: text, numbers or vectors by name, and `units` of all arrays.

    `units` is a text for each array of points and cells that has a unit, such as ``pressure: Pa``.
    """
    attributes = (dataset.GetPointData(), dataset.GetCellData())
    names = {data.GetArrayName(k) for data in attributes for k in range(data.GetNumberOfArrays())}
    units = [f"{name}: {UNITS[name]}" for name in sorted(names & set(UNITS))]
    fields = {"format_version": FORMAT_VERSION, "porefv_version": __version__, **provenance, "units": units}
    for name, values in fields.items():
        if isinstance(values, str | list):
            array = _vtk("vtkCommonCore").vtkStringArray()
            for text in [values] if isinstance(values, str) else values:
                array.InsertNextValue(printable(text))
        else:
            array = vtk_array(np.atleast_1d(np.asarray(values)))
        array.SetName(name)
        dataset.GetFieldData().AddArray(array)


def vtk_array(values: np.ndarray) -> Any:
    """An array of VTK that shares memory with `values`."""
    return _vtk("util.numpy_support").numpy_to_vtk(np.ascontiguousarray(values))


def vtk_points(points: np.ndarray) -> Any:
    """Points (p, 3) of a VTK dataset."""
    vtk_points = _vtk("vtkCommonCore").vtkPoints()
    vtk_points.SetData(vtk_array(points))
    return vtk_points


def cell_array(rows: np.ndarray) -> Any:
    """Cells of one size: their points are the rows."""
    cells = vtk_data_model().vtkCellArray()
    cells.SetData(rows.shape[1], vtk_array(rows.ravel().astype(np.int64)))
    return cells


def attach(attributes: Any, arrays: dict[str, np.ndarray], rows: int) -> None:
    """Add arrays by name to the point or cell data of a VTK dataset; InputError if one has another number of rows."""
    for name, values in arrays.items():
        if np.shape(values)[:1] != (rows,):
            raise InputError(f"{name} must have {rows} rows, not shape {np.shape(values)}")
        array = vtk_array(values)
        array.SetName(name)
        attributes.AddArray(array)
