import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from porefv import results
from porefv.errors import ComputationError, InputError, MissingExtraError
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Wall, Walls
from porefv.packing.box import WALLS
from porefv.packing.packing import Packing
from porefv.results.force_table import force_table

PACKINGS = Path(__file__).parents[2] / "data" / "packings"


@pytest.fixture(scope="module")
def flow():
    walls = Walls.along("y", drop=2.0)
    fluid = Fluid(viscosity=1.0e-3, density=1000.0)
    return PoreFlow(Packing.read(PACKINGS / "n200_s1.csv"), walls, fluid, gravity=(0.0, 0.0, -9.81))


@pytest.fixture(scope="module")
def everything(flow, tmp_path_factory):
    """All that can be asked of a flow, read back."""
    return results.read(results.write(flow, tmp_path_factory.mktemp("flow") / "results"))


def names(directory):
    return sorted(path.name for path in directory.iterdir())


# The summary


def test_summary_has_the_numbers_of_the_flow(flow, everything):
    summary = everything.summary
    assert summary["permeability"] == flow.permeability
    assert summary["hydraulic_conductivity"] == flow.hydraulic_conductivity
    assert summary["flow"]["inflow"] == flow.inflow
    assert summary["flow"]["outflow"] == flow.outflow
    assert summary["flow"]["imbalance"] == flow.imbalance
    assert summary["flow"]["wall_flux"] == flow.wall_flux
    assert summary["packing"]["spheres"] == 200
    assert summary["packing"]["porosity"] == flow.mesh.packing.porosity
    assert summary["mesh"]["pores"] == flow.mesh.n_pores
    assert summary["mesh"]["throats"] == len(flow.mesh.throats)
    assert summary["mesh"]["united_pores"] == flow.mesh.n_united
    assert summary["solver"]["name"] == flow.solver_report.name
    assert summary["solver"]["imbalance"] == flow.solver_report.imbalance
    assert summary["forces"]["conservation_residual"] == flow.forces.conservation_residual
    for part, total in flow.forces.sums.items():
        np.testing.assert_array_equal(summary["forces"]["sums"][part], total)


def test_summary_pore_volume_is_that_of_the_pores(flow, everything):
    assert everything.summary["packing"]["pore_volume"] == pytest.approx(flow.mesh.pore_volumes.sum(), rel=1e-12)


def test_summary_tells_stages_versions_walls_and_units(everything):
    summary = everything.summary
    stages = ["triangulation", "throats", "pressure", "forces", "velocities", "writing"]
    assert list(summary["seconds"]) == [*stages, "total"]
    assert set(summary["versions"]) == {"python", "porefv", "numpy", "scipy", "numba", "vtk"}
    assert summary["walls"]["y_min"] == {"pressure": 2.0, "slip": False}
    assert summary["units"]["permeability"] == "m2"
    assert summary["created"].endswith("+00:00")


def test_summary_tells_how_the_packing_was_read(everything):
    reading = everything.summary["packing"]["reading"]
    assert reading["format"] == "table with header, separated by commas"
    assert reading["scale"] == 1.0 and reading["units"] == "" and reading["periodicity"] == ""
    assert reading["columns"] == {axis: axis for axis in ("x", "y", "z", "radius")}
    assert reading["box"] == "comments box_lower, box_upper"


def test_spheres_are_read_back_with_their_box_and_give_the_same_flow(flow, everything):
    packing = Packing.read(everything.directory / "spheres.vtp")
    np.testing.assert_array_equal(packing.centres, flow.mesh.packing.centres)
    np.testing.assert_array_equal(packing.radii, flow.mesh.packing.radii)
    np.testing.assert_array_equal(packing.box.upper, flow.mesh.box.upper)
    assert PoreFlow(packing, flow.walls, flow.fluid).permeability == flow.permeability


def test_summary_counts_unusual_throats(flow, everything):
    unusual = everything.summary["unusual"]
    assert unusual["closed_throats"] == flow.mesh.throats.closed.sum()
    assert unusual["throats_without_conductance"] == np.count_nonzero(flow.conductances == 0.0)
    assert unusual["throats_without_volume"] == np.count_nonzero(flow.mesh.throats.volumes <= 0.0)


