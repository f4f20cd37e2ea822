"""The Reynolds number of a flow, and the warning above 1."""

import json

import numpy as np
import pytest

from porefv import Fluid, PoreFlow, Walls, results
from porefv.cli.program import main
from porefv.errors import OutOfRangeWarning

MILLIMETRES = 1e-3


def small(packing, drop, fluid):
    """A packing of a thousandth of its size."""
    return PoreFlow(packing.scaled(MILLIMETRES), Walls.along("y", drop=drop), fluid)


def test_the_number_is_that_of_the_darcy_velocity_and_the_mean_diameter(mesh_of):
    packing = mesh_of("n25_s1").packing
    flow = small(packing, 1e-3, Fluid(1e-3, 800.0))
    diameter = 2e-3 * packing.radii.mean()
    assert flow.reynolds == pytest.approx(800.0 * np.linalg.norm(flow.darcy_velocity) * diameter / 1e-3)
    speed = np.linalg.norm(flow.pore_velocity, axis=1).max()
    assert flow.pore_reynolds == pytest.approx(800.0 * speed * diameter / 1e-3)
    assert flow.pore_reynolds > flow.reynolds


def test_it_is_in_proportion_to_the_drop_and_falls_with_the_square_of_viscosity(mesh_of):
    packing = mesh_of("n25_s1").packing
    one = small(packing, 1.0, Fluid(1e-3, 1000.0)).reynolds
    assert small(packing, 3.0, Fluid(1e-3, 1000.0)).reynolds == pytest.approx(3.0 * one)
    assert small(packing, 1.0, Fluid(1e-2, 1000.0)).reynolds == pytest.approx(one / 100.0)


@pytest.mark.parametrize("fluid", [None, Fluid(), Fluid(viscosity=2e-3)])
def test_without_a_given_density_there_is_none(mesh_of, fluid, tmp_path):
    flow = PoreFlow(mesh_of("n25_s1"), Walls.along("y"), fluid)
    assert flow.reynolds is None and flow.pore_reynolds is None
    assert flow.fluid.density == 1000.0 and not flow.fluid.density_given
    assert "reynolds" not in results.read(results.write(flow, tmp_path / "found", vtk=False)).summary


def test_a_density_that_is_given_counts_as_given_whatever_it_is():
    assert Fluid(density=1000.0).density_given and Fluid(1e-3, 0.0).density_given


def test_above_one_results_are_written_with_a_warning_that_says_what_it_means(mesh_of, tmp_path):
    packing = mesh_of("n25_s1").packing
    fast = small(packing, 100.0, Fluid(1e-3, 1000.0))
    assert fast.reynolds > 1.0
    with pytest.warns(OutOfRangeWarning, match=r"Reynolds number .* without inertia.*too large"):
        results.write(fast, tmp_path / "fast", vtk=False)


def test_the_summary_and_info_have_it(mesh_of, tmp_path, capsys):
    slow = small(mesh_of("n25_s1").packing, 1.0, Fluid(1e-3, 1000.0))
    assert slow.reynolds < 1.0
    directory = results.write(slow, tmp_path / "slow", vtk=False)
    summary = json.loads((directory / "summary.json").read_text())
    assert summary["reynolds"] == {"sample": slow.reynolds, "largest_pore": slow.pore_reynolds}
    main(["info", str(directory)])
    assert f"{slow.reynolds:.3g}, in a pore at most {slow.pore_reynolds:.3g}" in capsys.readouterr().out
