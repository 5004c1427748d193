"""Random numbers in kernels: a hash of (world's seed, step, index), the same in any batch.

The hash is the 32-bit finaliser known as "lowbias32" (C. Wellons, hash-prospector); normal
deviates come from the Box-Muller transform. Both are computed in single precision whatever the
precision of the simulation, so that the two see the same noise.
"""

import math

from physics.backend import ti
from physics.engine import step_counter
from physics.engine.memory import layout as lay

_LOG_2 = math.log(2)

# Streams of one step: what a number is for.
FIRST_NORMAL, SECOND_NORMAL, ACTUATION = (0x9E3779B9, 0x85EBCA6B, 0xC2B2AE35)


@ti.func
def key(S: ti.template(), m: ti.template(), lane):
    """The key of this step of one world: seed and step mixed (uint32)."""
    low = ti.cast(S[m.header + lay.H_SEED_LOW][lane], ti.u32)
    high = ti.cast(S[m.header + lay.H_SEED_HIGH][lane], ti.u32)
    return _mixed(low, high, step_counter.steps(S, m, lane))


@ti.func
def keys(S: ti.template(), m: ti.template(), T: ti.template()):
    """The keys of this step of all worlds of a group (a uint32 per lane)."""
    low = _whole(S[m.header + lay.H_SEED_LOW], T)
    high = _whole(S[m.header + lay.H_SEED_HIGH], T)
    step = _whole(S[m.header + lay.H_STEP], T)
    step_high = _whole(S[m.header + lay.H_STEP_HIGH], T)
    return _mixed(low, high, step_counter.joined(step, step_high))


@ti.func
def _mixed(low, high, steps):
    return mix(mix(low | (high << ti.u32(16))) + steps)


@ti.func
def _whole(x, T: ti.template()):
    """Whole numbers of a lane vector (uint32)."""
    return T.words([ti.cast(x[lane], ti.u32) for lane in range(T.lanes)])


@ti.func
def mix(x):
    """A bijection of uint32 whose output bits all depend on all input bits."""
    y = x ^ (x >> ti.u32(16))
    y = y * ti.u32(0x21F0AAAD)
    y = y ^ (y >> ti.u32(15))
    y = y * ti.u32(0xD35A2D97)
    return y ^ (y >> ti.u32(15))


@ti.func
def bits(step_key, stream: ti.template(), index):
    """32 random bits for one use in a step (uint32)."""
    return mix(step_key + mix(ti.u32(stream) + ti.cast(index, ti.u32)))


@ti.func
def uniform(bits):
    """A number in [0, 1) from the upper 24 of 32 random bits (float32)."""
    return ti.cast(bits >> ti.u32(8), ti.f32) * ti.f32(2.0**-24)


@ti.func
def normal_pairs(bits1, bits2, T: ti.template()):
    """Two independent standard normal deviates per lane (float32)."""
    # u in (0, 1] as m 2^e with m in [sqrt(1/2), sqrt(2)): log(u) by a series in m - 1 over m + 1.
    u = _uniforms(bits1, T) + ti.f32(2.0**-25)
    word = T.flags([ti.bit_cast(u[lane], ti.i32) for lane in range(T.lanes)])
    exponent = (word - 0x3F3504F3) >> 23
    mantissa = word - (exponent << 23)
    m = T.singles([ti.bit_cast(mantissa[lane], ti.f32) for lane in range(T.lanes)])
    r = (m - ti.f32(1.0)) / (m + ti.f32(1.0))
    z = r * r
    series = ti.f32(2 / 9) * z + ti.f32(2 / 7)
    series = (series * z + ti.f32(2 / 5)) * z + ti.f32(2 / 3)
    whole = T.singles([ti.cast(exponent[lane], ti.f32) for lane in range(T.lanes)])
    log_u = whole * ti.f32(_LOG_2) + r * (series * z + ti.f32(2.0))
    radius = ti.sqrt(ti.f32(-2.0) * log_u)
    # The angle in [-pi/4, pi/4) and one of four quarter turns.
    quarter = bits2 >> ti.u32(30)
    angle = (_uniforms(bits2 << ti.u32(2), T) - ti.f32(0.5)) * ti.f32(math.pi / 2)
    a = angle * angle
    s = ((a * ti.f32(-1 / 5040) + ti.f32(1 / 120)) * a - ti.f32(1 / 6)) * a
    s = angle + angle * s
    c = (a * ti.f32(1 / 40320) - ti.f32(1 / 720)) * a + ti.f32(1 / 24)
    c = (c * a - ti.f32(0.5)) * a + ti.f32(1.0)
    odd = (quarter & ti.u32(1)) == ti.u32(1)
    x = ti.select(odd, s, c)
    y = ti.select(odd, c, s)
    return (
        radius * ti.select(quarter >= ti.u32(2), x * ti.f32(-1.0), x),
        radius * ti.select((quarter == ti.u32(1)) | (quarter == ti.u32(2)), y * ti.f32(-1.0), y),
    )


@ti.func
def _uniforms(bits, T: ti.template()):
    """``uniform`` of every lane."""
    return T.singles([uniform(bits[lane]) for lane in range(T.lanes)])


@ti.func
def add_to_readings(S: ti.template(), m: ti.template(), T: ti.template()):
    """Adds normal noise to every reading, each of its own standard deviation; no clipping."""
    step_keys = keys(S, m, T)
    for pair in range((m.readings + 1) // 2):
        first, second = normal_pairs(
            bits(step_keys, FIRST_NORMAL, pair), bits(step_keys, SECOND_NORMAL, pair), T
        )
        readings = S.at[m.reading_block + 2 * pair]
        readings[0] = readings[0] + m.numbers[m.noise_table + 2 * pair] * _widened(first, T)
        if 2 * pair + 1 < m.readings:
            readings[1] = readings[1] + m.numbers[m.noise_table + 2 * pair + 1] * _widened(
                second, T
            )


@ti.func
def _widened(x, T: ti.template()):
    """Single-precision lanes in the precision of the simulation."""
    return T.vec([ti.cast(x[lane], T.f) for lane in range(T.lanes)])
