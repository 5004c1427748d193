"""Welds: rigid joints between squares of adjacent voxels (MODEL.md, section 2).

The anchor is the centre of body 1; it lies ROPE_LENGTH = 1.2 m from the centre of body 2 along
that body's axis u (its x axis for a neighbour at the right, its y axis for one above). Along u
the 3x3 system of the joint decouples from the other two directions, and in the frame (u, t),
t = u turned left, its matrix is constant. With lengths in units of GYRATION, rho = 1.2 / kappa:

    K = [[2]] for u,   [[2 + rho^2, rho], [rho, 2]] for (t, angle),   det = 4 + rho^2
"""

import math

from physics.backend import ti
from physics.engine.lane_math import any_lane, sines_cosines, turned
from physics.engine.memory import layout as lay
from physics.engine.memory.tables import I_WELD_ROW
from physics.scene import material

_ARM = material.SQUARE_SIDE  # [m]
_RHO = _ARM / lay.GYRATION
_DET = 4 + _RHO**2
_TT = 2 / _DET  # the inverse of the 2x2 block
_TA = -_RHO / _DET
_AA = (2 + _RHO**2) / _DET


@ti.func
def _axis(c, s, above, T: ti.template()):
    """Unit vector from body 2, whose x axis is (c, s), to the anchor: that axis, or its y axis if
    body 1 lies above."""
    ux = c
    uy = s
    if above != 0:
        ux = T.f(0.0) - s
        uy = c
    return ux, uy


@ti.func
def prepare(S: ti.template(), m: ti.template(), T: ti.template()):
    """Axes for this step; applies the impulses of the last one."""
    for n in range(m.welds):
        row = m.weld_table + I_WELD_ROW * n
        body1, body2 = S.at[m.integers[row]], S.at[m.integers[row + 1]]
        weld = S.at[m.weld_block + lay.WELD_ITEMS * n]
        ux, uy = _axis(body2[lay.COS], body2[lay.SIN], m.integers[row + 2], T)
        weld[lay.WE_UX] = ux
        weld[lay.WE_UY] = uy
        px, py, pw = weld[lay.WE_PX], weld[lay.WE_PY], weld[lay.WE_PW]
        body1[lay.VX] = body1[lay.VX] + px
        body1[lay.VY] = body1[lay.VY] + py
        body1[lay.W] = body1[lay.W] + pw
        body2[lay.VX] = body2[lay.VX] - px
        body2[lay.VY] = body2[lay.VY] - py
        body2[lay.W] = body2[lay.W] - (pw + T.f(_RHO) * (ux * py - uy * px))


@ti.func
def solve_velocities(S: ti.template(), m: ti.template(), T: ti.template()):
    """One iteration over all welds: each makes the bodies' velocities agree at its anchor."""
    for n in range(m.welds):
        row = m.weld_table + I_WELD_ROW * n
        body1, body2 = S.at[m.integers[row]], S.at[m.integers[row + 1]]
        weld = S.at[m.weld_block + lay.WELD_ITEMS * n]
        ux, uy = weld[lay.WE_UX], weld[lay.WE_UY]
        v1x, v1y, w1 = body1[lay.VX], body1[lay.VY], body1[lay.W]
        v2x, v2y, w2 = body2[lay.VX], body2[lay.VY], body2[lay.W]
        dx = v1x - v2x
        dy = v1y - v2y
        error_u = dx * ux + dy * uy
        error_t = (dy * ux - dx * uy) - T.f(_RHO) * w2
        error_a = w1 - w2
        pu = T.f(-0.5) * error_u
        pt = T.f(-_TT) * error_t - T.f(_TA) * error_a
        pw = T.f(-_TA) * error_t - T.f(_AA) * error_a
        px = pu * ux - pt * uy
        py = pu * uy + pt * ux
        weld[lay.WE_PX] = weld[lay.WE_PX] + px
        weld[lay.WE_PY] = weld[lay.WE_PY] + py
        weld[lay.WE_PW] = weld[lay.WE_PW] + pw
        body1[lay.VX] = v1x + px
        body1[lay.VY] = v1y + py
        body1[lay.W] = w1 + pw
        body2[lay.VX] = v2x - px
        body2[lay.VY] = v2y - py
        body2[lay.W] = w2 - (pw + T.f(_RHO) * pt)


