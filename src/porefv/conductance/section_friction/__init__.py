"""Section friction: the default conductance model, and the pore centres between which its throats extend."""

from porefv.conductance.section_friction.model import SectionFriction
from porefv.conductance.section_friction.pore_centres import centres_of_pores

__all__ = ["SectionFriction", "centres_of_pores"]
