"""The commands export, plot --what and info, on results with the quantities of the sample."""

from pathlib import Path

import numpy as np
import pytest

from porefv.cli.program import main
from porefv.scenes.flow_scene import FlowScene

PACKINGS = Path(__file__).parents[2] / "data" / "packings"
SAMPLE = [
    "permeability", "pressure", "profile", "pore_sizes", "constriction_sizes", "tortuosity", "diffusion", "velocity",
    "planes",
]  # fmt: skip


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """The results of a scene of 25 spheres with VTK files and all quantities of the sample."""
    directory = tmp_path_factory.mktemp("solved") / "results"
    walls = {"y_min": {"pressure": 1.0}, "y_max": {"pressure": 0.0}}
    output = {"directory": str(directory), "quantities": SAMPLE, "vtk": True, "layers": 4}
    scene = {"packing": str(PACKINGS / "n25_s1.csv"), "walls": walls, "output": output}
    return FlowScene.from_mapping(scene).solve()


def test_info_prints_the_quantities_of_the_sample(solved, capsys):
    assert main(["info", str(solved)]) == 0
    out = capsys.readouterr().out
    for text in (
        "Sample", "hydraulic tortuosity", "effective diffusivity", "formation factor", "diffusive tortuosity",
        "Darcy velocity", "interstitial velocity", "4 layers along y, porosity",
        "pore radius, by number", "constriction radius, by flux", "3 planes along y",
    ):  # fmt: skip
        assert text in out


@pytest.mark.parametrize("what", ["profile", "pore_sizes", "constriction_sizes"])
def test_plot_draws_a_quantity(solved, tmp_path, capsys, what):
    pytest.importorskip("matplotlib")
    assert main(["plot", str(solved), "--what", what, "--out", str(tmp_path / "a.png")]) == 0
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert capsys.readouterr() == ("", "")


def test_plot_of_a_quantity_that_was_not_asked_for_names_the_remedy(write_scene, tmp_path, capsys):
    assert main(["solve", str(write_scene(tmp_path, "n25_s1.csv")), "--quiet"]) == 0
    assert main(["plot", str(tmp_path / "results"), "--what", "profile", "--out", str(tmp_path / "a.png")]) == 2
    assert 'add "profile" to the quantities' in capsys.readouterr().err
    assert not (tmp_path / "a.png").exists()


def test_plot_draws_every_kind_that_it_offers():
    from porefv.cli.plot import KINDS
    from porefv.results.drawing import PICTURES

    assert sorted(KINDS) == sorted(PICTURES)


def test_plot_draws_a_section_of_results_at_a_place(solved, tmp_path, capsys):
    path = tmp_path / "a.svg"
    options = ["--what", "section", "--axis", "x", "--at", "0.3", "--size", "400x300", "--dpi", "50"]
    assert main(["plot", str(solved), "--out", str(path), *options]) == 0
    text = path.read_text(encoding="utf-8")
    assert "x = 0.3 m" in text and "pressure, Pa" in text and 'width="576pt"' in text  # 8 inches
    assert capsys.readouterr() == ("", "")


def test_plot_says_what_a_picture_leaves_out(solved, tmp_path, capsys):
    options = ["--what", "velocity", "--size", "400x300", "--dpi", "50"]
    assert main(["plot", str(solved), "--out", str(tmp_path / "a.png"), *options]) == 0
    assert "porefv plot: arrows: mean velocity" in capsys.readouterr().err


@pytest.mark.parametrize(("options", "said"), [
    (["--what", "forces"], 'has no force: add "forces" to the quantities'),
    (["--what", "section", "--at", "2"], "must lie within the box, between 0 and 1 m"),
    (["--what", "profile", "--axis", "x"], "profile has none"),
    (["--axis", "x"], "the picture pressure has none"),
])  # fmt: skip
def test_plot_refuses_what_it_cannot_draw(solved, tmp_path, capsys, options, said):
    assert main(["plot", str(solved), "--out", str(tmp_path / "a.png"), *options]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "a.png").exists()


