"""What `porefv info` and `porefv check` say of a packing file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from porefv.cli.text import count_text, path_text, range_text, rows_text, vector_text

if TYPE_CHECKING:
    from porefv.packing.packing import Packing

# Spheres count as in contact if they are closer than this part of the smallest radius.
_CONTACT = 1e-3


def is_packing_file(path: Path) -> bool:
    """Whether a path is a file that is no scene."""
    return path.is_file() and path.suffix.lower() != ".toml"


def packing_text(packing: Packing, path: Path) -> str:
    """Number, sizes, box, porosity, contacts and walls of a packing."""
    from porefv.packing.free_space import wall_layers
    from porefv.packing.neighbours import neighbour_pairs

    radii, box = packing.radii, packing.walled_box
    pairs = neighbour_pairs(packing.centres, radii, _CONTACT * float(radii.min()))
    overlapping = len(packing.overlaps.pairs)
    around = packing.bounding_box
    corners = (
        "none: a scene must give one" if box is None else f"{vector_text(box.lower)} to {vector_text(box.upper)} m"
    )
    per_sphere = f"{2 * len(pairs) / len(packing):.2f} a sphere"
    rows: list[tuple[str, Any]] = [
        ("reading", packing.reading),
        ("spheres", f"{count_text(len(packing))}, radii {range_text(radii)} m, mean {radii.mean():.4g} m"),
        ("bounds", f"{vector_text(around.lower)} to {vector_text(around.upper)} m"),
        ("box", corners),
        ("contacts", f"{count_text(len(pairs))} (closer than {_CONTACT:g} of the smallest radius), {per_sphere}"),
        ("overlaps", f"{count_text(overlapping)} pairs, {count_text(packing.triple_overlaps)} triples"),
    ]
    if overlapping:
        deepest = packing.overlaps.depths / radii[packing.overlaps.pairs].min(axis=1)
        rows.append(("deepest overlap", f"{deepest.max():.3g} of the smaller radius"))
    if box is not None:
        rows.append(("porosity", f"{packing.porosity:.6g}"))
        for layer in wall_layers(packing):
            text = f"nearest sphere {layer.gap:.3g} m away"
            if layer.gap <= 0.0:
                text = f"a sphere reaches {-layer.gap:.3g} m beyond it"
            if not math.isnan(layer.porosity):
                text += f", porosity {layer.porosity:.3f} along the wall, {layer.inside:.3f} inside"
            rows.append((layer.wall, text + (": FREE SPACE" if layer.free else "")))
    return "\n".join([path_text(path), *rows_text(rows)])


def hidden_row(packing: Packing) -> str:
    """How many spheres are hidden within the union of others, which takes the triangulation."""
    from porefv.mesh.cell_mesh import CellMesh

    hidden = len(CellMesh(packing, wall_tolerance=math.inf).triangulation.hidden)
    return "\n".join(rows_text([("hidden spheres", count_text(hidden))]))
