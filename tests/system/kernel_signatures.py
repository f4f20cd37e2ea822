"""Which kernels scenes need, for which types of arguments: what the package is built with.

python tests/system/kernel_signatures.py            what the record lacks
python tests/system/kernel_signatures.py --write    records it anew
"""

import json
import sys
import tempfile
from pathlib import Path

import numpy as np

from porefv import Cell, HydraulicRadius, Packing, PeriodicFlow, PoreFlow, PoreMesh, Walls
from porefv.cli import main as porefv
from porefv.coupling.micromechanics import cell_strains
from porefv.dem.dem import DEM
from porefv.system import threads
from porefv.system.kernel_build import RECORD, recorded
from porefv.system.kernel_types import types_text
from porefv.system.kernels import all_kernels
from porefv.transport import implicit
from porefv.transport.solute import Solute

DATA = Path(__file__).resolve().parents[2] / "data"

FLOW = """
packing = "{data}/packings/{packing}.csv"
fluid = {{ viscosity = 1.0, density = 1000.0 }}
walls = {{ y_min = {{ pressure = 1.0 }}, y_max = {{ pressure = 0.0 }}, lateral = {{ slip = {slip} }} }}
mesh = {{ unite_tolerance = {unite} }}
flow = {{ conductance = "{model}", solver = "{solver}", gravity = [0.0, 0.0, -9.81] }}

[output]
directory = "results/flow"
quantities = ["permeability", "pressure", "forces", "profile", "pore_sizes", "constriction_sizes", "planes",
    "diffusion"]
vtk = true
"""
FLOWS = [
    {"packing": packing, "slip": slip, "unite": unite, "model": model, "solver": solver}
    for packing, slip, unite, model, solver in (
        ("n54_s1", "true", 0.01, "section-friction", "direct"),
        ("n2000_s1", "false", 0.0, "section-friction", "cg"),
        ("n200_s1", "true", 0.01, "hydraulic-radius", "cg"),
        ("n25_s1", "false", 0.0, "effective-radius", "auto"),
        ("sc8", "true", 0.01, "section-friction", "auto"),
        ("n20000_s1", "false", 0.01, "section-friction", "auto"),  # in blocks and parts
    )
]
PACKINGS = (
    "box = { upper = [0.02, 0.02, 0.02] }\ngrains = { number = 60, ratio = 0.5 }\ncloud = { porosity = 0.7 }",
    "box = { upper = [0.02, 0.02, 0.02] }\ngrains = { number = 60, ratio = 0.5 }\n"
    "growth = { stress = 5.0e3, friction_angle = 10.0 }",
    "box = { upper = [0.02, 0.02, 0.06] }\ngrains = { number = 60, ratio = 0.8 }\n"
    "settling = { porosity = 0.8, gravity = [0.0, 0.0, -9.81] }",
)
SIMULATION = """
packing = {{ file = "{data}/packings/n25_s1.csv", scale = 0.05 }}
fluid = {{ viscosity = {viscosity}, density = 1000.0 }}
walls = {{ z_min = {{ pressure = 0.0 }}, z_max = {{ pressure = 0.0, free = {pairs} }}, lateral = {{ slip = true }} }}
output = {{ directory = "results/simulation", profiles = 1.0e-4 }}
coupling = {{ scheme = "{scheme}", pair_resistance = {pairs}, stride = {stride} }}

[[stages]]
name = "dry"
fluid = false
damping = 0.2
plates = {{ z_max = {{ stress = 5.0e3, top_speed = 0.01 }} }}
rest = {{ unbalanced = 1.0e-2 }}

[[stages]]
name = "wet"
plates = {{ z_max = {{ {plate} }} }}
duration = 1.0e-3
every = 5.0e-4
permeameter = true
"""
PRESSES = "stress = 10.0e3, top_speed = 0.5"
SIMULATIONS = [
    {"scheme": "implicit-drag", "viscosity": 10.0, "pairs": "false", "stride": 1, "plate": PRESSES},
    {"scheme": "semi-implicit", "viscosity": 1.0e-3, "pairs": "false", "stride": 1, "plate": PRESSES},
    {"scheme": "implicit-drag", "viscosity": 10.0, "pairs": "true", "stride": 1, "plate": PRESSES},
    {"scheme": "implicit-drag", "viscosity": 10.0, "pairs": "true", "stride": 4, "plate": "velocity = [0.0, 0.0, 0.0]"},
]


