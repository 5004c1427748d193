"""Environments x steps per second, from one environment to many; as a command:

    python -m experiments.bench.environments --most 16384 --out curve.json

Protocol: `VoxelVectorEnv` with the worm (worm-7x1, medium sensors, hills of a new seed in every
episode of 15 s), one thread, float32. Environments are in phases spread evenly over an episode, so
that resets are part of what is measured; actions are drawn beforehand, uniformly. After 60 steps of
warm-up a number of steps that takes about a second is timed, in process CPU time, five times; the
median counts, the extremes are given. EvoGym's Walker-v0 is timed by its own step in the same way
where EvoGym is installed.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import torch

__all__ = ["curve", "main"]

_WARM_UP = 60  # steps
_FORMAT = 1  # of the table in JSON
_ROUNDS = 5
_ACTIONS = 64  # different ones


def curve(most: int, seconds: float = 1.0) -> list[dict[str, Any]]:
    """Rates for 1, 4, 16, ... environments.

    Args:
        most: The largest number of environments.
        seconds: How long a round lasts [s].

    Returns:
        Rows with environments, steps per second (all environments together) and its extremes.
    """
    rows, count = [], 1
    while count <= most:
        rows.append({"environments": count, **_rates(_stepper(count), count, seconds)})
        count *= 4
    return rows


def evogym(seconds: float = 1.0) -> dict[str, Any] | None:
    """The same for one environment of EvoGym, or None where it is not installed."""
    try:
        import evogym.envs  # noqa: F401
        import gymnasium
        from evogym import sample_robot
    except ImportError:
        return None
    body, connections = sample_robot((5, 5))
    env = gymnasium.make("Walker-v0", body=body, connections=connections)
    env.reset(seed=0)
    action = env.action_space.sample()

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()

    return _rates(step, 1, seconds)


def _stepper(count: int) -> Callable[[], object]:
    """A step of so many environments, each in a phase of its own."""
    from physics.envs import VoxelVectorEnv

    env = VoxelVectorEnv("worm-7x1", "hilly-3-30", count, sensors="medium", threads=1)
    env.reset(seed=0)
    env.spread_phases()
    draws = torch.Generator().manual_seed(0)
    actions = 2 * torch.rand(_ACTIONS, count, env.sim.n_voxels, generator=draws) - 1
    done = 0

    def step() -> None:
        nonlocal done
        env.step(actions[done % _ACTIONS])
        done += 1

    return step


def _rates(step: Callable[[], object], count: int, seconds: float) -> dict[str, float]:
    """Steps of all environments per second: median, least and greatest of some rounds."""
    for _ in range(_WARM_UP):
        step()
    once = _seconds(step, 10) / 10
    steps = max(5, round(seconds / max(once, 1e-6)))
    rates = [count * steps / _seconds(step, steps) for _ in range(_ROUNDS)]
    return {
        "steps_per_second": statistics.median(rates),
        "least": min(rates),
        "greatest": max(rates),
    }


def _seconds(step: Callable[[], object], steps: int) -> float:
    """Process CPU time of some steps [s]."""
    start = time.process_time()
    for _ in range(steps):
        step()
    return time.process_time() - start


def main(arguments: Sequence[str] | None = None) -> list[dict[str, Any]]:
    """Measures and prints the curve, and writes it where asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--most", type=int, default=16_384, help="environments")
    parser.add_argument("--seconds", type=float, default=1.0, help="of a round")
    parser.add_argument("--out", type=Path, default=None, help="a JSON file")
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    rows = curve(options.most, options.seconds)
    print("environments  steps/s  (least to greatest)")
    for row in rows:
        print(
            f"{row['environments']:>12}  {row['steps_per_second']:>9,.0f}  "
            f"({row['least']:,.0f} to {row['greatest']:,.0f})"
        )
    other = evogym(options.seconds)
    print(
        f"EvoGym Walker-v0: {other['steps_per_second']:,.0f}" if other else "EvoGym: not installed"
    )
    if options.out is not None:
        options.out.write_text(
            json.dumps({"format": _FORMAT, "rows": rows, "evogym": other}, indent=1) + "\n"
        )
    return rows


if __name__ == "__main__":
    main()
