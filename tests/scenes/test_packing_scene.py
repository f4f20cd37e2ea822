import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from porefv.cli.program import main
from porefv.errors import ComputationError, InputError
from porefv.packing.packing import Packing
from porefv.scenes import packing_scene
from porefv.scenes.packing_scene import PackingScene
from porefv.system.progress import Progress

ROOT = Path(__file__).parents[2]

CLOUD = """\
output = "out.csv"
seed = 3
[grains]
number = 50
ratio = 0.5
[box]
upper = [1.0, 1.0, 1.0]
[cloud]
porosity = 0.8
"""
GROWTH = CLOUD.replace("[cloud]\nporosity = 0.8", "[growth]\nstress = 5.0e3")


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(CLOUD)
    return path


# ---- what is written ----------


def test_pack_writes_a_packing_that_says_what_it_is_and_how_it_was_made(scene, capsys):
    scene.write_text(GROWTH)
    assert main(["pack", str(scene)]) == 0
    said = capsys.readouterr()
    assert re.search(r"50 spheres, radii \S+ to \S+ m\nporosity 0\.\d{4}, mean stress \S+ Pa\ncoordination", said.out)
    assert f"packing in {scene.parent / 'out.csv'}" in said.out
    assert said.err == ""
    packing = Packing.read(scene.parent / "out.csv").validate()
    found = packing.metadata
    assert (found["method"], found["seed"], found["friction_angle"]) == ("growth", "3", "30 degrees")
    assert float(found["porosity"]) == pytest.approx(packing.porosity, abs=1e-6)
    assert float(found["mean_stress"].split()[0]) == pytest.approx(5e3, rel=2e-3)
    assert float(found["unbalanced"]) < 1e-3
    assert found["made_by"].startswith("porefv ")
    assert packing.box.upper.tolist() == [1.0, 1.0, 1.0]


@pytest.mark.parametrize("name", ["out.csv", "out.txt"])
def test_what_is_written_is_what_was_made(scene, name):
    scene.write_text(CLOUD.replace("out.csv", name))
    made = PackingScene.read(scene).pack()
    found = Packing.read(scene.parent / name)
    assert np.array_equal(found.centres, made.centres) and np.array_equal(found.radii, made.radii)
    assert found.metadata == made.metadata


def test_settled_packings_tell_the_height_of_the_bed(scene):
    text = CLOUD.replace("number = 50", "number = 100").replace("ratio = 0.5", "ratio = 0.8")
    text = text.replace("[cloud]\nporosity = 0.8", "[settling]\nporosity = 0.9")
    scene.write_text(text.replace("[1.0, 1.0, 1.0]", "[0.02, 0.02, 0.06]"))
    packing = PackingScene.read(scene).pack()
    top, bottom = packing.centres[:, 2] + packing.radii, packing.centres[:, 2] - packing.radii
    assert packing.metadata["method"] == "settling"
    assert float(packing.metadata["bed_height"].split()[0]) == pytest.approx(top.max() - bottom.min(), rel=1e-5)
    assert top.max() < 0.03  # it fell


def test_quiet_pack_says_nothing(scene, capsys):
    assert main(["pack", str(scene), "--quiet", "--threads", "1"]) == 0
    assert capsys.readouterr() == ("", "")


# ---- what is not overwritten, and not left behind ----------


def test_pack_overwrites_only_by_force_and_refuses_before_computing(scene, capsys, monkeypatch):
    assert main(["pack", str(scene)]) == 0
    with monkeypatch.context() as patch:
        patch.setattr(packing_scene, "cloud", lambda *a: pytest.fail("computed"))
        assert main(["pack", str(scene)]) == 2
    assert "out.csv exists. Choose another file, or replace it with force=True" in capsys.readouterr().err
    scene.write_text(CLOUD.replace("seed = 3", "seed = 4"))
    assert main(["pack", str(scene), "--force"]) == 0
    assert Packing.read(scene.parent / "out.csv").metadata["seed"] == "4"


@pytest.mark.parametrize(("error", "status"), [(KeyboardInterrupt, 130), (ComputationError("no rest"), 1)])
def test_what_is_interrupted_or_fails_leaves_nothing_behind(scene, capsys, monkeypatch, error, status):
    def fail(*arguments, **options):
        raise error

    scene.write_text(GROWTH)
    monkeypatch.setattr(packing_scene, "grow", fail)
    assert main(["pack", str(scene)]) == status
    assert "Traceback" not in capsys.readouterr().err
    assert [path.name for path in scene.parent.iterdir()] == ["scene.toml"]


