import io
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from porefv.cli.program import main
from porefv.errors import ComputationError
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.scenes.flow_scene import FlowScene
from porefv.system.progress import Progress

DATA = Path(__file__).parents[2] / "data"


@pytest.fixture
def scene(write_scene, tmp_path):
    """The path of a scene of 25 spheres."""
    return write_scene(tmp_path, "n25_s1.csv")


def run(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "porefv", *map(str, arguments)], capture_output=True, text=True, **options
    )


# The four commands


def test_solve_writes_results_and_says_where(scene, capsys):
    assert main(["solve", str(scene)]) == 0
    said = capsys.readouterr()
    assert re.search(r"25 spheres, 122 pores, permeability 0\.000190\d+ m², force balance", said.out)
    assert f"results in {scene.parent / 'results'}" in said.out
    assert said.err == ""
    assert sorted(p.name for p in (scene.parent / "results").iterdir()) == ["forces.csv", "summary.json"]


def test_quiet_solve_says_nothing(scene, capsys):
    assert main(["solve", str(scene), "--quiet", "--threads", "1"]) == 0
    assert capsys.readouterr() == ("", "")


def test_solve_overwrites_only_by_force(scene, capsys):
    assert main(["solve", str(scene)]) == 0
    assert main(["solve", str(scene)]) == 2
    assert "already holds results" in capsys.readouterr().err
    assert main(["solve", str(scene), "--force"]) == 0


def test_check_tells_what_was_found_and_writes_nothing(scene, capsys):
    assert main(["check", str(scene)]) == 0
    out = capsys.readouterr().out
    assert "scene.toml has no errors" in out
    assert "25 spheres, radii 0.111 to 0.2078 m" in out
    assert "y_min: 1 Pa, no-slip" in out
    assert "table with header, separated by commas; no unit stated, taken as m; columns x, y, z, radius" in out
    assert "--force" not in out
    assert [path.name for path in scene.parent.iterdir()] == ["scene.toml"]


def test_check_warns_of_results_that_exist(scene, capsys):
    main(["solve", str(scene), "--quiet"])
    assert main(["check", str(scene)]) == 0
    assert "(exists: solve needs --force)" in capsys.readouterr().out


def test_info_prints_a_summary(scene, capsys):
    main(["solve", str(scene), "--quiet"])
    assert main(["info", str(scene.parent / "results")]) == 0
    out = capsys.readouterr().out
    for line in (
        r"Packing\n", r"  porosity +0\.5335", r"  throats +240\n", r"  permeability +0\.000190\d+ m²\n",
        r"  hydraulic conductivity +\S+ m/s\n", r"  force balance +\S+\n",
        r"  table +forces\.csv\n", r"  solver +direct, .* imbalance",
    ):  # fmt: skip
        assert re.search(line, out), line


def test_info_of_the_pores_alone(write_scene, tmp_path, capsys):
    path = write_scene(tmp_path, "n25_s1.csv")
    path.write_text(path.read_text().replace('["permeability", "pressure", "forces"]', "[]"))
    assert main(["solve", str(path)]) == 0
    assert main(["info", str(tmp_path / "results")]) == 0
    out = capsys.readouterr().out
    assert "122" in out and "permeability" not in out


def test_plot_draws_a_picture(write_scene, tmp_path, capsys):
    pytest.importorskip("pyvista")
    path = write_scene(tmp_path, "nine_0.72.csv", vtk="true")
    main(["solve", str(path), "--quiet"])
    if main(["plot", str(tmp_path / "results"), "--out", str(tmp_path / "nine.png")]) == 1:
        pytest.skip(capsys.readouterr().err)
    assert (tmp_path / "nine.png").read_bytes().startswith(b"\x89PNG")
    assert capsys.readouterr() == ("", "")


def test_plot_replaces_a_picture_only_on_demand(tmp_path, capsys, monkeypatch):
    drawn = SimpleNamespace(notes=(), save=lambda path: path.write_bytes(b"a new picture"))
    monkeypatch.setattr("porefv.export.pictures.picture", lambda *_, **__: drawn)
    picture = tmp_path / "picture.png"
    picture.write_bytes(b"earlier")
    arguments = ["plot", str(DATA / "packings" / "n25_s1.csv"), "--out", str(picture)]
    assert main(arguments) == 2
    assert "picture.png exists already: choose another with --out, or add --force" in capsys.readouterr().err
    assert picture.read_bytes() == b"earlier"
    assert main([*arguments, "--force"]) == 0
    assert picture.read_bytes() == b"a new picture"


