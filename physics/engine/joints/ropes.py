"""Ropes: side-adjacent squares of a voxel never come closer than ROPE_LENGTH.

A rope is active in a step that starts with a shorter distance; then it is an equality in
velocity (REFERENCE: rope). Few are active at a time, so they are listed per group.
"""

from physics.backend import ti
from physics.engine.lane_math import any_lane, limited, magnitude
from physics.engine.memory import layout as lay
from physics.engine.memory.model import I_ROPE_ROW, I_ROPES
from physics.scene import material

_COUNT = len(material.ROPES)


@ti.func
def prepare(
    S: ti.template(), lists: ti.template(), g, m: ti.template(), mi: ti.template(), T: ti.template()
):
    """Lists the ropes that are short in any lane and applies their last impulses."""
    count = 0
    if m.ropes != 0:
        for v in range(m.voxels):
            block = v * lay.VOXEL_ITEMS
            for k in range(_COUNT):
                b1 = block + mi[I_ROPES + I_ROPE_ROW * k]
                b2 = block + mi[I_ROPES + I_ROPE_ROW * k + 1]
                o = block + lay.ROPES + lay.ROPE_ITEMS * k
                dx = S[g, b1 + lay.X] - S[g, b2 + lay.X]
                dy = S[g, b1 + lay.Y] - S[g, b2 + lay.Y]
                squared = dx * dx + dy * dy
                short = squared < T.f(material.ROPE_LENGTH**2)
                impulse = ti.select(short, S[g, o + lay.RO_IMPULSE], T.vec(0.0))
                if any_lane(short, T):
                    inverse = T.f(1.0) / ti.sqrt(squared)
                    nx = dx * inverse
                    ny = dy * inverse
                    S[g, o + lay.RO_NX] = nx
                    S[g, o + lay.RO_NY] = ny
                    S[g, o + lay.RO_ACTIVE] = ti.select(short, T.vec(1.0), T.vec(0.0))
                    _apply(S, g, b1, b2, nx * impulse, ny * impulse)
                    entry = m.rope_list + 3 * count
                    lists[g, entry] = o
                    lists[g, entry + 1] = b1
                    lists[g, entry + 2] = b2
                    count += 1
                S[g, o + lay.RO_IMPULSE] = impulse
    lists[g, lay.L_ROPES] = count


@ti.func
def solve_velocities(S: ti.template(), lists: ti.template(), g, m: ti.template(), T: ti.template()):
    """One iteration over the active ropes. K = 2 inverse masses: the anchors are centres."""
    for n in range(lists[g, lay.L_ROPES]):
        o = lists[g, m.rope_list + 3 * n]
        b1 = lists[g, m.rope_list + 3 * n + 1]
        b2 = lists[g, m.rope_list + 3 * n + 2]
        nx, ny = S[g, o + lay.RO_NX], S[g, o + lay.RO_NY]
        speed = nx * (S[g, b1 + lay.VX] - S[g, b2 + lay.VX]) + ny * (
            S[g, b1 + lay.VY] - S[g, b2 + lay.VY]
        )
        change = speed * S[g, o + lay.RO_ACTIVE] * T.f(-0.5)
        S[g, o + lay.RO_IMPULSE] = S[g, o + lay.RO_IMPULSE] + change
        _apply(S, g, b1, b2, nx * change, ny * change)


@ti.func
def solve_positions(
    S: ti.template(), lists: ti.template(), g, m: ti.template(), live, T: ti.template()
):
    """One iteration of the position stage on live lanes; returns the lanes still off."""
    off = live < live
    for n in range(lists[g, lay.L_ROPES]):
        o = lists[g, m.rope_list + 3 * n]
        b1 = lists[g, m.rope_list + 3 * n + 1]
        b2 = lists[g, m.rope_list + 3 * n + 2]
        dx = S[g, b1 + lay.X] - S[g, b2 + lay.X]
        dy = S[g, b1 + lay.Y] - S[g, b2 + lay.Y]
        length = ti.sqrt(dx * dx + dy * dy)
        limit = T.vec(material.MAX_CORRECTION)
        error = length - T.f(material.ROPE_LENGTH)
        error = limited(error, limit, T)
        mends = ti.select(live > T.f(0.0), S[g, o + lay.RO_ACTIVE], T.vec(0.0)) > T.f(0.0)
        off = off | (mends & (magnitude(error, T) > T.f(material.LINEAR_TOLERANCE)))
        shift = ti.select(mends, error * T.f(-0.5), T.vec(0.0)) / length
        S[g, b1 + lay.X] = S[g, b1 + lay.X] + dx * shift
        S[g, b1 + lay.Y] = S[g, b1 + lay.Y] + dy * shift
        S[g, b2 + lay.X] = S[g, b2 + lay.X] - dx * shift
        S[g, b2 + lay.Y] = S[g, b2 + lay.Y] - dy * shift
    return off


@ti.func
def _apply(S: ti.template(), g, b1, b2, px, py):
    """Impulse (px, py) on body 1 and its opposite on body 2."""
    S[g, b1 + lay.VX] = S[g, b1 + lay.VX] + px
    S[g, b1 + lay.VY] = S[g, b1 + lay.VY] + py
    S[g, b2 + lay.VX] = S[g, b2 + lay.VX] - px
    S[g, b2 + lay.VY] = S[g, b2 + lay.VY] - py
