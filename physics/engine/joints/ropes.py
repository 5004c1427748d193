"""Ropes: side-adjacent squares of a voxel never come closer than ROPE_LENGTH.

A rope is active in a step that starts with a shorter distance; then it is an equality in
velocity (MODEL.md, section 2). Few are active at a time, so they are listed per group.
"""

from physics.backend import ti
from physics.engine.lane_math import any_lane, limited, magnitude
from physics.engine.memory import layout as lay
from physics.engine.memory.tables import I_ROPE_ROW, I_ROPES
from physics.scene import material

_COUNT = len(material.ROPES)


@ti.func
def prepare(S: ti.template(), m: ti.template(), T: ti.template()):
    """Lists the ropes that are short in any lane and applies their last impulses."""
    count = 0
    if m.ropes != 0:
        for v in range(m.voxels):
            for k in range(_COUNT):
                place1 = v * lay.VOXEL_ITEMS + m.integers[I_ROPES + I_ROPE_ROW * k]
                place2 = v * lay.VOXEL_ITEMS + m.integers[I_ROPES + I_ROPE_ROW * k + 1]
                place = v * lay.VOXEL_ITEMS + lay.ROPES + lay.ROPE_ITEMS * k
                body1, body2, rope = S.at[place1], S.at[place2], S.at[place]
                dx = body1[lay.X] - body2[lay.X]
                dy = body1[lay.Y] - body2[lay.Y]
                squared = dx * dx + dy * dy
                short = squared < T.f(material.ROPE_LENGTH**2)
                impulse = ti.select(short, rope[lay.RO_IMPULSE], T.vec(0.0))
                if any_lane(short, T):
                    inverse = T.f(1.0) / ti.sqrt(squared)
                    nx = dx * inverse
                    ny = dy * inverse
                    rope[lay.RO_NX] = nx
                    rope[lay.RO_NY] = ny
                    rope[lay.RO_ACTIVE] = ti.select(short, T.vec(1.0), T.vec(0.0))
                    _apply(body1, body2, nx * impulse, ny * impulse)
                    entry = m.rope_list + 3 * count
                    S.lists[entry] = place
                    S.lists[entry + 1] = place1
                    S.lists[entry + 2] = place2
                    count += 1
                rope[lay.RO_IMPULSE] = impulse
    S.lists[lay.L_ROPES] = count


@ti.func
def solve_velocities(S: ti.template(), m: ti.template(), T: ti.template()):
    """One iteration over the active ropes. K = 2 inverse masses: the anchors are centres."""
    for n in range(S.lists[lay.L_ROPES]):
        rope = S.at[S.lists[m.rope_list + 3 * n]]
        body1 = S.at[S.lists[m.rope_list + 3 * n + 1]]
        body2 = S.at[S.lists[m.rope_list + 3 * n + 2]]
        nx, ny = rope[lay.RO_NX], rope[lay.RO_NY]
        speed = nx * (body1[lay.VX] - body2[lay.VX]) + ny * (body1[lay.VY] - body2[lay.VY])
        change = speed * rope[lay.RO_ACTIVE] * T.f(-0.5)
        rope[lay.RO_IMPULSE] = rope[lay.RO_IMPULSE] + change
        _apply(body1, body2, nx * change, ny * change)


@ti.func
def solve_positions(S: ti.template(), m: ti.template(), live, T: ti.template()):
    """One iteration of the position stage on live lanes; returns the lanes still off."""
    off = live < live
    for n in range(S.lists[lay.L_ROPES]):
        rope = S.at[S.lists[m.rope_list + 3 * n]]
        body1 = S.at[S.lists[m.rope_list + 3 * n + 1]]
        body2 = S.at[S.lists[m.rope_list + 3 * n + 2]]
        dx = body1[lay.X] - body2[lay.X]
        dy = body1[lay.Y] - body2[lay.Y]
        length = ti.sqrt(dx * dx + dy * dy)
        limit = T.vec(material.MAX_CORRECTION)
        error = length - T.f(material.ROPE_LENGTH)
        error = limited(error, limit, T)
        mends = ti.select(live > T.f(0.0), rope[lay.RO_ACTIVE], T.vec(0.0)) > T.f(0.0)
        off = off | (mends & (magnitude(error, T) > T.f(material.LINEAR_TOLERANCE)))
        shift = ti.select(mends, error * T.f(-0.5), T.vec(0.0)) / length
        body1[lay.X] = body1[lay.X] + dx * shift
        body1[lay.Y] = body1[lay.Y] + dy * shift
        body2[lay.X] = body2[lay.X] - dx * shift
        body2[lay.Y] = body2[lay.Y] - dy * shift
    return off


@ti.func
def _apply(body1: ti.template(), body2: ti.template(), px, py):
    """Impulse (px, py) on body 1 and its opposite on body 2."""
    body1[lay.VX] = body1[lay.VX] + px
    body1[lay.VY] = body1[lay.VY] + py
    body2[lay.VX] = body2[lay.VX] - px
    body2[lay.VY] = body2[lay.VY] - py
