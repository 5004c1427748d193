"""From a controller's command to the actuation in force: clipping and damage."""

from physics.backend import ti
from physics.engine import noise, step_counter
from physics.engine.lane_math import any_lane, limited
from physics.engine.memory import layout as lay
from physics.engine.memory.tables import F_LOWPASS

REST, FROZEN, RANDOM, BLIND = range(4)  # damage.MODES


@ti.func
def broken(S: ti.template(), m: ti.template(), voxel: ti.template(), T: ti.template()):
    """The lanes in which a voxel is broken by now."""
    breaks = step_counter.steps_until(S, m, lay.H_BREAKS_HIGH, voxel[lay.BREAKS], T)
    mends = step_counter.steps_until(S, m, lay.H_MENDS_HIGH, voxel[lay.MENDS], T)
    return (breaks <= T.f(0.0)) & (mends > T.f(0.0))


@ti.func
def receive(S: ti.template(), m: ti.template(), number, value, T: ti.template()):
    """Takes a controller's command to a voxel; it is in force when those before it were."""
    command = value
    if m.delay > 0:
        queue = m.delay_block + number * m.delay
        command = S[queue]
        for k in range(m.delay - 1):
            S[queue + k] = S[queue + k + 1]
        S[queue + m.delay - 1] = value
    S[number * lay.VOXEL_ITEMS + lay.COMMAND] = command


@ti.func
def obey(S: ti.template(), m: ti.template(), number, T: ti.template()):
    """Sets the actuation of a voxel for the next step as it was told, unless damage keeps it from
    obeying."""
    voxel = S.at[number * lay.VOXEL_ITEMS]
    one = T.vec(1.0)
    clipped = limited(voxel[lay.COMMAND], one, T)
    if m.numbers[F_LOWPASS] < T.f(1.0):
        now = voxel[lay.ACTUATION]
        clipped = now + m.numbers[F_LOWPASS] * (clipped - now)
    if ti.static(T.features.varied):
        clipped = clipped * voxel[lay.ACTUATED]
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
def actuate(S: ti.template(), m: ti.template(), T: ti.template()):
    """Sets the actuation of all voxels for the next step."""
    for v in range(m.voxels):
        obey(S, m, v, T)
