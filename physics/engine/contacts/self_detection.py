"""Self-collision detection: squares of one robot that overlap without a joint; where they touch.

Two equal squares whose centres are d apart and whose angles differ by delta reach equally far
along each of their four axes: they overlap by h (1 + |cos delta| + |sin delta|) less the
component of d along that axis, and least along the axis on which d is longest. The square that
owns this axis is the reference: its face towards the other one plays the part of the ground in
``ground``, and clips the other's edge that faces it most (MODEL.md, section 4).

A group lists the pairs that meet in any lane, in the order of the model's table. A world holds
its first ``self_contact_limit`` self-contacts and ignores further ones, whatever its lane-mates do.
"""

from physics.backend import ti
from physics.engine.lane_math import any_lane, magnitude
from physics.engine.memory import layout as lay
from physics.engine.memory.tables import PAIR_ROW
from physics.scene import material

_REACH = material.SQUARE_SIDE * 2**0.5  # centres of squares that meet are no further apart [m]
_LEAST = 1e-12  # a robot starts with squares that touch by rounding errors [m]
_SQUARES = 4  # of a voxel
_FAR = 1e30


@ti.func
def detect(S: ti.template(), m: ti.template(), T: ti.template()):
    """Finds the self-contacts of the poses reached; points found again keep their impulses."""
    _remember(S, m, T)
    _bound_voxels(S, m, T)
    old = S.lists[lay.L_SELF_CONTACTS]
    count = 0
    cursor = 0
    held = T.vec(0.0)
    limit = T.vec(ti.cast(m.self_contact_limit, T.f))
    for n in range(m.voxel_pairs):
        row = m.pair_table + PAIR_ROW * n
        voxel1 = m.integers[row]
        voxel2 = m.integers[row + 1]
        welded = m.integers[row + 2]
        first = voxel1 * lay.VOXEL_ITEMS
        squares = 0
        if _neighbours(S, m, voxel1, voxel2, welded, T):
            squares = _SQUARES
        for i in range(squares):
            body1 = first + i * lay.BODY_ITEMS
            others = 0
            if _close(S, body1, 1, voxel2, welded >> _SQUARES * i, T):
                others = _SQUARES
            for j in range(others):
                k = _SQUARES * i + j
                if (welded >> k) & 1 == 0:
                    body2 = voxel2 * lay.VOXEL_ITEMS + j * lay.BODY_ITEMS
                    hit = _collide(S, m, body1, body2, count, held < limit, T)
                    if any_lane(hit, T):
                        held = ti.select(hit, held + T.f(1.0), held)
                        entry = m.self_contact_list + lay.SELF_CONTACT_ENTRY * count
                        S.lists[entry] = _SQUARES * _SQUARES * n + k
                        S.lists[entry + 1] = body1
                        S.lists[entry + 2] = body2
                        cursor = _recall(S, m, count, cursor, old, T)
                        count += 1
    S.lists[lay.L_SELF_CONTACTS] = count


@ti.func
def _remember(S: ti.template(), m: ti.template(), T: ti.template()):
    """Keeps keys and impulses of the self-contacts so far, for those that are found again."""
    for n in range(S.lists[lay.L_SELF_CONTACTS]):
        touch = S.at[m.self_contact_block + lay.SELF_CONTACT_ITEMS * n]
        memory = S.at[m.self_contact_memory + lay.MEMORY_ITEMS * n]
        memory[0] = touch[lay.SC_KEY]
        for p in range(2):
            point = lay.SC_POINTS + lay.SELF_CONTACT_POINT_ITEMS * p
            memory[1 + 2 * p] = touch[point + lay.MP_JN]
            memory[2 + 2 * p] = touch[point + lay.MP_JT]
        number = S.lists[m.self_contact_list + lay.SELF_CONTACT_ENTRY * n]
        S.lists[m.self_contact_list_old + n] = number


@ti.func
def _recall(
    S: ti.template(),
    m: ti.template(),
    count,
    cursor,
    old,
    T: ti.template(),
):
    """Starts each point of a self-contact with the impulses it had, if it is the same as before.

    They are listed in order, so the old one is sought from the cursor on; returns its place.
    """
    number = S.lists[m.self_contact_list + lay.SELF_CONTACT_ENTRY * count]
    touch = S.at[m.self_contact_block + lay.SELF_CONTACT_ITEMS * count]
    place = cursor
    while place < old and S.lists[m.self_contact_list_old + place] < number:
        place += 1
    memory = S.at[m.self_contact_memory + lay.MEMORY_ITEMS * place]
    zero = T.vec(0.0)
    same = zero < zero
    if place < old and S.lists[m.self_contact_list_old + place] == number:
        same = memory[0] == touch[lay.SC_KEY]
    for p in range(2):
        point = lay.SC_POINTS + lay.SELF_CONTACT_POINT_ITEMS * p
        keeps = same & (touch[point + lay.MP_DEPTH] >= zero)
        for j in range(2):
            impulse = memory[1 + 2 * p + j]
            touch[point + lay.MP_JN + j] = ti.select(keeps, impulse, zero)
    return place


