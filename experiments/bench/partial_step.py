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
from physics.engine import F_NOISE, Tables, load_sizes, sense, step

__all__ = ["STAGES", "PartialStep"]

_SENSORS = 2 * step.SELF_COLLISION
# Noise is no stage of its own: the sensors have it or not. Robots without self-collision have no
# such stage.
STAGES = {
    "free motion": step.MOTION,
    "springs": step.SPRINGS,
    "ropes": step.ROPES,
    "welds": step.WELDS,
    "contacts": step.GROUND,
    "position stage": step.POSITIONS,
    "detection": step.DETECTION,
    "self-collision": step.SELF_COLLISION,
    "sensors": _SENSORS,
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
                sizes = load_sizes(mi, 0)
                for g in range(lists.shape[0]):
                    state, before, m = ti.static(
                        (
                            T.group(S, g, sizes.group_items, T.lists(lists, g)),
                            T.group(S_before, g, sizes.group_items, T.lists(lists_before, g)),
                            Tables(sizes, mi, mf, stages),
                        )
                    )
                    for _time in range(times):
                        for item in range(m.group_items):
                            state[item] = before[item]
                        for item in range(state.lists.items):
                            state.lists[item] = before.lists[item]
                        step.advance(state, m, T)
                        step.touch(state, terrain, m, True, T)
                        if m.stages & _SENSORS:
                            sense(state, m, T)

    return rounds


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
            times: How often the step is taken.
            noise: whether the sensors have any.

        Returns:
            State of the worlds after it, (groups, items, lanes).
        """
        numbers = self._numbers if noise else self._without_noise
        self._kernel(*self._now, *self._model, numbers, *self._before, stages, times)
        return self._now[0]
