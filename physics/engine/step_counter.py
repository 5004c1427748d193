"""The steps that a world has taken, in two digits: float32 alone counts to 2^24 only.

`layout.STEPS_PER_HIGH` steps make one of the higher digit.
"""

from physics.backend import ti
from physics.engine.memory import layout as lay

_WHOLE = float(lay.STEPS_PER_HIGH)


@ti.func
def advance(S: ti.template(), m: ti.template(), alive, T: ti.template()):
    """Counts a step in the lanes where ``alive`` is 1, none where it is 0."""
    h = m.header
    step = S[h + lay.H_STEP] + alive
    whole = T.f(_WHOLE)
    carries = ti.select(step >= whole, T.vec(1.0), T.vec(0.0))
    S[h + lay.H_STEP] = step - carries * whole
    S[h + lay.H_STEP_HIGH] = S[h + lay.H_STEP_HIGH] + carries


@ti.func
def steps_until(S: ti.template(), m: ti.template(), high: ti.template(), low, T: ti.template()):
    """Steps from now to another one, whose higher digit is the header's item ``high``: rounded,
    but of the right sign, and 0 only at that step."""
    h = m.header
    highs = S[h + high] - S[h + lay.H_STEP_HIGH]
    return highs * T.f(_WHOLE) + (low - S[h + lay.H_STEP])


@ti.func
def steps(S: ti.template(), m: ti.template(), lane):
    """Steps that one world has taken (uint32)."""
    low = ti.cast(S[m.header + lay.H_STEP][lane], ti.u32)
    high = ti.cast(S[m.header + lay.H_STEP_HIGH][lane], ti.u32)
    return joined(low, high)


@ti.func
def joined(low, high):
    """Steps of two digits (uint32)."""
    return low + high * ti.u32(lay.STEPS_PER_HIGH)
