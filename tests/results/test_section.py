"""A plane section: discs and polygons that fill the plane."""

from pathlib import Path

import numpy as np
import pytest

from porefv import results
from porefv.cli.program import main
from porefv.errors import InputError
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.packing.packing import Packing
from porefv.results.section import CORNERS, write_section

pyvista = pytest.importorskip("pyvista")
PACKINGS = Path(__file__).parents[2] / "data" / "packings"


@pytest.fixture(scope="module")
def flow():
    return PoreFlow(Packing.read(PACKINGS / "n54_s1.csv"), Walls.along("y"))


@pytest.fixture(scope="module")
def found(flow, tmp_path_factory):
    return results.read(results.write(flow, tmp_path_factory.mktemp("section") / "results"))


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("at", [None, 0.31])
def test_discs_and_polygons_fill_the_plane_without_overlap(flow, found, tmp_path, axis, at):
    section = pyvista.read(write_section(found, tmp_path / "section.vtp", axis, at))
    areas = section.compute_cell_sizes()["Area"]
    k = "xyz".index(axis)
    place = flow.mesh.box.lower[k] + 0.5 * flow.mesh.box.size[k] if at is None else at
    np.testing.assert_allclose(section.points[:, k], place, atol=1e-12)
    grains = section["grain"] >= 0
    np.testing.assert_array_equal(grains, section["pore"] < 0)
    # A regular polygon in each circle of a sphere; spheres of this packing overlap but little.
    heights = flow.mesh.packing.centres[:, k] - place
    squares = (flow.mesh.packing.radii**2 - heights**2)[section["grain"][grains]]
    polygon = 0.5 * CORNERS * np.sin(2.0 * np.pi / CORNERS)
    np.testing.assert_allclose(areas[grains], polygon * squares, rtol=1e-5)
    assert areas.sum() == pytest.approx(flow.mesh.box.section(k), rel=1e-4)


def test_polygons_have_the_fields_of_their_pores_and_discs_those_of_their_grains(flow, found, tmp_path):
    section = pyvista.read(write_section(found, tmp_path / "section.vtp"))
    grain, pore = section["grain"], section["pore"]
    np.testing.assert_array_equal(section["pressure"][pore >= 0], flow.pressure[pore[pore >= 0]])
    np.testing.assert_array_equal(section["fluid_force"][grain >= 0], flow.forces.total[grain[grain >= 0]])
    assert np.isnan(section["pressure"][grain >= 0]).all() and np.isnan(section["radius"][pore >= 0]).all()
    assert section.field_data["viscosity"][0] == flow.fluid.viscosity


def test_the_command_writes_a_section(found, tmp_path, capsys):
    path = tmp_path / "section.vtp"
    command = ["export", str(found.directory), "--to", "section", "--axis", "y", "--at", "0.4", "--out", str(path)]
    assert main(command) == 0
    assert capsys.readouterr().out == f"written {path}\n"
    np.testing.assert_allclose(pyvista.read(path).points[:, 1], 0.4)
    assert main(command) == 2
    assert "replace it with" in capsys.readouterr().err


def test_a_plane_outside_the_box_and_another_extension_are_refused(found, tmp_path):
    with pytest.raises(InputError, match="the plane z = 2 m is outside the box, 0 to 1 m"):
        write_section(found, tmp_path / "section.vtp", "z", 2.0)
    with pytest.raises(InputError, match=r"ends in \.vtp"):
        write_section(found, tmp_path / "section.csv")
