"""Contacts of squares with the segments of terrain in the window (see `terrain_window`).

A square on a segment touches in one or two points: its edge most opposed to the segment's
normal, clipped to the segment's extent (MODEL.md, section 4).
"""

import math

from physics.backend import ti
from physics.engine.lane_math import any_lane, magnitude
from physics.engine.memory import layout as lay
from physics.scene import material

_RADIUS = material.SQUARE_HALF * math.sqrt(2)  # of the circle around a square [m]
_OUTSKIRTS = _RADIUS * math.sqrt(2) + 0.01  # beyond that a square is surely not near [m]
_FAR = 1e30
# The segment's normal is taken unless another direction is this much less deep [m]: which of two
# equal depths is the less is left to rounding, and a contact whose normal changes starts anew.
_PREFERENCE = 0.1 * material.LINEAR_TOLERANCE


@ti.func
def detect(S: ti.template(), m: ti.template(), T: ti.template()):
    """Finds the contacts of the poses reached; points found again keep their impulses."""
    old = S.lists[lay.L_CONTACTS]
    for n in range(old):
        _forget(S.at[S.lists[m.contact_list + 2 * n]], T)
    count = 0
    for v in range(m.voxels):
        block = v * lay.VOXEL_ITEMS
        touched = _touched_pairs(S, m, block, T)
        for k in range(4 * lay.PAIRS_PER_BODY):
            if touched & (1 << k):
                entry = m.contact_list_new + 2 * count
                S.lists[entry] = block + lay.PAIRS + k * lay.PAIR_ITEMS
                S.lists[entry + 1] = block + (k // lay.PAIRS_PER_BODY) * lay.BODY_ITEMS
                count += 1
    for n in range(old):
        _drop_lost(S.at[S.lists[m.contact_list + 2 * n]], T)
    for n in range(2 * count):
        S.lists[m.contact_list + n] = S.lists[m.contact_list_new + n]
    S.lists[lay.L_CONTACTS] = count


@ti.func
def _touched_pairs(S: ti.template(), m: ti.template(), block, T: ti.template()):
    """Which contact pairs of a voxel touch in any lane, a bit each.

    Most voxels are far from the ground, and none is near all of its segments: a look at a circle
    around the four squares spares one at each of them.
    """
    touched = 0
    voxel = S.at[block]
    x_low, y_low = voxel[lay.X], voxel[lay.Y]
    x_high, y_high = x_low, y_low
    for b in ti.static(range(1, 4)):
        x, y = voxel[b * lay.BODY_ITEMS + lay.X], voxel[b * lay.BODY_ITEMS + lay.Y]
        x_low, x_high = ti.min(x_low, x), ti.max(x_high, x)
        y_low, y_high = ti.min(y_low, y), ti.max(y_high, y)
    if any_lane(y_low <= S[m.header + lay.H_WINDOW_TOP] + T.f(_OUTSKIRTS), T):
        half = T.f(0.5)
        x, y = (x_low + x_high) * half, (y_low + y_high) * half
        radius = (x_high - x_low + (y_high - y_low)) * half + T.f(_OUTSKIRTS)
        for number in range(m.segments):
            if any_lane(_near(S, m, x, y, number, radius, T), T):
                for b in range(4):
                    k = b * lay.PAIRS_PER_BODY + number % lay.PAIRS_PER_BODY
                    body = S.at[block + b * lay.BODY_ITEMS]
                    pair = S.at[block + lay.PAIRS + k * lay.PAIR_ITEMS]
                    if _collide(S, m, body, pair, number, T):
                        touched = touched | (1 << k)
    return touched


@ti.func
def _near(S: ti.template(), m: ti.template(), x, y, number, radius, T: ti.template()):
    """The lanes in which a circle around a point is not above a segment or beside it."""
    segment = S.at[m.window + lay.SEGMENT_ITEMS * number]
    height, _ = _beside(segment, x, y, T)
    left = x + radius >= segment[lay.SE_X]
    return (height <= radius) & left & (x - radius <= segment[lay.SE_END])


@ti.func
def _beside(segment: ti.template(), x, y, T: ti.template()):
    """Height of a point above a segment's line, whose normal is (-ty, tx), and its place along
    it [m]."""
    tx, ty = segment[lay.SE_TX], segment[lay.SE_TY]
    dx = x - segment[lay.SE_X]
    dy = y - segment[lay.SE_Y]
    return dy * tx - dx * ty, dx * tx + dy * ty


@ti.func
def _forget(pair: ti.template(), T: ti.template()):
    """Marks the points of a pair as not found yet."""
    for p in range(2):
        pair[lay.PA_POINTS + p * lay.POINT_ITEMS + lay.PT_DEPTH] = T.vec(-1.0)


@ti.func
def _drop_lost(pair: ti.template(), T: ti.template()):
    """Clears the impulses of points that were not found again."""
    zero = T.vec(0.0)
    found = zero < zero
    for p in range(2):
        o = lay.PA_POINTS + p * lay.POINT_ITEMS
        touches = pair[o + lay.PT_DEPTH] >= zero
        pair[o + lay.PT_JN] = ti.select(touches, pair[o + lay.PT_JN], zero)
        pair[o + lay.PT_JT] = ti.select(touches, pair[o + lay.PT_JT], zero)
        found = found | touches
    pair[lay.PA_KEY] = ti.select(found, pair[lay.PA_KEY], zero)


@ti.func
def _collide(
    S: ti.template(),
    m: ti.template(),
    body: ti.template(),
    pair: ti.template(),
    number,
    T: ti.template(),
):
    """Contact of a body with the segment ``number`` of the window, in all lanes at once.

    Everything is seen from the body's centre, in its frame. Returns 1 if there is a contact in any
    lane. If a body touches two segments of one parity, the pair keeps the deeper.
    """
    segment = S.at[m.window + lay.SEGMENT_ITEMS * number]
    zero, one, minus = T.vec(0.0), T.vec(1.0), T.vec(-1.0)
    far = T.vec(_FAR)
    h = T.f(material.SQUARE_HALF)
    tx, ty = segment[lay.SE_TX], segment[lay.SE_TY]
    length = segment[lay.SE_LENGTH]
    height, along = _beside(segment, body[lay.X], body[lay.Y], T)
    c, s = body[lay.COS], body[lay.SIN]
    ground_x, ground_y = s * tx - c * ty, c * tx + s * ty  # the segment's normal
    # How far the square would have to move along the normals of the ground's edges to be free.
    depth = (magnitude(ground_x, T) + magnitude(ground_y, T)) * h - height
    half_width = (magnitude(c, T) + magnitude(s, T)) * h
    from_start = body[lay.X] - segment[lay.SE_X]
    from_end = body[lay.X] - segment[lay.SE_END]
    depth_left, depth_right = half_width + from_start, half_width - from_end
    hit = (depth >= zero) & (depth_left > zero) & (depth_right > zero)
    touched = 0
    if any_lane(hit, T):
        # And against the normals of its faces that look down.
        start_x = zero - (along * ground_y + height * ground_x)
        start_y = along * ground_x - height * ground_y
        end_x, end_y = start_x + length * ground_y, start_y - length * ground_x
        sign_x, sign_y = ti.select(s < zero, minus, one), ti.select(c < zero, minus, one)
        depth_x = h + ti.max(sign_x * start_x, sign_x * end_x)
        depth_y = h + ti.max(sign_y * start_y, sign_y * end_y)
        depth_side, depth_face = ti.min(depth_left, depth_right), ti.min(depth_x, depth_y)
        hit = hit & (depth_face >= zero)
        by_side = depth_side < depth - T.f(_PREFERENCE)
        least = ti.select(by_side, depth_side, depth)
        by_face = depth_face < least - T.f(_PREFERENCE)
        # The normal, and the extent of the reference edge along the tangent (ny, -nx). A point p
        # of the other edge is (n p + offset) times side deep.
        nx, ny, offset, side = ground_x, ground_y, height, minus
        first, last = zero - along, length - along
        feature = zero
        if any_lane(hit & (by_side | by_face), T):
            left = depth_left < depth_right
            out = ti.select(left, minus, one)
            top = s * ti.select(left, start_x, end_x) + c * ti.select(left, start_y, end_y)
            nx, ny = ti.select(by_side, c * out, nx), ti.select(by_side, zero - s * out, ny)
            offset = ti.select(by_side, out * ti.select(left, from_start, from_end), offset)
            first = ti.select(by_side, ti.select(left, zero - far, zero - top), first)
            last = ti.select(by_side, ti.select(left, top, far), last)
            feature = ti.select(by_side, ti.select(left, one, one + one), zero)
            across = depth_x < depth_y
            nx = ti.select(by_face, ti.select(across, sign_x, zero), nx)
            ny = ti.select(by_face, ti.select(across, zero, sign_y), ny)
            offset = ti.select(by_face, T.vec(material.SQUARE_HALF), offset)
            side = ti.select(by_face, one, side)
            first = ti.select(by_face, T.vec(-material.SQUARE_HALF), first)
            last = ti.select(by_face, T.vec(material.SQUARE_HALF), last)
        # The square's edge that faces against the normal most: its middle and half of it.
        flat = magnitude(ny, T) >= magnitude(nx, T)
        fx = ti.select(flat, zero, ti.select(nx > zero, minus, one))
        fy = ti.select(flat, ti.select(ny > zero, minus, one), zero)
        px, py, ux, uy = fx * h, fy * h, zero - fy * h, fx * h
        q_first, q_last = minus, one
        if any_lane(hit & by_face, T):
            # Its face is the reference edge; the other one is the ground's edge that faces it most.
            lean = c * nx - s * ny
            slanted = ground_x * nx + ground_y * ny >= magnitude(lean, T)
            left = slanted | (lean < zero)
            px = ti.select(by_face, ti.select(left, start_x, end_x), px)
            py = ti.select(by_face, ti.select(left, start_y, end_y), py)
            ux = ti.select(by_face, ti.select(slanted, ground_y, zero - s), ux)
            uy = ti.select(by_face, ti.select(slanted, zero - ground_x, zero - c), uy)
            q_first = ti.select(by_face, zero, q_first)
            q_last = ti.select(by_face, ti.select(slanted, length, far), q_last)
            edge = ti.select(slanted, zero, ti.select(left, one, one + one))
            feature = ti.select(by_face, edge + T.f(3.0), feature)
        # Clip this edge, p + q u, to the extent of the reference edge.
        middle, slope = px * ny - py * nx, ux * ny - uy * nx
        at_first, at_last = (first - middle) / slope, (last - middle) / slope
        q_low = ti.max(q_first, ti.min(at_first, at_last))
        q_high = ti.min(q_last, ti.max(at_first, at_last))
        level, rise = side * (px * nx + py * ny + offset), side * (ux * nx + uy * ny)
        depth_low, depth_high = level + q_low * rise, level + q_high * rise
        depth = ti.max(depth_low, depth_high)
        low, high = lay.PA_POINTS, lay.PA_POINTS + lay.POINT_ITEMS
        so_far = ti.max(pair[low + lay.PT_DEPTH], pair[high + lay.PT_DEPTH])
        hit = hit & (q_low <= q_high) & (depth >= zero) & (depth > so_far)
        if any_lane(hit, T):
            touched = 1
            # Four edges of the square: 0 bottom, 1 top, 2 left, 3 right.
            upper = ti.select(flat, fy, fx) > zero
            edge = ti.select(upper, one, zero) + ti.select(flat, zero, one + one)
            place = S[m.header + lay.H_WINDOW_BASE] + ti.cast(number, T.f)
            key = one + edge + T.f(4.0) * (feature + T.f(6.0) * place)
            same = key == pair[lay.PA_KEY]
            pair[lay.PA_KEY] = ti.select(hit, key, pair[lay.PA_KEY])
            normal_x = ti.select(by_side | by_face, c * nx - s * ny, zero - ty)
            normal_y = ti.select(by_side | by_face, s * nx + c * ny, tx)
            pair[lay.PA_NX] = ti.select(hit, normal_x, pair[lay.PA_NX])
            pair[lay.PA_NY] = ti.select(hit, normal_y, pair[lay.PA_NY])
            for p in range(2):
                q = q_low
                deep = depth_low
                if p != 0:
                    q = q_high
                    deep = depth_high
                o = lay.PA_POINTS + p * lay.POINT_ITEMS
                _store_point(body, pair, o, hit, same, deep, px + ux * q, py + uy * q, T)
    return touched


@ti.func
def _store_point(
    body: ti.template(), pair: ti.template(), o, hit, same, depth, lx, ly, T: ti.template()
):
    """Writes the point at o of a pair in the lanes of ``hit``; unless it is the same as before, it
    has no impulse."""
    c, s = body[lay.COS], body[lay.SIN]
    px = body[lay.X] + (c * lx - s * ly)
    py = body[lay.Y] + (s * lx + c * ly)
    keeps = same & (depth >= T.f(0.0))
    zero = T.vec(0.0)
    pair[o + lay.PT_DEPTH] = ti.select(hit, depth, pair[o + lay.PT_DEPTH])
    pair[o + lay.PT_LX] = ti.select(hit, lx, pair[o + lay.PT_LX])
    pair[o + lay.PT_LY] = ti.select(hit, ly, pair[o + lay.PT_LY])
    pair[o + lay.PT_PX] = ti.select(hit, px, pair[o + lay.PT_PX])
    pair[o + lay.PT_PY] = ti.select(hit, py, pair[o + lay.PT_PY])
    impulse_n, impulse_t = pair[o + lay.PT_JN], pair[o + lay.PT_JT]
    pair[o + lay.PT_JN] = ti.select(hit & ~keeps, zero, impulse_n)
    pair[o + lay.PT_JT] = ti.select(hit & ~keeps, zero, impulse_t)
