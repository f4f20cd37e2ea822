"""README and docs are true: their Python runs, commands say what is printed, scenes are valid, links lead somewhere.

Links lead to files, to headings (`page.md#heading`), to numbered equations (`#eq-name`), and to public names
(`#porefv.flow.forces.grain_forces`), which the site finds on the pages made from docstrings.
"""

import contextlib
import importlib
import importlib.util
import io
import os
import re
import shlex
import shutil
import tomllib
from functools import cache
from pathlib import Path

import pytest

from porefv import cli
from porefv.scenes.flow_scene import FlowScene

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "data/README.md")]
PAGES += sorted((ROOT / "docs").glob("*.md"))
WITH_LINKS = [*PAGES, *sorted((ROOT / "tutorials").glob("*.md"))]
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?: \d{3}\b)*(?:\.\d+)?(?:e[-+]?\d+)?")
# Names of the numbered equations of all pages.
EQUATION_LABELS = [
    name for page in PAGES for name in re.findall(r"^\$\$ \((.+)\)$", page.read_text(encoding="utf-8"), re.MULTILINE)
]
EQUATIONS = set(EQUATION_LABELS)

# What a scene in data/scenes needs at least; examples that show a table or two are laid over it.
LEAST = {"packing": "../packings/n25_s1.csv", "walls": {"y_min": {"pressure": 1.0}, "y_max": {"pressure": 0.0}}}


