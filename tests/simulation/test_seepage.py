"""Upward seepage through a settled bed: the floor bears what the fluid does not."""

from pathlib import Path

import numpy as np
import pytest

from porefv import Packing
from porefv.scenes.simulation_scene import SimulationScene
from porefv.simulation import read_series, run

BED = Path(__file__).parents[1] / "packing" / "cases" / "bed_settled.csv"
DENSITY, FLUID_DENSITY, GRAVITY = 2600.0, 1000.0, 9.81


# The stress swings about its mean for as long as the bed moves: half loads need a long mean.
@pytest.mark.parametrize(("ratio", "duration", "within"), [(0.5, 0.15, 0.02), (0.9, 0.03, 0.03), (1.2, 0.03, 0.05)])
def test_the_floor_bears_the_buoyant_weight_less_the_seepage_force(tmp_path, ratio, duration, within):
    bed = Packing.read(BED)
    weight = (4 / 3 * np.pi * bed.radii**3).sum() * (DENSITY - FLUID_DENSITY) * GRAVITY / bed.box.section(2)
    scene = {
        "packing": str(BED),
        "gravity": [0.0, 0.0, -GRAVITY],
        "material": {"young": 5e6, "density": DENSITY},
        "fluid": {"viscosity": 0.1, "density": FLUID_DENSITY},
        "walls": {"z_min": {"pressure": ratio * weight}, "z_max": {"pressure": 0.0}, "lateral": {"slip": True}},
        "stages": [{"duration": duration}],
        "output": {"directory": str(tmp_path / "results"), "axis": "z"},
    }
    series = read_series(run(SimulationScene.from_mapping(scene)))
    last = series["contact_stress_z_min"][-len(series) // 2 :].mean() / weight
    assert last == pytest.approx(max(0.0, 1.0 - ratio), abs=within)
    assert np.nanmax(series["momentum_residual"]) < 1e-10