def test_summary_is_text_for_people_vectors_on_one_line(everything):
    text = (everything.directory / "summary.json").read_text(encoding="utf-8")
    assert '      "lower": [0.0, 0.0, 0.0],\n' in text
    assert json.loads(text) == everything.summary


# The tables and meshes


def test_forces_of_the_table_read_back_to_the_last_bit(flow, everything):
    table = everything.forces
    packing = flow.mesh.packing
    assert list(table["id"]) == [*(str(k) for k in range(200)), *WALLS]
    for column, name in enumerate("xyz"):
        np.testing.assert_array_equal(table[name][:200], packing.centres[:, column])
        for part in ("pressure", "viscous", "buoyancy", "total"):
            np.testing.assert_array_equal(table[f"{part}_{name}"][:200], getattr(flow.forces, part)[:, column])
            walls = getattr(flow.forces, f"wall_{part}")[:, column]
            np.testing.assert_array_equal(table[f"{part}_{name}"][200:], walls)
    np.testing.assert_array_equal(table["radius"][:200], packing.radii)
    assert np.isnan(table["radius"][200:]).all()
    assert list(table[202][["x", "y", "z"]]) == [0.5, 0.0, 0.5]  # the middle of y_min


@pytest.mark.parametrize("table_format", ["npy", "parquet"])
def test_a_table_of_each_format_equals_the_csv_file_to_the_last_bit(flow, everything, tmp_path, table_format):
    if table_format == "parquet":
        pytest.importorskip("pyarrow")
    directory = results.write(flow, tmp_path / "results", quantities=["forces"], vtk=False, table_format=table_format)
    assert names(directory) == [f"forces.{table_format}", "summary.json"]
    found = results.read(directory)
    assert found.forces.dtype == everything.forces.dtype
    assert found.forces.tobytes() == everything.forces.tobytes() == force_table(flow).tobytes()
    assert found.summary["forces"]["table"] == f"forces.{table_format}"


def test_npy_table_is_read_by_numpy_alone(flow, everything, tmp_path):
    directory = results.write(flow, tmp_path / "results", quantities=["forces"], vtk=False, table_format="npy")
    table = np.load(directory / "forces.npy")  # refuses pickles
    assert table.dtype.names == everything.forces.dtype.names
    np.testing.assert_array_equal(table["total_z"][:200], flow.forces.total[:, 2] + 0.0)


