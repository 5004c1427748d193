"""Sensors: readings in [0, 1] from the state of a group of worlds (REFERENCE: sensors)."""

from physics import layout as lay
from physics import material, noise
from physics.backend import ti
from physics.model import (
    AREA,
    F_NOISE,
    F_RAY_ROW,
    F_RAYS,
    SE_FIRST_RAY,
    SE_INTERVAL,
    SE_KIND,
    SE_RAYS,
    SE_READING,
    SE_RING,
    SE_SLOTS,
    SE_VOXEL,
    SENSOR_ROW,
    TOUCH,
    VELOCITY,
)
from physics.numerics import tanh

_AREA_GAIN = 4.0  # 0.5 + 0.5 tanh(gain (ratio - 1))
_SPEED_SCALE = 4.0  # 0.5 + 0.5 tanh(speed / scale)
_FAR = 1e30


@ti.func
def sense(S: ti.template(), g, m: ti.template(), mi: ti.template(), mf: ti.template(), T: ti.template()):
    """Fills the readings from the state after a step; before the first step windows are empty."""
    for n in range(m.sensors):
        row = m.sensor_table + SENSOR_ROW * n
        block = mi[row + SE_VOXEL]
        reading = m.reading_block + mi[row + SE_READING]
        kind = mi[row + SE_KIND]
        if kind == AREA:
            ratio = area_ratio(S, g, block, T)
            S[g, reading] = squash(T.f(_AREA_GAIN) * (ratio - T.f(1.0)), T)
        elif kind == TOUCH:
            S[g, reading] = _average(S, g, m, mi, row, 0, 1, touch(S, g, block, T), T)
        elif kind == VELOCITY:
            vx, vy = _own_velocity(S, g, block, T)
            mean_x = _average(S, g, m, mi, row, 0, 2, vx, T)
            mean_y = _average(S, g, m, mi, row, 1, 2, vy, T)
            S[g, reading] = squash(mean_x * T.f(1 / _SPEED_SCALE), T)
            S[g, reading + 1] = squash(mean_y * T.f(1 / _SPEED_SCALE), T)
        else:
            _cast_rays(S, g, m, mi, mf, row, T)
    if mf[F_NOISE] > T.f(0.0):
        noise.add_to_readings(S, g, m, mf[F_NOISE], T)


@ti.func
def squash(x, T: ti.template()):
    """Maps the reals to (0, 1), 0 to 0.5."""
    return T.f(0.5) + T.f(0.5) * tanh(x, T)


@ti.func
def area_ratio(S: ti.template(), g, block, T: ti.template()):
    """Area of the quadrilateral of a voxel's outer corners over its area at rest."""
    xs = [T.vec(0.0) for _ in range(4)]
    ys = [T.vec(0.0) for _ in range(4)]
    for k in ti.static(range(4)):
        o = block + k * lay.BODY_ITEMS
        ax = T.f(material.SQUARE_HALF * material.CORNER_SIGNS[k][0])
        ay = T.f(material.SQUARE_HALF * material.CORNER_SIGNS[k][1])
        c, s = S[g, o + lay.COS], S[g, o + lay.SIN]
        # Relative to the first square, so that far from the origin no digits are lost.
        xs[k] = (S[g, o + lay.X] - S[g, block + lay.X]) + (c * ax - s * ay)
        ys[k] = (S[g, o + lay.Y] - S[g, block + lay.Y]) + (s * ax + c * ay)
    # Half the cross product of the diagonals; the corners run clockwise.
    cross = (xs[2] - xs[0]) * (ys[3] - ys[1]) - (xs[3] - xs[1]) * (ys[2] - ys[0])
    return ti.abs(cross) * T.f(0.5 / material.VOXEL_SIDE**2)


@ti.func
def touch(S: ti.template(), g, block, T: ti.template()):
    """1 in lanes where a square of the voxel touches the ground, else 0."""
    deepest = T.vec(-1.0)
    for pair in range(4 * lay.PAIRS_PER_BODY):
        for p in range(2):
            o = block + lay.PAIRS + pair * lay.PAIR_ITEMS + lay.PA_POINTS + p * lay.POINT_ITEMS
            deepest = ti.max(deepest, S[g, o + lay.PT_DEPTH])
    return ti.select(deepest >= T.f(0.0), T.vec(1.0), T.vec(0.0))


