"""The ground under a group of worlds: a window of terrain segments, and contact detection.

Each world stands on its own terrain. The segments around its robot are kept as lane vectors,
so that detection needs no gathers; the window is filled anew when a robot nears its edge.

A square on a segment touches in one or two points: its edge most opposed to the segment's
normal, clipped to the segment's extent (REFERENCE: contact).
"""

import math

from physics.backend import ti
from physics.engine.lane_math import any_lane, magnitude
from physics.engine.memory import layout as lay
from physics.engine.memory.model import F_REACH
from physics.scene import material

_RADIUS = material.SQUARE_HALF * math.sqrt(2)  # of the circle around a square [m]
_OUTSKIRTS = _RADIUS * math.sqrt(2) + 0.01  # beyond that a square is surely not near [m]
MARGIN = 2.0  # ground kept ready beyond what is within reach [m]
_FAR = 1e30


@ti.func
def update_window(
    S: ti.template(),
    terrain: ti.template(),
    g,
    m: ti.template(),
    mf: ti.template(),
    T: ti.template(),
):
    """Keeps the segments within reach of every square of each robot in the window."""
    if m.segments > 0:
        reach = mf[F_REACH]
        low = T.vec(_FAR)
        high = T.vec(-_FAR)
        for v in range(m.voxels):
            for k in range(4):
                x = S[g, v * lay.VOXEL_ITEMS + k * lay.BODY_ITEMS + lay.X]
                low = ti.select(x < low, x, low)
                high = ti.select(x > high, x, high)
        low = low - reach
        high = high + reach
        leaves = (low < S[g, m.header + lay.H_WINDOW_LOW]) | (
            high > S[g, m.header + lay.H_WINDOW_HIGH]
        )
        if any_lane(leaves, T):
            marks = ti.select(leaves, T.vec(1.0), T.vec(0.0))
            for lane in range(T.lanes):
                if marks[lane] > T.f(0.0):
                    _fill_lane(S, terrain, g, m, lane, low[lane] - T.f(MARGIN), T)


@ti.func
def _fill_lane(
    S: ti.template(), terrain: ti.template(), g, m: ti.template(), lane, low, T: ti.template()
):
    """Fills one lane of the window with the segments from the abscissa ``low`` on.

    The first segment has an even number, so that a segment keeps its parity, which is what
    names a contact pair, as the window moves.
    """
    world = g * T.places + lane
    points = terrain.shape[1]
    first = ti.cast(S[g, m.header + lay.H_WINDOW_BASE][lane], ti.i32)
    while first > 0 and terrain[world, first, 0] > low:
        first -= 1
    while first < points - 2 and terrain[world, first + 1, 0] <= low:
        first += 1
    first -= first % 2
    top = T.f(-_FAR)
    for k in range(m.segments):
        o = m.window + lay.SEGMENT_ITEMS * k
        index = ti.min(first + k, points - 2)
        x0, y0 = terrain[world, index, 0], terrain[world, index, 1]
        dx = terrain[world, index + 1, 0] - x0
        dy = terrain[world, index + 1, 1] - y0
        length = ti.sqrt(dx * dx + dy * dy)
        for y in ti.static((y0, y0 + dy)):
            if y > top:  # which no point without height is
                top = y
        if first + k > points - 2:  # beyond the last segment: nothing to stand on
            y0 = T.f(-_FAR)
        S[g, o + lay.SE_X][lane] = x0
        S[g, o + lay.SE_Y][lane] = y0
        S[g, o + lay.SE_TX][lane] = dx / length
        S[g, o + lay.SE_TY][lane] = dy / length
        S[g, o + lay.SE_LENGTH][lane] = length
    S[g, m.header + lay.H_WINDOW_TOP][lane] = top
    S[g, m.header + lay.H_WINDOW_BASE][lane] = ti.cast(first, T.f)
    S[g, m.header + lay.H_WINDOW_LOW][lane] = terrain[world, first, 0] if first > 0 else T.f(-_FAR)
    S[g, m.header + lay.H_WINDOW_HIGH][lane] = (
        terrain[world, first + m.segments, 0] if first + m.segments < points - 1 else T.f(_FAR)
    )


