"""From a controller's command to the actuation in force: clipping and damage."""

from physics.backend import ti
from physics.engine import noise
from physics.engine.lane_math import any_lane, limited
from physics.engine.memory import layout as lay

REST, FROZEN, RANDOM, BLIND = range(4)  # damage.MODES


@ti.func
def broken(S: ti.template(), g, m: ti.template(), block, T: ti.template()):
    """The lanes in which the voxel at this offset is broken by now."""
    step = S[g, m.header + lay.H_STEP]
    return (step >= S[g, block + lay.BREAKS]) & (step < S[g, block + lay.MENDS])


@ti.func
def command(S: ti.template(), g, m: ti.template(), voxel, value, T: ti.template()):
    """Sets the actuation of a voxel for the next step, unless damage keeps it from obeying."""
    block = voxel * lay.VOXEL_ITEMS
    one = T.vec(1.0)
    S[g, block + lay.COMMAND] = value
    clipped = limited(value, one, T)
    fails = broken(S, g, m, block, T)
    if m.damage_mode != BLIND and any_lane(fails, T):
        stuck = T.vec(0.0)
        if m.damage_mode == FROZEN:
            stuck = S[g, block + lay.ACTUATION]
        elif m.damage_mode == RANDOM:
            for lane in range(T.lanes):
                bits = noise.bits(noise.key(S, g, m, lane), noise.ACTUATION, voxel)
                S[g, block + lay.ACTUATION][lane] = ti.cast(noise.uniform(bits), T.f)
            stuck = S[g, block + lay.ACTUATION] * T.f(2.0) - one
        clipped = ti.select(fails, stuck, clipped)
    S[g, block + lay.ACTUATION] = clipped


@ti.func
def hold(S: ti.template(), g, m: ti.template(), T: ti.template()):
    """Keeps the commands of the last control step in force; voxels may break in between."""
    for v in range(m.voxels):
        command(S, g, m, v, S[g, v * lay.VOXEL_ITEMS + lay.COMMAND], T)