@ti.func
def solve_positions(S: ti.template(), m: ti.template(), live, T: ti.template()):
    """One iteration of the position stage on live lanes; returns the lanes still off."""
    mask = live > T.f(0.0)
    off = live < live
    zero = T.vec(0.0)
    for n in range(m.welds):
        row = m.weld_table + I_WELD_ROW * n
        body1, body2 = S.at[m.integers[row]], S.at[m.integers[row + 1]]
        x1, y1, angle1, c1, s1 = _pose(body1)
        x2, y2, angle2, c2, s2 = _pose(body2)
        ux, uy = _axis(c2, s2, m.integers[row + 2], T)
        dx = (x1 - x2) - T.f(_ARM) * ux
        dy = (y1 - y2) - T.f(_ARM) * uy
        angle = _less_than_half_a_turn(angle1 - angle2, T)
        off = off | (
            (dx * dx + dy * dy > T.f(material.LINEAR_TOLERANCE**2))
            | _beyond(angle, material.ANGULAR_TOLERANCE, T)
        )
        error_u = dx * ux + dy * uy
        error_t = dy * ux - dx * uy
        error_a = angle * T.f(lay.GYRATION)
        pu = T.f(-0.5) * error_u
        pt = T.f(-_TT) * error_t - T.f(_TA) * error_a
        pw = T.f(-_TA) * error_t - T.f(_AA) * error_a
        px = ti.select(mask, pu * ux - pt * uy, zero)
        py = ti.select(mask, pu * uy + pt * ux, zero)
        turn1 = ti.select(mask, pw * T.f(1 / lay.GYRATION), zero)
        turn2 = ti.select(mask, (pw + T.f(_RHO) * pt) * T.f(-1 / lay.GYRATION), zero)
        sine1, cosine1, sine2, cosine2 = sines_cosines(turn1, turn2, T)
        new_c1, new_s1 = turned(c1, s1, sine1, cosine1, T)
        new_c2, new_s2 = turned(c2, s2, sine2, cosine2, T)
        body1[lay.X], body1[lay.Y] = x1 + px, y1 + py
        body1[lay.ANGLE] = angle1 + turn1
        body1[lay.COS] = ti.select(mask, new_c1, c1)
        body1[lay.SIN] = ti.select(mask, new_s1, s1)
        body2[lay.X], body2[lay.Y] = x2 - px, y2 - py
        body2[lay.ANGLE] = angle2 + turn2
        body2[lay.COS] = ti.select(mask, new_c2, c2)
        body2[lay.SIN] = ti.select(mask, new_s2, s2)
    return off & mask


@ti.func
def _pose(body: ti.template()):
    """Centre [m], angle [rad], its cosine and sine."""
    return body[lay.X], body[lay.Y], body[lay.ANGLE], body[lay.COS], body[lay.SIN]


@ti.func
def _beyond(angle, limit: ti.template(), T: ti.template()):
    """Lanes where an angle lies outside [-limit, limit]."""
    return (angle > T.f(limit)) | (angle < T.f(-limit))


@ti.func
def _less_than_half_a_turn(angle, T: ti.template()):
    """The same angle in [-pi, pi], if it was in [-3 pi, 3 pi]."""
    result = angle
    if any_lane(_beyond(angle, math.pi, T), T):
        whole_turn = T.f(2 * math.pi)
        result = ti.select(
            angle > T.f(math.pi),
            angle - whole_turn,
            ti.select(angle < T.f(-math.pi), angle + whole_turn, angle),
        )
    return result
