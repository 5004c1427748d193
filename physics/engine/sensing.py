"""Sensors: readings in [0, 1] from the state of a group of worlds (MODEL.md, section 6)."""

from physics.backend import ti
from physics.engine import noise, step_counter
from physics.engine.actuation import BLIND, broken
from physics.engine.lane_math import magnitude, tanh
from physics.engine.memory import layout as lay
from physics.engine.memory.tables import (
    AREA,
    F_NOISE,
    F_RAY_ROW,
    F_RAYS,
    RAY,
    RE_INTERVAL,
    RE_KIND,
    RE_RAY,
    RE_RING,
    RE_SLOTS,
    RE_VOXEL,
    READING_ROW,
    TOUCH,
    VELOCITY_X,
)
from physics.scene import material

_AREA_GAIN = 4.0  # an area reads 0.5 + 0.5 tanh(4 (ratio - 1))
_SPEED_GAIN = 0.25  # a speed reads 0.5 + 0.5 tanh(speed / 4)


@ti.func
def sense(S: ti.template(), m: ti.template(), T: ti.template()):
    """Fills the readings from the state after a step; before the first step windows are empty.

    One loop over readings in which each piece of code stands once: kernels compile in a time
    that grows with the square of their size.
    """
    interval = -1  # whose window the header describes
    for r in range(m.readings):
        row = m.reading_table + READING_ROW * r
        kind = m.integers[row + RE_KIND]
        voxel = S.at[m.integers[row + RE_VOXEL]]
        value = T.vec(0.0)
        if kind == AREA:
            value = T.f(_AREA_GAIN) * (area_ratio(voxel, T) - T.f(1.0))
        elif kind == TOUCH:
            value = touch(voxel, T)
        else:
            c, s = frame(voxel, T)
            if kind == RAY:
                value = _cast_ray(S, m, voxel, m.integers[row + RE_RAY], c, s, T)
            else:
                value = _own_velocity(voxel, c, s, kind == VELOCITY_X, T)
        if m.integers[row + RE_SLOTS] > 0:
            if m.integers[row + RE_INTERVAL] != interval:
                interval = m.integers[row + RE_INTERVAL]
                _find_window(S, m, row, T)
            value = _average(S, m, row, value, T)
        if kind != TOUCH and kind != RAY:
            value = T.f(0.5) + T.f(0.5) * tanh(value, T)
        S[m.reading_block + r] = value
    if m.numbers[m.own_numbers + F_NOISE] > T.f(0.0):
        noise.add_to_readings(S, m, T)
    if m.damage_mode == BLIND:
        for r in range(m.readings):
            voxel = S.at[m.integers[m.reading_table + READING_ROW * r + RE_VOXEL]]
            reading = S.at[m.reading_block + r]
            reading[0] = ti.select(broken(S, m, voxel, T), T.vec(0.0), reading[0])


@ti.func
def area_ratio(voxel: ti.template(), T: ti.template()):
    """Area of the quadrilateral of a voxel's outer corners over its area at rest."""
    # Each corner relative to the first square, so that no digits are lost far from the origin.
    x = [T.vec(0.0), T.vec(0.0), T.vec(0.0), T.vec(0.0)]
    y = [T.vec(0.0), T.vec(0.0), T.vec(0.0), T.vec(0.0)]
    for k in ti.static(range(4)):
        o = k * lay.BODY_ITEMS
        ax = T.f(material.SQUARE_HALF * material.CORNER_SIGNS[k][0])
        ay = T.f(material.SQUARE_HALF * material.CORNER_SIGNS[k][1])
        c, s = voxel[o + lay.COS], voxel[o + lay.SIN]
        x[k] = (voxel[o + lay.X] - voxel[lay.X]) + (c * ax - s * ay)
        y[k] = (voxel[o + lay.Y] - voxel[lay.Y]) + (s * ax + c * ay)
    cross, _ = ti.static((material.crossed_diagonals(x, y), 0))
    return magnitude(cross, T) * T.f(0.5 / material.VOXEL_SIDE**2)


@ti.func
def touch(voxel: ti.template(), T: ti.template()):
    """1 in lanes where a square of the voxel touches the ground, else 0."""
    deepest = T.vec(-1.0)
    for pair in range(4 * lay.PAIRS_PER_BODY):
        for p in range(2):
            o = lay.PAIRS + pair * lay.PAIR_ITEMS + lay.PA_POINTS + p * lay.POINT_ITEMS
            deepest = ti.max(deepest, voxel[o + lay.PT_DEPTH])
    return ti.select(deepest >= T.f(0.0), T.vec(1.0), T.vec(0.0))


