"""Stress and strain of grains in a sample that consolidates: effective stress + pressure = total (C14 fig. 10).

The oedometer of benchmarks/consolidation.py, looked at from within: at some time factors, layer by layer, the fluid's
pressure, the increment of the grains' stress, and their strain since the load came. Beside the strain is that of the
same layer of the dry sample at the same stress: it is loaded in steps, slowly, from rest to rest.

    python benchmarks/micromechanics.py --grains 2000 --out docs/img/micromechanics.png
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from consolidation import CONFINEMENT, DRAINED, VISCOSITY, permeability, sample

from porefv.conductance.registry import AUTO
from porefv.coupling.consolidation import terzaghi_pressure
from porefv.coupling.coupling import Coupling
from porefv.coupling.micromechanics import grain_strains, grain_stresses, layer_means
from porefv.dem.dem import DEM
from porefv.dem.plate import Plate
from porefv.export.picture_style import PictureSize, new_figure, style
from porefv.flow.fluid import Fluid
from porefv.mesh.pore_mesh import PoreMesh

Z = 2
STEPS = np.array([0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0])  # of the dry sample's load
SLOW = 0.002  # speed of the plate on dry grains, slow enough not to throw them about [m/s]
INNER = slice(1, -1)  # layers that are not on a plate


@dataclass
class Start:
    """The sample before the load: what displacements and stresses are measured from."""

    mesh: PoreMesh
    places: np.ndarray
    stress: np.ndarray
    edges: np.ndarray

    @classmethod
    def of(cls, dem: DEM, layers: int) -> Start:
        mesh = PoreMesh(dem.packing)
        edges = np.linspace(dem.box.lower[Z], dem.box.upper[Z], layers + 1)
        return cls(mesh, dem.places.copy(), vertical_stress(dem, mesh), edges)

    @property
    def middles(self) -> np.ndarray:
        """Of the layers, as parts of the height."""
        middles = 0.5 * (self.edges[1:] + self.edges[:-1]) - self.edges[0]
        return middles / (self.edges[-1] - self.edges[0])

    def profiles(self, dem: DEM) -> tuple[np.ndarray, np.ndarray]:
        """Increment of vertical stress [Pa] and strain of each layer since the start."""
        outward = (dem.places - self.places) * np.tile([-1.0, 1.0], 3)
        strain = grain_strains(self.mesh, dem.positions - self.mesh.packing.centres, outward)[:, Z, Z]
        gained = vertical_stress(dem, PoreMesh(dem.packing)) - self.stress
        grains = np.stack([gained, strain], axis=1)
        places = self.mesh.packing.centres[:, Z]
        stress, strain = layer_means(places, grains, self.mesh.laguerre_volumes, self.edges).T
        return stress, strain


def vertical_stress(dem: DEM, mesh: PoreMesh) -> np.ndarray:
    return grain_stresses(dem.contacts, dem.positions, mesh.laguerre_volumes)[:, Z, Z]


def pressures(coupling: Coupling, edges: np.ndarray) -> np.ndarray:
    """Mean pressure of each layer [Pa]."""
    mesh = coupling.mesh
    # Of the undeformed height: the plate has come down by a thousandth of it.
    places = edges[0] + (mesh.vertices[:, Z] - mesh.box.lower[Z]) * (edges[-1] - edges[0]) / mesh.box.size[Z]
    return layer_means(np.clip(places, edges[0], edges[-1]), coupling.cell_pressure, mesh.cell_volumes, edges)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--grains", type=int, default=2000)
    parser.add_argument("--stress", type=float, default=10e3, help="of the plate [Pa]")
    parser.add_argument("--times", type=float, nargs="+", default=[0.05, 0.1, 0.2, 0.5, 1.5], help="time factors")
    parser.add_argument("--shown", type=float, default=0.2, help="time factor of the profiles in the picture")
    parser.add_argument("--layers", type=int, default=10)
    parser.add_argument("--store", type=Path, default=Path("consolidation"), help="directory for samples")
    parser.add_argument("--out", type=Path, help="write the picture here")
    options = parser.parse_args()
    options.store.mkdir(exist_ok=True)
    load = options.stress - CONFINEMENT

    dry = sample(options.grains, options.store)
    start = Start.of(dry, options.layers)
    dry_stress, dry_strain = np.zeros((2, len(STEPS) + 1, options.layers))
    for i, part in enumerate(STEPS, 1):
        dry.set_plates({"z_max": Plate(stress=CONFINEMENT + part * load, top_speed=SLOW)})
        dry.run_to_rest(1e-5, 1e-4, 500_000)
        dry_stress[i], dry_strain[i] = start.profiles(dry)
    curve = dry_strain[:, INNER].mean(axis=1)
    modulus = float(load / curve[-1])
    print(
        f"{options.grains} grains, {options.layers} layers. Dry: stress gained over the load "
        f"{dry_stress[-1].min() / load:.3f} to {dry_stress[-1].max() / load:.3f}; secant modulus within "
        + ", ".join(f"{load * part / e / 1e6:.2f} ({part:g})" for part, e in zip(STEPS, curve[1:], strict=True))
        + " MPa (at a part of the load)"
    )

    dem = sample(options.grains, options.store)
    dem.damping = 0.0
    dem.set_plates({"z_max": Plate(stress=options.stress, top_speed=0.5)})
    coupling = Coupling(dem, DRAINED, Fluid(viscosity=VISCOSITY))
    half = 0.5 * (start.edges[-1] - start.edges[0])
    unit = half**2 * VISCOSITY / (permeability(start.mesh.packing, AUTO())["taps"] * modulus)
    rows = {}
    for moment in sorted({*options.times, options.shown}):
        coupling.run(max(round(moment * unit / dem.step) - coupling.effort.steps, 0))
        stress, strain = start.profiles(dem)
        pressure = pressures(coupling, start.edges)
        rows[moment] = stress, strain, pressure
        thrust = (dem.wall_forces + coupling.wall_fluid_forces)[2 * Z :, Z] * [-1.0, 1.0]
        wall_total = thrust / dem.box.section(Z) - CONFINEMENT
        error = (stress + pressure) / load - 1.0
        same = np.array([np.interp(stress[k], dry_stress[:, k], dry_strain[:, k]) for k in range(options.layers)])
        off = (strain - same) * modulus / load
        print(
            f"T {moment:g}: (σ' + p) / Δσ - 1 from {error.min():+.3f} to {error.max():+.3f}, rms "
            f"{np.sqrt((error**2).mean()):.3f}, mean {error.mean():+.4f}; plates {wall_total.mean() / load - 1:+.4f}. "
            f"Strain less the dry one at that stress, over the final: {off.min():+.3f} to {off.max():+.3f}"
        )
        parts = np.stack([stress, pressure, stress + pressure, modulus * strain, modulus * same], axis=1) / load
        for z, (held, fluid, total, own, other) in zip(start.middles, parts, strict=True):
            print(f"    z/h {z:.2f}  σ' {held:.3f}  p {fluid:.3f}  sum {total:.3f}  ε {own:.3f}  dry {other:.3f}")
    if options.out:
        plot(start.middles, rows, options.shown, load, curve, options.out)


@style()
def plot(middles: np.ndarray, rows: dict, shown: float, load: float, curve: np.ndarray, path: Path) -> None:
    figure = new_figure(PictureSize(2000, 1100), layout="constrained")
    left, right = figure.subplots(1, 2)
    stress, strain, pressure = rows[shown]
    fine = np.linspace(0.0, 1.0, 201)
    exact = terzaghi_pressure(2.0 * fine, shown)
    left.plot(exact, fine, "-", color="tab:blue", alpha=0.4, label="Terzaghi")
    left.plot(1.0 - exact, fine, "-", color="tab:red", alpha=0.4)
    left.plot(pressure / load, middles, "o", color="tab:blue", label="pressure $p$")
    left.plot(stress / load, middles, "s", color="tab:red", label="stress of grains $\\Delta\\sigma'$")
    left.plot((stress + pressure) / load, middles, "k^", label="$\\Delta\\sigma' + p$")
    left.plot(strain / curve[-1], middles, "x", color="tab:green", label="strain, over the final one")
    left.axvline(1.0, color="k", lw=0.7)
    left.set(xlabel="over the load", ylabel="z / h", title=f"T = {shown:g}", xlim=(0.0, 2.0), ylim=(0.0, 1.0))
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3)
    for i, (time, (stress, strain, _)) in enumerate(rows.items()):
        right.plot(1e3 * strain[INNER], stress[INNER] / 1e3, "o", color=f"C{i}", label=f"T = {time:g}")
        right.plot(1e3 * strain[[0, -1]], stress[[0, -1]] / 1e3, "o", color=f"C{i}", mfc="none")
    right.plot([], [], "ko", mfc="none", label="layers on the plates")
    right.plot(1e3 * curve, np.append(0.0, STEPS) * load / 1e3, "k-", lw=0.9, label="dry, within")
    right.set(xlabel="strain of the layer, $10^{-3}$", ylabel="$\\Delta\\sigma'$ of the layer, kPa")
    right.grid(alpha=0.3)
    right.legend()
    figure.savefig(path)


if __name__ == "__main__":
    main()
