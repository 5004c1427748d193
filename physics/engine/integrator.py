"""Free motion of the squares: gravity and damping, then positions from velocities."""

from physics.backend import ti
from physics.engine.lane_math import any_lane, limited, rotate
from physics.engine.memory import layout as lay
from physics.engine.memory.model import F_DAMPING, F_GRAVITY
from physics.scene import material


@ti.func
def integrate_velocities(
    S: ti.template(), g, m: ti.template(), mf: ti.template(), T: ti.template()
):
    """v += g dt, then v and omega are damped."""
    fall = mf[F_GRAVITY] * T.f(material.DT)
    keep = T.f(1.0) - mf[F_DAMPING] * T.f(material.DT)
    for v in range(m.voxels):
        for k in range(4):
            o = v * lay.VOXEL_ITEMS + k * lay.BODY_ITEMS
            S[g, o + lay.VX] = S[g, o + lay.VX] * keep
            S[g, o + lay.VY] = (S[g, o + lay.VY] - fall) * keep
            S[g, o + lay.W] = S[g, o + lay.W] * keep


@ti.func
def integrate_positions(S: ti.template(), g, m: ti.template(), T: ti.template()):
    """x += v dt and a rotation by omega dt, both limited per step. Worlds that are over rest."""
    alive = S[g, m.header + lay.H_ALIVE] > T.f(0.0)
    longest = T.f(material.MAX_TRANSLATION)
    widest = T.vec(material.MAX_ROTATION)
    zero = T.vec(0.0)
    for v in range(m.voxels):
        for k in range(4):
            o = v * lay.VOXEL_ITEMS + k * lay.BODY_ITEMS
            dx = S[g, o + lay.VX] * T.f(material.DT)
            dy = S[g, o + lay.VY] * T.f(material.DT)
            turn = S[g, o + lay.W] * T.f(material.DT / lay.GYRATION)
            squared = dx * dx + dy * dy
            too_far = squared > longest * longest
            if any_lane(too_far, T):
                scale = ti.select(too_far, longest / ti.sqrt(squared), T.vec(1.0))
                dx = dx * scale
                dy = dy * scale
            turn = limited(turn, widest, T)
            move(S, g, o, alive, dx, dy, turn, T)
            for item in ti.static((lay.VX, lay.VY, lay.W)):
                S[g, o + item] = ti.select(alive, S[g, o + item], zero)


@ti.func
def move(S: ti.template(), g, o, mask, dx, dy, turn, T: ti.template()):
    """Shifts and turns the body at offset o in the lanes of the mask; others keep every bit."""
    x, y, angle = S[g, o + lay.X], S[g, o + lay.Y], S[g, o + lay.ANGLE]
    old_c, old_s = S[g, o + lay.COS], S[g, o + lay.SIN]
    c, s = rotate(old_c, old_s, turn, T)
    S[g, o + lay.X] = ti.select(mask, x + dx, x)
    S[g, o + lay.Y] = ti.select(mask, y + dy, y)
    S[g, o + lay.ANGLE] = ti.select(mask, angle + turn, angle)
    S[g, o + lay.COS] = ti.select(mask, c, old_c)
    S[g, o + lay.SIN] = ti.select(mask, s, old_s)