def test_a_warning_is_said_once(write_scene, tmp_path, capsys):
    # Each sphere twice, a little apart. With triple overlaps the packing is validated for its porosity, too.
    rng = np.random.default_rng(1)
    packing = Packing.read(DATA / "packings" / "n25_s1.csv")
    moves = rng.normal(size=packing.centres.shape)
    moves *= 0.03 * packing.radii[:, None] / np.linalg.norm(moves, axis=1)[:, None]
    moved = np.clip(packing.centres + moves, packing.radii[:, None], 1 - packing.radii[:, None])
    near = tmp_path / "near.csv"
    Packing(np.vstack([packing.centres, moved]), np.tile(packing.radii, 2), packing.box).write(near)
    assert main(["solve", str(write_scene(tmp_path, near))]) == 0
    assert capsys.readouterr().err.count("one sphere lies within another but for less than") == 1


# What is imported


def test_help_comes_at_once():
    # How long it takes is measured by benchmarks/start_up.py.
    watched = "import sys\ntry:\n from porefv.cli.program import main; main(['--help'])\nfinally:\n"
    watched += " assert not {'numpy', 'numba', 'scipy', 'pyvista', 'pydantic'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", watched], check=True, capture_output=True)


@pytest.mark.parametrize("vtk", ["false", "true"])
def test_vtk_is_imported_only_if_asked_for(write_scene, tmp_path, vtk):
    path = write_scene(tmp_path, "n25_s1.csv", vtk)
    code = (
        "import sys\nfrom porefv.cli.program import main\n"
        f"assert main(['solve', {str(path)!r}]) == 0\n"
        "names = ('vtkmodules', 'pyvista', 'meshio', 'fipy', 'matplotlib')\n"
        "print([name for name in names if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    # pyvista is for reading and drawing: files are written by VTK itself, which loads sooner.
    assert done.stdout.splitlines()[-1] == ("[]" if vtk == "false" else "['vtkmodules']")


# Errors


@pytest.mark.parametrize("arguments", [
    ["solve", "missing.toml"], ["check", "missing.toml"], ["info", "missing"],
    ["plot", "missing", "--out", "a.png"], ["solve"], ["paint"],
    ["solve", "scene.toml", "--threads", "0"], ["plot", "missing"],
])  # fmt: skip
def test_bad_input_is_status_2_and_no_traceback(arguments, tmp_path):
    done = run(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert re.search(r"^porefv( \w+)?: error: ", done.stderr, re.MULTILINE)
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_an_unknown_option_is_refused_with_the_usage_of_its_command(capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["plot", "results", "--out", "picture.png", "--resume"])
    error = capsys.readouterr().err
    assert error.startswith("usage: porefv plot ") and "porefv plot: error: unrecognized arguments: --resume" in error


def test_errors_name_file_and_line(scene):
    scene.write_text(scene.read_text().replace("[walls]", "[fluid]\nviscosity = 0\n[walls]"))
    done = run("solve", scene.name, cwd=scene.parent)
    assert done.returncode == 2
    assert done.stderr == (
        "porefv: error: scene.toml, line 3: [fluid] viscosity must be a positive number of Pa s, not 0.0\n"
    )


def test_failed_computation_is_status_1(scene, capsys, monkeypatch):
    def fail(*arguments, **options):
        raise ComputationError("the solver stopped")

    monkeypatch.setattr(FlowScene, "pore_flow", fail)
    assert main(["solve", str(scene)]) == 1
    assert capsys.readouterr().err == "porefv: error: the solver stopped\n"
    assert [path.name for path in scene.parent.iterdir()] == ["scene.toml"]


def test_interruption_is_status_130(scene, capsys, monkeypatch):
    def interrupt(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(FlowScene, "pore_flow", interrupt)
    assert main(["solve", str(scene)]) == 130
    assert capsys.readouterr().err == "porefv: error: interrupted; nothing was written\n"
    assert [path.name for path in scene.parent.iterdir()] == ["scene.toml"]


def test_an_interruption_while_text_is_decoded_says_no_word_of_codecs(scene, capsys, monkeypatch):
    def interrupt(*arguments, **options):
        raise KeyboardInterrupt("decoding with 'utf-8-sig' codec failed (KeyboardInterrupt: )") from KeyboardInterrupt()

    monkeypatch.setattr(FlowScene, "pore_flow", interrupt)
    assert main(["solve", str(scene)]) == 130
    assert capsys.readouterr().err == "porefv: error: interrupted; nothing was written\n"


@pytest.mark.parametrize(
    ("error", "said"), [(ZeroDivisionError("0"), "defect of porefv"), (MemoryError(), "not enough memory")]
)
def test_unforeseen_errors_are_status_1_and_no_traceback(scene, capsys, monkeypatch, error, said):
    def fail(*arguments, **options):
        raise error

    monkeypatch.setattr(FlowScene, "pore_flow", fail)
    assert main(["solve", str(scene)]) == 1
    assert said in capsys.readouterr().err


def test_reader_that_goes_away_is_no_error(scene):
    main(["solve", str(scene), "--quiet"])
    command = f"{sys.executable} -m porefv info {scene.parent / 'results'} | true; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True)
    assert done.stdout.strip() == "0"
    assert done.stderr == ""


# Progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_terminal_shows_stages_and_is_left_clean():
    terminal = Terminal()
    progress = Progress(["reading", "writing"], terminal)
    progress.note("compiling")
    for stage in progress.stages:
        with progress.stage(stage):
            time.sleep(0.02)
    text = terminal.getvalue()
    assert text.startswith("porefv: compiling\n")
    assert "1/2 reading" in text and "2/2 writing" in text
    assert text.endswith("\x1b[2K")
    assert list(progress.seconds) == ["reading", "writing"]
    assert all(seconds > 0.01 for seconds in progress.seconds.values())


def test_a_stage_shows_its_state_and_which_part_of_it_is_done():
    terminal = Terminal()
    progress = Progress(["consolidation"], terminal)
    progress.show("of no stage")
    with progress.stage("consolidation"):
        for part in (0.25, 0.5, 1.0):
            progress.show(f"part {part}", part)
            time.sleep(0.15)
    text = terminal.getvalue()
    assert all(f"part {part}" in text for part in (0.25, 0.5)) and "of no stage" not in text
    assert "\x1b[36m00:00" in text  # what remains by the clock


@pytest.mark.parametrize(("stream", "quiet"), [(io.StringIO(), False), (Terminal(), True)])
def test_log_and_quiet_terminal_show_nothing(stream, quiet):
    progress = Progress(["reading"], stream, quiet=quiet)
    progress.note("compiling")
    with progress.stage("reading"):
        pass
    assert stream.getvalue() == ""
    assert "reading" in progress.seconds


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs a terminal to pretend")
def test_solve_draws_its_progress_on_a_terminal(scene):
    import pty

    leader, follower = pty.openpty()
    command = [sys.executable, "-m", "porefv", "solve", str(scene)]
    subprocess.run(command, stdout=subprocess.PIPE, stderr=follower, check=True)
    os.close(follower)
    text = os.read(leader, 1 << 16).decode()
    os.close(leader)
    for number, stage in enumerate(FlowScene.read(scene).stages, 1):
        assert f"{number}/7 {stage}" in text


# Whoever stops it, or cannot listen


def test_sigterm_is_status_143_and_nothing_is_left(scene, capsys, monkeypatch):
    monkeypatch.setattr(FlowScene, "pore_flow", lambda *arguments: signal.raise_signal(signal.SIGTERM))
    assert main(["solve", str(scene)]) == 143
    assert capsys.readouterr().err == "porefv: error: terminated; nothing was written\n"
    assert [path.name for path in scene.parent.iterdir()] == ["scene.toml"]
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_a_signal_that_a_library_turns_into_an_error_is_a_signal(scene, monkeypatch):
    def interrupted(*arguments):
        try:
            signal.raise_signal(number)
        except BaseException:
            raise ImportError("a library is half loaded") from None

    monkeypatch.setattr(FlowScene, "pore_flow", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs may ignore it
    for number, status in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):  # noqa: B007
        assert main(["solve", str(scene)]) == status
    signal.signal(signal.SIGINT, before)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device that is full")
@pytest.mark.parametrize(
    ("output", "reason"), [(">/dev/full", "No space left on device"), (">&-", "it is closed"), (">&- 2>&-", "")]
)
def test_an_output_that_cannot_be_written_to(scene, output, reason):
    said = run_in_shell(f"{sys.executable} -m porefv solve {scene} {output}", 1)
    assert said == (f"porefv: error: cannot write to standard output: {reason}. Files that were to be written are "
                    "complete\n" if reason else "")  # fmt: skip
    assert json.loads((scene.parent / "results" / "summary.json").read_text())["permeability"] > 0.0
    assert run_in_shell(f"{sys.executable} -m porefv info {scene.parent / 'results'} {output}", 1) == said
    assert run_in_shell(f"{sys.executable} -m porefv solve {scene} --force --quiet {output}", 0) == ""


def run_in_shell(command, status):
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True)
    assert done.returncode == status and done.stdout == ""
    return done.stderr


def test_an_output_of_few_characters_gets_what_it_knows(scene):
    environment = os.environ | {"PYTHONIOENCODING": "ascii"}
    assert r"permeability 0.000190292 m\xb2" in run("solve", scene, env=environment).stdout


# Names and texts of all kinds


def test_control_characters_are_shown_not_sent_to_the_terminal(tmp_path, capsys):
    name = "\x1b[31mred\x07\u202e.csv"
    shutil.copyfile(DATA / "packings" / "n25_s1.csv", tmp_path / name)
    scene = tmp_path / "\x1b[2J.toml"
    scene.write_text(
        f"packing = {json.dumps(name)}\n[walls]\nx_min = {{ pressure = 1.0 }}\nx_max = {{ pressure = 0.0 }}"
    )
    for arguments in (["check"], ["solve"], ["solve"]):
        main([*arguments, str(scene)])
    main(["info", str(tmp_path / "results")])
    main(["info", str(tmp_path / "no\x1b[1m")])
    with pytest.raises(SystemExit):
        main(["solve", "\x1b[1m", "\x1b[2m"])
    said = "".join(capsys.readouterr())
    assert r"\x1b[31mred\x07\u202e.csv" in said and r"\x1b[2J.toml" in said and r"no\x1b[1m" in said
    assert all(character.isprintable() or character == "\n" for character in said)


@pytest.mark.parametrize("long", ["[fluid]\n{} = 1", '[output]\nquantities = ["{}"]', '[output]\ndirectory = "{}"',
                                  '[{}]', "a = {}"])  # fmt: skip
def test_messages_are_bounded(scene, capsys, long):
    scene.write_text(scene.read_text().partition("[output]")[0] + long.format("k" * 1_000_000))
    assert main(["solve", str(scene)]) == 2
    said = capsys.readouterr().err
    assert 20 < len(said) < 2100 and "defect" not in said


@pytest.mark.parametrize("digits", [4000, 5000])
def test_numbers_of_thousands_of_digits_are_refused(scene, capsys, digits):
    scene.write_text(f"{scene.read_text()}[fluid]\nviscosity = {'9' * digits}\n")
    assert main(["solve", str(scene)]) == 2
    assert "scene.toml" in (said := capsys.readouterr().err) and len(said) < 400 and "defect" not in said


@pytest.mark.parametrize("command", ["solve", "check", "trade"])
def test_the_root_is_no_place_for_results(scene, capsys, command):
    scene.write_text(f'{scene.read_text()}directory = "/"\n')
    assert main([command, str(scene), *["--out", "/"] * (command == "trade")]) == 2
    assert "cannot write /: it is the root of the file system" in capsys.readouterr().err


def test_a_tilde_is_the_home_directory(scene, monkeypatch, capsys):
    monkeypatch.setenv("HOME", str(scene.parent / "home"))
    scene.write_text(f'{scene.read_text()}directory = "~/results"\n')
    assert main(["solve", str(scene), "--quiet"]) == 0
    assert (scene.parent / "home" / "results" / "summary.json").is_file()
    scene.write_text(scene.read_text().replace("~/", "~nobody_of_this_name/"))
    assert main(["solve", str(scene)]) == 2
    assert "the home directory in '~nobody_of_this_name/results' is not known" in capsys.readouterr().err


def test_a_path_with_a_line_break_is_refused(scene, capsys):
    assert main(["info", f"{scene.parent}\nporefv: done"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    scene.write_text(scene.read_text() + 'directory = "x\\ny"\n')
    assert main(["solve", str(scene)]) == 2
    assert "a line break stands in 'x\\ny'" in capsys.readouterr().err


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="a device without an end")
def test_a_scene_has_an_end(capsys):
    assert main(["solve", "/dev/zero"]) == 2
    assert "more than 64 MiB" in capsys.readouterr().err


@pytest.mark.skipif(os.name != "posix", reason="names of bytes")
def test_names_that_are_no_text(scene, capsys):
    folder = scene.parent / os.fsdecode(b"d\xff")
    folder.mkdir()
    (folder / "scene.toml").write_text(scene.read_text())
    assert main(["solve", str(folder / "scene.toml")]) == 0
    assert main(["info", str(folder / "results")]) == 0
    assert r"d\udcff" in capsys.readouterr().out


def test_numbers_of_a_summary_may_be_of_any_size(scene, capsys):
    main(["solve", str(scene), "--quiet"])
    path = scene.parent / "results" / "summary.json"
    for old in ("porosity", "inflow", "viscosity", "total"):
        summary = path.read_text()
        path.write_text(re.sub(rf'"{old}": [^,\n]+', f'"{old}": {10**400}', summary))
        assert main(["info", str(path.parent)]) in (0, 2)
        assert "defect" not in capsys.readouterr().err
        path.write_text(summary)


# Packing files, and walls with free space


def test_a_packing_file_is_described_checked_and_drawn(tmp_path, capsys):
    path = DATA / "packings" / "n200_s1.csv"
    assert main(["info", str(path)]) == 0
    said = capsys.readouterr().out
    for word in ("200, radii", "contacts", "porosity", "hidden spheres", "x_min", "reading"):
        assert word in said
    assert main(["check", str(path)]) == 0
    assert capsys.readouterr().out.endswith("no errors\n")
    assert main(["plot", str(path), "--out", str(tmp_path / "picture.png")]) == 0
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    header = "# box_lower = 0 0 0\n# box_upper = 1 1 1\nx,y,z,r\n"
    (tmp_path / "twice.csv").write_text(header + "0.5,0.5,0.5,0.1\n" * 2)
    assert main(["check", str(tmp_path / "twice.csv")]) == 2
    assert "one sphere lies within another" in capsys.readouterr().err


def test_free_space_is_told_and_taken_away(tmp_path, capsys):
    packing = Packing.read(DATA / "packings" / "n2000_s1.csv")
    packing.with_box(Box(packing.box.lower, packing.box.upper * [1, 1, 1.2])).write(tmp_path / "bed.csv")
    scene = tmp_path / "scene.toml"
    text = 'packing = "bed.csv"\n{}\n[walls]\nz_min = {{ pressure = 1.0 }}\nz_max = {{ pressure = 0.0 }}\n'
    scene.write_text(text.format(""))
    assert main(["check", str(scene)]) == 0
    assert "z_max: nearest sphere" in capsys.readouterr().err
    assert main(["solve", str(scene)]) == 0
    assert "free space between walls and grains" in capsys.readouterr().err
    summary = json.loads((tmp_path / "results" / "summary.json").read_text())
    assert [name for name, wall in summary["packing"]["walls"].items() if wall["free_space"]] == ["z_max"]
    assert 0.3 < summary["interior"]["porosity"] < 0.4 < summary["packing"]["porosity"]
    for box in ('box = "bed"', 'box = "fit"'):
        scene.write_text(text.format(box))
        assert main(["solve", str(scene), "--force"]) == 0
        assert capsys.readouterr().err == ""
    scene.write_text(text.format('box = "tight"'))
    assert main(["check", str(scene)]) == 2
    assert "unknown box 'tight'" in capsys.readouterr().err


def test_the_command_alone_says_what_to_do_first(capsys):
    assert main([]) == 0
    said = capsys.readouterr().out
    assert "porefv check packing.csv" in said
    assert max(map(len, said.splitlines())) <= 90


def test_a_mistyped_command_gets_a_suggestion(capsys):
    with pytest.raises(SystemExit):
        main(["slove", "scene.toml"])
    assert "did you mean 'solve'?" in capsys.readouterr().err


@pytest.mark.parametrize(
    "command", ["pack", "solve", "simulate", "reference", "trade", "check", "info", "plot", "export"]
)
def test_the_help_of_a_command_has_an_example_and_a_page_that_exists(command, capsys):
    with pytest.raises(SystemExit):
        main([command, "--help"])
    said = capsys.readouterr().out
    assert f"  porefv {command} " in said
    page = re.search(r"docs/(\w+\.md)", said)[1]
    assert (Path(__file__).parents[2] / "docs" / page).is_file()
