"""Errors of the models on the resolved cases of data/reference/stokes, as of this version of the code.

    python tests/regression/record.py

writes resolved_cases.json beside this file, with which test_resolved_cases.py compares. Run it only for a change of the
models that is intended, and measure docs/accuracy.md anew then.
"""

import json
from pathlib import Path

import numpy as np

from porefv import Fluid, HydraulicRadius, PoreFlow, SectionFriction
from porefv.resolved import StokesReference

HERE = Path(__file__).parent
STOKES = HERE.parents[1] / "data" / "reference" / "stokes"
RECORD = HERE / "resolved_cases.json"
MODELS = {"section-friction": SectionFriction(), "hydraulic-radius": HydraulicRadius()}


def errors(name):
    """Error of the permeability, and rms error of the forces, of each model on a case; relative."""
    ref = StokesReference.read(STOKES / f"{name}.json")
    mesh, found = ref.pore_mesh(), {}
    for model in MODELS.values():
        flow = PoreFlow(mesh, ref.walls, Fluid(ref.viscosity), model)
        exact = ref.values.sphere_total
        error = np.linalg.norm(flow.forces.total - exact) / np.linalg.norm(exact)
        found[model.name] = [round(flow.permeability / ref.permeability - 1.0, 6), round(float(error), 6)]
    return found


def main():
    cases = {path.stem: errors(path.stem) for path in sorted(STOKES.glob("*.json"))}
    lines = ",\n".join(f' "{name}": {json.dumps(found)}' for name, found in cases.items())
    RECORD.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
    print(f"{len(cases)} cases in {RECORD}")


if __name__ == "__main__":
    main()
