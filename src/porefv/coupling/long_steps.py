"""How long steps of grains and fluid together may be: as long as pairs and pressures, found in turn, agree.

Pairs resist the velocities under the pressures of before, which the pressures of the step change further. Longer steps
change them by more. The error is seen in the power of the pairs: what their forces do at the velocities that they were
found for is not what they do at those of the step. A step whose error is above a bound halves the next ones; many whose
error is small allow longer ones again.
"""

from __future__ import annotations

from porefv.coupling.coupling_state import CouplingState

# Error of the power of pairs, over that of the fluid on the grains, above which steps are halved, and below which it is
# not noticeable.
_MOST, _NOTICEABLE = 5e-4, 1.5e-4
# Steps for which half the length is left to work, and those without a noticeable error until it may grow.
_PATIENCE, _CALM = 10, 200


def adapt(state: CouplingState, error: float, most: int) -> None:
    """Take in the error of a step, and change how long the next ones may be: `longest`, 1 to `most`."""
    state.calm = state.calm + 1 if error <= _NOTICEABLE else min(state.calm + 1, _PATIENCE)
    if error > _MOST and state.calm >= _PATIENCE and state.longest > 1:
        state.longest, state.calm = state.longest // 2, 0
    elif state.calm >= _CALM and state.longest < most:
        state.longest, state.calm = min(2 * state.longest, most), _PATIENCE
