"""Contacts with the ground: friction and non-penetration as accumulated, clamped impulses.

Works on the pairs that ``ground.detect`` listed. In lanes without the contact the effective
masses are zero, so that every impulse is zero (MODEL.md, section 4).
"""

from physics.backend import ti
from physics.engine.integrator import move
from physics.engine.lane_math import any_lane, limited
from physics.engine.memory import layout as lay
from physics.engine.memory.tables import F_FRICTION
from physics.scene import material


@ti.func
def prepare(S: ti.template(), m: ti.template(), T: ti.template()):
    """Arms, effective masses and target velocities of all contacts, then warm starts."""
    count = S.lists[lay.L_CONTACTS]
    for n in range(count):
        pair = S.at[S.lists[m.contact_list + 2 * n]]
        body = S.at[S.lists[m.contact_list + 2 * n + 1]]
        for p in range(2):
            _prepare_point(pair, body, lay.PA_POINTS + p * lay.POINT_ITEMS, T)
    for n in range(count):
        pair = S.at[S.lists[m.contact_list + 2 * n]]
        body = S.at[S.lists[m.contact_list + 2 * n + 1]]
        nx, ny = pair[lay.PA_NX], pair[lay.PA_NY]
        for p in range(2):
            o = lay.PA_POINTS + p * lay.POINT_ITEMS
            jn, jt = pair[o + lay.PT_JN], pair[o + lay.PT_JT]
            body[lay.VX] = body[lay.VX] + (nx * jn + ny * jt)
            body[lay.VY] = body[lay.VY] + (ny * jn - nx * jt)
            body[lay.W] = body[lay.W] + (pair[o + lay.PT_RN] * jn + pair[o + lay.PT_RT] * jt)


@ti.func
def _prepare_point(pair: ti.template(), body: ti.template(), o, T: ti.template()):
    """The normal is (nx, ny), the tangent (ny, -nx)."""
    zero = T.vec(0.0)
    touches = pair[o + lay.PT_DEPTH] >= zero
    nx, ny = pair[lay.PA_NX], pair[lay.PA_NY]
    rx = pair[o + lay.PT_PX] - body[lay.X]
    ry = pair[o + lay.PT_PY] - body[lay.Y]
    rn = (rx * ny - ry * nx) * T.f(1 / lay.GYRATION)
    rt = (rx * nx + ry * ny) * T.f(-1 / lay.GYRATION)
    one = T.f(1.0)
    pair[o + lay.PT_RN] = rn
    pair[o + lay.PT_RT] = rt
    pair[o + lay.PT_MN] = ti.select(touches, one / (one + rn * rn), zero)
    pair[o + lay.PT_MT] = ti.select(touches, one / (one + rt * rt), zero)
    pair[o + lay.PT_JP] = zero
    speed = nx * body[lay.VX] + ny * body[lay.VY] + rn * body[lay.W]
    bounces = speed < T.f(-material.RESTITUTION_SPEED)
    pair[o + lay.PT_TARGET] = ti.select(bounces, speed * T.f(-material.RESTITUTION), zero)


@ti.func
def solve_velocities(S: ti.template(), m: ti.template(), T: ti.template()):
    """One iteration: for each pair the friction of its points, then their normal impulses."""
    friction = _friction(S, m, T)
    zero = T.vec(0.0)
    for n in range(S.lists[lay.L_CONTACTS]):
        pair = S.at[S.lists[m.contact_list + 2 * n]]
        body = S.at[S.lists[m.contact_list + 2 * n + 1]]
        nx, ny = pair[lay.PA_NX], pair[lay.PA_NY]
        vx, vy, w = body[lay.VX], body[lay.VY], body[lay.W]
        for p in range(2):
            o = lay.PA_POINTS + p * lay.POINT_ITEMS
            rt, old = pair[o + lay.PT_RT], pair[o + lay.PT_JT]
            limit = friction * pair[o + lay.PT_JN]
            total = old - pair[o + lay.PT_MT] * ((ny * vx - nx * vy) + rt * w)
            total = limited(total, limit, T)
            change = total - old
            pair[o + lay.PT_JT] = total
            vx += ny * change
            vy = vy - nx * change
            w += rt * change
        for p in range(2):
            o = lay.PA_POINTS + p * lay.POINT_ITEMS
            rn, old = pair[o + lay.PT_RN], pair[o + lay.PT_JN]
            speed = ((nx * vx + ny * vy) + rn * w) - pair[o + lay.PT_TARGET]
            total = old - pair[o + lay.PT_MN] * speed
            total = ti.select(total < zero, zero, total)
            change = total - old
            pair[o + lay.PT_JN] = total
            vx += nx * change
            vy += ny * change
            w += rn * change
        body[lay.VX] = vx
        body[lay.VY] = vy
        body[lay.W] = w


@ti.func
def _friction(S: ti.template(), m: ti.template(), T: ti.template()):
    """The coefficient of friction, of every world or of all."""
    if ti.static(T.features.varied):
        return S[m.header + lay.H_FRICTION]
    return m.numbers[F_FRICTION]


@ti.func
def solve_positions(S: ti.template(), m: ti.template(), live, T: ti.template()):
    """One iteration of the position stage on live lanes; returns the lanes still too deep."""
    zero = T.vec(0.0)
    tolerance = T.f(material.LINEAR_TOLERANCE)
    off = live < live
    for n in range(S.lists[lay.L_CONTACTS]):
        pair = S.at[S.lists[m.contact_list + 2 * n]]
        body = S.at[S.lists[m.contact_list + 2 * n + 1]]
        nx, ny = pair[lay.PA_NX], pair[lay.PA_NY]
        for p in range(2):
            o = lay.PA_POINTS + p * lay.POINT_ITEMS
            mask = (live > T.f(0.0)) & (pair[o + lay.PT_DEPTH] >= zero)
            if any_lane(mask, T):
                c, s = body[lay.COS], body[lay.SIN]
                lx, ly = pair[o + lay.PT_LX], pair[o + lay.PT_LY]
                rx = c * lx - s * ly
                ry = s * lx + c * ly
                dx = (body[lay.X] + rx) - pair[o + lay.PT_PX]
                dy = (body[lay.Y] + ry) - pair[o + lay.PT_PY]
                separation = (dx * nx + dy * ny) - pair[o + lay.PT_DEPTH]
                off = off | (mask & (separation < T.f(-3.0) * tolerance))
                error = separation + tolerance
                deepest = T.vec(-material.MAX_CORRECTION)
                error = ti.select(error > zero, zero, ti.select(error < deepest, deepest, error))
                rn = (rx * ny - ry * nx) * T.f(1 / lay.GYRATION)
                old = pair[o + lay.PT_JP]
                total = old - error * T.f(material.BAUMGARTE) / (T.f(1.0) + rn * rn)
                total = ti.select(mask & (total > zero), total, ti.select(mask, zero, old))
                change = total - old
                pair[o + lay.PT_JP] = total
                turn = rn * change * T.f(1 / lay.GYRATION)
                move(body, mask, nx * change, ny * change, turn, T)
    return off