def test_plot_solves_the_flow_again_for_paths_and_refuses_one_that_changed(write_scene, tmp_path, capsys):
    scene = write_scene(tmp_path, "n25_s1.csv")
    assert main(["solve", str(scene), "--quiet"]) == 0
    picture = ["plot", str(tmp_path / "results"), "--what", "paths", "--size", "400x300", "--dpi", "50", "--out"]
    assert main([*picture, str(tmp_path / "a.png")]) == 0
    assert "200 paths of particles" in capsys.readouterr().err
    changed = scene.read_text(encoding="utf-8").replace("pressure = 1.0", "pressure = 2.0")
    scene.write_text(changed, encoding="utf-8")
    assert main([*picture, str(tmp_path / "b.png")]) == 2
    assert "has changed since" in capsys.readouterr().err
    scene.unlink()
    assert main([*picture, str(tmp_path / "b.png")]) == 2
    assert f"there is no {scene}" in capsys.readouterr().err


def test_plot_of_paths_of_results_without_a_scene_names_the_remedy(solved, tmp_path, capsys):
    assert main(["plot", str(solved), "--what", "paths", "--out", str(tmp_path / "a.png")]) == 2
    assert 'flow.plot("paths")' in capsys.readouterr().err


def test_plot_draws_a_packing_file_and_refuses_what_needs_a_flow(tmp_path, capsys):
    packing = str(PACKINGS / "n25_s1.csv")
    assert main(["plot", packing, "--what", "section", "--out", str(tmp_path / "a.svg")]) == 0
    assert "there are no pores" in capsys.readouterr().err
    assert main(["plot", packing, "--what", "network", "--out", str(tmp_path / "a.png")]) == 2
    assert "--what can be packing or section" in capsys.readouterr().err


def test_export_writes_a_network_that_numpy_reads(solved, tmp_path, capsys):
    path = tmp_path / "network.npz"
    assert main(["export", str(solved), "--to", "openpnm", "--out", str(path)]) == 0
    assert capsys.readouterr().out == f"written {path}\n"
    with np.load(path) as arrays:
        assert arrays["pore.coords"].shape == (122, 3)


def test_export_of_csv_writes_two_files(solved, tmp_path, capsys):
    assert main(["export", str(solved), "--to", "csv", "--out", str(tmp_path / "network")]) == 0
    assert sorted(path.name for path in (tmp_path / "network").iterdir()) == ["pores.csv", "throats.csv"]
    assert len(capsys.readouterr().out.splitlines()) == 2


def test_export_of_a_mesh_is_silent_but_for_the_name(solved, tmp_path, capsys):
    pytest.importorskip("meshio")
    for extension in ("vtu", "msh", "inp"):
        path = tmp_path / f"pores.{extension}"
        assert main(["export", str(solved), "--to", extension, "--out", str(path)]) == 0
        assert capsys.readouterr() == (f"written {path}\n", "")


def test_export_replaces_only_by_force(solved, tmp_path, capsys):
    command = ["export", str(solved), "--to", "openpnm", "--out", str(tmp_path / "network.npz")]
    assert main(command) == 0
    assert main(command) == 2
    assert "replace it with force=True (--force on the command line)" in capsys.readouterr().err
    assert main([*command, "--force"]) == 0


def test_export_refuses_what_is_no_results_directory(tmp_path, capsys):
    assert main(["export", str(tmp_path), "--to", "csv", "--out", str(tmp_path / "a")]) == 2
    assert "holds no results of porefv solve" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [["--to", "stl", "--out", "a.stl"], ["--out", "a.npz"], ["--to", "csv"]])
def test_export_says_what_it_wants(solved, arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["export", str(solved), *arguments])
    assert ended.value.code == 2
    assert capsys.readouterr().err.startswith("usage: porefv export ")


def test_plot_of_a_quantity_refuses_a_simulation(tmp_path, capsys):
    (tmp_path / "simulation.json").write_text("{}")
    assert main(["plot", str(tmp_path), "--what", "profile", "--out", str(tmp_path / "a.png")]) == 2
    assert "--what is for results of porefv solve" in capsys.readouterr().err
