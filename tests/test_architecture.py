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
LAYERS, CIRCLES, *_ = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
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


def test_tests_have_the_folders_of_the_source():
    folders = {path.name for path in SOURCE.iterdir() if (path / "__init__.py").exists()}
    assert folders <= {path.name for path in (ROOT / "tests").iterdir()}


def test_the_page_lists_the_exceptions_of_the_contract():
    table = PAGE.split("### Conveniences")[1].split("### Types")[0]
    listed = {" -> ".join(pair) for pair in re.findall(r"\| `(porefv\.[\w.]+)` \| `(porefv\.[\w.]+)` \|", table)}
    assert listed == set(CIRCLES["ignore_imports"])
    within = {line for line in listed if len({name.split(".")[1] for name in line.split(" -> ")}) == 1}
    assert set(LAYERS["ignore_imports"]) == listed - within


def imports_at_once(tree):
    """Modules that a module imports when it is imported itself, unless for type checkers only."""
    nodes = list(tree.body)
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.ImportFrom):
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            nodes += node.orelse
        elif not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            nodes += ast.iter_child_nodes(node)


def test_the_exceptions_import_when_called():
    for line in CIRCLES["ignore_imports"]:
        importer, imported = line.split(" -> ")
        tree = ast.parse((SOURCE.parent / f"{importer.replace('.', '/')}.py").read_text(encoding="utf-8"))
        assert imported not in set(imports_at_once(tree)), line


def test_imports_for_type_checkers_make_no_circle_that_the_page_does_not_list():
    table = PAGE.split("### Types")[1].split("## How a packing")[0]
    listed = set(re.findall(r"\| `(porefv\.[\w.]+)` \| `(porefv\.[\w.]+)` \|", table))
    with_types, without = (
        grimp.build_graph("porefv", exclude_type_checking_imports=exclude) for exclude in (False, True)
    )
    for line in CIRCLES["ignore_imports"]:
        importer, imported = line.split(" -> ")
        with_types.remove_import(importer=importer, imported=imported)
    circles = {
        (importer, imported)
        for importer in with_types.modules
        for imported in with_types.find_modules_directly_imported_by(importer)
        - without.find_modules_directly_imported_by(importer)
        if with_types.find_shortest_chain(importer=imported, imported=importer)
    }
    assert circles == listed


def test_no_module_imports_the_package_itself_or_a_module_by_its_text():
    # Neither is seen by the contract: the package reaches everything.
    graph = grimp.build_graph("porefv")
    assert graph.find_modules_that_directly_import("porefv") == set()
    by_text = re.compile(r"import_module\(|__import__\(")
    found = [path.relative_to(SOURCE) for path in SOURCE.rglob("*.py") if by_text.search(path.read_text("utf-8"))]
    assert {path.name for path in found} == {
        "lazy_exports.py", "optional_imports.py",
        "kernel_build.py", "kernel_types.py",  # names that are recorded in a file
    }  # fmt: skip


def names_of(module):
    """Top-level names of a module of the package, submodules included."""
    base = SOURCE.parent / module.replace(".", "/")
    file = base.with_suffix(".py") if base.with_suffix(".py").exists() else base / "__init__.py"
    names = {path.stem for path in base.glob("*")} if base.is_dir() else set()
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.ImportFrom | ast.Import):
            names.update(alias.asname or alias.name for alias in node.names)
        elif isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            names.update(ast.literal_eval(node.value))
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
    private = re.compile(r"(?<!self)(?<!cls)(?<!os)\._(?!_)[a-z]\w*|import _[a-z]\w*")
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in sorted((ROOT / "tests").rglob("*.py"))
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if private.search(line) and path != Path(__file__)
    ]
    assert found == []