def run_everything(folder: Path) -> None:
    """Each kind of scene, small, and the same in Python."""
    for number, values in enumerate(FLOWS):
        run(folder, "solve", f"flow_{number}", FLOW.format(data=DATA.as_posix(), **values))
    for number, text in enumerate(PACKINGS):
        run(folder, "pack", f"pack_{number}", f'output = "packing_{number}.csv"\n{text}')
    for number, values in enumerate(SIMULATIONS):
        run(folder, "simulate", f"simulation_{number}", SIMULATION.format(data=DATA.as_posix(), **values))
    dem = DEM(Packing.read(DATA / "packings" / "n5000_s1.csv"))  # in ranges
    dem.run(2)
    packing = Packing.read(DATA / "packings" / "n54_s1.csv")
    mesh = PoreMesh(packing)
    cell_strains(mesh, np.zeros((54, 3)), np.zeros(6)), mesh.volume_gradients
    cemented = PoreMesh(Packing(packing.centres, 1.3 * packing.radii, packing.box), wall_tolerance=1.0)
    _ = cemented.facets.volumes, cemented.cell_void_volumes
    for made in (packing, Packing(packing.centres.copy(), packing.radii.copy(), packing.box)):
        for model in (None, HydraulicRadius()):
            flow = PoreFlow(made, Walls.along("y", slip=True), conductance=model)
            flow.forces, flow.pore_velocity, flow.to_fipy().mesh
    for factor, model, solver in ((0.8, None, "direct"), (1.25, HydraulicRadius(), "cg")):
        periodic = PeriodicFlow(
            Packing(packing.centres, factor * packing.radii, Cell([1, 1, 1])), conductance=model, solver=solver
        )
        periodic.forces([1, 0, 0]), periodic.mesh.laguerre_volumes, periodic.mesh.cell_surfaces, periodic.porosity
    Solute(flow).advance(1.0)
    implicit.FACTOR_LIMIT = 0  # as if there were many pores
    Solute(flow, 1e-3).advance(1.0)


def run(folder: Path, command: str, name: str, text: str) -> None:
    """One scene, which must succeed."""
    scene = folder / f"{name}.toml"
    scene.write_text(text, encoding="utf-8")
    for step in (["check"], [command, "--quiet", "--force"]):
        if porefv([*step, str(scene)]):
            raise SystemExit(f"{name}: porefv {step[0]} failed")


def needed() -> dict[str, list[str]]:
    """Signatures that the kernels have been used with in this process."""
    found = {name: sorted({types_text(types) for types in kernel.signatures}) for name, kernel in all_kernels().items()}
    return {name: signatures for name, signatures in sorted(found.items()) if signatures}


def lacking(record: dict[str, list[str]]) -> list[str]:
    """What is needed and not in a record."""
    return [
        f"{name}({signature})"
        for name, signatures in needed().items()
        for signature in signatures
        if signature not in record.get(name, [])
    ]


def main() -> None:
    """Compare with the record, or write it."""
    with tempfile.TemporaryDirectory() as folder:
        for count in (1, 2):
            threads.processors = lambda count=count: count
            run_everything(Path(folder))
    if "--write" in sys.argv:
        RECORD.write_text(json.dumps(needed(), indent=1) + "\n", encoding="utf-8")
    else:
        record = recorded()
        print("\n".join([f"lacks {line}" for line in lacking(record)] + [f"compared with {len(record)} kernels"]))


if __name__ == "__main__":
    main()
