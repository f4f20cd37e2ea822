"""Quantities of the sample in a results directory: only what is asked for, the same when it is read back."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from porefv import results
from porefv.errors import InputError
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.packing import Packing
from porefv.results import Sections
from porefv.results.drawing import draw
from porefv.results.quantity_pictures import quantity_picture
from porefv.scenes.flow_scene import FlowScene
from porefv.transport.diffusion import effective_diffusion

PACKINGS = Path(__file__).parents[2] / "data" / "packings"
SAMPLE = ("profile", "pore_sizes", "constriction_sizes", "tortuosity", "diffusion", "velocity", "planes")
TABLES = ("profile", "pore_sizes", "constriction_sizes", "planes")


@pytest.fixture(scope="module")
def flow():
    return PoreFlow(Packing.read(PACKINGS / "n200_s1.csv"), Walls.along("y", drop=2.0))


@pytest.fixture(scope="module")
def found(flow, tmp_path_factory):
    """All quantities of the sample, read back."""
    directory = tmp_path_factory.mktemp("sample") / "results"
    return results.read(results.write(flow, directory, quantities=SAMPLE, vtk=False))


def test_tables_read_back_to_the_last_bit(flow, found):
    profile = flow.profile()
    np.testing.assert_array_equal(found.profile["porosity"], profile.porosity)
    np.testing.assert_array_equal(found.profile["pressure"], profile.pressure)
    np.testing.assert_array_equal(found.profile["lower"], profile.edges[:-1])
    np.testing.assert_array_equal(found.profile["upper"], profile.edges[1:])
    np.testing.assert_array_equal(found.pore_sizes["radius"], flow.pore_sizes.radii)
    np.testing.assert_array_equal(found.pore_sizes["void_volume"], flow.mesh.pore_volumes)
    np.testing.assert_array_equal(found.pore_sizes["z"], flow.pore_sizes.centres[:, 2])
    np.testing.assert_array_equal(found.constriction_sizes["radius"], flow.constriction_sizes.radii)
    np.testing.assert_array_equal(found.constriction_sizes["flux"], np.abs(flow.flux))
    np.testing.assert_array_equal(found.constriction_sizes["second_pore"], flow.mesh.throats.pores[:, 1])
    np.testing.assert_array_equal(found.planes["place"], profile.edges[1:-1])
    np.testing.assert_array_equal(found.planes["flux"], flow.plane_fluxes(profile.edges[1:-1]))


def test_scalars_read_back_to_the_last_bit(flow, found):
    assert found.tortuosity == flow.tortuosity
    np.testing.assert_array_equal(found.darcy_velocity, flow.darcy_velocity)
    np.testing.assert_array_equal(found.interstitial_velocity, flow.interstitial_velocity)


def test_diffusion_is_that_of_the_mesh_along_the_axis_of_flow(flow, found):
    expected = effective_diffusion(flow.mesh, "y")
    assert found.diffusion == {
        "axis": "y",
        "relative_diffusivity": expected.relative_diffusivity,
        "formation_factor": expected.formation_factor,
        "diffusive_tortuosity": expected.diffusive_tortuosity,
    }


def test_diffusion_has_the_axis_that_is_asked_for(flow, tmp_path):
    directory = results.write(
        flow, tmp_path / "results", quantities=["diffusion"], vtk=False, sections=Sections(axis="x")
    )
    found = results.read(directory).diffusion
    assert found["axis"] == "x"
    assert found["relative_diffusivity"] == effective_diffusion(flow.mesh, "x").relative_diffusivity


def test_where_nothing_diffuses_the_rest_is_unknown(tmp_path):
    packing = Packing.read(PACKINGS / "n25_s1.csv")
    closed = PoreMesh(Packing(packing.centres, 1.5 * packing.radii, packing.box), wall_tolerance=0.9)
    directory = results.write(
        PoreFlow(closed, Walls.along("y")), tmp_path / "results", quantities=["diffusion"], vtk=False
    )
    found = results.read(directory).diffusion
    assert found == {
        "axis": "y", "relative_diffusivity": 0.0, "formation_factor": None, "diffusive_tortuosity": None
    }  # fmt: skip


def test_the_summary_has_medians_and_units(flow, found):
    summary = found.summary
    assert summary["pore_sizes"]["by_number"]["r50"] == flow.pore_sizes.by_number.quantile(0.5)
    assert summary["constriction_sizes"]["by_flux"]["mean"] == flow.constriction_sizes.by_flux.mean
    assert summary["profile"]["axis"] == summary["planes"]["axis"] == "y"
    assert [summary[name]["table"] for name in TABLES] == [f"{name}.csv" for name in TABLES]
    assert set(SAMPLE) <= set(summary["units"])
    assert "quantities" in summary["seconds"]


@pytest.mark.parametrize("quantity", SAMPLE)
def test_only_what_is_asked_for_is_written(flow, tmp_path, quantity):
    directory = results.write(flow, tmp_path / "results", quantities=[quantity], vtk=False)
    tables = [f"{quantity}.csv"] if quantity in TABLES else []
    assert sorted(path.name for path in directory.iterdir()) == sorted([*tables, "summary.json"])
    assert set(SAMPLE) & set(json.loads((directory / "summary.json").read_text())) == {quantity}


@pytest.mark.parametrize(
    "attribute", [*TABLES, "tortuosity", "diffusion", "darcy_velocity", "interstitial_velocity"]
)  # fmt: skip
def test_what_was_not_asked_for_is_an_error_that_names_the_remedy(flow, tmp_path, attribute):
    written = results.read(results.write(flow, tmp_path / "results", quantities=["permeability"], vtk=False))
    with pytest.raises(InputError, match=r"add .* to the quantities in the scene's \[output\], and solve again"):
        getattr(written, attribute)


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text.replace("porosity", "density"),
        lambda text: text.replace(",0.", ",zero", 1),
        lambda text: text.rstrip("\n").rpartition(",")[0],
        lambda text: "",
    ],
)
def test_a_damaged_table_is_refused(flow, tmp_path, damage):
    written = results.read(results.write(flow, tmp_path / "results", quantities=["profile"], vtk=False))
    path = written.directory / "profile.csv"
    path.write_text(damage(path.read_text()))
    with pytest.raises(InputError, match=r"profile\.csv is damaged"):
        _ = written.profile


def test_layers_axis_and_planes_are_those_of_the_scene(tmp_path):
    scene = FlowScene.from_mapping(
        {
            "packing": str(PACKINGS / "n25_s1.csv"),
            "walls": {"y_min": {"pressure": 1.0}, "y_max": {"pressure": 0.0}},
            "output": {
                "directory": str(tmp_path / "results"), "quantities": ["profile", "planes"],
                "layers": 4, "axis": "z", "planes": [0.1, 0.7],
            },
        }
    )  # fmt: skip
    written = results.read(scene.solve())
    assert list(written.profile["upper"]) == [0.25, 0.5, 0.75, 1.0]
    assert list(written.planes["place"]) == [0.1, 0.7]
    assert written.summary["profile"]["axis"] == "z"


def test_planes_lie_between_the_layers_unless_they_are_given(flow, tmp_path):
    sections = Sections(layers=4)
    written = results.read(
        results.write(flow, tmp_path / "results", quantities=["planes"], vtk=False, sections=sections)
    )
    assert list(written.planes["place"]) == [0.25, 0.5, 0.75]
    np.testing.assert_allclose(written.planes["flux"], flow.inflow, rtol=1e-9)


def test_one_layer_has_no_planes(flow, tmp_path):
    sections = Sections(layers=1)
    written = results.read(
        results.write(flow, tmp_path / "results", quantities=["planes"], vtk=False, sections=sections)
    )
    assert len(written.planes) == 0


@pytest.mark.parametrize(
    ("sections", "quantity", "message"),
    [
        (Sections(planes=(0.5, 1.0)), "planes", r"planes must lie inside the box, between 0 and 1 m along y: 1 m"),
        (Sections(axis="x", planes=(-1.0,)), "planes", "between 0 and 1 m along x"),
    ],
)
def test_planes_outside_the_box_are_refused_before_anything_is_computed(sections, quantity, message, tmp_path):
    flow = PoreFlow(Packing.read(PACKINGS / "n25_s1.csv"), Walls.along("y"))
    with pytest.raises(InputError, match=message):
        results.write(flow, tmp_path / "results", quantities=[quantity], sections=sections, vtk=False)
    assert "conductances" not in vars(flow) and not (tmp_path / "results").exists()


def test_tortuosity_without_opposite_walls_is_refused_before_anything_is_computed(tmp_path):
    flow = PoreFlow(Packing.read(PACKINGS / "n25_s1.csv"), Walls(x_min=Wall(1.0), y_max=Wall(0.0)))
    with pytest.raises(InputError, match="tortuosity needs exactly two pressure walls"):
        results.write(flow, tmp_path / "results", quantities=["tortuosity"], vtk=False)
    assert "conductances" not in vars(flow)


@pytest.mark.parametrize("bad", [{"axis": "w"}, {"layers": 0}, {"layers": 2.5}, {"layers": True}])
def test_sections_refuse_what_is_none(bad):
    with pytest.raises(InputError, match="must be"):
        Sections(**bad)


def test_layers_finer_than_any_grain_read_back(flow, tmp_path):
    sections = Sections(layers=500)
    written = results.read(
        results.write(flow, tmp_path / "results", quantities=["profile"], vtk=False, sections=sections)
    )
    assert len(written.profile) == 500
    assert math.isclose(written.profile["porosity"].mean(), flow.mesh.packing.porosity, abs_tol=1e-12)


# Pictures


@pytest.mark.parametrize("quantity", ["profile", "pore_sizes", "constriction_sizes"])
def test_pictures_show_the_table(found, tmp_path, quantity):
    pytest.importorskip("matplotlib")
    path = tmp_path / "picture.png"
    draw(found, path, quantity)
    assert path.read_bytes().startswith(b"\x89PNG")
    axes = quantity_picture(found, quantity).figure.axes
    assert [ax.get_xlabel() for ax in axes] == {
        "profile": ["porosity", "mean pressure, Pa"],
        "pore_sizes": ["radius of the inscribed sphere of a pore, mm"],
        "constriction_sizes": ["radius of the inscribed circle of a throat, mm"],
    }[quantity]


def test_curves_of_distributions_end_at_one(found):
    pytest.importorskip("matplotlib")
    for quantity in ("pore_sizes", "constriction_sizes"):
        curves = [line for line in quantity_picture(found, quantity).figure.axes[0].lines if len(line.get_xdata()) > 1]
        assert [line.get_ydata()[-1] for line in curves] == [1.0, 1.0]


def test_there_is_no_picture_of_other_quantities(found):
    with pytest.raises(InputError, match="there is no picture of 'tortuosity'"):
        quantity_picture(found, "tortuosity")
