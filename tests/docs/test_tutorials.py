"""Each notebook says for whom it is, has exercises with solutions that run, and asserts on its numbers.

The site runs the notebooks (`sphinx-build`, see CONTRIBUTING.md): one that fails fails the site.
"""

import re
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "tutorials"
NOTEBOOKS = sorted(path for path in FOLDER.glob("*.md") if path.name != "README.md")
COURSE = [path for path in NOTEBOOKS if re.match(r"\d", path.name)]


def cells(path):
    """(tags, source) of each code cell."""
    text = path.read_text(encoding="utf-8")
    found = re.findall(r"^```\{code-cell\}[^\n]*\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    tags = [re.match(r":tags: \[(.*)\]\n", cell) for cell in found]
    return [(set(tag[1].split(", ")) if tag else set(), cell) for tag, cell in zip(tags, found, strict=True)]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_text_that_jupytext_opens_and_says_for_whom_it_is(path):
    head, _, text = path.read_text(encoding="utf-8").removeprefix("---\n").partition("\n---\n")
    assert "format_name: myst" in head
    assert "name: python3" in head
    title, paragraph = text.strip().split("\n\n")[:2]
    assert title.startswith("# ")
    paragraph = " ".join(paragraph.split())
    assert re.match(r"\*\*For\*\* .*\*\*Afterwards\*\* .*minutes to read, .*s to run", paragraph)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_asserts_on_its_numbers(path):
    assert any("remove-cell" in tags and "assert" in source for tags, source in cells(path))


@pytest.mark.parametrize("path", COURSE, ids=lambda path: path.stem)
def test_exercises_have_solutions_that_run(path):
    text = path.read_text(encoding="utf-8").partition("\n## Exercises\n")[2]
    exercises = re.split(r"^### Exercise \d", text, flags=re.MULTILINE)[1:]
    assert 3 <= len(exercises) <= 5
    assert all(":tags: [hide-cell]" in exercise for exercise in exercises)


def test_the_list_of_the_course_has_every_notebook():
    listed = re.findall(r"^(\w+)$", (FOLDER / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert set(listed) == {path.stem for path in NOTEBOOKS}
