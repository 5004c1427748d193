"""A whole evolution, as the command runs it: what share of the closed loop's rate is left."""

from __future__ import annotations

import csv
import statistics
import subprocess
import sys
import tempfile
from itertools import pairwise
from pathlib import Path

from experiments.bench.measurement import Measurement, Target
from experiments.bench.rates import BIPED, rates
from experiments.bench.setting import Setting
from experiments.bench.workload import ClosedLoop
from experiments.runs.names import HISTORY
from physics import steps_in

__all__ = ["evolve", "generation_seconds", "paper_run_minutes", "share"]

_SHARE = Target(85.0, 95.0)
_PAPER_RUN = Target(4.0, 2.5)
_PAPER_EVALUATIONS, _PAPER_DURATION = 20_000, 60.0
_COMMAND = "from experiments.cli import main; main()"


def evolve(setting: Setting) -> list[Measurement]:
    """Runs side by side on all cores, in a process of its own.

    The rate per core that it is held against is measured before and after, since it depends on
    what else the machine does; a median like that of the generations.
    """
    before = _rate(setting)
    with tempfile.TemporaryDirectory() as folder:
        seconds = generation_seconds(_evolve(setting, Path(folder, "run")))
    rate = statistics.mean((before, _rate(setting)))
    robot_steps = setting.runs * setting.population * steps_in(setting.duration)
    name = f"evolve, {BIPED}, high, {setting.runs} x {setting.population}, {setting.cores} core(s)"
    shares = (share(robot_steps, s, setting.cores, rate) for s in seconds)
    minutes = (paper_run_minutes(s, setting) for s in seconds)
    return [
        Measurement(f"{name}: wall time", "robot-steps/s", tuple(robot_steps / s for s in seconds)),
        Measurement(f"{name}: share of the closed loop", "%", tuple(shares), target=_SHARE),
        Measurement(
            f"one paper run of {_PAPER_EVALUATIONS:,} evaluations, as one of {setting.runs}",
            "min",
            tuple(minutes),
            more_is_better=False,
            target=_PAPER_RUN,
        ),
    ]


def generation_seconds(history: Path) -> list[float]:
    """Wall time of each generation but the first, which compiles [s].

    Args:
        history: a run's history.csv, whose `seconds` count from the start of the evolution.
    """
    with history.open(newline="", encoding="utf-8") as file:
        ends = [float(row["seconds"]) for row in csv.DictReader(file) if row["run"] == "0"]
    return [end - start for start, end in pairwise(ends)]


def share(robot_steps: int, seconds: float, cores: int, rate: float) -> float:
    """Robot-steps per second of wall time over what all cores could do [%].

    Args:
        robot_steps: done in that time.
        seconds: The wall time [s].
        cores: The number of cores that were used.
        rate: robot-steps per second of one core in the closed loop.
    """
    return 100 * robot_steps / seconds / (cores * rate)


def paper_run_minutes(seconds: float, setting: Setting) -> float:
    """Wall time of one of the paper's runs among others side by side [min].

    Args:
        seconds: wall time of one generation of all runs.
        setting: How much was measured; its episodes are as long or shorter, and the cost is taken
            as proportional to their length.
    """
    generations = _PAPER_EVALUATIONS / setting.population
    times_as_long = steps_in(_PAPER_DURATION) / steps_in(setting.duration)
    return seconds * times_as_long * generations / setting.runs / 60


def _rate(setting: Setting) -> float:
    robots = ClosedLoop(BIPED, "hebbian", setting.worlds, setting.seed)
    return statistics.median(rates(robots, setting))


def _evolve(setting: Setting, folder: Path) -> Path:
    """Runs the command; returns the file with the course of the evolution."""
    options = {
        "shape": BIPED,
        "sensors": "high",
        "runs": setting.runs,
        "population": setting.population,
        "generations": setting.generations,
        "duration": setting.duration,
        "seed": setting.seed,
        "threads": setting.cores,
        "out": folder,
    }
    words = [word for name, value in options.items() for word in (f"--{name}", str(value))]
    subprocess.run(
        [sys.executable, "-c", _COMMAND, "evolve", *words], stdout=subprocess.DEVNULL, check=True
    )
    return folder / HISTORY
