"""Free motion of the squares: gravity and damping, then positions from velocities."""

from physics.backend import ti
from physics.engine.lane_math import any_lane, limited, rotate
from physics.engine.memory import layout as lay
from physics.engine.memory.tables import F_DAMPING, F_GRAVITY
from physics.scene import material


@ti.func
def integrate_velocities(S: ti.template(), m: ti.template(), T: ti.template()):
    """v += g dt, then v and omega are damped."""
    fall = gravity(S, m, T) * T.f(material.DT)
    keep = T.f(1.0) - m.numbers[F_DAMPING] * T.f(material.DT)
    for v in range(m.voxels):
        for k in range(4):
            body = S.at[v * lay.VOXEL_ITEMS + k * lay.BODY_ITEMS]
            body[lay.VX] = body[lay.VX] * keep
            body[lay.VY] = (body[lay.VY] - fall) * keep
            body[lay.W] = body[lay.W] * keep


@ti.func
def gravity(S: ti.template(), m: ti.template(), T: ti.template()):
    """Downward acceleration [m/s^2], of every world or of all."""
    if ti.static(T.features.varied):
        return S[m.header + lay.H_GRAVITY]
    return m.numbers[F_GRAVITY]


@ti.func
def integrate_positions(S: ti.template(), m: ti.template(), T: ti.template()):
    """x += v dt and a rotation by omega dt, both limited per step. Worlds that are over rest."""
    alive = S[m.header + lay.H_ALIVE] > T.f(0.0)
    longest = T.f(material.MAX_TRANSLATION)
    widest = T.vec(material.MAX_ROTATION)
    zero = T.vec(0.0)
    for v in range(m.voxels):
        for k in range(4):
            body = S.at[v * lay.VOXEL_ITEMS + k * lay.BODY_ITEMS]
            dx = body[lay.VX] * T.f(material.DT)
            dy = body[lay.VY] * T.f(material.DT)
            turn = body[lay.W] * T.f(material.DT / lay.GYRATION)
            squared = dx * dx + dy * dy
            too_far = squared > longest * longest
            if any_lane(too_far, T):
                scale = ti.select(too_far, longest / ti.sqrt(squared), T.vec(1.0))
                dx = dx * scale
                dy = dy * scale
            turn = limited(turn, widest, T)
            move(body, alive, dx, dy, turn, T)
            for item in ti.static((lay.VX, lay.VY, lay.W)):
                body[item] = ti.select(alive, body[item], zero)


@ti.func
def move(body: ti.template(), mask, dx, dy, turn, T: ti.template()):
    """Shifts and turns a body in the lanes of the mask; others keep every bit."""
    x, y, angle = body[lay.X], body[lay.Y], body[lay.ANGLE]
    old_c, old_s = body[lay.COS], body[lay.SIN]
    c, s = rotate(old_c, old_s, turn, T)
    body[lay.X] = ti.select(mask, x + dx, x)
    body[lay.Y] = ti.select(mask, y + dy, y)
    body[lay.ANGLE] = ti.select(mask, angle + turn, angle)
    body[lay.COS] = ti.select(mask, c, old_c)
    body[lay.SIN] = ti.select(mask, s, old_s)
