"""Springs: soft constraints along the line between two anchors (MODEL.md, section 2).

The textbook quantities K (inverse effective mass), gamma (softness) and m = 1 / (K + gamma)
are folded into one scale: with gamma = g K for a constant g, direction, arms, bias and impulse
are stored multiplied or divided by sqrt(m), and one iteration reads

    lambda = -g / (1 + g) acc - bias - J v,    acc += lambda,    v += J^T lambda

where J = (n, arm1, -n, -arm2).
"""

from physics.backend import ti
from physics.engine.memory import layout as lay
from physics.engine.memory.tables import (
    F_SPRING_ROW,
    F_SPRINGS,
    FS_GROW,
    FS_REST,
    FS_SHRINK,
    FS_X1,
    FS_X2,
    FS_Y1,
    FS_Y2,
    I_SPRING_ROW,
    I_SPRINGS,
)
from physics.scene import material

# gamma = SOFTNESS * K, bias = BIAS * (l - L)
SOFTNESS, _RELAX, BIAS = material.spring_constants(
    material.SPRING_FREQUENCY, material.SPRING_DAMPING_RATIO
)
_COUNT = len(material.SPRINGS)


@ti.func
def prepare(S: ti.template(), m: ti.template(), T: ti.template()):
    """Directions, arms and biases for this step; applies the impulses of the last one."""
    for v in range(m.voxels):
        block = v * lay.VOXEL_ITEMS
        for k in range(_COUNT):
            row = F_SPRINGS + F_SPRING_ROW * k
            body1 = S.at[block + m.integers[I_SPRINGS + I_SPRING_ROW * k]]
            body2 = S.at[block + m.integers[I_SPRINGS + I_SPRING_ROW * k + 1]]
            spring = S.at[block + lay.SPRINGS + lay.SPRING_ITEMS * k]
            c1, s1 = body1[lay.COS], body1[lay.SIN]
            c2, s2 = body2[lay.COS], body2[lay.SIN]
            r1x = c1 * m.numbers[row + FS_X1] - s1 * m.numbers[row + FS_Y1]
            r1y = s1 * m.numbers[row + FS_X1] + c1 * m.numbers[row + FS_Y1]
            r2x = c2 * m.numbers[row + FS_X2] - s2 * m.numbers[row + FS_Y2]
            r2y = s2 * m.numbers[row + FS_X2] + c2 * m.numbers[row + FS_Y2]
            dx = (body1[lay.X] - body2[lay.X]) + (r1x - r2x)
            dy = (body1[lay.Y] - body2[lay.Y]) + (r1y - r2y)
            cross1 = (r1x * dy - r1y * dx) * T.f(1 / lay.GYRATION)
            cross2 = (r2x * dy - r2y * dx) * T.f(1 / lay.GYRATION)
            squared = dx * dx + dy * dy
            length = ti.sqrt(squared)
            # m = 1 / (K + gamma) = l^2 / q, with K in units of a square's inverse mass. All
            # quotients follow from one division: scale = sqrt(m), and scale / l.
            q = _firmness(S, block, T) * (T.f(2.0) * squared + cross1 * cross1 + cross2 * cross2)
            inverse = T.f(1.0) / (ti.sqrt(q) * length)
            scale = squared * inverse
            per_length = length * inverse
            nx = dx * per_length
            ny = dy * per_length
            arm1 = cross1 * per_length
            arm2 = cross2 * per_length
            actuation = S[block + lay.ACTUATION]
            slope = ti.select(
                actuation >= T.f(0.0),
                T.vec(m.numbers[row + FS_SHRINK]),
                T.vec(m.numbers[row + FS_GROW]),
            )
            rest = m.numbers[row + FS_REST] - slope * actuation
            impulse = spring[lay.SP_IMPULSE] * spring[lay.SP_SCALE] * (q * inverse)
            spring[lay.SP_NX] = nx
            spring[lay.SP_NY] = ny
            spring[lay.SP_ARM1] = arm1
            spring[lay.SP_ARM2] = arm2
            spring[lay.SP_BIAS] = (length - rest) * scale * _bias(S, block, T)
            spring[lay.SP_IMPULSE] = impulse
            spring[lay.SP_SCALE] = scale
            body1[lay.VX] = body1[lay.VX] + nx * impulse
            body1[lay.VY] = body1[lay.VY] + ny * impulse
            body1[lay.W] = body1[lay.W] + arm1 * impulse
            body2[lay.VX] = body2[lay.VX] - nx * impulse
            body2[lay.VY] = body2[lay.VY] - ny * impulse
            body2[lay.W] = body2[lay.W] - arm2 * impulse