@ti.func
def frame(voxel: ti.template(), T: ti.template()):
    """Cosine and sine of a voxel's angle: the mean of the directions SW->SE and NW->NE."""
    ne, se, sw = lay.BODY_ITEMS, 2 * lay.BODY_ITEMS, 3 * lay.BODY_ITEMS
    ax, ay = voxel[se + lay.X] - voxel[sw + lay.X], voxel[se + lay.Y] - voxel[sw + lay.Y]
    bx, by = voxel[ne + lay.X] - voxel[lay.X], voxel[ne + lay.Y] - voxel[lay.Y]
    # The sum of two unit vectors points along the mean of their angles.
    inverse_a = T.f(1.0) / ti.sqrt(ax * ax + ay * ay)
    inverse_b = T.f(1.0) / ti.sqrt(bx * bx + by * by)
    c = ax * inverse_a + bx * inverse_b
    s = ay * inverse_a + by * inverse_b
    inverse = T.f(1.0) / ti.sqrt(c * c + s * s)
    return c * inverse, s * inverse


@ti.func
def _own_velocity(voxel: ti.template(), c, s, along_x, T: ti.template()):
    """Mean velocity of a voxel's squares along an axis of its frame, times the gain."""
    vx = T.vec(0.0)
    vy = T.vec(0.0)
    for k in range(4):
        vx += voxel[k * lay.BODY_ITEMS + lay.VX]
        vy += voxel[k * lay.BODY_ITEMS + lay.VY]
    speed = c * vx + s * vy
    if not along_x:
        speed = c * vy - s * vx
    return speed * T.f(0.25 * _SPEED_GAIN)


@ti.func
def _find_window(S: ti.template(), m: ti.template(), row, T: ti.template()):
    """Where the window over a reading's interval stands after this step, lane by lane.

    Each lane has its own step count k: the sample goes to slot k mod slots, and the window
    holds as many samples as the table says: that of the first steps, and beyond them that of the
    steps from which windows have another length.
    """
    slots = ti.cast(m.integers[row + RE_SLOTS], ti.u32)
    table = m.interval_table + m.integers[row + RE_INTERVAL] * m.interval_row
    for lane in range(T.lanes):
        k = step_counter.steps(S, m, lane)
        length = 0
        if k > ti.u32(0):
            entry = table + ti.cast(k, ti.i32) - 1
            if k > ti.cast(m.interval_steps, ti.u32):
                entry = table + m.interval_steps
                end = table + m.interval_row - 2
                while entry < end and k >= ti.cast(m.integers[entry + 2], ti.u32):
                    entry += 2
                entry += 1
            length = m.integers[entry]
        S[m.header + lay.H_PLACE][lane] = ti.cast(k % slots, T.f)
        S[m.header + lay.H_LENGTH][lane] = ti.cast(length, T.f)


@ti.func
def _average(S: ti.template(), m: ti.template(), row, value, T: ti.template()):
    """Puts a sample into a reading's ring and averages its window; before the first step the
    value is 0."""
    slots = m.integers[row + RE_SLOTS]
    ring = m.rings + m.integers[row + RE_RING]
    place = S[m.header + lay.H_PLACE]
    length = S[m.header + lay.H_LENGTH]
    total = T.vec(0.0)
    zero = T.vec(0.0)
    for slot in range(slots):
        index = ti.cast(slot, T.f)
        kept = S.at[ring + slot]
        sample = ti.select(place == index, value, kept[0])
        kept[0] = sample
        age = place - index
        age = ti.select(age < zero, age + ti.cast(slots, T.f), age)
        total += ti.select(age < length, sample, zero)
    return ti.select(length > zero, total / ti.max(length, T.vec(1.0)), zero)


@ti.func
def _cast_ray(
    S: ti.template(),
    m: ti.template(),
    voxel: ti.template(),
    ray,
    c,
    s,
    T: ti.template(),
):
    """Distance from a voxel's centre to the ground along a ray, over the lidar's range."""
    x = T.vec(0.0)
    y = T.vec(0.0)
    for k in range(4):
        x += voxel[k * lay.BODY_ITEMS + lay.X]
        y += voxel[k * lay.BODY_ITEMS + lay.Y]
    x = x * T.f(0.25)
    y = y * T.f(0.25)
    zero = T.vec(0.0)
    numbers = m.own_numbers + F_RAYS + F_RAY_ROW * ray
    cr, sr, far = m.numbers[numbers], m.numbers[numbers + 1], m.numbers[numbers + 2]
    ux = c * cr - s * sr
    uy = s * cr + c * sr
    nearest = T.vec(far)
    for k in range(m.segments):
        segment = S.at[m.window + lay.SEGMENT_ITEMS * k]
        tx, ty = segment[lay.SE_TX], segment[lay.SE_TY]
        dx, dy = x - segment[lay.SE_X], y - segment[lay.SE_Y]
        # Height above the line falls by ``sinks`` per metre along the ray.
        sinks = ux * ty - uy * tx
        distance = (dy * tx - dx * ty) / sinks
        along = (dx * tx + dy * ty) + distance * (ux * tx + uy * ty)
        hits = (distance >= zero) & (distance < nearest)
        hits = hits & (along >= zero) & (along <= segment[lay.SE_LENGTH])
        nearest = ti.select(hits, distance, nearest)
    return nearest / far
