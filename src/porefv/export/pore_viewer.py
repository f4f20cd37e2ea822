"""PoreViewer: FiPy's viewer for variables on a FluidMesh, which FiPy's own viewers cannot show."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

import numpy as np

from porefv.errors import InputError
from porefv.export.pictures import load_pyvista
from porefv.export.vtk_datasets import cells_grid, to_pyvista
from porefv.export.vtk_files import write_xml
from porefv.fipy.fipy_import import load_fipy
from porefv.fipy.fluid_mesh import FluidMesh
from porefv.system.atomic_files import atomic_write

if TYPE_CHECKING:
    import pyvista

fipy = load_fipy()


class PoreViewer(fipy.viewers.viewer.AbstractViewer):  # type: ignore[name-defined]
    """Shows CellVariables on a `FluidMesh` with PyVista, or writes them to a file.

    Parameters
    ----------
    vars : CellVariable or list of CellVariable
        Scalars and vectors on one mesh. Each has the name that it was given, or `variable 0`, `variable 1`, ...
    title : str, optional
        Over the picture; the name of the first variable by default.
    **limits
        `datamin`, `datamax`: range of the colours.

    Raises
    ------
    InputError
        For variables that are not on one FluidMesh, or with the same name.

    Examples
    --------
    >>> import fipy
    >>> mesh = PoreMesh(Packing.read("data/packings/n25_s1.csv")).to_fipy()
    >>> height = fipy.CellVariable(mesh=mesh, name="height", value=mesh.z)
    >>> PoreViewer(vars=height).plot("height.vtu")
    """

    def __init__(self, vars: Any, title: str | None = None, **limits: float):
        super().__init__(vars, title=title, **limits)
        meshes = {id(var.mesh): var.mesh for var in self.vars}
        if len(meshes) != 1 or not isinstance(self.vars[0].mesh, FluidMesh):
            raise InputError("a PoreViewer shows CellVariables on one FluidMesh, such as PoreMesh.to_fipy() makes")
        self._mesh: FluidMesh = self.vars[0].mesh
        names = self._names()
        for name, var in zip(names, self.vars, strict=True):
            if not isinstance(var, fipy.CellVariable) or var.rank > 1:
                raise InputError(f"a PoreViewer shows scalars and vectors of cells, and {name} is {type(var).__name__}")
        if len({*names, "pore"}) < len(names) + 1:
            raise InputError(
                f"variables of a viewer must have different names, other than pore, not {', '.join(names)}"
            )

    def _names(self) -> list[str]:
        return [str(var.name) or f"variable {k}" for k, var in enumerate(self.vars)]

    def _fields(self) -> dict[str, np.ndarray]:
        """Values by pore, a vector's (n_pores, 3); NaN for pores that were left out."""
        fields = {}
        for name, var in zip(self._names(), self.vars, strict=True):
            value = np.asarray(var.value).T
            field = np.full((self._mesh.pore_mesh.n_pores, *value.shape[1:]), np.nan)
            field[self._mesh.pores] = value
            fields[name] = field
        return fields

    def grid(self) -> pyvista.UnstructuredGrid:
        """The cells with the variables as cell data, for pictures of your own."""
        return to_pyvista(self._mesh.pore_mesh, **self._fields())

    def plot(self, filename: str | Path | None = None) -> None:
        """Show the first variable, or write a file: `.vtu` with all variables for ParaView, `.png` with the first.

        Parameters
        ----------
        filename : str or Path, optional
            Written whole or not at all.
        """
        kind = "" if filename is None else Path(filename).suffix
        if filename is not None and kind == ".vtu":
            # VTK writes names as they are, and reads them as XML.
            fields = {escape(name, {'"': "&quot;"}): values for name, values in self._fields().items()}
            grid = cells_grid(self._mesh.pore_mesh, **fields)
            with atomic_write(Path(filename)) as path:
                write_xml(grid, path)
            return
        if filename is not None and kind != ".png":
            raise InputError(f"{filename}: a PoreViewer writes .vtu and .png files")
        plotter = load_pyvista().Plotter(off_screen=filename is not None)
        plotter.add_mesh(
            self.grid(), scalars=self._names()[0], clim=self._colour_range(), lighting=False,
            scalar_bar_args={"vertical": True},
        )  # fmt: skip
        plotter.add_text(self.title, font_size=10)
        if filename is None:
            plotter.show()
            return
        with atomic_write(Path(filename)) as path:
            plotter.screenshot(str(path))

    def _colour_range(self) -> tuple[float, float] | None:
        low, high = self._autoscale(self.vars[:1], self.limits.get("datamin"), self.limits.get("datamax"))
        return float(low), float(high)

    def _validFileExtensions(self) -> list[str]:
        return [".vtu", ".png"]