def blocks(page, *languages):
    """(language, text) of each fenced block; all of them, or those in the languages given."""
    found = re.findall(r"^```(\w*)\n(.*?)^```$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    return [block for block in found if not languages or block[0] in languages]


def pages_with(*languages):
    return [pytest.param(page, id=page.name) for page in PAGES if blocks(page, *languages)]


@pytest.fixture
def working_directory(tmp_path, monkeypatch):
    """A copy of the data, to stand and write in."""
    shutil.copytree(ROOT / "data", tmp_path / "data", ignore=shutil.ignore_patterns("results"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def assert_says(printed, expected):
    """The same words; the same numbers up to rounding, times apart. A line of ... stands for any lines."""
    lines = [line.rstrip() for line in printed.strip().splitlines()]
    skipping = False
    for line in expected.strip().splitlines():
        if line.strip() == "...":
            skipping = True
            continue
        while skipping and lines and not same(lines[0], line):
            lines.pop(0)
        skipping = False
        assert lines, f"not printed: {line}"
        assert same(lines[0], line), f"printed: {lines[0]}\nexpected: {line}"
        lines.pop(0)
    assert skipping or not lines, f"printed besides: {lines}"


def same(printed, expected):
    words = [re.sub(r"\d+\.\d+(?= s\b)", "T", text) for text in (printed, expected)]
    numbers = [[float(x.replace(" ", "")) for x in NUMBER.findall(text)] for text in words]
    texts = [" ".join(NUMBER.sub("#", text).split()) for text in words]
    # Two per cent covers a last digit that rounds the other way; what is rounding itself need only be small.
    return texts[0] == texts[1] and all(
        a == pytest.approx(b, rel=0.02, abs=0.0) or max(abs(a), abs(b)) < 1e-10 for a, b in zip(*numbers, strict=True)
    )


@pytest.mark.parametrize("page", pages_with("python"))
def test_python_runs_and_prints_what_the_page_says(page, working_directory):
    (working_directory / "docs" / "img").mkdir(parents=True)
    namespace = {"__name__": "__docs__"}
    previous, printed = "", ""
    for language, text in blocks(page):
        if language == "python":
            output = io.StringIO()
            with contextlib.redirect_stdout(output):
                exec(compile(text, str(page), "exec"), namespace)
            printed = output.getvalue()
        elif language == "text" and previous == "python":
            assert_says(printed, text)
        previous = language


@pytest.mark.parametrize("page", pages_with("console"))
def test_commands_print_what_the_page_says(page, working_directory, capsys):
    """Blocks in `console`: lines that start with $ are commands, the others what they print."""
    for _, text in blocks(page, "console"):
        for command, _, expected in (part.partition("\n") for part in text.split("$ ")[1:]):
            program, *arguments = shlex.split(command)
            assert program == "porefv"
            assert cli.main(arguments) == 0, capsys.readouterr().err
            assert_says(capsys.readouterr().out, expected)


@pytest.mark.parametrize("page", pages_with("toml"))
def test_scenes_are_valid(page):
    for _, text in blocks(page, "toml"):
        FlowScene.from_mapping(LEAST | tomllib.loads(text), directory=ROOT / "data" / "scenes")


@pytest.mark.parametrize("name", ["quickstart.md", "formats.md"])
def test_a_scene_that_a_page_shows_as_a_file_is_that_file(name):
    text = (ROOT / "docs" / name).read_text(encoding="utf-8")
    shown = re.findall(
        r"This is\s\[`data/scenes/(\w+\.toml)`\].{,300}?```toml\n(.*?)^```$", text, re.MULTILINE | re.DOTALL
    )
    assert shown
    for file, scene in shown:
        assert tomllib.loads(scene) == tomllib.loads((ROOT / "data" / "scenes" / file).read_text(encoding="utf-8"))


@pytest.mark.parametrize("page", sorted((ROOT / "docs").glob("*.md")), ids=lambda page: page.name)
def test_the_first_paragraph_says_who_a_page_is_for(page):
    paragraph = " ".join(page.read_text(encoding="utf-8").split("\n\n")[1].split())
    if page.name == "index.md":  # the entrance, which leads to the others
        assert "This site is for" in paragraph
    else:
        assert re.match(
            r"(This page is|These pages are) for .* After (each section|reading (it|them|an entry)),? you", paragraph
        )


@pytest.mark.parametrize("page", WITH_LINKS, ids=lambda page: page.name)
def test_relative_links_lead_somewhere(page):
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        if not path and anchor.startswith("eq-"):
            assert anchor in EQUATIONS, f"{page.name} links to {target}, which no equation of a page is called"
            continue
        if not path and anchor.startswith("porefv."):
            assert is_public(anchor), f"{page.name} links to {target}, which no page made from docstrings has"
            continue
        goal = (page.parent / path).resolve() if path else page
        assert goal.exists(), f"{page.name} links to {target}"
        if anchor:
            assert anchor in anchors(goal), f"{page.name} links to {target}"


def anchors(page):
    """The ids of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def is_public(path):
    """Whether the pages made from docstrings have a name, or a member of a class among them."""
    home = next((name for name in public_names() if path == name or path.startswith(f"{name}.")), None)
    if home is None:
        return False
    found = public_names()[home]
    for member in path[len(home) + 1 :].split(".") if path != home else ():
        found = None if member.startswith("_") else getattr(found, member, None)
    return found is not None


@cache
def public_names():
    """What each public name stands for, by the path that the site has it under."""
    specification = importlib.util.spec_from_file_location("api_pages", ROOT / "docs" / "api_pages.py")
    api_pages = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(api_pages)
    named = {}
    for package, names in api_pages.PACKAGES.items():
        for name in names or importlib.import_module(package).__all__:
            part, _, name = name.rpartition(".")
            found = getattr(importlib.import_module(f"{package}.{part}" if part else package), name)
            named[f"{getattr(found, '__module__', package)}.{name}"] = found
    return named


def test_each_equation_has_a_name_of_its_own():
    assert len(EQUATION_LABELS) == len(EQUATIONS) > 0


def test_docstrings_and_numbered_equations_name_each_other():
    """A docstring names an equation as `:eq:`; each equation is named by that of the function which computes it."""
    source = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "src").rglob("*.py"))
    assert set(re.findall(r":eq:`([^`]+)`", source)) == EQUATIONS


def test_continuous_integration_runs_the_command_of_the_readme():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    commands = [text.strip() for _, text in blocks(ROOT / "README.md", "sh")]
    assert any("pytest" in command and command in script for command in commands)
    assert os.access(ROOT / ".ci" / "run", os.X_OK)


def test_the_gallery_has_every_picture_and_the_script_that_made_it():
    text = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    made = re.findall(r"img/([\w.]+)\).*?\]\(\.\./[\w/]+\.py\)", text)
    assert sorted(made) == sorted(path.name for path in (ROOT / "docs" / "img").iterdir())
