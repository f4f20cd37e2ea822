"""Pages of the site that are made from the source: public names by package, errors, and the help of the commands."""

import argparse
import importlib
import inspect
import os
from pathlib import Path

from porefv.cli import program

# Packages, each with its public names: those of `__all__`, or of these modules.
PACKAGES = {
    "porefv.packing": (), "porefv.tessellation": (), "porefv.mesh": (), "porefv.conductance": (), "porefv.solvers": (),
    "porefv.flow": (),
    "porefv.transport": (
        "diffusion.EffectiveDiffusion", "diffusion.effective_diffusion", "solute.Solute", "solute.Balance",
        "residence.Residence", "residence.residence_time", "residence.breakthrough", "residence.vessel_peclet",
    ),
    "porefv.fipy": (
        "fluid_mesh.FluidMesh", "flow_problem.FlowProblem", "pore_solver.PoreSolver", "pore_solver.use_pore_solver",
    ),
    "porefv.dem": (), "porefv.coupling": (), "porefv.export": (), "porefv.results": (), "porefv.scenes": (),
    "porefv.simulation": (), "porefv.resolved": (), "porefv.comparison": (),
}  # fmt: skip


def write(folder: Path) -> None:
    """Write the pages, and their index, into a folder; pages that would not change are left as they are."""
    folder.mkdir(exist_ok=True)
    listed = "\n   ".join([*PACKAGES, "porefv.errors"])
    pages = {"index": _titled("Docstrings", _INTRODUCTION + f".. toctree::\n   :maxdepth: 1\n\n   {listed}\n")}
    pages |= {package: _page(package, names) for package, names in PACKAGES.items()}
    pages["porefv.errors"] = _titled(
        "Errors and warnings: porefv.errors",
        ".. automodule:: porefv.errors\n   :members:\n   :show-inheritance:\n",
    )
    pages["commands"] = _titled("Commands", _commands())
    for name, text in pages.items():
        path = folder / f"{name}.rst"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


_INTRODUCTION = (
    "These pages are for users who write Python and know the name that they look for. After reading an entry you know "
    "the shapes, units and errors of the name, and have an example. Packages stand in the order in which data flow. "
    "The :doc:`Python interface </docs/api>` shows how they work together.\n\n"
)


def _page(package: str, names: tuple[str, ...]) -> str:
    module = importlib.import_module(package)
    parts = [f"{inspect.getdoc(module)}\n"]
    parts.append(
        f"This page is for users who call ``{package}``: it has the arguments and results of each public name.\n"
    )
    for name in names or sorted(module.__all__, key=str.lower):
        part, _, name = name.rpartition(".")
        home = importlib.import_module(f"{package}.{part}") if part else module
        found = getattr(home, name)
        path = f"{getattr(found, '__module__', None)}.{name}"
        if inspect.isclass(found) and found.__name__ == name:
            parts.append(f".. autoclass:: {path}\n   :members:\n   :undoc-members:\n")
        elif inspect.isfunction(found):
            parts.append(f".. autofunction:: {path}\n")
        else:
            parts.append(f".. data:: {home.__name__}.{name}\n\n   {_alias(found)}\n")
    return _titled(package, "\n".join(parts))


def _alias(found: object) -> str:
    return f"Another name of `{found.__module__}.{found.__name__}`." if inspect.isclass(found) else f"``{found!r}``"


def _commands() -> str:
    """The help of each command, as a terminal of 80 columns shows it."""
    os.environ["COLUMNS"] = "80"
    parser = program._parser()
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    introduction = (
        "This page is for users of the command line. After reading it you know each command with its options. It is "
        "what ``porefv COMMAND --help`` prints.\n"
    )
    parts = [introduction, _literal(parser.format_help())]
    for name, command in commands.choices.items():
        title = f"porefv {name}"
        parts += [f"{title}\n{'-' * len(title)}\n", _literal(command.format_help())]
    return "\n".join(parts)


def _literal(text: str) -> str:
    return ".. code-block:: text\n\n" + "".join(f"   {line}\n" if line else "\n" for line in text.splitlines())


def _titled(title: str, text: str) -> str:
    return f"{title}\n{'=' * len(title)}\n\n{text}"
