"""One step of the engine, stage by stage (MODEL.md, section 3)."""

from physics.backend import ti
from physics.engine import integrator, step_counter
from physics.engine.contacts import (
    continuous,
    ground_detection,
    ground_solver,
    self_detection,
    self_solver,
    terrain_window,
)
from physics.engine.joints import ropes, springs, welds
from physics.engine.lane_math import any_lane, magnitude
from physics.engine.memory import layout as lay

# The stages of a step, bits of a mask: a kernel that times them takes only some, `m.stages`.
MOTION, SPRINGS, ROPES, WELDS, GROUND, POSITIONS, DETECTION, SELF_COLLISION = (
    1 << k for k in range(8)
)


@ti.func
def advance(S: ti.template(), m: ti.template(), T: ti.template()):
    """First half of a step: moves a group of worlds by DT with the actuation in force."""
    if m.stages & MOTION:
        count_step(S, m, T)
        integrator.integrate_velocities(S, m, T)
    prepare(S, m, T)
    for _ in range(m.velocity_iterations):
        solve_velocities(S, m, T)
    if m.stages & MOTION:
        if ti.static(T.features.continuous):
            continuous.remember(S, m, T)
        integrator.integrate_positions(S, m, T)
    if m.stages & POSITIONS:
        solve_positions(S, m, T)


@ti.func
def touch(S: ti.template(), terrain: ti.template(), m: ti.template(), advanced, T: ti.template()):
    """Second half of a step: finds contacts. Without the first (``advanced`` is false) it is a
    look at poses that were set by hand, of which none has landed."""
    if m.stages & DETECTION:
        terrain_window.update(S, terrain, m, T)
        detect(S, m, advanced, T)
    if ti.static(T.features.self_collision):  # noqa: SIM102 - compile-time
        if m.stages & SELF_COLLISION:
            self_detection.detect(S, m, T)
    if m.stages & MOTION:
        mark_ends(S, m, T)


@ti.func
def prepare(S: ti.template(), m: ti.template(), T: ti.template()):
    """Contacts and joints as the velocities find them, with the impulses of the step before."""
    if ti.static(T.features.self_collision):  # noqa: SIM102 - compile-time
        if m.stages & SELF_COLLISION:
            self_solver.prepare(S, m, T)
    if m.stages & GROUND:
        ground_solver.prepare(S, m, T)
    if ti.static(T.features.self_collision):  # noqa: SIM102 - compile-time
        if m.stages & SELF_COLLISION:
            self_solver.warm_start(S, m, T)
    if m.stages & SPRINGS:
        springs.prepare(S, m, T)
    if m.stages & ROPES:
        ropes.prepare(S, m, T)
    if m.stages & WELDS:
        welds.prepare(S, m, T)


@ti.func
def solve_velocities(S: ti.template(), m: ti.template(), T: ti.template()):
    """One round of impulses."""
    if m.stages & SPRINGS:
        springs.solve_velocities(S, m, T)
    if m.stages & ROPES:
        ropes.solve_velocities(S, m, T)
    if m.stages & WELDS:
        welds.solve_velocities(S, m, T)
    if ti.static(T.features.self_collision):  # noqa: SIM102 - compile-time
        if m.stages & SELF_COLLISION:
            self_solver.solve_velocities(S, m, T)
    if m.stages & GROUND:
        ground_solver.solve_velocities(S, m, T)


@ti.func
def detect(S: ti.template(), m: ti.template(), advanced, T: ti.template()):
    """Contacts with the ground, after squares that have landed were set back."""
    if ti.static(T.features.continuous):
        landed = 1
        while landed > 0:
            ground_detection.detect(S, m, T)
            landed = 0
            if advanced:
                landed = continuous.set_back(S, m, T)
    else:
        ground_detection.detect(S, m, T)


@ti.func
def count_step(S: ti.template(), m: ti.template(), T: ti.template()):
    """A world goes on until its last step is done, it failed or its robot left the ground."""
    h = m.header
    left = step_counter.steps_until(S, m, lay.H_LIFE_HIGH, S[h + lay.H_LIFE], T)
    going = (left > T.f(0.0)) & (S[h + lay.H_FAILED] == T.f(0.0))
    going = going & (S[h + lay.H_LEFT] == T.f(0.0))
    alive = ti.select(going, T.vec(1.0), T.vec(0.0))
    S[h + lay.H_ALIVE] = alive
    step_counter.advance(S, m, alive, T)


@ti.func
def solve_positions(
    S: ti.template(),
    m: ti.template(),
    T: ti.template(),
):
    """Mends positions. A lane stops once all was within tolerance, whatever the others do."""
    live = S[m.header + lay.H_ALIVE]
    iteration = 0
    while iteration < m.position_iterations:
        off = ground_solver.solve_positions(S, m, live, T)
        if ti.static(T.features.self_collision):
            off = off | self_solver.solve_positions(S, m, live, T)
        off = off | ropes.solve_positions(S, m, live, T)
        off = off | welds.solve_positions(S, m, live, T)
        live = ti.select(off, live, T.vec(0.0))
        iteration = iteration + 1 if any_lane(off, T) else m.position_iterations


@ti.func
def mark_ends(S: ti.template(), m: ti.template(), T: ti.template()):
    """A world fails when a position is no longer a finite number of reasonable size; a robot leaves
    the ground when its centre is beyond the ends of the profile."""
    zero, one = T.vec(0.0), T.vec(1.0)
    total = zero
    center = zero
    for v in range(m.voxels):
        for k in range(4):
            body = S.at[v * lay.VOXEL_ITEMS + k * lay.BODY_ITEMS]
            total += magnitude(body[lay.X], T) + magnitude(body[lay.Y], T)
            center += body[lay.X]
    header = S.at[m.header]
    header[lay.H_FAILED] = ti.select(total < T.f(1e9), header[lay.H_FAILED], one)
    center = center / ti.cast(4 * m.voxels, T.f)
    left = (center < header[lay.H_GROUND_START]) | (center > header[lay.H_GROUND_END])
    header[lay.H_LEFT] = ti.select(left, one, zero)
