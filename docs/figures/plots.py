"""The pictures of docs/plot.md, docs/simulate.md and docs/quantities.md, and docs/img/n2000.png, by `porefv plot`.

python docs/figures/plots.py [NAME ...]

Without names, all are drawn; the oedometer takes minutes. The sizes are such that letters can be read at half size.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from small_png import FOLDER, shrink

from porefv.cli import main as porefv

SCENES = Path(__file__).resolve().parents[2] / "data" / "scenes"
PLOTS = {
    "n2000": ("n2000",),
    "plot_network": ("n2000", "--what", "network"),
    "plot_throats": ("n2000", "--what", "throats"),
    "plot_section": ("n2000", "--what", "section"),
    "plot_velocity": ("n2000", "--what", "velocity"),
    "plot_paths": ("n25", "--what", "paths"),
    "plot_sc8": ("sc8", "--what", "network"),
    "oedometer": ("oedometer",),
    "quantities_profile": ("quantities", "--what", "profile"),
    "quantities_pore_sizes": ("quantities", "--what", "pore_sizes"),
    "quantities_constriction_sizes": ("quantities", "--what", "constriction_sizes"),
}


def main(names: list[str]) -> int:
    plots = {name: PLOTS[name] for name in names or PLOTS}
    with tempfile.TemporaryDirectory() as folder:
        for scene in {scene for scene, *_ in plots.values()}:
            command = "simulate" if scene == "oedometer" else "solve"
            if status := porefv([command, str(SCENES / f"{scene}.toml"), "--force", "--quiet"]):
                return status
        for name, (scene, *options) in plots.items():
            path = Path(folder) / f"{name}.png"
            size = [] if scene == "oedometer" else ["--size", "1200x900", "--dpi", "180"]
            if status := porefv(["plot", str(SCENES / "results" / scene), "--out", str(path), *options, *size]):
                return status
            shrink(path, FOLDER / f"{name}.png")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