def test_parquet_table_has_texts_and_doubles(flow, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    directory = results.write(flow, tmp_path / "results", quantities=["forces"], vtk=False, table_format="parquet")
    kinds = {str(field.type) for field in parquet.read_schema(directory / "forces.parquet")}
    assert kinds == {"string", "double"}


def test_lines_of_the_csv_file_are_the_shortest_texts_that_read_back(everything):
    header, first, *_, last = (everything.directory / "forces.csv").read_text().splitlines()
    row, wall = everything.forces[0].tolist(), everything.forces[-1].tolist()
    assert header == ",".join(everything.forces.dtype.names)
    assert first == ",".join([row[0], *map(repr, row[1:])])
    assert last == ",".join([wall[0], *map(repr, wall[1:4]), "", *map(repr, wall[5:])])


def test_table_has_no_negative_zeros(flow, everything):
    assert "-0.0," not in (everything.directory / "forces.csv").read_text()


def test_meshes_carry_the_fields(flow, everything):
    pytest.importorskip("pyvista")
    mesh, throats = flow.mesh, flow.mesh.throats
    pores = everything.pores
    np.testing.assert_array_equal(pores["pressure"], flow.cell_pressure)
    np.testing.assert_array_equal(pores["volume"], mesh.pore_volumes[mesh.cell_pore])
    np.testing.assert_array_equal(pores["velocity"], flow.pore_velocity[mesh.cell_pore])
    np.testing.assert_array_equal(pores["pore"], mesh.cell_pore)
    np.testing.assert_array_equal(everything.spheres["fluid_force"], flow.forces.total)
    np.testing.assert_array_equal(everything.spheres["radius"], mesh.packing.radii)
    network = everything.throats
    np.testing.assert_array_equal(network["flux"], flow.flux)
    np.testing.assert_array_equal(network["conductance"], flow.conductances)
    np.testing.assert_array_equal(network["length"], throats.lengths)
    surfaces = throats.wetted_surfaces(flow.walls.slip)
    np.testing.assert_array_equal(network["hydraulic_radius"], throats.volumes / surfaces)


def test_only_what_was_asked_for_is_written(flow, tmp_path):
    results.write(flow, tmp_path / "k", quantities=["permeability"], vtk=False)
    assert names(tmp_path / "k") == ["summary.json"]
    assert "forces" not in results.read(tmp_path / "k").summary
    results.write(flow, tmp_path / "f", quantities=["forces"], vtk=False)
    assert names(tmp_path / "f") == ["forces.csv", "summary.json"]
    assert "permeability" not in results.read(tmp_path / "f").summary


def test_meshes_without_pressure_have_none(flow, tmp_path):
    pytest.importorskip("pyvista")
    found = results.read(results.write(flow, tmp_path / "k", quantities=["permeability"]))
    assert set(found.pores.cell_data) == {"pore", "volume", "walls"}
    assert set(found.spheres.point_data) == {"id", "radius"}


def test_permeability_of_walls_that_have_none_is_refused(tmp_path):
    walls = Walls(y_min=Wall(pressure=1.0))
    flow = PoreFlow(Packing.read(PACKINGS / "n25_s1.csv"), walls)
    with pytest.raises(InputError, match="two pressure walls"):
        results.write(flow, tmp_path / "results", vtk=False)
    assert names(tmp_path) == []


def test_unknown_quantity_is_refused(flow, tmp_path):
    with pytest.raises(InputError, match="unknown quantity 'drag'; known: permeability"):
        results.write(flow, tmp_path / "results", quantities=["drag"])


def test_unknown_table_format_is_refused(flow, tmp_path):
    with pytest.raises(InputError, match="unknown table_format 'xlsx'; known: csv, npy, parquet"):
        results.write(flow, tmp_path / "results", table_format="xlsx")


# Overwriting


def test_results_are_replaced_only_by_force(flow, tmp_path):
    directory = tmp_path / "results"
    results.write(flow, directory, quantities=["forces"], vtk=False)
    with pytest.raises(InputError, match="already holds results"):
        results.write(flow, directory, quantities=["permeability"], vtk=False)
    assert names(directory) == ["forces.csv", "summary.json"]
    results.write(flow, directory, quantities=["permeability"], vtk=False, force=True)
    assert names(directory) == ["summary.json"]
    assert names(tmp_path) == ["results"]


def test_a_table_of_another_format_is_replaced_with_the_results(flow, tmp_path):
    directory = results.write(flow, tmp_path / "results", quantities=["forces"], vtk=False, table_format="npy")
    results.write(flow, directory, quantities=["forces"], vtk=False, force=True)
    assert names(directory) == ["forces.csv", "summary.json"]


def test_files_of_others_are_never_replaced(flow, tmp_path):
    directory = results.write(flow, tmp_path / "results", quantities=[], vtk=False)
    (directory / "notes.txt").write_text("by hand")
    with pytest.raises(InputError, match="holds notes.txt, which .* would be lost"):
        results.write(flow, directory, quantities=[], vtk=False, force=True)
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.tex").write_text("by hand")
    with pytest.raises(InputError, match="not results of porefv"):
        results.write(flow, other, quantities=[], vtk=False, force=True)
    assert (other / "thesis.tex").read_text() == "by hand"


def test_refusal_comes_before_any_computation(flow, tmp_path):
    (tmp_path / "file").write_text("")
    fresh = PoreFlow(flow.mesh, flow.walls)
    for directory in (tmp_path / "file", tmp_path / "file" / "results"):
        with pytest.raises(InputError, match="cannot write"):
            results.write(fresh, directory, vtk=False)
    assert "conductances" not in vars(fresh)


def test_failure_keeps_what_existed(flow, tmp_path, monkeypatch):
    directory = results.write(flow, tmp_path / "results", quantities=["forces"], vtk=False)
    before = (directory / "summary.json").read_bytes()

    def fail(*arguments, **options):
        raise ComputationError("no")

    monkeypatch.setattr(results.writing, "summary_json", fail)
    with pytest.raises(ComputationError):
        results.write(flow, directory, vtk=False, force=True)
    assert names(tmp_path) == ["results"]
    assert names(directory) == ["forces.csv", "summary.json"]
    assert (directory / "summary.json").read_bytes() == before


def test_missing_vtk_is_said_before_any_computation(flow, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "vtkmodules.vtkCommonDataModel", None)
    fresh = PoreFlow(flow.mesh, flow.walls)
    with pytest.raises(InputError, match="pip install"):
        results.write(fresh, tmp_path / "results")
    assert "conductances" not in vars(fresh)


def test_missing_pyarrow_is_said_before_any_computation(flow, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    fresh = PoreFlow(flow.mesh, flow.walls)
    with pytest.raises(MissingExtraError, match="Writing forces.parquet needs .* pip install pyarrow"):
        results.write(fresh, tmp_path / "results", vtk=False, table_format="parquet")
    assert "conductances" not in vars(fresh) and not (tmp_path / "results").exists()


# Reading


def test_what_is_no_results_directory_is_refused(tmp_path):
    with pytest.raises(InputError, match="holds no results of porefv solve"):
        results.read(tmp_path)
    with pytest.raises(InputError, match="holds no results"):
        results.read(tmp_path / "missing")
    (tmp_path / "summary.json").write_text('{"packing": ')
    with pytest.raises(InputError, match="summary.json is damaged"):
        results.read(tmp_path)
    (tmp_path / "summary.json").write_text("[1, 2]")
    with pytest.raises(InputError, match="another program's"):
        results.read(tmp_path)


def test_what_was_not_asked_for_cannot_be_read(flow, tmp_path):
    found = results.read(results.write(flow, tmp_path / "k", quantities=["permeability"], vtk=False))
    with pytest.raises(InputError, match='has no forces.csv: add "forces" to the quantities'):
        found.forces  # noqa: B018
    with pytest.raises(InputError, match="has no pores.vtu: set vtk = true"):
        found.pores  # noqa: B018


def test_a_parquet_table_is_not_read_without_pyarrow(flow, tmp_path, monkeypatch):
    found = results.read(results.write(flow, tmp_path / "k", quantities=["permeability"], vtk=False))
    (tmp_path / "k" / "forces.parquet").write_bytes(b"PAR1")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtraError, match="Reading forces.parquet needs .* pip install pyarrow"):
        found.forces  # noqa: B018


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda table: np.arange(3.0), "its columns are not id, x, y"),
        (lambda table: table[["id", "x"]].copy(), "its columns are not id, x, y"),
        (lambda table: table.astype([(name, "U5") for name in table.dtype.names]), "not texts .id. and doubles"),
        (lambda table: table[:-1], "its rows are not the spheres .* and then the six walls"),
        (lambda table: (table["x"].__setitem__(7, np.nan), table)[1], r"row 7 lacks a number \(x\)"),
    ],
)
def test_what_is_no_table_of_forces_is_refused(flow, tmp_path, damage, reason):
    directory = results.write(flow, tmp_path / "results", quantities=["forces"], vtk=False, table_format="npy")
    np.save(directory / "forces.npy", damage(np.load(directory / "forces.npy")))
    with pytest.raises(InputError, match=f"forces.npy is damaged: .*{reason}.*. Solve again"):
        results.read(directory).forces  # noqa: B018


def test_numbers_need_no_vtk():
    code = (
        "import sys\n"
        "sys.modules['vtkmodules'] = sys.modules['pyvista'] = sys.modules['meshio'] = None\n"
        "import porefv.results, porefv.scenes.flow_scene, porefv.cli.text\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_forces_in_files_of_earlier_versions_have_the_name_of_today(flow, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    written = results.write(flow, tmp_path / "results")
    spheres = pyvista.read(written / "spheres.vtp")
    forces = np.array(spheres["fluid_force"])
    spheres.rename_array("fluid_force", "total_force", preference="point")
    spheres.field_data.clear()
    spheres.save(written / "spheres.vtp")
    np.testing.assert_array_equal(results.read(written).spheres["fluid_force"], forces)
