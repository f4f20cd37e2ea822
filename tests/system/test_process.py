"""Importing porefv, and computing with it, changes nothing in the process of whoever does."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

PACKING = Path(__file__).parents[2] / "data" / "packings" / "n25_s1.csv"

CODE = """
import json, os, sys
import numba, numba.core.caching, numba.core.dispatcher, numba.core.decorators
import numpy as np

def state():
    attributes = {
        (name, key): value
        for name, module in list(sys.modules.items()) if name.split(".")[0] == "numba"
        for key, value in list(vars(module).items()) if callable(value)
    }
    return dict(os.environ), list(sys.argv), attributes, np.random.get_state()[1].tolist()

environment, argv, attributes, generator = state()
import porefv
from porefv import Packing, PoreFlow, Walls
flow = PoreFlow(Packing.read("PACKING"), Walls.along("y"))
flow.forces, flow.pore_velocity
EXTRA
after = state()
print(json.dumps({
    "environment": sorted(key for key in {*environment, *after[0]} if environment.get(key) != after[0].get(key)),
    "argv": argv == after[1],
    "numba": [key for key, value in attributes.items() if after[2].get(key, value) is not value],
    "generator": generator == after[3],
}))
"""


EXTRAS = {"flow": "", "fipy": "flow.to_fipy().solve()", "pyvista": "flow.mesh.to_pyvista()"}


@pytest.mark.parametrize("extra", EXTRAS)
def test_a_flow_changes_nothing(extra):
    code = CODE.replace("EXTRA", EXTRAS[extra]).replace("PACKING", PACKING.as_posix())
    done = subprocess.run([sys.executable, "-c", code, "--argument"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    # The imports of FiPy and of VTK may add variables of their own; what porefv sets is gone.
    assert [name for name in found["environment"] if "FIPY" in name or "NUMBA" in name or "POREFV" in name] == []
    assert found["environment"] == [] or extra != "flow"
    assert found["argv"] and found["generator"]
    assert found["numba"] == []
