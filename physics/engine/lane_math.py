"""Small functions on lane vectors: tanh, rotation, lane tests."""

from physics.backend import ti

# tanh(x) = x P(x^2) / Q(x^2) on |x| <= 8, a least-maximum fit of relative error 6.4e-9
# (below float32 rounding); beyond, tanh is 1 in float32. LLVM packs it, unlike libm's tanh.
_TANH_LIMIT = 8.0
_TANH_P = (
    1.5230357886165323e-08,
    2.1894620954510874e-05,
    0.0035715956001018817,
    0.1344449595479643,
    0.9999999935696097,
)
_TANH_Q = (
    8.522422834078442e-07,
    0.0003411288010218295,
    0.026164433766535353,
    0.4677782327397449,
    1.0,
)


@ti.func
def polynomial(z, coefficients: ti.template(), T: ti.template()):
    """The polynomial in z with these coefficients, the highest power first."""
    result = T.vec(coefficients[0])
    for c in ti.static(coefficients[1:]):
        result = result * z + T.f(c)
    return result


@ti.func
def any_lane(mask, T: ti.template()):
    """Whether the mask is set in any lane.

    LLVM makes two instructions of this chain, but one after the other of a chain of ``max``.
    """
    flags = ti.select(mask, T.flags(1), T.flags(0))
    union, _ = ti.static((T.union(flags), 0))  # static takes no expression that stands alone
    return union != 0


@ti.func
def magnitude(x, T: ti.template()):
    """Absolute value of a lane vector."""
    return ti.max(x, T.f(0.0) - x)


@ti.func
def limited(x, limit, T: ti.template()):
    """A lane vector cut to [-limit, limit]; NaN stays NaN."""
    low = T.f(0.0) - limit
    return ti.select(x > limit, limit, ti.select(x < low, low, x))


@ti.func
def tanh(x, T: ti.template()):
    """Hyperbolic tangent of a lane vector; NaN stays NaN."""
    result = x
    if ti.static(T.double):
        result = T.vec([ti.tanh(x[lane]) for lane in range(T.lanes)])
    else:
        clipped = limited(x, T.vec(_TANH_LIMIT), T)
        z = clipped * clipped
        result = clipped * polynomial(z, _TANH_P, T) / polynomial(z, _TANH_Q, T)
    return result


# Taylor coefficients of sin(x)/x and cos(x) in x^2. The angle per step stays far below 1 rad
# in any gait; at the limit of pi/2 the single-precision pair is wrong by 4e-6 and 3e-5.
_SIN = (1 / 362880, -1 / 5040, 1 / 120, -1 / 6, 1.0)
_COS = (1 / 40320, -1 / 720, 1 / 24, -1 / 2, 1.0)
_SIN_DOUBLE = (-1 / 1307674368000, 1 / 6227020800, -1 / 39916800, *_SIN)
_COS_DOUBLE = (-1 / 87178291200, 1 / 479001600, -1 / 3628800, *_COS)

# Up to this angle x [rad] the first terms alone give the same bits in float32: x^2 / 24 is below
# 2^-26, half the distance from 1/2 to the next smaller number, and x^2 / 120 below 2^-27, half that
# of 1/6 to its neighbours, so that the higher terms change neither coefficient.
TINY_TURN = 5.9e-4


@ti.func
def sine_cosine(angle, T: ti.template()):
    """Sine and cosine of a small angle [rad]."""
    z = angle * angle
    sine = angle
    cosine = angle
    if ti.static(T.double):
        sine = angle * polynomial(z, _SIN_DOUBLE, T)
        cosine = polynomial(z, _COS_DOUBLE, T)
    else:
        sine = angle * polynomial(z, _SIN, T)
        cosine = polynomial(z, _COS, T)
    return sine, cosine


@ti.func
def sines_cosines(angle1, angle2, T: ti.template()):
    """``sine_cosine`` of two angles, which takes a third of the work where both are tiny."""
    sine1, cosine1, sine2, cosine2 = angle1, angle1, angle2, angle2
    if ti.static(T.double):
        sine1, cosine1 = sine_cosine(angle1, T)
        sine2, cosine2 = sine_cosine(angle2, T)
    else:
        z1, z2 = angle1 * angle1, angle2 * angle2
        if any_lane(z1 + z2 > T.f(TINY_TURN**2), T):
            sine1, cosine1 = sine_cosine(angle1, T)
            sine2, cosine2 = sine_cosine(angle2, T)
        else:
            sine1, cosine1 = angle1 * polynomial(z1, _SIN[-2:], T), polynomial(z1, _COS[-2:], T)
            sine2, cosine2 = angle2 * polynomial(z2, _SIN[-2:], T), polynomial(z2, _COS[-2:], T)
    return sine1, cosine1, sine2, cosine2


@ti.func
def turned(c, s, sine, cosine, T: ti.template()):
    """Turns the unit vector (c, s) by an angle and renormalises it."""
    new_c = c * cosine - s * sine
    new_s = s * cosine + c * sine
    # One Newton step towards 1 / |(c, s)|: the length is already 1 up to rounding.
    norm = T.f(1.5) - T.f(0.5) * (new_c * new_c + new_s * new_s)
    return new_c * norm, new_s * norm


@ti.func
def rotate(c, s, angle, T: ti.template()):
    """Turns the unit vector (c, s) by a small angle [rad] and renormalises it."""
    sine, cosine = sine_cosine(angle, T)
    return turned(c, s, sine, cosine, T)
