"""Inputs of lazy objects are fixed, and the arrays they keep are read-only."""

import dataclasses

import numpy as np
import pytest

from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.system.lazy import lazy_property


@pytest.fixture
def flow(mesh_of):
    return PoreFlow(mesh_of("n25_s1"), Walls.along("y"))


def test_inputs_of_a_flow_and_its_mesh_cannot_be_set_again(flow):
    before = flow.permeability
    for name, value in [("walls", Walls.along("x")), ("gravity", (0.0, 0.0, 1.0)), ("pressure", 0.0), ("forces", 0.0)]:
        with pytest.raises(AttributeError, match=rf"PoreFlow\.{name} cannot be set.* Make a new PoreFlow"):
            setattr(flow, name, value)
    for thing, name in [(flow.mesh, "packing"), (flow.mesh.facets, "mesh"), (flow.mesh.throats, "closed")]:
        with pytest.raises(AttributeError, match="cannot be set"):
            setattr(thing, name, None)
    with pytest.raises(ValueError, match="read-only"):
        flow.gravity[2] = -9.81
    assert flow.permeability == before


def kept(thing):
    """Arrays that the lazy properties of an object give, those in tuples and dataclasses too."""
    for name in dir(type(thing)):
        if isinstance(getattr(type(thing), name, None), lazy_property):
            yield from ((f"{type(thing).__name__}.{name}", array) for array in arrays(getattr(thing, name)))


def arrays(value):
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple):
        for item in value:
            yield from arrays(item)
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from arrays(getattr(value, field.name))


def test_arrays_that_are_kept_cannot_be_changed(flow):
    writeable = [
        name
        for thing in (flow, flow.mesh, flow.mesh.facets, flow.mesh.throats)
        for name, array in kept(thing)
        if array.flags.writeable
    ]
    assert writeable == []
    with pytest.raises(ValueError, match="read-only"):
        flow.mesh.throats.areas[:] = 0.0
