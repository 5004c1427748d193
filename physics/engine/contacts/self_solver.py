"""Contacts between squares of one robot: accumulated, clamped impulses on both.

Works on the self-contacts that ``self_detection.detect`` listed, as ``ground_solver`` does on those
with the ground. In lanes without the contact the effective masses are zero, so that every impulse
is zero.
"""

from physics.backend import ti
from physics.engine.integrator import move
from physics.engine.lane_math import any_lane
from physics.engine.memory import layout as lay
from physics.scene import material

_HUGE = 1e30  # more than any impulse


@ti.func
def prepare(S: ti.template(), m: ti.template(), T: ti.template()):
    """Target velocities of the bounces, from the velocities before any warm start."""
    for n in range(S.lists[lay.L_SELF_CONTACTS]):
        self_contact = S.at[m.self_contact_block + lay.SELF_CONTACT_ITEMS * n]
        entry = m.self_contact_list + lay.SELF_CONTACT_ENTRY * n
        body1, body2 = S.at[S.lists[entry + 1]], S.at[S.lists[entry + 2]]
        nx, ny = self_contact[lay.SC_NX], self_contact[lay.SC_NY]
        dx = body2[lay.VX] - body1[lay.VX]
        dy = body2[lay.VY] - body1[lay.VY]
        w1, w2 = body1[lay.W], body2[lay.W]
        for p in range(2):
            point = lay.SC_POINTS + lay.SELF_CONTACT_POINT_ITEMS * p
            arms = point + lay.MP_ARMS
            turning = (
                self_contact[arms + lay.ARM_ITEMS + lay.AR_N] * w2
                - self_contact[arms + lay.AR_N] * w1
            )
            speed = (nx * dx + ny * dy) + turning
            bounces = speed < T.f(-material.RESTITUTION_SPEED)
            target = ti.select(bounces, speed * T.f(-material.RESTITUTION), T.vec(0.0))
            self_contact[point + lay.MP_TARGET] = target
            self_contact[point + lay.MP_JP] = T.vec(0.0)


@ti.func
def warm_start(S: ti.template(), m: ti.template(), T: ti.template()):
    """Applies the impulses of the last step."""
    for n in range(S.lists[lay.L_SELF_CONTACTS]):
        self_contact = S.at[m.self_contact_block + lay.SELF_CONTACT_ITEMS * n]
        entry = m.self_contact_list + lay.SELF_CONTACT_ENTRY * n
        for second in range(2):
            body = S.at[S.lists[entry + 1 + second]]
            sign = T.f(1.0) if second != 0 else T.f(-1.0)
            nx, ny = self_contact[lay.SC_NX] * sign, self_contact[lay.SC_NY] * sign
            for p in range(2):
                point = lay.SC_POINTS + lay.SELF_CONTACT_POINT_ITEMS * p
                arms = point + lay.MP_ARMS + lay.ARM_ITEMS * second
                jn, jt = self_contact[point + lay.MP_JN], self_contact[point + lay.MP_JT]
                turn = self_contact[arms + lay.AR_N] * jn + self_contact[arms + lay.AR_T] * jt
                body[lay.VX] = body[lay.VX] + (nx * jn + ny * jt)
                body[lay.VY] = body[lay.VY] + (ny * jn - nx * jt)
                body[lay.W] = body[lay.W] + turn * sign