@ti.func
def _bound_voxels(S: ti.template(), m: ti.template(), T: ti.template()):
    """The corners of the box around the centres of each voxel's squares."""
    for v in range(m.voxels):
        for axis in range(2):
            centers = S.at[v * lay.VOXEL_ITEMS + lay.BODIES + lay.X + axis]
            low = centers[0]
            high = low
            for k in range(1, _SQUARES):
                x = centers[k * lay.BODY_ITEMS]
                low = ti.min(low, x)
                high = ti.max(high, x)
            bounds = S.at[m.self_contact_bounds + lay.BOUND_ITEMS * v + axis]
            bounds[0] = low
            bounds[2] = high


@ti.func
def _neighbours(S: ti.template(), m: ti.template(), voxel1, voxel2, welded, T: ti.template()):
    """Whether squares of two voxels are near enough to meet in any lane: most pairs of voxels are
    told apart by their bounds."""
    a = S.at[m.self_contact_bounds + lay.BOUND_ITEMS * voxel1]
    b = S.at[m.self_contact_bounds + lay.BOUND_ITEMS * voxel2]
    gap = T.vec(0.0)
    for axis in range(2):
        gap = ti.max(gap, a[axis] - b[2 + axis])
        gap = ti.max(gap, b[axis] - a[2 + axis])
    near = any_lane(gap < T.f(_REACH), T)
    if near:
        near = _close(S, voxel1 * lay.VOXEL_ITEMS, _SQUARES, voxel2, welded, T)
    return near


