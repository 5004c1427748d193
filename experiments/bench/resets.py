"""What resets cost beside steps: `bench --resets`.

Protocol: worm-7x1, medium sensors, hills of a new seed in every episode of 15 s, one thread,
float32, process CPU time, random actions drawn beforehand.

Steps of `VoxelVectorEnv` whose worlds are reset within its calls are timed in turns with steps of
one whose worlds are not, in stretches of half an episode: 400 worlds in 20 cohorts, one of which
is reset every 45 steps, and 400 worlds each in a phase of its own, one of which is reset in 44 % of
the steps. A share is the time without resets over that with them.

Resets of one of 256 worlds of a `Simulator`, with a new seed, or with that and a terrain that has
been drawn before, are timed one by one, each after a step of all of them, and given in such steps.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import torch
from torch import Tensor

from experiments.bench.measurement import Measurement, Target
from experiments.bench.rates import WORM
from experiments.bench.setting import Setting
from experiments.bench.timing import cpu_seconds
from physics import Simulator, Terrain

__all__ = ["environments", "single_worlds"]

_GROUND, _EPISODE, _COHORTS, _STRETCH = "hilly-3-30", 15.0, 20, 450
_WORLDS, _TRIES = 256, 40  # of single resets; tries per repetition
_ENDLESS = 1e6  # [s]
_ACTIONS = 64  # different ones


def environments(setting: Setting) -> list[Measurement]:
    """Shares that are left of the speed of steps without resets."""
    plain = _environment(setting, _ENDLESS, None)
    cohorts = _environment(setting, _EPISODE, _COHORTS)
    phases = _environment(setting, _EPISODE, setting.worlds)
    shares: list[tuple[float, float]] = []
    for _ in range(setting.repetitions):
        alone, together, apart = (_stretch(each) for each in (plain, cohorts, phases))
        shares.append((100 * alone / together, 100 * alone / apart))
    what = f"speed with resets over that without, {WORM}, {setting.worlds} environments"
    targets = (Target(95.0), Target(80.0))
    names = (f"{what} in {_COHORTS} cohorts", f"{what}, each in a phase of its own")
    return [
        Measurement(name, "%", samples, target=target)
        for name, samples, target in zip(names, zip(*shares, strict=True), targets, strict=True)
    ]


def single_worlds(setting: Setting) -> list[Measurement]:
    """What the reset of one world costs, in control steps of all."""
    ground = Terrain.from_open_name(_GROUND, range(_WORLDS))
    sim = Simulator(WORM, ground, _WORLDS, sensors="medium", seed=setting.seed, threads=1)
    actions = itertools.cycle(_actions(sim, torch.Generator().manual_seed(setting.seed)))
    for _ in range(setting.warm_up):
        sim.step(next(actions))
    draws = np.random.default_rng(setting.seed)
    return [
        Measurement(
            f"reset of one of {_WORLDS} worlds, {WORM}, with {what}",
            "steps",
            tuple(_in_steps(sim, actions, draws, terrain) for _ in range(setting.repetitions)),
            more_is_better=False,
            target=Target(steps),
        )
        for what, terrain, steps in (
            ("a new seed", False, 2.0),
            ("a new seed and a terrain that is at hand", True, 3.0),
        )
    ]


def _in_steps(
    sim: Simulator, actions: Iterator[Tensor], draws: np.random.Generator, terrain: bool
) -> float:
    """Time of some resets of one world over that of the steps between them."""
    worlds, seeds = draws.permutation(_WORLDS)[:_TRIES], draws.integers(2**31, size=_TRIES).tolist()
    terrains = Terrain.from_open_name(_GROUND, seeds) if terrain else None
    reset = step = 0.0
    for number, (world, seed) in enumerate(zip(worlds, seeds, strict=True)):
        step += cpu_seconds(partial(sim.step, next(actions)))
        mask = np.arange(_WORLDS) == world
        own = None if terrains is None else [terrains[number]]
        reset += cpu_seconds(partial(sim.reset, mask, [seed], own))
    return reset / step


def _environment(setting: Setting, episode: float, groups: int | None) -> Callable[[], object]:
    """A step of environments, in so many groups of the same phase; None: all in the same one."""
    from physics.envs import VoxelVectorEnv

    env = VoxelVectorEnv(
        WORM, _GROUND, setting.worlds, sensors="medium", episode=episode, threads=1
    )
    env.reset(seed=setting.seed)
    if groups is not None:
        env.spread_phases(groups)
    actions = itertools.cycle(_actions(env.sim, torch.Generator().manual_seed(setting.seed)))

    def step() -> object:
        return env.step(next(actions))

    for _ in range(setting.warm_up):
        step()
    return step


def _stretch(step: Callable[[], object]) -> float:
    """CPU time of half an episode's steps [s]."""
    return cpu_seconds(lambda: [step() and None for _ in range(_STRETCH)])


def _actions(sim: Simulator, draws: torch.Generator) -> Tensor:
    """Different actuations of all worlds, at random."""
    return 2 * torch.rand(_ACTIONS, sim.n_worlds, sim.n_voxels, generator=draws) - 1
