"""Robot-steps per second of a whole GPU, where PyTorch finds one."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import Literal

import torch

from experiments.bench.measurement import Measurement, Target
from experiments.bench.rates import BIPED
from experiments.bench.setting import Setting
from experiments.bench.workload import ClosedLoop, OwnModule, Workload, warm_up

__all__ = ["gpu", "wall_rates"]

Driver = Literal["hebbian", "mlp", "own module"]

_WORLDS = (400, 4_800, 16_000, 48_000, 96_000)
_DRIVERS: tuple[Driver, ...] = ("hebbian", "mlp", "own module")
_ROOM = 2**18  # for a world, twice what the largest takes [bytes]
_TARGETS = {("hebbian", 48_000): Target(10e6, 10e6)}
_SCRIPT = """
import json, sys
from experiments.bench.gpu import wall_rates
from experiments.bench.setting import Setting
seed, repetitions = map(int, sys.argv[1:3])
for driver, worlds in json.loads(sys.argv[3]):
    rates = wall_rates(driver, worlds, Setting(1, seed, repetitions=repetitions), "cuda")
    print(json.dumps(rates), flush=True)
"""


def gpu(setting: Setting) -> list[Measurement]:
    """Closed loops of all sizes that fit, in a process apart, for one simulates on one device."""
    if not torch.cuda.is_available():
        return []
    most = torch.cuda.get_device_properties(0).total_memory // _ROOM
    cases = [(driver, worlds) for driver in _DRIVERS for worlds in _WORLDS if worlds <= most]
    arguments = [str(setting.seed), str(setting.repetitions), json.dumps(cases)]
    command = [sys.executable, "-c", _SCRIPT, *arguments]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return [
        Measurement(
            f"closed loop on the GPU, {BIPED}, high, {driver}, {worlds} worlds",
            "robot-steps/s",
            tuple(json.loads(line)),
            target=_TARGETS.get((driver, worlds)),
        )
        for (driver, worlds), line in zip(
            cases, done.stdout.splitlines()[-len(cases) :], strict=True
        )
    ]


def wall_rates(driver: Driver, worlds: int, setting: Setting, device: str) -> list[float]:
    """Robot-steps per second of wall time, one figure per repetition.

    Args:
        driver: networks of hebbtorch in the kernel, or a PyTorch module that acts step by step.
        worlds: The number of robots.
        setting: How much is measured.
        device: "cpu" or "cuda".
    """
    robots: Workload
    if driver == "own module":
        robots = OwnModule(BIPED, worlds, setting.seed, device)
    else:
        robots = ClosedLoop(BIPED, driver, worlds, setting.seed, device)
    warm_up((robots,), setting)
    rates = []
    for _ in range(setting.repetitions):
        _wait(robots)
        began = time.perf_counter()
        robots.stretch(setting.steps)()
        _wait(robots)
        rates.append(worlds * setting.steps / (time.perf_counter() - began))
    return rates


def _wait(robots: Workload) -> None:
    """Until all that was asked of the device is done."""
    robots.sim.failed().any().item()
