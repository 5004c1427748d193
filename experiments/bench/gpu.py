"""Robot-steps per second of a whole GPU, where PyTorch finds one."""

from __future__ import annotations

import json
import subprocess
import sys
import time

import torch

from experiments.bench.measurement import Measurement, Target
from experiments.bench.rates import BIPED
from experiments.bench.setting import Setting
from experiments.bench.workload import ClosedLoop, warm_up

__all__ = ["gpu", "wall_rates"]

_WORLDS = (400, 4_800, 48_000)
_TARGETS = {48_000: Target(10e6, 10e6)}
_SCRIPT = """
import json, sys
from experiments.bench.gpu import wall_rates
from experiments.bench.setting import Setting
worlds, seed, repetitions = map(int, sys.argv[1:])
print(json.dumps(wall_rates("cuda", worlds, Setting(1, seed, repetitions=repetitions))))
"""


def gpu(setting: Setting) -> list[Measurement]:
    """Closed loops of several sizes, each in a process of its own: one simulates on one device."""
    if not torch.cuda.is_available():
        return []
    rows = []
    for worlds in _WORLDS:
        arguments = map(str, (worlds, setting.seed, setting.repetitions))
        command = [sys.executable, "-c", _SCRIPT, *arguments]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        what = f"closed loop on the GPU, {BIPED}, high, hebbian, {worlds} worlds"
        samples = tuple(json.loads(done.stdout.splitlines()[-1]))
        rows.append(Measurement(what, "robot-steps/s", samples, target=_TARGETS.get(worlds)))
    return rows


def wall_rates(device: str, worlds: int, setting: Setting) -> list[float]:
    """Robot-steps per second of wall time, one figure per repetition."""
    robots = ClosedLoop(BIPED, "hebbian", worlds, setting.seed, device)
    warm_up((robots,), setting)
    rates = []
    for _ in range(setting.repetitions):
        _wait(robots)
        began = time.perf_counter()
        robots.stretch(setting.steps)()
        _wait(robots)
        rates.append(worlds * setting.steps / (time.perf_counter() - began))
    return rates


def _wait(robots: ClosedLoop) -> None:
    """Until all that was asked of the device is done."""
    robots.sim.failed().any().item()
