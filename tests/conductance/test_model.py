"""What a class must be to be a conductance model."""

from dataclasses import dataclass

import numpy as np
import pytest

from porefv.conductance.model import ConductanceModel
from porefv.conductance.registry import MODELS
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls


def plates(self, throats, slip):
    return throats.fluid_areas * (throats.volumes / throats.wetted_surfaces(slip)) ** 2 / 3


@pytest.mark.parametrize(
    ("attribute", "meant"),
    [
        ("force_splits", "did you mean 'force_split'?"),
        ("share", "known are .*force_split"),
        ("conductivities", "did you mean 'conductivity'?"),
        ("drop_beyond_vertice", "did you mean 'drop_beyond_vertices'?"),
    ],
)
def test_a_mistyped_attribute_is_an_error(attribute, meant):
    for value in ("drag", plates) if attribute != "share" else ("drag",):
        with pytest.raises(TypeError, match=meant):
            type("Slits", (ConductanceModel,), {"name": "slits", "conductivity": plates, attribute: value})


def test_an_unknown_force_split_is_an_error_where_the_class_is_made():
    with pytest.raises(TypeError, match="force_split must be one of surface, drag, not 'weight'"):
        type("Slits", (ConductanceModel,), {"name": "slits", "conductivity": plates, "force_split": "weight"})


def test_a_model_without_conductivity_cannot_be_made():
    empty = type("Empty", (ConductanceModel,), {"name": "empty"})
    with pytest.raises(TypeError, match="conductivity"):
        empty()


def test_parameters_methods_and_private_names_of_its_own_are_allowed(mesh_of):
    @dataclass(frozen=True)
    class Scaled(ConductanceModel):
        factor: float = 2.0
        name = "scaled"
        force_split = "drag"
        _tables = (1.0, 2.0)

        def conductivity(self, throats, slip):
            return self.factor * plates(self, throats, slip)

        def mean(self, throats):
            return self.conductivity(throats, np.zeros(6, bool)).mean()

    one, two = (PoreFlow(mesh_of("n25_s1"), Walls.along("y"), conductance=Scaled(x)).permeability for x in (1.0, 2.0))
    assert two == pytest.approx(2.0 * one, rel=1e-12)


def test_hooks_of_the_models_of_the_package_are_declared(mesh_of):
    for model in MODELS.values():
        beyond = model().drop_beyond_vertices(mesh_of("n25_s1").throats, np.zeros(6, bool))
        assert (beyond is not None) == (model.name == "section-friction")
        if beyond is not None:
            assert beyond.parts.shape == (len(beyond.throats), 2)
            assert (beyond.parts >= 0.0).all() and (beyond.parts <= 1.0).all()
