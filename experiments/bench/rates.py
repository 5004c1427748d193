"""Robot-steps per second of one core: open loop, closed loop, and through PyTorch.

A robot-step is one control step, 1/60 s, of one robot. The baselines are the paper's own
simulator, in Java, on one core of the same kind of machine.
"""

from __future__ import annotations

from typing import Literal

from experiments.bench.measurement import Measurement, Target
from experiments.bench.setting import Setting
from experiments.bench.timing import cpu_seconds, cpu_seconds_each
from experiments.bench.workload import ClosedLoop, OpenLoop, OwnModule, Workload, warm_up

__all__ = ["BIPED", "CONTROLLERS", "WORM", "closed_loop", "open_loop", "own_module", "rates"]

BIPED, WORM = "biped-4x3", "worm-7x1"
Controller = Literal["hebbian", "mlp"]
CONTROLLERS: tuple[Controller, ...] = ("hebbian", "mlp")
_UNIT = "robot-steps/s/core"

_OPEN = {BIPED: (4859.0, Target(300e3, 450e3)), WORM: (6865.0, Target(400e3, 550e3))}
_CLOSED = {
    (BIPED, "hebbian"): (4073.0, Target(200e3, 300e3)),
    (WORM, "hebbian"): (5969.0, Target(200e3, 300e3)),
    (BIPED, "mlp"): (4653.0, Target(250e3, 350e3)),
    (WORM, "mlp"): (6732.0, Target(250e3, 350e3)),
}
_OWN_MODULE = Target(60.0, 80.0)


def open_loop(setting: Setting, shape: str) -> list[Measurement]:
    """Robots under given actuations."""
    baseline, target = _OPEN[shape]
    robots = OpenLoop(shape, setting.worlds, setting.seed)
    what = f"open loop, {shape}, {setting.worlds} worlds"
    return [
        Measurement(what, _UNIT, tuple(rates(robots, setting)), baseline=baseline, target=target)
    ]


def closed_loop(setting: Setting, shape: str, controller: Controller) -> list[Measurement]:
    """Robots under networks within the simulator's kernel."""
    baseline, target = _CLOSED[shape, controller]
    robots = ClosedLoop(shape, controller, setting.worlds, setting.seed)
    sizes = "-".join(map(str, robots.loop.network.sizes))
    what = f"closed loop, {shape}, high, {controller} {sizes}, {setting.worlds} worlds"
    return [
        Measurement(what, _UNIT, tuple(rates(robots, setting)), baseline=baseline, target=target)
    ]


def own_module(setting: Setting) -> list[Measurement]:
    """A user's own PyTorch module, against the same robots in the open loop without sensors.

    Both are timed in turns, so that a disturbance by another job meets both.
    """
    plain = OpenLoop(BIPED, setting.worlds, setting.seed)
    own = OwnModule(BIPED, setting.worlds, setting.seed)
    warm_up((plain, own), setting)
    seconds = [
        (cpu_seconds(plain.stretch(setting.steps)), cpu_seconds(own.stretch(setting.steps)))
        for _ in range(setting.repetitions)
    ]
    robot_steps = setting.worlds * setting.steps
    what = f"own torch module through sim.step, {BIPED}, high, {setting.worlds} worlds"
    return [
        Measurement(what, _UNIT, tuple(robot_steps / own for _, own in seconds)),
        Measurement(
            "the same, as a share of the open loop",
            "%",
            tuple(100 * plain / own for plain, own in seconds),
            target=_OWN_MODULE,
        ),
    ]


def rates(robots: Workload, setting: Setting) -> list[float]:
    """Robot-steps per second of CPU time, one figure per repetition."""
    warm_up((robots,), setting)
    seconds = cpu_seconds_each(lambda: robots.stretch(setting.steps), setting.repetitions)
    return [robots.sim.n_worlds * setting.steps / s for s in seconds]