def test_an_interruption_while_writing_leaves_the_old_file(scene, monkeypatch):
    assert main(["pack", str(scene), "--quiet"]) == 0
    before = (scene.parent / "out.csv").read_text()

    def rows(packing, delimiter):
        yield "0,0,0,1"
        raise KeyboardInterrupt

    monkeypatch.setattr("porefv.packing.files.csv.format_rows", rows)
    assert main(["pack", str(scene), "--force"]) == 130
    assert (scene.parent / "out.csv").read_text() == before
    assert sorted(path.name for path in scene.parent.iterdir()) == ["out.csv", "scene.toml"]


def test_a_directory_that_is_missing_is_named_before_computing(scene, capsys):
    scene.write_text(CLOUD.replace("out.csv", "nowhere/out.csv"))
    assert main(["pack", str(scene)]) == 2
    assert "nowhere is not a directory" in capsys.readouterr().err


# ---- bad scenes ----------


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("number", "numbr", 4, "unknown key 'numbr'; did you mean 'number'?"),
        ("[cloud]", "[clowd]", 8, "unknown key 'clowd'; did you mean 'cloud'?"),
        ("number = 50", "number = 50.5", 4, "number: expected a whole number, 1 or more, not 50.5"),
        ("seed = 3", "seed = -1", 2, "seed: expected a whole number, 0 or more"),
        ("ratio = 0.5", "ratio = 2.0", 5, "[grains] ratio, r_min over r_max, must lie in (0, 1]"),
        ("ratio = 0.5", "diameters = [1.0, 2.0]", 3, "passing: missing; give diameters and passing together"),
        ("ratio = 0.5", "ratio = 0.5\ndiameters = [1.0]", 6, "diameters and ratio exclude each other"),
        ("ratio = 0.5", "diameters = [1, 2]\npassing = [0, 100]", 6, "not per cent"),
        ("upper = [1.0, 1.0, 1.0]", "upper = [1.0, -1.0, 1.0]", 7, "the box has size -1 m along y"),
        ("porosity = 0.8", "porosity = 80", 9, "[cloud] porosity: must lie between 0 and 1, not 80.0"),
        ("out.csv", "out.dump", 1, "the extension '.dump' tells no format to write"),
        ("[cloud]\nporosity = 0.8", "[growth]\ndamping = 0.2", 8, "growth needs a stress in Pa, a porosity, or both"),
        ("[cloud]\nporosity = 0.8", "[growth]\nstress = -1", 9, "must be a positive number of Pa"),
        ("[cloud]\nporosity = 0.8", "[growth]\nstress = 1\nfriction_angle = 90", 10, "an angle from 0 to 89"),
        ("[cloud]\nporosity = 0.8", "[settling]\ngravity = [0, 0, 0]", 9, "grains settle by it"),
        ("[cloud]", "[settling]\n[cloud]", 9, "[settling] and [cloud] exclude each other"),
        ("[cloud]", "[material]\nyoung = 0\n[cloud]", 9, "[material] young must be a positive modulus in Pa"),
    ],
)
def test_errors_name_the_line_the_key_and_the_remedy(scene, capsys, old, new, line, said):
    assert old in CLOUD
    scene.write_text(CLOUD.replace(old, new))
    assert main(["pack", str(scene)]) == 2
    error = capsys.readouterr().err
    assert f"scene.toml, line {line}: " in error
    assert said in error
    assert not (scene.parent / "out.csv").exists()


def test_a_scene_must_say_how_to_pack(scene):
    scene.write_text(CLOUD.replace("[cloud]\nporosity = 0.8", ""))
    with pytest.raises(InputError, match=r"one of the tables \[cloud\], \[growth\] and \[settling\] is needed"):
        PackingScene.read(scene)


# ---- progress ----------


def test_the_terminal_shows_stress_porosity_and_unbalanced_force(monkeypatch):
    shown = []
    monkeypatch.setattr(Progress, "show", lambda progress, state: shown.append(state))
    scene = PackingScene.from_mapping(tomllib.loads(GROWTH.replace("number = 50", "number = 30")))
    progress = Progress(("packing", "writing"), quiet=True)
    progress.draws = True
    scene.make(progress)
    assert re.fullmatch(r"n 0\.\d{4}  unbalanced \S+  \S+ Pa  pressing", shown[-1])
    assert len(shown[-1]) < 50


# ---- examples and documentation ----------


@pytest.mark.parametrize("path", sorted((ROOT / "data" / "scenes").glob("pack_*.toml")), ids=lambda path: path.name)
def test_example_scenes_are_sound(path):
    scene = PackingScene.read(path)
    assert scene.output.parent == path.parent


def test_scenes_on_the_page_on_packing_are_sound():
    page = (ROOT / "docs" / "pack.md").read_text(encoding="utf-8")
    scenes = re.findall(r"^```ini\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    assert scenes
    for text in scenes:
        PackingScene.from_mapping(tomllib.loads(text))
