"""Continuous collision detection: where a square that lands first touches the ground.

A step may carry a falling square centimetres into the ground. The reference's engine looks back
for the moment of the touch, and leaves the square there, as deep as one at rest. It looks at
squares that touched nothing before the step; their velocity stays as it is.
"""

from physics.backend import ti
from physics.engine.integrator import move
from physics.engine.lane_math import any_lane, rotate
from physics.engine.memory import layout as lay
from physics.scene import material


@ti.func
def remember(S: ti.template(), g, m: ti.template(), T: ti.template()):
    """Keeps the poses before the move, and which squares touch the ground."""
    for v in range(m.voxels):
        for b in range(4):
            body = v * lay.VOXEL_ITEMS + b * lay.BODY_ITEMS
            o = m.landing_block + (4 * v + b) * lay.LANDING_ITEMS
            S[g, o + lay.LA_X] = S[g, body + lay.X]
            S[g, o + lay.LA_Y] = S[g, body + lay.Y]
            S[g, o + lay.LA_ANGLE] = S[g, body + lay.ANGLE]
            pair = v * lay.VOXEL_ITEMS + lay.PAIRS + b * lay.PAIRS_PER_BODY * lay.PAIR_ITEMS
            key = S[g, pair + lay.PA_KEY] + S[g, pair + lay.PAIR_ITEMS + lay.PA_KEY]
            S[g, o + lay.LA_STOOD] = ti.select(key > T.f(0.0), T.vec(1.0), T.vec(0.0))


@ti.func
def set_back(S: ti.template(), lists: ti.template(), g, m: ti.template(), T: ti.template()):
    """Sets squares that have landed back to where they touched; returns how many contacts did.

    Until none does, the contacts must be detected anew.
    """
    zero, one = T.vec(0.0), T.vec(1.0)
    landed = 0
    for n in range(lists[g, lay.L_CONTACTS]):
        pair = lists[g, m.contact_list + 2 * n]
        body = lists[g, m.contact_list + 2 * n + 1]
        voxel = body // lay.VOXEL_ITEMS
        number = 4 * voxel + (body - voxel * lay.VOXEL_ITEMS) // lay.BODY_ITEMS
        before = m.landing_block + number * lay.LANDING_ITEMS
        new = S[g, before + lay.LA_STOOD] == zero
        if any_lane(new, T):
            dx = S[g, body + lay.X] - S[g, before + lay.LA_X]
            dy = S[g, body + lay.Y] - S[g, before + lay.LA_Y]
            turn = S[g, body + lay.ANGLE] - S[g, before + lay.LA_ANGLE]
            back = _way_back(S, g, pair, body, new, dx, dy, turn, T)
            lands = back < zero
            if any_lane(lands, T):
                landed += 1
                sink = T.f(material.LINEAR_TOLERANCE)
                nx, ny = S[g, pair + lay.PA_NX], S[g, pair + lay.PA_NY]
                move(
                    S, g, body, lands, dx * back - nx * sink, dy * back - ny * sink, turn * back, T
                )
                S[g, before + lay.LA_STOOD] = ti.select(lands, one, S[g, before + lay.LA_STOOD])
    return landed


@ti.func
def _way_back(S: ti.template(), g, pair, body, new, dx, dy, turn, T: ti.template()):
    """The part of the last move, in (-1, 0], that leads back to where a point touched first.

    The depth of each point of the contact is taken to have grown evenly from what it was.
    """
    zero = T.vec(0.0)
    nx, ny = S[g, pair + lay.PA_NX], S[g, pair + lay.PA_NY]
    c, s = S[g, body + lay.COS], S[g, body + lay.SIN]
    old_c, old_s = rotate(c, s, zero - turn, T)
    back = zero
    for p in range(2):
        o = pair + lay.PA_POINTS + p * lay.POINT_ITEMS
        depth = S[g, o + lay.PT_DEPTH]
        lx, ly = S[g, o + lay.PT_LX], S[g, o + lay.PT_LY]
        px = dx + ((c - old_c) * lx - (s - old_s) * ly)
        py = dy + ((s - old_s) * lx + (c - old_c) * ly)
        sunk = zero - (nx * px + ny * py)
        falls = new & (depth >= zero) & (depth < sunk)
        part = zero - depth / ti.select(falls, sunk, T.vec(1.0))
        back = ti.select(falls & (part < back), part, back)
    return back
