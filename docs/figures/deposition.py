"""The pictures of the immersed deposition of 500 grains in docs/simulate.md and docs/coupling.md, of one run.

docs/img/deposition.png by `porefv plot`, and docs/img/deposition.gif, an animation of its frames: the grains, coloured
by the speed at which they sink, beside the pressure and the effective stress.

python docs/figures/deposition.py [--results DIRECTORY]

A run takes about 15 minutes on one core. `--results` takes one that there is: it needs `frames` and `profiles` of the
same interval.
"""

from __future__ import annotations

import argparse
import io
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from small_png import FOLDER, shrink

from porefv import simulation
from porefv.cli import main as porefv
from porefv.export.picture_style import INK, SPEEDS, PictureSize, new_figure, style
from porefv.export.rendering import Projection, View, load_pyvista
from porefv.packing.box import Box
from porefv.scenes import SimulationScene
from porefv.simulation.run_record import read_record

SCENES = Path(__file__).resolve().parents[2] / "data" / "scenes"
# Interval between profiles, and between frames [s].
INTERVAL = 1.0
SIZE = PictureSize(500, 500, 90.0)
# Part of the width that the grains take.
GRAINS = 0.46
FRAMES, COLOURS, MILLISECONDS = 42, 48, 150


def simulated(folder: Path) -> Path:
    """Results of deposition_500.toml, with frames."""
    data = tomllib.loads((SCENES / "deposition_500.toml").read_text(encoding="utf-8"))
    data["output"] |= {"directory": str(folder / "deposition_500"), "frames": INTERVAL, "profiles": INTERVAL}
    return simulation.run(SimulationScene.from_mapping(data, directory=SCENES))


class Course:
    """What is drawn of a run.

    Parameters
    ----------
    results : Path
    """

    def __init__(self, results: Path):
        scene = SimulationScene.from_record(read_record(results).scene)
        assert scene.fluid is not None
        self._pyvista = load_pyvista()
        self._profiles = simulation.read_profiles(results)
        self._times = np.unique(self._profiles["time"])[1:]
        self._frames = {float(grains["time"][0]): grains for grains in self._read(results / "frames")}
        first = self._frames[min(self._frames)]
        self._box = Box(first["box_lower"], first["box_upper"])
        radius, weight = float(first["radius"].mean()), (scene.material.density - scene.fluid.density) * 9.81
        # Speed of a grain alone [m/s], and weight of all grains, less their buoyancy, on the floor [Pa].
        self._stokes = 2.0 / 9.0 * weight * radius**2 / scene.fluid.viscosity
        self._load = weight * (4.0 / 3.0 * np.pi * first["radius"] ** 3).sum() / self._box.section(2)

    def _read(self, folder: Path) -> list[Any]:
        return [self._pyvista.read(path) for path in sorted(folder.glob("grains_*.vtp"))]

    def times(self) -> np.ndarray:
        """Times of the frames: close at first, when most moves [s]."""
        known = np.array([time for time in self._times if min(abs(t - time) for t in self._frames) < 1e-9 * time])
        chosen = np.unique(np.round((len(known) - 1) * np.linspace(0.0, 1.0, FRAMES) ** 1.2).astype(int))
        return known[chosen]

    def picture(self, time: float) -> Image.Image:
        """The grains and the stresses at a time."""
        image = self._grains(time)
        with style():
            figure = new_figure(SIZE)
            figure.figimage(image, 0, 0, origin="upper", zorder=-1)
            self._stresses(figure.add_axes((GRAINS + 0.13, 0.2, 0.82 - GRAINS, 0.68)), time)
            scale = figure.add_axes((0.06, 0.075, GRAINS - 0.08, 0.016))
            scale.imshow(np.linspace(0.0, 1.0, 256)[None], aspect="auto", cmap=SPEEDS, extent=(0.0, 0.6, 0.0, 1.0))
            scale.set_yticks([])
            scale.set_xlabel("speed / speed of a grain alone", labelpad=2.0)
            figure.text(0.5, 0.95, f"{time:.0f} s", ha="center")
            buffer = io.BytesIO()
            figure.savefig(buffer, format="png", dpi=figure.dpi)
        return Image.open(buffer).convert("RGB")

    def _grains(self, time: float) -> np.ndarray:
        """(h, w, 3) image of the grains."""
        pv, grains = self._pyvista, self._frames[min(self._frames, key=lambda t: abs(t - time))]
        view, size = View(self._box, 2), PictureSize(int(GRAINS * SIZE.width), SIZE.height, SIZE.dpi)
        plotter = pv.Plotter(off_screen=True, window_size=(size.width, size.height))
        plotter.set_background("white")
        centres = pv.PolyData(view.place(grains.points))
        centres["radius"] = grains["radius"] / view.scale
        centres["speed"] = np.linalg.norm(grains["velocity"], axis=1) / self._stokes
        ball = pv.Sphere(radius=1.0, theta_resolution=20, phi_resolution=20)
        balls = centres.glyph(scale="radius", geom=ball, orient=False)
        look = {"scalars": "speed", "cmap": SPEEDS, "clim": [0.0, 0.6], "show_scalar_bar": False}
        plotter.add_mesh(balls, smooth_shading=True, ambient=0.3, **look)
        edges = pv.Box(np.stack([-view.half, view.half], axis=1).ravel()).extract_all_edges()
        plotter.add_mesh(edges, color=INK, line_width=1.0, lighting=False)
        corners = np.array([view.corner(*(2.0 * np.array(k) - 1.0)) for k in np.ndindex(2, 2, 2)])
        Projection(view, corners, size, (0.04, 0.98, 0.13, 0.93)).aim(plotter)
        image = plotter.screenshot(return_img=True)
        plotter.close()
        return np.asarray(image)

    def _stresses(self, ax: Any, time: float) -> None:
        layers = self._profiles[self._profiles["time"] == time]
        height = 0.5 * (layers["lower"] + layers["upper"])
        ax.plot(layers["total_stress"] / self._load, height, color=INK, lw=3.0, alpha=0.25, label="total stress")
        ax.plot(layers["pressure"] / self._load, height, ".-", color="tab:blue", label="pressure")
        ax.plot(layers["effective_stress"] / self._load, height, ".-", color="tab:orange", label="effective stress")
        ax.set_xlim(-0.03, 1.05)
        ax.set_ylim(self._box.lower[2], self._box.upper[2])
        ax.set_xlabel("stress / weight on the floor")
        ax.set_ylabel("height, m")
        ax.grid(alpha=0.3)
        ax.legend(loc="upper right")


def animate(results: Path, path: Path) -> None:
    """Write the animation of a run; its frames share their colours."""
    course = Course(results)
    pictures = [course.picture(time) for time in course.times()]
    few = Image.new("RGB", (SIZE.width, 4 * SIZE.height))
    for k in range(4):
        few.paste(pictures[k * (len(pictures) - 1) // 3], (0, k * SIZE.height))
    palette = few.quantize(COLOURS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    first, *others = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures)
    durations = [MILLISECONDS] * len(others) + [3000]
    first.save(path, save_all=True, append_images=others, duration=durations, loop=0, optimize=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--results", type=Path, help="a run of deposition_500.toml with frames")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        results = options.results or simulated(Path(folder))
        picture = Path(folder) / "deposition.png"
        if status := porefv(["plot", str(results), "--out", str(picture)]):
            return status
        shrink(picture, FOLDER / "deposition.png", Image.Quantize.MEDIANCUT)
        animate(results, FOLDER / "deposition.gif")
    return 0


if __name__ == "__main__":
    sys.exit(main())
