"""Where the time of a step goes, stage by stage.

A stage cannot be timed alone: what it costs depends on the state that the stages before it
leave, and those of the solver take turns. So the time of a step with the first k stages, less
that with the first k - 1, is the cost of stage k, in its place and on its own input.
"""

from __future__ import annotations

import statistics
from functools import partial
from itertools import pairwise

from experiments.bench.measurement import Stage
from experiments.bench.partial_step import STAGES, PartialStep
from experiments.bench.rates import BIPED
from experiments.bench.setting import Setting
from experiments.bench.timing import cpu_seconds
from experiments.bench.workload import ClosedLoop, warm_up

__all__ = ["step_stages"]

_ROUNDS = 16  # steps from the same state in one launch


def step_stages(setting: Setting) -> list[Stage]:
    """CPU time of each stage of a robot-step in the closed loop, at several moments."""
    robots = ClosedLoop(BIPED, "hebbian", setting.worlds, setting.seed)
    warm_up((robots,), setting)
    PartialStep(robots).run(sum(STAGES.values()))  # compiles
    moments = [_costs(robots, setting) for _ in range(setting.repetitions)]
    return [
        Stage(name, 1e6 * statistics.median(costs))
        for name, costs in zip(
            (*STAGES, "network and rest"), zip(*moments, strict=True), strict=True
        )
    ]


def _costs(robots: ClosedLoop, setting: Setting) -> list[float]:
    """CPU time of each stage per robot-step [s], the network last.

    The network is what makes a closed-loop step longer than all other stages: in the partial step
    it would compete with the copies of the state for the cache.
    """
    step = PartialStep(robots)
    times, stages = [cpu_seconds(partial(step.run, 0, _ROUNDS))], 0
    for name, stage in STAGES.items():
        stages += stage
        call = partial(step.run, stages, _ROUNDS, noise=name == "noise")
        times.append(cpu_seconds(call))
    per_step = [t / (_ROUNDS * setting.worlds) for t in times]
    whole = cpu_seconds(robots.stretch(setting.steps)) / (setting.steps * setting.worlds)
    return [
        *(later - earlier for earlier, later in pairwise(per_step)),
        whole - (per_step[-1] - per_step[0]),
    ]
