"""A step with sensing, of which stages can be left out.

It starts from the same state however often it is taken, so that a stage meets the input that it
would meet in a whole step, whatever is left out after it.
"""

from functools import lru_cache
from typing import Any

from torch import Tensor

from experiments.bench.workload import Workload
from physics import backend
from physics.backend import ti
from physics.engine import integrator, step
from physics.engine.contacts import ground_detection, ground_solver, self_detection, self_solver
from physics.engine.joints import ropes, springs, welds
from physics.engine.memory.model import F_NOISE, load_sizes
from physics.engine.sensing import sense

__all__ = ["STAGES", "PartialStep"]

_MOTION, _SPRINGS, _ROPES, _WELDS, _CONTACTS, _POSITIONS, _DETECT, _SELF, _SENSE = (
    1 << k for k in range(9)
)
# Noise is no stage of its own: the sensors have it or not. Robots without self-collision have no
# such stage.
STAGES = {
    "free motion": _MOTION,
    "springs": _SPRINGS,
    "ropes": _ROPES,
    "welds": _WELDS,
    "contacts": _CONTACTS,
    "position stage": _POSITIONS,
    "detection": _DETECT,
    "self-collision": _SELF,
    "sensors": _SENSE,
    "noise": 0,
}


@lru_cache
def _kernel(program: backend.Program) -> Any:
    """A step with the stages of a mask, a number of times from the same state."""
    backend.start("cpu")
    T = backend.real(program)

    @ti.kernel
    def rounds(
        S: T.array,
        lists: backend.integers(2),
        terrain: T.scalars(3),
        mi: backend.integers(1),
        mf: T.scalars(1),
        S_before: T.array,
        lists_before: backend.integers(2),
        stages: ti.i32,
        times: ti.i32,
    ):
        for q in range(backend.GRAIN):
            if q == 0:
                m = load_sizes(mi, 0)
                for g in range(lists.shape[0]):
                    state, before = ti.static(
                        (T.group(S, g, m.group_items), T.group(S_before, g, m.group_items))
                    )
                    contacts, _ = ti.static((T.lists(lists, g), 0))
                    for _time in range(times):
                        for item in range(m.group_items):
                            state[item] = before[item]
                        for item in range(contacts.items):
                            contacts[item] = lists_before[g, item]
                        _step(state, contacts, terrain, m, mi, mf, stages, T)
                        if stages & _SENSE:
                            sense(state, m, mi, mf, T)

    return rounds


@ti.func
def _step(
    S: ti.template(),
    lists: ti.template(),
    terrain: ti.template(),
    m: ti.template(),
    mi: ti.template(),
    mf: ti.template(),
    stages,
    T: ti.template(),
):
    """``step.advance`` and ``step.touch`` with the stages of a mask, but continuous detection."""
    if stages & _MOTION:
        step.count_step(S, m, T)
        integrator.integrate_velocities(S, m, mf, T)
    if ti.static(T.features.self_collision):  # noqa: SIM102 - compile-time
        if stages & _SELF:
            self_solver.prepare(S, lists, m, T)
    if stages & _CONTACTS:
        ground_solver.prepare(S, lists, m, T)
    if ti.static(T.features.self_collision):  # noqa: SIM102 - compile-time
        if stages & _SELF:
            self_solver.warm_start(S, lists, m, T)
    if stages & _SPRINGS:
        springs.prepare(S, m, mi, mf, T)
    if stages & _ROPES:
        ropes.prepare(S, lists, m, mi, T)
    if stages & _WELDS:
        welds.prepare(S, m, mi, T)
    for _ in range(m.velocity_iterations):
        if stages & _SPRINGS:
            springs.solve_velocities(S, m, T)
        if stages & _ROPES:
            ropes.solve_velocities(S, lists, m, T)
        if stages & _WELDS:
            welds.solve_velocities(S, m, mi, T)
        if ti.static(T.features.self_collision):  # noqa: SIM102 - compile-time
            if stages & _SELF:
                self_solver.solve_velocities(S, lists, m, T)
        if stages & _CONTACTS:
            ground_solver.solve_velocities(S, lists, m, mf, T)
    if stages & _MOTION:
        integrator.integrate_positions(S, m, T)
    if stages & _POSITIONS:
        step.solve_positions(S, lists, m, mi, T)
    if stages & _DETECT:
        ground_detection.update_window(S, terrain, m, mf, T)
        ground_detection.detect(S, lists, m, T)
    if ti.static(T.features.self_collision):  # noqa: SIM102 - compile-time
        if stages & _SELF:
            self_detection.detect(S, lists, m, mi, T)
    if stages & _MOTION:
        step.mark_ends(S, m, T)


class PartialStep:
    """The next step of some robots, from the state in which they are when this is made."""

    def __init__(self, robots: Workload) -> None:
        sim = robots.sim
        self._kernel = _kernel(sim.program)
        tensors = sim.kernel_tensors(sim.program)
        state, lists, *model, self._numbers = (tensor.clone() for tensor in tensors)
        self._now = state, lists
        self._before = state.clone(), lists.clone()
        self._model = model
        self._without_noise = self._numbers.clone()
        self._without_noise[F_NOISE] = 0.0

    def run(self, stages: int, times: int = 1, *, noise: bool = True) -> Tensor:
        """Takes the step with some stages, a number of times.

        Args:
            stages: sum of those in `STAGES`.
            times: how often.
            noise: whether the sensors have any.

        Returns:
            State of the worlds after it, (groups, items, lanes).
        """
        numbers = self._numbers if noise else self._without_noise
        self._kernel(*self._now, *self._model, numbers, *self._before, stages, times)
        return self._now[0]
