"""From a controller's command to the actuation in force: clipping and damage."""

from physics.backend import ti
from physics.engine import noise
from physics.engine.lane_math import any_lane, limited
from physics.engine.memory import layout as lay

REST, FROZEN, RANDOM, BLIND = range(4)  # damage.MODES


@ti.func
def broken(S: ti.template(), m: ti.template(), voxel: ti.template(), T: ti.template()):
    """The lanes in which a voxel is broken by now."""
    step = S[m.header + lay.H_STEP]
    return (step >= voxel[lay.BREAKS]) & (step < voxel[lay.MENDS])


@ti.func
def command(S: ti.template(), m: ti.template(), number, value, T: ti.template()):
    """Sets the actuation of a voxel for the next step, unless damage keeps it from obeying."""
    voxel = S.at[number * lay.VOXEL_ITEMS]
    one = T.vec(1.0)
    voxel[lay.COMMAND] = value
    clipped = limited(value, one, T)
    fails = broken(S, m, voxel, T)
    if m.damage_mode != BLIND and any_lane(fails, T):
        stuck = T.vec(0.0)
        if m.damage_mode == FROZEN:
            stuck = voxel[lay.ACTUATION]
        elif m.damage_mode == RANDOM:
            for lane in range(T.lanes):
                bits = noise.bits(noise.key(S, m, lane), noise.ACTUATION, number)
                voxel[lay.ACTUATION][lane] = ti.cast(noise.uniform(bits), T.f)
            stuck = voxel[lay.ACTUATION] * T.f(2.0) - one
        clipped = ti.select(fails, stuck, clipped)
    voxel[lay.ACTUATION] = clipped


@ti.func
def hold(S: ti.template(), m: ti.template(), T: ti.template()):
    """Keeps the commands of the last control step in force; voxels may break in between."""
    for v in range(m.voxels):
        command(S, m, v, S[v * lay.VOXEL_ITEMS + lay.COMMAND], T)
