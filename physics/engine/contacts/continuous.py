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
def remember(S: ti.template(), m: ti.template(), T: ti.template()):
    """Keeps the poses before the move, and which squares touch the ground."""
    for v in range(m.voxels):
        for b in range(4):
            body = S.at[v * lay.VOXEL_ITEMS + b * lay.BODY_ITEMS]
            before = S.at[m.continuous_block + (4 * v + b) * lay.CONTINUOUS_ITEMS]
            before[lay.CC_X] = body[lay.X]
            before[lay.CC_Y] = body[lay.Y]
            before[lay.CC_ANGLE] = body[lay.ANGLE]
            pairs = lay.PAIRS + b * lay.PAIRS_PER_BODY * lay.PAIR_ITEMS
            pair = S.at[v * lay.VOXEL_ITEMS + pairs]
            key = pair[lay.PA_KEY] + pair[lay.PAIR_ITEMS + lay.PA_KEY]
            before[lay.CC_STOOD] = ti.select(key > T.f(0.0), T.vec(1.0), T.vec(0.0))


@ti.func
def set_back(S: ti.template(), m: ti.template(), T: ti.template()):
    """Sets squares that have landed back to where they touched; returns how many contacts did.

    Until none does, the contacts must be detected anew.
    """
    zero, one = T.vec(0.0), T.vec(1.0)
    landed = 0
    for n in range(S.lists[lay.L_CONTACTS]):
        pair = S.at[S.lists[m.contact_list + 2 * n]]
        place = S.lists[m.contact_list + 2 * n + 1]
        body = S.at[place]
        voxel = place // lay.VOXEL_ITEMS
        number = 4 * voxel + (place - voxel * lay.VOXEL_ITEMS) // lay.BODY_ITEMS
        before = S.at[m.continuous_block + number * lay.CONTINUOUS_ITEMS]
        new = before[lay.CC_STOOD] == zero
        if any_lane(new, T):
            dx = body[lay.X] - before[lay.CC_X]
            dy = body[lay.Y] - before[lay.CC_Y]
            turn = body[lay.ANGLE] - before[lay.CC_ANGLE]
            back = _way_back(pair, body, new, dx, dy, turn, T)
            lands = back < zero
            if any_lane(lands, T):
                landed += 1
                sink = T.f(material.LINEAR_TOLERANCE)
                nx, ny = pair[lay.PA_NX], pair[lay.PA_NY]
                move(body, lands, dx * back - nx * sink, dy * back - ny * sink, turn * back, T)
                before[lay.CC_STOOD] = ti.select(lands, one, before[lay.CC_STOOD])
    return landed


@ti.func
def _way_back(pair: ti.template(), body: ti.template(), new, dx, dy, turn, T: ti.template()):
    """The part of the last move, in (-1, 0], that leads back to where a point touched first.

    The depth of each point of the contact is taken to have grown evenly from what it was.
    """
    zero = T.vec(0.0)
    nx, ny = pair[lay.PA_NX], pair[lay.PA_NY]
    c, s = body[lay.COS], body[lay.SIN]
    old_c, old_s = rotate(c, s, zero - turn, T)
    back = zero
    for p in range(2):
        o = lay.PA_POINTS + p * lay.POINT_ITEMS
        depth = pair[o + lay.PT_DEPTH]
        lx, ly = pair[o + lay.PT_LX], pair[o + lay.PT_LY]
        px = dx + ((c - old_c) * lx - (s - old_s) * ly)
        py = dy + ((s - old_s) * lx + (c - old_c) * ly)
        sunk = zero - (nx * px + ny * py)
        falls = new & (depth >= zero) & (depth < sunk)
        part = zero - depth / ti.select(falls, sunk, T.vec(1.0))
        back = ti.select(falls & (part < back), part, back)
    return back