@ti.func
def _close(S: ti.template(), body1, squares, voxel2, welded, T: ti.template()):
    """Whether some squares, from ``body1`` on, are near enough to a voxel's to meet in any lane.

    Distances are many, but cheap; what they spare are tests of lanes, which cost as much as ten.
    """
    least = T.vec(_FAR)
    for k in range(squares * _SQUARES):
        if (welded >> k) & 1 == 0:
            one = S.at[body1 + k // _SQUARES * lay.BODY_ITEMS]
            other = S.at[voxel2 * lay.VOXEL_ITEMS + k % _SQUARES * lay.BODY_ITEMS]
            dx = other[lay.X] - one[lay.X]
            dy = other[lay.Y] - one[lay.Y]
            least = ti.min(least, dx * dx + dy * dy)
    return any_lane(least < T.f(_REACH**2), T)


@ti.func
def _face(x, y, T: ti.template()):
    """The unit vector along an axis that points most like (x, y)."""
    zero = T.vec(0.0)
    one = T.vec(1.0)
    minus = T.vec(-1.0)
    along_y = magnitude(y, T) >= magnitude(x, T)
    return (
        ti.select(along_y, zero, ti.select(x > zero, one, minus)),
        ti.select(along_y, ti.select(y > zero, one, minus), zero),
    )


@ti.func
def _collide(S: ti.template(), m: ti.template(), body1, body2, count, free, T: ti.template()):
    """Writes the self-contact of two squares as the one of this number, in all lanes at once.

    Returns the lanes that have one, which are among the free ones; in the others its depths are
    negative and its effective masses zero.
    """
    square1, square2 = S.at[body1], S.at[body2]
    dx = square2[lay.X] - square1[lay.X]
    dy = square2[lay.Y] - square1[lay.Y]
    hit = free & (dx * dx + dy * dy < T.f(_REACH**2))
    if any_lane(hit, T):
        touch = S.at[m.self_contact_block + lay.SELF_CONTACT_ITEMS * count]
        hit = _clip(S, body1, body2, touch, hit, dx, dy, T)
    return hit


@ti.func
def _clip(S: ti.template(), body1, body2, touch: ti.template(), near, dx, dy, T: ti.template()):
    """Separating axes, then the one square's edge clipped to the other one's face."""
    zero = T.vec(0.0)
    one = T.vec(1.0)
    minus = T.vec(-1.0)
    h = T.f(material.SQUARE_HALF)
    square1, square2 = S.at[body1], S.at[body2]
    c1, s1 = square1[lay.COS], square1[lay.SIN]
    c2, s2 = square2[lay.COS], square2[lay.SIN]
    own = ti.max(magnitude(c1 * dx + s1 * dy, T), magnitude(c1 * dy - s1 * dx, T))
    other = ti.max(magnitude(c2 * dx + s2 * dy, T), magnitude(c2 * dy - s2 * dx, T))
    turned = magnitude(c1 * c2 + s1 * s2, T) + magnitude(s1 * c2 - c1 * s2, T)
    reach = (turned + T.f(1.0)) * h
    hit = near & (reach - ti.max(own, other) > T.f(_LEAST))
    if any_lane(hit, T):
        swap = other > own  # body 2 is the reference
        sign = ti.select(swap, minus, one)
        cr, sr = ti.select(swap, c2, c1), ti.select(swap, s2, s1)
        ci, si = ti.select(swap, c1, c2), ti.select(swap, s1, s2)
        # Seen from the reference's centre: the other one's centre, the normal of the face.
        px, py = dx * sign, dy * sign
        rx, ry = _face(cr * px + sr * py, cr * py - sr * px, T)
        nx, ny = cr * rx - sr * ry, sr * rx + cr * ry
        tx, ty = ny, zero - nx
        # The edge of the other one, in its frame: normal f, direction g, both to be scaled by h.
        fx, fy = _face(zero - (ci * nx + si * ny), si * nx - ci * ny, T)
        gx, gy = zero - fy, fx
        ex, ey = (ci * fx - si * fy) * h, (si * fx + ci * fy) * h
        wx, wy = (ci * gx - si * gy) * h, (si * gx + ci * gy) * h
        # Clip the edge, middle + q * half edge with |q| <= 1, to the face.
        mx, my = px + ex, py + ey
        middle = mx * tx + my * ty
        slope = wx * tx + wy * ty
        at_start = (T.f(-material.SQUARE_HALF) - middle) / slope
        at_end = (h - middle) / slope
        q_low = ti.max(minus, ti.min(at_start, at_end))
        q_high = ti.min(one, ti.max(at_start, at_end))
        below = h - (mx * nx + my * ny)
        rise = wx * nx + wy * ny
        depth_low = below - q_low * rise
        depth_high = below - q_high * rise
        hit = hit & (q_low <= q_high) & (ti.max(depth_low, depth_high) >= zero)
        key = (rx + T.f(3.0) * ry) + T.f(8.0) * (fx + T.f(3.0) * fy) + T.f(32.0) * sign
        touch[lay.SC_KEY] = ti.select(hit, key, zero)
        touch[lay.SC_NX] = nx * sign
        touch[lay.SC_NY] = ny * sign
        for p in range(2):
            q = q_low
            deep = depth_low
            if p != 0:
                q = q_high
                deep = depth_high
            point = lay.SC_POINTS + lay.SELF_CONTACT_POINT_ITEMS * p
            touches = hit & (deep >= zero)
            touch[point + lay.MP_DEPTH] = ti.select(touches, deep, minus)
            _store_arms(S, body1, body2, touch, point, touches, swap, ex + wx * q, ey + wy * q, T)
    return hit


@ti.func
def _store_arms(
    S: ti.template(),
    body1,
    body2,
    touch: ti.template(),
    point,
    touches,
    swap,
    x,
    y,
    T: ti.template(),
):
    """Levers and effective masses of the point at (x, y) from the centre of the body that is not
    the reference."""
    square1, square2 = S.at[body1], S.at[body2]
    dx = square2[lay.X] - square1[lay.X]
    dy = square2[lay.Y] - square1[lay.Y]
    nx, ny = touch[lay.SC_NX], touch[lay.SC_NY]
    normal = T.vec(2.0)  # inverse effective masses
    tangential = T.vec(2.0)
    zero = T.vec(0.0)
    one = T.vec(1.0)
    minus = T.vec(-1.0)
    for second in range(2):
        square = S.at[body2 if second != 0 else body1]
        arms = point + lay.MP_ARMS + lay.ARM_ITEMS * second
        # To the centre of this body from that of the other one, where this is the reference.
        away = ti.select(swap, zero, one)
        if second != 0:
            away = ti.select(swap, minus, zero)
        rx = x + away * dx
        ry = y + away * dy
        c, s = square[lay.COS], square[lay.SIN]
        rn = (rx * ny - ry * nx) * T.f(1 / lay.GYRATION)
        rt = (rx * nx + ry * ny) * T.f(-1 / lay.GYRATION)
        touch[arms + lay.AR_X] = c * rx + s * ry
        touch[arms + lay.AR_Y] = c * ry - s * rx
        touch[arms + lay.AR_N] = rn
        touch[arms + lay.AR_T] = rt
        normal += rn * rn
        tangential += rt * rt
    touch[point + lay.MP_MN] = ti.select(touches, one / normal, zero)
    touch[point + lay.MP_MT] = ti.select(touches, one / tangential, zero)