@ti.func
def solve_velocities(S: ti.template(), m: ti.template(), T: ti.template()):
    """One iteration over all springs; the velocities of a voxel stay in registers."""
    for v in range(m.voxels):
        voxel = S.at[v * lay.VOXEL_ITEMS]
        vx = [voxel[k * lay.BODY_ITEMS + lay.VX] for k in range(4)]
        vy = [voxel[k * lay.BODY_ITEMS + lay.VY] for k in range(4)]
        w = [voxel[k * lay.BODY_ITEMS + lay.W] for k in range(4)]
        # The sides N and S join squares (0, 1) and (2, 3), E and W squares (1, 2) and (3, 0): the
        # second round runs the code of the first on squares renumbered by one.
        for half in range(2):
            for link in range(4):
                o = lay.SPRINGS + (half * 4 + link) * (2 * lay.SPRING_ITEMS)
                _solve_one(voxel, o, vx, vy, w, 0, 1, T)
                _solve_one(voxel, o + lay.SPRING_ITEMS, vx, vy, w, 2, 3, T)
            _renumber(vx)
            _renumber(vy)
            _renumber(w)
        central = lay.SPRINGS + 16 * lay.SPRING_ITEMS
        _solve_one(voxel, central, vx, vy, w, 2, 0, T)
        _solve_one(voxel, central + lay.SPRING_ITEMS, vx, vy, w, 3, 1, T)
        for k in ti.static(range(4)):
            o = ((k + 2) % 4) * lay.BODY_ITEMS
            voxel[o + lay.VX] = vx[k]
            voxel[o + lay.VY] = vy[k]
            voxel[o + lay.W] = w[k]


@ti.func
def _firmness(S: ti.template(), block, T: ti.template()):
    """1 + g of a voxel's springs."""
    if ti.static(T.features.varied):
        return S[block + lay.FIRMNESS]
    return T.f(1 + SOFTNESS)


@ti.func
def _bias(S: ti.template(), block, T: ti.template()):
    """Bias of a voxel's springs per metre that they are too long."""
    if ti.static(T.features.varied):
        return S[block + lay.BIAS]
    return T.f(BIAS)


@ti.func
def _relax(voxel: ti.template(), T: ti.template()):
    """-g / (1 + g) of a voxel's springs."""
    if ti.static(T.features.varied):
        return voxel[lay.RELAX]
    return T.f(-_RELAX)


@ti.func
def _renumber(a: ti.template()):
    """Square k + 1 becomes square k."""
    first = a[0]
    for k in ti.static(range(3)):
        a[k] = a[k + 1]
    a[3] = first


@ti.func
def _solve_one(
    voxel: ti.template(),
    o,
    vx: ti.template(),
    vy: ti.template(),
    w: ti.template(),
    i: ti.template(),
    j: ti.template(),
    T: ti.template(),
):
    """One iteration of the spring at offset o of a voxel, between squares i and j."""
    nx, ny = voxel[o + lay.SP_NX], voxel[o + lay.SP_NY]
    arm1, arm2 = voxel[o + lay.SP_ARM1], voxel[o + lay.SP_ARM2]
    acc = voxel[o + lay.SP_IMPULSE]
    speed = (nx * (vx[i] - vx[j]) + ny * (vy[i] - vy[j])) + (arm1 * w[i] - arm2 * w[j])
    change = (acc * _relax(voxel, T) - voxel[o + lay.SP_BIAS]) - speed
    voxel[o + lay.SP_IMPULSE] = acc + change
    px = nx * change
    py = ny * change
    vx[i] += px
    vy[i] += py
    w[i] += arm1 * change
    vx[j] = vx[j] - px
    vy[j] = vy[j] - py
    w[j] = w[j] - arm2 * change
