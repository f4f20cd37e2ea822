"""The tutorials run from top to bottom, and find the numbers they show."""

import json
import shutil
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")

ROOT = Path(__file__).parents[2]


def run(name, folder, *expressions):
    """Execute a notebook; the values of expressions after its last cell."""
    shutil.copytree(ROOT / "data" / "packings", folder / "data" / "packings")
    (folder / "tutorials").mkdir()
    notebook = nbformat.read(ROOT / "tutorials" / name, as_version=4)
    question = f"import json; print(json.dumps([{', '.join(expressions)}]))"
    notebook.cells.append(nbformat.v4.new_code_cell(question))
    client = nbclient.NotebookClient(
        notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": folder / "tutorials"}}
    )
    client.execute()
    return json.loads(notebook.cells[-1].outputs[-1]["text"])


def test_forces_from_a_packing_file_to_a_picture(tmp_path):
    permeability, void, residual, total, walls, ratio, strongest = run(
        "forces.ipynb", tmp_path,
        "flow.permeability", "void - mesh.facets.volumes.sum()", "forces.conservation_residual",
        "forces.sums['total'].tolist()", "forces.sums['wall_total'].tolist()", "ratio.mean()", "strongest",
    )  # fmt: skip
    assert permeability == pytest.approx(6.4490e-6, rel=1e-4)
    assert abs(void) < 1e-12
    assert residual < 1e-12
    assert total == pytest.approx([-0.01038, 0.98125, -0.00214], abs=1e-5)
    assert [a + b for a, b in zip(total, walls, strict=True)] == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    assert ratio == pytest.approx(1.0, abs=0.05)
    assert strongest == 12
    assert (tmp_path / "tutorials" / "forces.png").read_bytes().startswith(b"\x89PNG")


def test_the_pressure_equation_three_ways(tmp_path):
    in_fipy, exact, of_porefv, settled, forces, permeability = run(
        "pressure_three_ways.ipynb", tmp_path,
        "float(np.abs(in_fipy - by_hand).max() / drop)", "float(np.abs(exact - by_hand).max() / drop)",
        "float(np.abs(flow.pressure - by_hand).max() / drop)", "float(settled)", "float(forces)",
        "[k_by_hand, flow.permeability]",
    )  # fmt: skip
    assert in_fipy < 1e-7
    assert exact < 1e-11
    assert of_porefv < 1e-11
    assert settled < 1e-7
    assert forces < 1e-6
    assert permeability[0] == pytest.approx(permeability[1], rel=1e-9)


def test_a_solute_and_how_long_the_fluid_stays(tmp_path):
    by_steps, by_age, imbalance, difference, left = run(
        "solute.ipynb", tmp_path,
        "by_steps / tau", "float(np.nanmean([residence_time(flow).mean / tau]))", "tracer.balance.largest_imbalance",
        "float(difference)", "left",
    )  # fmt: skip
    assert by_steps == pytest.approx(1.0, abs=1e-6)
    assert by_age == pytest.approx(1.0, abs=1e-10)
    assert imbalance < 1e-14
    assert difference < 1e-9
    assert left == sorted(left, reverse=True)
