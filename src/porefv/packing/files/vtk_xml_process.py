"""Reads a VTK XML file, and writes its points, point data and field data to standard output as an .npz file.

`porefv.packing.files.vtk` runs this file in a process of its own: with a damaged file, VTK's reader may end the process
that it runs in. It may also ask for any amount of memory, so that memory is limited. The last line of standard error
says what VTK found wrong; there is none if VTK broke down.
"""

import io
import os
import sys

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkFileOutputWindow, vtkOutputWindow
from vtkmodules.vtkIOXML import vtkXMLGenericDataObjectReader

# Bytes of memory: what the libraries take, and what an honest file takes for each of its own bytes.
_LIBRARIES, _PER_BYTE = 2**32, 100


def main(path: str) -> int:
    """Read a file and write its arrays; 0, or 1 if it cannot be read."""
    limit_memory(_LIBRARIES + _PER_BYTE * os.path.getsize(path))
    window = vtkFileOutputWindow()  # VTK says nothing by itself
    window.SetFileName(os.devnull)
    vtkOutputWindow.SetInstance(window)
    reasons: list[str] = []

    def note(caller: object, event: str, text: str) -> None:
        # Of several lines the last says what is wrong; those before say where in VTK's source.
        reasons.append(text.strip().splitlines()[-1].rstrip(".!"))

    note.CallDataType = "string0"  # type: ignore[attr-defined]  # how VTK learns that it shall pass the text
    reader = vtkXMLGenericDataObjectReader()
    reader.SetFileName(path)
    reader.AddObserver("ErrorEvent", note)  # type: ignore[arg-type]
    reader.Update()
    mesh = reader.GetOutput()
    if not reasons and not (hasattr(mesh, "GetPointData") and mesh.GetNumberOfPoints()):
        reasons.append("no points in it")
    if reasons:
        print(reasons[0], file=sys.stderr)
        return 1
    found = {"points": vtk_to_numpy(mesh.GetPoints().GetData())}
    found |= arrays("point", mesh.GetPointData()) | arrays("field", mesh.GetFieldData())
    content = io.BytesIO()
    np.savez(content, **found)  # type: ignore[arg-type]
    sys.stdout.buffer.write(content.getvalue())
    return 0


def limit_memory(size: int) -> None:
    """Let this process take no more memory than so many bytes, where the system knows such a limit."""
    try:
        import resource
    except ImportError:  # not POSIX
        return
    try:
        resource.setrlimit(resource.RLIMIT_AS, (size, size))
    except (OSError, ValueError):  # a smaller one holds already, or the system has none
        return


def arrays(kind: str, data: object) -> dict[str, np.ndarray]:
    """Arrays of numbers that have a name, by kind and name."""
    found = {}
    for place in range(data.GetNumberOfArrays()):  # type: ignore[attr-defined]
        array = data.GetArray(place)  # type: ignore[attr-defined]
        if array is not None and array.GetName():
            found[f"{kind}/{array.GetName()}"] = vtk_to_numpy(array)
    return found


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