@ti.func
def frame(S: ti.template(), g, block, T: ti.template()):
    """Cosine and sine of a voxel's angle: the mean of the directions SW->SE and NW->NE."""
    ne, se = block + lay.BODY_ITEMS, block + 2 * lay.BODY_ITEMS
    sw = block + 3 * lay.BODY_ITEMS
    ax, ay = S[g, se + lay.X] - S[g, sw + lay.X], S[g, se + lay.Y] - S[g, sw + lay.Y]
    bx, by = S[g, ne + lay.X] - S[g, block + lay.X], S[g, ne + lay.Y] - S[g, block + lay.Y]
    # The sum of two unit vectors points along the mean of their angles.
    inverse_a = T.f(1.0) / ti.sqrt(ax * ax + ay * ay)
    inverse_b = T.f(1.0) / ti.sqrt(bx * bx + by * by)
    c = ax * inverse_a + bx * inverse_b
    s = ay * inverse_a + by * inverse_b
    inverse = T.f(1.0) / ti.sqrt(c * c + s * s)
    return c * inverse, s * inverse


@ti.func
def _own_velocity(S: ti.template(), g, block, T: ti.template()):
    """Mean velocity of a voxel's squares in the voxel's frame [m/s]."""
    vx = T.vec(0.0)
    vy = T.vec(0.0)
    for k in ti.static(range(4)):
        vx += S[g, block + (k * lay.BODY_ITEMS + lay.VX)]
        vy += S[g, block + (k * lay.BODY_ITEMS + lay.VY)]
    c, s = frame(S, g, block, T)
    return (c * vx + s * vy) * T.f(0.25), (c * vy - s * vx) * T.f(0.25)


@ti.func
def _average(
    S: ti.template(), g, m: ti.template(), mi: ti.template(), row, part, parts, value, T: ti.template()
):
    """Puts a sample into a sensor's ring and averages its window.

    Each lane has its own step count k: the sample goes to slot k mod slots, and the window
    holds the last ``interval_table[k]`` samples. Before the first step the value is 0.
    """
    slots = mi[row + SE_SLOTS]
    ring = m.rings + mi[row + SE_RING] + part * slots
    table = m.interval_table + mi[row + SE_INTERVAL] * m.interval_steps
    step = S[g, m.header + lay.H_STEP]
    place = T.vec(0.0)
    length = T.vec(0.0)
    for lane in ti.static(range(T.lanes)):
        k = ti.cast(step[lane], ti.i32)
        place[lane] = ti.cast(k % slots, T.f)
        if k > 0:
            length[lane] = ti.cast(mi[table + k - 1], T.f)
    total = T.vec(0.0)
    zero = T.vec(0.0)
    for slot in range(slots):
        index = ti.cast(slot, T.f)
        sample = ti.select(place == index, value, S[g, ring + slot])
        S[g, ring + slot] = sample
        age = place - index
        age = ti.select(age < zero, age + ti.cast(slots, T.f), age)
        total += ti.select(age < length, sample, zero)
    return ti.select(length > zero, total / ti.max(length, T.vec(1.0)), zero)


@ti.func
def _cast_rays(
    S: ti.template(), g, m: ti.template(), mi: ti.template(), mf: ti.template(), row, T: ti.template()
):
    """Distance to the ground along each ray of a lidar, over its range."""
    block = mi[row + SE_VOXEL]
    x = T.vec(0.0)
    y = T.vec(0.0)
    for k in ti.static(range(4)):
        x += S[g, block + (k * lay.BODY_ITEMS + lay.X)]
        y += S[g, block + (k * lay.BODY_ITEMS + lay.Y)]
    x = x * T.f(0.25)
    y = y * T.f(0.25)
    c, s = frame(S, g, block, T)
    zero = T.vec(0.0)
    for ray in range(mi[row + SE_RAYS]):
        numbers = F_RAYS + F_RAY_ROW * (mi[row + SE_FIRST_RAY] + ray)
        cr, sr = mf[numbers], mf[numbers + 1]
        ux = c * cr - s * sr
        uy = s * cr + c * sr
        nearest = T.vec(mf[numbers + 2])
        for k in range(m.segments):
            o = m.window + lay.SEGMENT_ITEMS * k
            tx, ty = S[g, o + lay.SE_TX], S[g, o + lay.SE_TY]
            dx, dy = x - S[g, o + lay.SE_X], y - S[g, o + lay.SE_Y]
            # Height above the line falls by ``sinks`` per metre along the ray.
            sinks = ux * ty - uy * tx
            distance = (dy * tx - dx * ty) / sinks
            along = (dx * tx + dy * ty) + distance * (ux * tx + uy * ty)
            hits = (
                (distance >= zero)
                & (distance < nearest)
                & (along >= zero)
                & (along <= S[g, o + lay.SE_LENGTH])
            )
            nearest = ti.select(hits, distance, nearest)
        reading = m.reading_block + mi[row + SE_READING] + ray
        S[g, reading] = nearest / mf[numbers + 2]
