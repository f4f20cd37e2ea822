"""The flow that a results directory holds, solved again from its scene."""

from __future__ import annotations

from pathlib import Path

from porefv.errors import InputError
from porefv.flow.pore_flow import PoreFlow
from porefv.results.reading import Results
from porefv.scenes.flow_scene import FlowScene

# Relative difference of inflows that solvers and machines explain.
_SAME = 1e-6


def flow_of_results(results: Results) -> PoreFlow:
    """The flow of results of `porefv solve`, solved again, for what their files do not hold.

    Raises
    ------
    InputError
        If the results come from no scene, have no flow, or the scene is not there or has another flow now.
    """
    summary, directory = results.summary, results.directory
    if "flow" not in summary:
        raise InputError(f"{directory} has no flow: its quantities needed none")
    if not summary.get("scene"):
        raise InputError(
            f"{directory} was written in Python, without a scene from which its flow could be solved again. Use the "
            'flow from which it was written: flow.plot("paths")'
        )
    path = Path(summary["scene"])
    if not path.is_file():
        raise InputError(
            f"the flow of {directory} is solved again from its scene, and there is no {path}. Run the command in the "
            "directory in which porefv solve was run"
        )
    flow = FlowScene.read(path).pore_flow()
    counts = {"spheres": len(flow.mesh.packing), "pores": flow.mesh.n_pores}
    found = {"spheres": summary["packing"]["spheres"], "pores": summary["mesh"]["pores"]}
    inflow = summary["flow"]["inflow"]
    if counts != found or abs(flow.inflow - inflow) > _SAME * abs(inflow):
        raise InputError(
            f"{path} or its packing has changed since {directory} was written: inflow {flow.inflow:.6g} m³/s, in the "
            f"results {inflow:.6g} m³/s. Solve the scene again"
        )
    return flow
