"""The picture of docs/architecture.md: the folders of the package, in the order of the import contract.

    python docs/figures/architecture.py

The order comes from pyproject.toml, the arrows from the imports of the source (read by grimp, which comes with
import-linter). Matplotlib draws them to docs/img/architecture.png.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import grimp
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from porefv.export.picture_style import style

ROOT = Path(__file__).resolve().parents[2]
# What each folder gives to those below it.
GIVES = {
    "errors": "all errors",
    "system": "kernels, threads, memory, files",
    "packing": "spheres, box, overlaps, files",
    "tessellation": "exact regular triangulation",
    "mesh": "cells, facets, throats, pores",
    "conductance": "flow of a throat: models",
    "solvers": "pressures of a network",
    "flow": "pressure, fluxes, forces",
    "transport": "diffusion in the pores",
    "fipy": "the fluid as a FiPy mesh",
    "dem": "grains that move",
    "coupling": "grains and fluid together",
    "export": "VTK, meshio, pictures",
    "results": "results directories",
    "scenes": "scene files",
    "simulation": "runs in stages",
    "resolved": "resolved Stokes flow",
    "comparison": "error against time",
    "cli": "the command porefv",
}
GROUPS = {
    "errors": "#e6e6e6", "system": "#e6e6e6",
    "packing": "#fbe3c0", "tessellation": "#fbe3c0", "mesh": "#fbe3c0",
    "conductance": "#cfe3f5", "solvers": "#cfe3f5", "flow": "#cfe3f5", "transport": "#cfe3f5",
    "fipy": "#cfe3f5",
    "dem": "#d8ecd0", "coupling": "#d8ecd0",
    "export": "#eadcf0", "results": "#eadcf0", "scenes": "#eadcf0", "simulation": "#eadcf0",
    "resolved": "#f5d5d5", "comparison": "#f5d5d5", "cli": "#e6e6e6",
}  # fmt: skip
# Imported by nearly all; left out of the arrows.
EVERYWHERE = ("errors", "system")


def main() -> None:
    contract = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ][0]
    folders = [name for name in reversed(contract["layers"]) if name in GIVES]
    exceptions = {tuple(line.split(" -> ")) for line in contract["ignore_imports"]}
    graph = grimp.build_graph("porefv", exclude_type_checking_imports=True)
    down, up = set(), set()
    for importer in graph.modules:
        for imported in graph.find_modules_directly_imported_by(importer):
            a, b = (f"{name}.".split(".")[1] for name in (importer, imported))
            if a != b and a in GIVES and b in GIVES:
                (up if (importer, imported) in exceptions else down).add((a, b))

    with style():
        figure, axes = plt.subplots(figsize=(9.5, 9.5), layout="constrained")
    place = {name: -k for k, name in enumerate(folders)}
    for name, y in place.items():
        axes.add_patch(
            FancyBboxPatch(
                (0, y - 0.34), 4.4, 0.68, boxstyle="round,pad=0.02", facecolor=GROUPS[name], edgecolor="#555555"
            )
        )
        axes.text(0.12, y, name, va="center", weight="bold", fontsize=11)
        axes.text(1.62, y, GIVES[name], va="center", fontsize=9.5)
    for importer, imported in sorted(essential({edge for edge in down if edge[1] not in EVERYWHERE})):
        arrow(axes, place[importer], place[imported], 4.45, "#4477aa", 1.2, side=1)
    for importer, imported in sorted(up):
        arrow(axes, place[importer], place[imported], -0.05, "#cc3311", 1.5, side=-1)
    top, bottom = 0.9, min(place.values()) - 0.9
    axes.text(4.6, top, "imports", color="#4477aa", fontsize=11)
    axes.text(-0.2, top, "conveniences", color="#cc3311", fontsize=11, ha="right")
    axes.set_xlim(-2.2, 7.2)
    axes.set_ylim(bottom, top + 0.5)
    axes.axis("off")
    figure.savefig(ROOT / "docs" / "img" / "architecture.png", dpi=110)


def essential(edges: set[tuple[str, str]]) -> set[tuple[str, str]]:
    """The edges that do not follow from others: a -> c follows from a -> b and b -> c."""
    reached: dict[str, set[str]] = {}

    def reach(name: str) -> set[str]:
        if name not in reached:
            nexts = {b for a, b in edges if a == name}
            reached[name] = nexts.union(*map(reach, nexts))
        return reached[name]

    return {(a, b) for a, b in edges if not any(b in reach(c) for d, c in edges if d == a and c != b)}


def arrow(axes, begin: float, end: float, x: float, colour: str, width: float, side: int) -> None:
    """A bow beside the boxes, wider the further it reaches."""
    bend = 0.55 if abs(begin - end) > 1 else 0.9
    axes.add_patch(
        FancyArrowPatch(
            (x, begin), (x, end), connectionstyle=f"arc3,rad={side * bend * (1 if end > begin else -1)}",
            arrowstyle="-|>", mutation_scale=9, color=colour, linewidth=width, alpha=0.75,
        )
    )  # fmt: skip


if __name__ == "__main__":
    main()
