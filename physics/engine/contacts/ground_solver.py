"""Contacts with the ground: friction and non-penetration as accumulated, clamped impulses.

Works on the pairs that ``ground.detect`` listed. In lanes without the contact the effective
masses are zero, so that every impulse is zero (REFERENCE: contact).
"""

from physics.backend import ti
from physics.engine.integrator import move
from physics.engine.lane_math import any_lane, limited
from physics.engine.memory import layout as lay
from physics.engine.memory.model import F_FRICTION
from physics.scene import material


@ti.func
def prepare(S: ti.template(), lists: ti.template(), g, m: ti.template(), T: ti.template()):
    """Arms, effective masses and target velocities of all contacts, then warm starts."""
    count = lists[g, lay.L_CONTACTS]
    for n in range(count):
        pair = lists[g, m.contact_list + 2 * n]
        body = lists[g, m.contact_list + 2 * n + 1]
        for p in range(2):
            _prepare_point(S, g, pair, body, pair + lay.PA_POINTS + p * lay.POINT_ITEMS, T)
    for n in range(count):
        pair = lists[g, m.contact_list + 2 * n]
        body = lists[g, m.contact_list + 2 * n + 1]
        nx, ny = S[g, pair + lay.PA_NX], S[g, pair + lay.PA_NY]
        for p in range(2):
            o = pair + lay.PA_POINTS + p * lay.POINT_ITEMS
            jn, jt = S[g, o + lay.PT_JN], S[g, o + lay.PT_JT]
            S[g, body + lay.VX] = S[g, body + lay.VX] + (nx * jn + ny * jt)
            S[g, body + lay.VY] = S[g, body + lay.VY] + (ny * jn - nx * jt)
            S[g, body + lay.W] = S[g, body + lay.W] + (
                S[g, o + lay.PT_RN] * jn + S[g, o + lay.PT_RT] * jt
            )


@ti.func
def _prepare_point(S: ti.template(), g, pair, body, o, T: ti.template()):
    """The normal is (nx, ny), the tangent (ny, -nx)."""
    zero = T.vec(0.0)
    touches = S[g, o + lay.PT_DEPTH] >= zero
    nx, ny = S[g, pair + lay.PA_NX], S[g, pair + lay.PA_NY]
    rx = S[g, o + lay.PT_PX] - S[g, body + lay.X]
    ry = S[g, o + lay.PT_PY] - S[g, body + lay.Y]
    rn = (rx * ny - ry * nx) * T.f(1 / lay.GYRATION)
    rt = (rx * nx + ry * ny) * T.f(-1 / lay.GYRATION)
    one = T.f(1.0)
    S[g, o + lay.PT_RN] = rn
    S[g, o + lay.PT_RT] = rt
    S[g, o + lay.PT_MN] = ti.select(touches, one / (one + rn * rn), zero)
    S[g, o + lay.PT_MT] = ti.select(touches, one / (one + rt * rt), zero)
    S[g, o + lay.PT_JP] = zero
    speed = nx * S[g, body + lay.VX] + ny * S[g, body + lay.VY] + rn * S[g, body + lay.W]
    bounces = speed < T.f(-material.RESTITUTION_SPEED)
    S[g, o + lay.PT_TARGET] = ti.select(bounces, speed * T.f(-material.RESTITUTION), zero)


@ti.func
def solve_velocities(
    S: ti.template(), lists: ti.template(), g, m: ti.template(), mf: ti.template(), T: ti.template()
):
    """One iteration: for each pair the friction of its points, then their normal impulses."""
    friction = mf[F_FRICTION]
    zero = T.vec(0.0)
    for n in range(lists[g, lay.L_CONTACTS]):
        pair = lists[g, m.contact_list + 2 * n]
        body = lists[g, m.contact_list + 2 * n + 1]
        nx, ny = S[g, pair + lay.PA_NX], S[g, pair + lay.PA_NY]
        vx, vy, w = S[g, body + lay.VX], S[g, body + lay.VY], S[g, body + lay.W]
        for p in range(2):
            o = pair + lay.PA_POINTS + p * lay.POINT_ITEMS
            rt, old = S[g, o + lay.PT_RT], S[g, o + lay.PT_JT]
            limit = friction * S[g, o + lay.PT_JN]
            total = old - S[g, o + lay.PT_MT] * ((ny * vx - nx * vy) + rt * w)
            total = limited(total, limit, T)
            change = total - old
            S[g, o + lay.PT_JT] = total
            vx += ny * change
            vy = vy - nx * change
            w += rt * change
        for p in range(2):
            o = pair + lay.PA_POINTS + p * lay.POINT_ITEMS
            rn, old = S[g, o + lay.PT_RN], S[g, o + lay.PT_JN]
            speed = ((nx * vx + ny * vy) + rn * w) - S[g, o + lay.PT_TARGET]
            total = old - S[g, o + lay.PT_MN] * speed
            total = ti.select(total < zero, zero, total)
            change = total - old
            S[g, o + lay.PT_JN] = total
            vx += nx * change
            vy += ny * change
            w += rn * change
        S[g, body + lay.VX] = vx
        S[g, body + lay.VY] = vy
        S[g, body + lay.W] = w


@ti.func
def solve_positions(
    S: ti.template(), lists: ti.template(), g, m: ti.template(), live, T: ti.template()
):
    """One iteration of the position stage on live lanes; returns the lanes still too deep."""
    zero = T.vec(0.0)
    tolerance = T.f(material.LINEAR_TOLERANCE)
    off = live < live
    for n in range(lists[g, lay.L_CONTACTS]):
        pair = lists[g, m.contact_list + 2 * n]
        body = lists[g, m.contact_list + 2 * n + 1]
        nx, ny = S[g, pair + lay.PA_NX], S[g, pair + lay.PA_NY]
        for p in range(2):
            o = pair + lay.PA_POINTS + p * lay.POINT_ITEMS
            mask = (live > T.f(0.0)) & (S[g, o + lay.PT_DEPTH] >= zero)
            if any_lane(mask, T):
                c, s = S[g, body + lay.COS], S[g, body + lay.SIN]
                lx, ly = S[g, o + lay.PT_LX], S[g, o + lay.PT_LY]
                rx = c * lx - s * ly
                ry = s * lx + c * ly
                dx = (S[g, body + lay.X] + rx) - S[g, o + lay.PT_PX]
                dy = (S[g, body + lay.Y] + ry) - S[g, o + lay.PT_PY]
                separation = (dx * nx + dy * ny) - S[g, o + lay.PT_DEPTH]
                off = off | (mask & (separation < T.f(-3.0) * tolerance))
                error = separation + tolerance
                deepest = T.vec(-material.MAX_CORRECTION)
                error = ti.select(error > zero, zero, ti.select(error < deepest, deepest, error))
                rn = (rx * ny - ry * nx) * T.f(1 / lay.GYRATION)
                old = S[g, o + lay.PT_JP]
                total = old - error * T.f(material.BAUMGARTE) / (T.f(1.0) + rn * rn)
                total = ti.select(mask & (total > zero), total, ti.select(mask, zero, old))
                change = total - old
                S[g, o + lay.PT_JP] = total
                turn = rn * change * T.f(1 / lay.GYRATION)
                move(S, g, body, mask, nx * change, ny * change, turn, T)
    return off