@ti.func
def solve_velocities(S: ti.template(), m: ti.template(), T: ti.template()):
    """One iteration: for each contact the friction of its points, then their normal impulses."""
    for n in range(S.lists[lay.L_SELF_CONTACTS]):
        self_contact = S.at[m.self_contact_block + lay.SELF_CONTACT_ITEMS * n]
        entry = m.self_contact_list + lay.SELF_CONTACT_ENTRY * n
        body1, body2 = S.at[S.lists[entry + 1]], S.at[S.lists[entry + 2]]
        nx, ny = self_contact[lay.SC_NX], self_contact[lay.SC_NY]
        v1x, v1y, w1 = body1[lay.VX], body1[lay.VY], body1[lay.W]
        v2x, v2y, w2 = body2[lay.VX], body2[lay.VY], body2[lay.W]
        zero = T.vec(0.0)
        for k in range(4):
            friction = 1 - k // 2  # arms, masses and impulses: first normal, then tangential
            point = lay.SC_POINTS + lay.SELF_CONTACT_POINT_ITEMS * (k % 2)
            arms = point + lay.MP_ARMS + lay.AR_N + friction
            ux = nx
            uy = ny
            least = zero
            most = T.vec(_HUGE)
            target = self_contact[point + lay.MP_TARGET]
            if friction != 0:
                ux = ny
                uy = zero - nx
                most = self_contact[point + lay.MP_JN] * T.f(material.SELF_FRICTION)
                least = zero - most
                target = zero
            a1, a2 = self_contact[arms], self_contact[arms + lay.ARM_ITEMS]
            speed = (ux * (v2x - v1x) + uy * (v2y - v1y)) + (a2 * w2 - a1 * w1)
            old = self_contact[point + lay.MP_JN + friction]
            total = old - self_contact[point + lay.MP_MN + friction] * (speed - target)
            total = ti.select(total > most, most, ti.select(total < least, least, total))
            change = total - old
            self_contact[point + lay.MP_JN + friction] = total
            px = ux * change
            py = uy * change
            v1x = v1x - px
            v1y = v1y - py
            w1 = w1 - a1 * change
            v2x += px
            v2y += py
            w2 += a2 * change
        body1[lay.VX] = v1x
        body1[lay.VY] = v1y
        body1[lay.W] = w1
        body2[lay.VX] = v2x
        body2[lay.VY] = v2y
        body2[lay.W] = w2


@ti.func
def solve_positions(S: ti.template(), m: ti.template(), live, T: ti.template()):
    """One iteration of the position stage on live lanes; returns the lanes still too deep."""
    zero = T.vec(0.0)
    tolerance = T.f(material.LINEAR_TOLERANCE)
    off = live < live
    for n in range(S.lists[lay.L_SELF_CONTACTS]):
        self_contact = S.at[m.self_contact_block + lay.SELF_CONTACT_ITEMS * n]
        entry = m.self_contact_list + lay.SELF_CONTACT_ENTRY * n
        body1, body2 = S.at[S.lists[entry + 1]], S.at[S.lists[entry + 2]]
        nx, ny = self_contact[lay.SC_NX], self_contact[lay.SC_NY]
        for p in range(2):
            point = lay.SC_POINTS + lay.SELF_CONTACT_POINT_ITEMS * p
            mask = (live > T.f(0.0)) & (self_contact[point + lay.MP_DEPTH] >= zero)
            if any_lane(mask, T):
                r1x, r1y = _arm(body1, self_contact, point + lay.MP_ARMS)
                r2x, r2y = _arm(body2, self_contact, point + lay.MP_ARMS + lay.ARM_ITEMS)
                dx = (body2[lay.X] - body1[lay.X]) + (r2x - r1x)
                dy = (body2[lay.Y] - body1[lay.Y]) + (r2y - r1y)
                separation = (dx * nx + dy * ny) - self_contact[point + lay.MP_DEPTH]
                off = off | (mask & (separation < T.f(-3.0) * tolerance))
                error = separation + tolerance
                # Most are less deep than the tolerance: nothing would change.
                sides = 2 if any_lane(mask & (error < zero), T) else 0
                change, a1, a2 = zero, zero, zero
                if sides > 0:
                    deepest = T.vec(-material.MAX_CORRECTION)
                    error = ti.select(
                        error > zero, zero, ti.select(error < deepest, deepest, error)
                    )
                    a1 = (r1x * ny - r1y * nx) * T.f(1 / lay.GYRATION)
                    a2 = (r2x * ny - r2y * nx) * T.f(1 / lay.GYRATION)
                    old = self_contact[point + lay.MP_JP]
                    total = old - error * T.f(material.BAUMGARTE) / (T.f(2.0) + (a1 * a1 + a2 * a2))
                    total = ti.select(mask & (total > zero), total, ti.select(mask, zero, old))
                    change = total - old
                    self_contact[point + lay.MP_JP] = total
                moves = mask & (change != zero)
                for second in range(sides):  # a loop, because it compiles the code of ``move`` once
                    body = S.at[S.lists[entry + 1 + second]]
                    shift = zero - change
                    arm = a1
                    if second != 0:
                        shift = change
                        arm = a2
                    turn = arm * shift * T.f(1 / lay.GYRATION)
                    move(body, moves, nx * shift, ny * shift, turn, T)
    return off


@ti.func
def _arm(body: ti.template(), self_contact: ti.template(), arms):
    """An arm in the body's frame, along the world's axes."""
    c, s = body[lay.COS], body[lay.SIN]
    x, y = self_contact[arms + lay.AR_X], self_contact[arms + lay.AR_Y]
    return c * x - s * y, s * x + c * y
