"""The import contract of pyproject.toml, docs/architecture.md, and the source say the same."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

grimp = pytest.importorskip("grimp")

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "porefv"
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
LAYERS, CIRCLES = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
    "contracts"
]
# From the top of the page to its end; the contract lists them the other way round.
FOLDERS = [name for name in reversed(LAYERS["layers"]) if name != "__main__"]


def test_the_page_lists_the_folders_in_the_order_of_the_contract():
    table = PAGE.split("## Folders")[1].split("## The contract")[0]
    assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == FOLDERS


def test_the_package_lists_the_folders_in_the_order_of_the_contract():
    listed = re.findall(r"^    (\w+) {2,}", ast.get_docstring(ast.parse((SOURCE / "__init__.py").read_text())), re.M)
    assert listed == FOLDERS


def test_every_folder_and_module_has_its_place():
    found = {path.stem for path in SOURCE.iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()}
    assert found - {"__init__", "__main__"} == set(FOLDERS)


def test_the_page_lists_the_exceptions_of_the_contract():
    table = PAGE.split("### Conveniences")[1].split("## How a packing")[0]
    listed = {" -> ".join(pair) for pair in re.findall(r"\| `(porefv\.[\w.]+)` \| `(porefv\.[\w.]+)` \|", table)}
    assert listed == set(CIRCLES["ignore_imports"])
    within = {line for line in listed if len({name.split(".")[1] for name in line.split(" -> ")}) == 1}
    assert set(LAYERS["ignore_imports"]) == listed - within


def test_the_exceptions_import_when_called():
    for line in CIRCLES["ignore_imports"]:
        importer, imported = line.split(" -> ")
        tree = ast.parse((SOURCE.parent / f"{importer.replace('.', '/')}.py").read_text(encoding="utf-8"))
        at_import = [node.module for node in tree.body if isinstance(node, ast.ImportFrom)]
        assert imported not in at_import, line


def test_imports_for_type_checkers_point_down_to_conveniences_only():
    with_types, without = (
        grimp.build_graph("porefv", exclude_type_checking_imports=exclude) for exclude in (False, True)
    )
    allowed = {tuple(line.split(" -> ")) for line in CIRCLES["ignore_imports"]}
    place = {name: k for k, name in enumerate(FOLDERS)}
    down = []
    for importer in with_types.modules:
        for imported in with_types.find_modules_directly_imported_by(importer) - (
            without.find_modules_directly_imported_by(importer)
        ):
            a, b = (f"{name}.".split(".")[1] for name in (importer, imported))
            if a in place and place[b] > place[a] and (importer, imported) not in allowed:
                down.append((importer, imported))
    assert down == []


def names_of(module):
    """Top-level names of a module of the package, submodules included."""
    base = SOURCE.parent / module.replace(".", "/")
    file = base.with_suffix(".py") if base.with_suffix(".py").exists() else base / "__init__.py"
    names = {path.stem for path in base.glob("*")} if base.is_dir() else set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.ImportFrom | ast.Import):
            names.update(alias.asname or alias.name for alias in node.names)
    return names


@pytest.mark.parametrize("folder", ["src", "tests", "benchmarks", "docs"])
def test_what_is_imported_from_the_package_exists(folder):
    # A linter takes what the package's __getattr__ gives for granted.
    missing = [
        f"{path.relative_to(ROOT)}:{node.lineno}: {node.module}.{alias.name}"
        for path in sorted((ROOT / folder).rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and f"{node.module}.".startswith("porefv.")
        for alias in node.names
        if alias.name not in names_of(node.module)
    ]
    assert missing == []


def test_tests_use_no_private_names():
    private = re.compile(r"(?<!self)(?<!cls)\._(?!_)[a-z]\w*|import _[a-z]\w*")
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in sorted((ROOT / "tests").rglob("*.py"))
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if private.search(line) and path != Path(__file__)
    ]
    assert found == []