@ti.func
def detect(S: ti.template(), lists: ti.template(), g, m: ti.template(), T: ti.template()):
    """Finds the contacts of the poses reached; points found again keep their impulses."""
    old = lists[g, lay.L_CONTACTS]
    for n in range(old):
        _forget(S, g, lists[g, m.contact_list + 2 * n], T)
    count = 0
    for v in range(m.voxels):
        block = v * lay.VOXEL_ITEMS
        touched = _touched_pairs(S, g, m, block, T)
        for k in range(4 * lay.PAIRS_PER_BODY):
            if touched & (1 << k):
                entry = m.contact_list_new + 2 * count
                lists[g, entry] = block + lay.PAIRS + k * lay.PAIR_ITEMS
                lists[g, entry + 1] = block + (k // lay.PAIRS_PER_BODY) * lay.BODY_ITEMS
                count += 1
    for n in range(old):
        _drop_lost(S, g, lists[g, m.contact_list + 2 * n], T)
    for n in range(2 * count):
        lists[g, m.contact_list + n] = lists[g, m.contact_list_new + n]
    lists[g, lay.L_CONTACTS] = count


@ti.func
def _touched_pairs(S: ti.template(), g, m: ti.template(), block, T: ti.template()):
    """Which contact pairs of a voxel touch in any lane, a bit each.

    Most voxels are far from the ground, and none is near all of its segments: a look at a circle
    around the four squares spares one at each of them.
    """
    touched = 0
    x_low, y_low = S[g, block + lay.X], S[g, block + lay.Y]
    x_high, y_high = x_low, y_low
    for b in ti.static(range(1, 4)):
        x, y = S[g, block + b * lay.BODY_ITEMS + lay.X], S[g, block + b * lay.BODY_ITEMS + lay.Y]
        x_low, x_high = ti.min(x_low, x), ti.max(x_high, x)
        y_low, y_high = ti.min(y_low, y), ti.max(y_high, y)
    if any_lane(y_low <= S[g, m.header + lay.H_WINDOW_TOP] + T.f(_OUTSKIRTS), T):
        half = T.f(0.5)
        x, y = (x_low + x_high) * half, (y_low + y_high) * half
        radius = (x_high - x_low + (y_high - y_low)) * half + T.f(_OUTSKIRTS)
        for number in range(m.segments):
            if any_lane(_near(S, g, m, x, y, number, radius, T), T):
                for b in range(4):
                    k = b * lay.PAIRS_PER_BODY + number % lay.PAIRS_PER_BODY
                    body = block + b * lay.BODY_ITEMS
                    pair = block + lay.PAIRS + k * lay.PAIR_ITEMS
                    if _collide(S, g, m, body, pair, number, T):
                        touched = touched | (1 << k)
    return touched


@ti.func
def _near(S: ti.template(), g, m: ti.template(), x, y, number, radius, T: ti.template()):
    """The lanes in which a circle around a point is not above a segment or beside it."""
    segment = m.window + lay.SEGMENT_ITEMS * number
    height, along = _beside(S, g, segment, x, y, T)
    beyond = S[g, segment + lay.SE_LENGTH] + radius
    return (height <= radius) & (along >= T.f(0.0) - radius) & (along <= beyond)


@ti.func
def _beside(S: ti.template(), g, segment, x, y, T: ti.template()):
    """Height of a point above a segment's line, whose normal is (-ty, tx), and its place along
    it [m]."""
    tx, ty = S[g, segment + lay.SE_TX], S[g, segment + lay.SE_TY]
    dx = x - S[g, segment + lay.SE_X]
    dy = y - S[g, segment + lay.SE_Y]
    return dy * tx - dx * ty, dx * tx + dy * ty


@ti.func
def _forget(S: ti.template(), g, pair, T: ti.template()):
    """Marks the points of a pair as not found yet."""
    for p in range(2):
        S[g, pair + lay.PA_POINTS + p * lay.POINT_ITEMS + lay.PT_DEPTH] = T.vec(-1.0)


@ti.func
def _drop_lost(S: ti.template(), g, pair, T: ti.template()):
    """Clears the impulses of points that were not found again."""
    zero = T.vec(0.0)
    found = zero < zero
    for p in range(2):
        o = pair + lay.PA_POINTS + p * lay.POINT_ITEMS
        touches = S[g, o + lay.PT_DEPTH] >= zero
        S[g, o + lay.PT_JN] = ti.select(touches, S[g, o + lay.PT_JN], zero)
        S[g, o + lay.PT_JT] = ti.select(touches, S[g, o + lay.PT_JT], zero)
        found = found | touches
    S[g, pair + lay.PA_KEY] = ti.select(found, S[g, pair + lay.PA_KEY], zero)


@ti.func
def _collide(S: ti.template(), g, m: ti.template(), body, pair, number, T: ti.template()):
    """Contact of a body with the segment ``number`` of the window, in all lanes at once.

    Returns 1 if there is one in any lane. If a body touches two segments of one parity, the
    pair keeps the deeper.
    """
    segment = m.window + lay.SEGMENT_ITEMS * number
    zero = T.vec(0.0)
    h = T.f(material.SQUARE_HALF)
    tx, ty = S[g, segment + lay.SE_TX], S[g, segment + lay.SE_TY]
    length = S[g, segment + lay.SE_LENGTH]
    height, along = _beside(S, g, segment, S[g, body + lay.X], S[g, body + lay.Y], T)
    radius = T.f(_RADIUS)
    near = (height <= radius) & (along >= -radius) & (along <= length + radius)
    touched = 0
    if any_lane(near, T):
        # The normal in the body's frame tells which of its edges faces the ground most.
        c, s = S[g, body + lay.COS], S[g, body + lay.SIN]
        local_x = s * tx - c * ty
        local_y = c * tx + s * ty
        flat = magnitude(local_y, T) >= magnitude(local_x, T)
        one = T.vec(1.0)
        minus = T.vec(-1.0)
        fx = ti.select(flat, zero, ti.select(local_x > zero, minus, one))
        fy = ti.select(flat, ti.select(local_y > zero, minus, one), zero)
        gx, gy = zero - fy, fx  # along the edge
        # World vectors from the centre to the edge's middle and from there to its end.
        ex = (c * fx - s * fy) * h
        ey = (s * fx + c * fy) * h
        wx = (c * gx - s * gy) * h
        wy = (s * gx + c * gy) * h
        # Clip the edge, middle + q * half edge with |q| <= 1, to 0 <= along <= length.
        middle = along + (ex * tx + ey * ty)
        slope = wx * tx + wy * ty
        at_start = (zero - middle) / slope
        at_end = (length - middle) / slope
        q_low = ti.max(minus, ti.min(at_start, at_end))
        q_high = ti.min(one, ti.max(at_start, at_end))
        edge_height = height + (ey * tx - ex * ty)
        rise = wy * tx - wx * ty
        depth_low = zero - (edge_height + q_low * rise)
        depth_high = zero - (edge_height + q_high * rise)
        depth = ti.max(depth_low, depth_high)
        low, high = pair + lay.PA_POINTS, pair + (lay.PA_POINTS + lay.POINT_ITEMS)
        so_far = ti.max(S[g, low + lay.PT_DEPTH], S[g, high + lay.PT_DEPTH])
        hit = near & (q_low <= q_high) & (depth >= zero) & (depth > so_far)
        if any_lane(hit, T):
            touched = 1
            # Four edges: 0 bottom, 1 top, 2 left, 3 right.
            upper = ti.select(flat, fy, fx) > zero
            edge = ti.select(upper, one, zero) + ti.select(flat, zero, one + one)
            base = S[g, m.header + lay.H_WINDOW_BASE]
            key = one + edge + (base + ti.cast(number, T.f)) * T.f(4.0)
            same = key == S[g, pair + lay.PA_KEY]
            S[g, pair + lay.PA_KEY] = ti.select(hit, key, S[g, pair + lay.PA_KEY])
            S[g, pair + lay.PA_NX] = ti.select(hit, zero - ty, S[g, pair + lay.PA_NX])
            S[g, pair + lay.PA_NY] = ti.select(hit, tx, S[g, pair + lay.PA_NY])
            fx, fy, gx, gy = fx * h, fy * h, gx * h, gy * h
            for p in range(2):
                q = q_low
                deep = depth_low
                if p != 0:
                    q = q_high
                    deep = depth_high
                o = pair + lay.PA_POINTS + p * lay.POINT_ITEMS
                _store_point(S, g, body, o, hit, same, deep, fx + gx * q, fy + gy * q, T)
    return touched


@ti.func
def _store_point(S: ti.template(), g, body, o, hit, same, depth, lx, ly, T: ti.template()):
    """Writes a point in the lanes of ``hit``; unless it is the same as before, with no impulse."""
    c, s = S[g, body + lay.COS], S[g, body + lay.SIN]
    px = S[g, body + lay.X] + (c * lx - s * ly)
    py = S[g, body + lay.Y] + (s * lx + c * ly)
    keeps = same & (depth >= T.f(0.0))
    zero = T.vec(0.0)
    S[g, o + lay.PT_DEPTH] = ti.select(hit, depth, S[g, o + lay.PT_DEPTH])
    S[g, o + lay.PT_LX] = ti.select(hit, lx, S[g, o + lay.PT_LX])
    S[g, o + lay.PT_LY] = ti.select(hit, ly, S[g, o + lay.PT_LY])
    S[g, o + lay.PT_PX] = ti.select(hit, px, S[g, o + lay.PT_PX])
    S[g, o + lay.PT_PY] = ti.select(hit, py, S[g, o + lay.PT_PY])
    impulse_n, impulse_t = S[g, o + lay.PT_JN], S[g, o + lay.PT_JT]
    S[g, o + lay.PT_JN] = ti.select(hit & ~keeps, zero, impulse_n)
    S[g, o + lay.PT_JT] = ti.select(hit & ~keeps, zero, impulse_t)
