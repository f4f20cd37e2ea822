"""PoreViewer: the file that it writes has the variables, pore by pore."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from porefv.errors import InputError

fipy = pytest.importorskip("fipy")
pyvista = pytest.importorskip("pyvista")
viewer = pytest.importorskip("porefv.export.pore_viewer")


@pytest.mark.parametrize("without", [(), ("y_min",)], ids=["all pores", "without a wall"])
def test_the_file_has_scalars_and_vectors_of_each_pore(without, mesh_of, tmp_path):
    mesh = mesh_of("n25_s1")
    fluid = mesh.to_fipy(without)
    height = fipy.CellVariable(mesh=fluid, name="height", value=fluid.z)
    centre = fipy.CellVariable(mesh=fluid, rank=1, value=fluid.cellCenters)
    viewer.PoreViewer(vars=[height, centre]).plot(tmp_path / "found.vtu")
    grid = pyvista.read(tmp_path / "found.vtu")
    expected = np.full((mesh.n_pores, 3), np.nan)
    expected[fluid.pores] = mesh.pore_centres[fluid.pores]
    assert_array_equal(grid.cell_data["height"], expected[mesh.cell_pore, 2])
    assert_array_equal(grid.cell_data["variable 1"], expected[mesh.cell_pore])


def test_what_a_viewer_cannot_show_is_refused(mesh_of, tmp_path):
    fluid = mesh_of("n25_s1").to_fipy()
    c, d = (fipy.CellVariable(mesh=fluid, name="c") for _ in range(2))
    with pytest.raises(InputError, match="on one FluidMesh"):
        viewer.PoreViewer(vars=fipy.CellVariable(mesh=fipy.Grid3D(nx=2, ny=2, nz=2)))
    with pytest.raises(InputError, match="different names, other than pore, not c, c"):
        viewer.PoreViewer(vars=[c, d])
    with pytest.raises(InputError, match=r"writes .vtu and .png files"):
        viewer.PoreViewer(vars=c).plot(tmp_path / "c.jpg")


def test_any_name_can_be_written(mesh_of, tmp_path):
    fluid = mesh_of("n25_s1").to_fipy()
    c = fipy.CellVariable(mesh=fluid, name='c & "T" <hot>', value=fluid.x)
    viewer.PoreViewer(vars=c).plot(tmp_path / "found.vtu")
    assert 'c & "T" <hot>' in pyvista.read(tmp_path / "found.vtu").cell_data
    with pytest.raises(InputError, match="shows scalars and vectors of cells"):
        viewer.PoreViewer(vars=c.faceValue)
