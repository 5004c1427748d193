"""Environments x steps per second, from one environment to many: `bench --environments 16384`.

Protocol: `VoxelVectorEnv` with the worm (worm-7x1, medium sensors, hills of a new seed in every
episode of 15 s), one thread, float32. Environments are in phases spread evenly over an episode, so
that resets are part of what is measured; actions are drawn beforehand, uniformly. After 60 steps of
warm-up a number of steps that takes about a second is timed, in process CPU time, five times; the
median counts, the extremes are given. EvoGym's Walker-v0 with a random 5 x 5 body is timed by its
own step in the same way and the same run, in another process, where an interpreter has EvoGym.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from rich.console import Console

from experiments.bench.machine import Machine
from experiments.io.atomic import write_atomically
from experiments.io.csvfile import write_csv
from experiments.io.style import sheet

__all__ = ["Rate", "bench_environments", "curve", "draw", "evogym", "write"]

_WARM_UP = 60  # steps
_ROUNDS = 5
_ACTIONS = 64  # different ones
_FORMAT = 1  # of the curve in JSON
_EVOGYM = """
import json, statistics, sys, time
import evogym.envs, gymnasium
from evogym import sample_robot
body, connections = sample_robot((5, 5))
env = gymnasium.make("Walker-v0", body=body, connections=connections)
env.reset(seed=0)
action = env.action_space.sample()
def seconds(steps):
    start = time.process_time()
    for _ in range(steps):
        ended = env.step(action)[2:4]
        if any(ended):
            env.reset()
    return time.process_time() - start
seconds({warm_up})
steps = max(5, round({seconds} * 10 / seconds(10)))
rates = [steps / seconds(steps) for _ in range({rounds})]
print(json.dumps([statistics.median(rates), min(rates), max(rates)]))
"""


@dataclass(frozen=True)
class Rate:
    """Steps of all environments per second of one core's time.

    Attributes:
        environments: How many step together.
        median, least, greatest: The rates of the rounds.
    """

    environments: int
    median: float
    least: float
    greatest: float


def bench_environments(
    console: Console, most: int, out: Path | None, seconds: float, python: str | None
) -> list[Rate]:
    """Measure the curve, show it, and write it where asked to.

    Args:
        console: To show it on.
        most: The largest number of environments.
        out: A folder for environments.csv, .json, .png and .pdf; None: nothing is written.
        seconds: How long a round lasts [s].
        python: An interpreter that has EvoGym; None: this one.

    Raises:
        ValueError: the number is none.
    """
    if most < 1:
        raise ValueError(f"environments: expected an integer >= 1, got {most}")
    rates = []
    for count in counts(most):
        rates += curve([count], seconds)
        console.print(
            f"{count:>6} environments: {rates[-1].median:>9,.0f} steps/s "
            f"({rates[-1].least:,.0f} to {rates[-1].greatest:,.0f})"
        )
    other = evogym(seconds, python)
    console.print(
        f"EvoGym's Walker-v0: {other.median:,.0f} steps/s ({other.least:,.0f} to "
        f"{other.greatest:,.0f})"
        if isinstance(other, Rate)
        else f"EvoGym: {other}"
    )
    if out is not None:
        for path in write(rates, other, out):
            console.print(f"wrote {path}")
    return rates


def counts(most: int) -> list[int]:
    """1, 4, 16, ... up to a number."""
    found = [1]
    while found[-1] * 4 <= most:
        found.append(found[-1] * 4)
    return found


def curve(environments: Sequence[int], seconds: float = 1.0) -> list[Rate]:
    """Rates for some numbers of environments.

    Args:
        environments: The numbers.
        seconds: How long a round lasts [s].
    """
    return [Rate(count, *_rates(_stepper(count), count, seconds)) for count in environments]


def evogym(seconds: float = 1.0, python: str | None = None) -> Rate | str:
    """The same for one environment of EvoGym; why not, in words, where it cannot be measured.

    Args:
        seconds: How long a round lasts [s].
        python: An interpreter that has EvoGym; None: this one.
    """
    code = _EVOGYM.format(warm_up=_WARM_UP, rounds=_ROUNDS, seconds=seconds)
    try:
        done = subprocess.run(
            [python or sys.executable, "-c", code], capture_output=True, text=True, check=False
        )
    except OSError as error:
        return f"not measured, {error}"
    if done.returncode != 0:
        reason = (done.stderr.strip().splitlines() or ["it ended without a word"])[-1]
        return f"not measured, {reason}"
    return Rate(1, *json.loads(done.stdout.strip().splitlines()[-1]))


def write(rates: Sequence[Rate], other: Rate | str, out: Path) -> list[Path]:
    """Write the curve as a table and a figure.

    Args:
        rates: The curve.
        other: What `evogym` returned.
        out: An existing folder.

    Returns:
        The files.
    """
    rows = [("hebbtorch", *vars(rate).values()) for rate in rates]
    if isinstance(other, Rate):
        rows.append(("EvoGym", *vars(other).values()))
    table = write_csv(
        out / "environments.csv", ("simulator", "environments", "median", "least", "greatest"), rows
    )
    content = {
        "format": _FORMAT,
        "machine": vars(Machine.here()),
        "rates": [vars(rate) for rate in rates],
        "evogym": vars(other) if isinstance(other, Rate) else other,
    }
    path = out / "environments.json"
    write_atomically(path, (json.dumps(content, indent=1) + "\n").encode())
    return [table, path, *draw(rates, other, out)]


def draw(rates: Sequence[Rate], other: Rate | str, out: Path) -> list[Path]:
    """The figure: steps per second against environments, both logarithmic."""
    with sheet(out, "environments", (3.6, 2.4)) as page:
        axes = page.panel(0)
        x = [rate.environments for rate in rates]
        axes.fill_between(x, [r.least for r in rates], [r.greatest for r in rates], alpha=0.2, lw=0)
        axes.plot(x, [rate.median for rate in rates], marker="o", markersize=3, label="hebbtorch")
        if isinstance(other, Rate):
            axes.axhline(
                other.median, color="#D55E00", linestyle="--", label="EvoGym, one Walker-v0"
            )
        axes.set(xscale="log", yscale="log", xlabel="environments", ylabel="steps / s, one core")
        axes.legend()
        page.note(
            "Vector environment with worm-7x1, medium sensors, a new terrain in every episode, "
            "phases spread over the episode; EvoGym by its own steps; process CPU time; median "
            "and range of five rounds."
        )
    return page.files


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


def _rates(step: Callable[[], object], count: int, seconds: float) -> tuple[float, float, float]:
    """Steps of all environments per second: median, least and greatest of some rounds."""
    for _ in range(_WARM_UP):
        step()
    once = _seconds(step, 10) / 10
    steps = max(5, round(seconds / max(once, 1e-6)))
    rates = [count * steps / _seconds(step, steps) for _ in range(_ROUNDS)]
    return statistics.median(rates), min(rates), max(rates)


def _seconds(step: Callable[[], object], steps: int) -> float:
    """Process CPU time of some steps [s]."""
    start = time.process_time()
    for _ in range(steps):
        step()
    return time.process_time() - start
