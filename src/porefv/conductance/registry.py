"""The conductance models of the package by name, and which of them is the default."""

from __future__ import annotations

from porefv.conductance.effective_radius import EffectiveRadius
from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.conductance.model import ConductanceModel
from porefv.conductance.section_friction.model import SectionFriction
from porefv.errors import InputError

MODELS: dict[str, type[HydraulicRadius | EffectiveRadius | SectionFriction]] = {
    model.name: model for model in (HydraulicRadius, EffectiveRadius, SectionFriction)
}
# The default of the package: closest to resolved flow (docs/accuracy.md).
AUTO = SectionFriction


def conductance_model(name: str, **parameters: float) -> ConductanceModel:
    """The model of that name: `hydraulic-radius`, `effective-radius` or `section-friction`, which is `auto`.

    Raises
    ------
    InputError
        For an unknown name or parameter.
    """
    if name != "auto" and name not in MODELS:
        raise InputError(f"unknown conductance {name!r}; known: auto, {', '.join(MODELS)}")
    model = AUTO if name == "auto" else MODELS[name]
    unknown = [parameter for parameter in parameters if parameter not in model.__dataclass_fields__]
    if unknown:
        with_it = [other for other in MODELS if set(unknown) <= set(MODELS[other].__dataclass_fields__)]
        hint = f"; {' and '.join(with_it)} does" if with_it else ""
        raise InputError(f"conductance {name!r} takes no parameter {', '.join(unknown)}{hint}")
    return model(**parameters)
