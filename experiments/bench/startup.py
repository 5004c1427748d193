"""What a user waits for the first step, with a cold and with a warm compile cache."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from experiments.bench.measurement import Measurement, Target
from experiments.bench.setting import Setting

__all__ = ["Start", "start_process", "starts"]

_COLD, _WARM = Target(20.0, 8.0), Target(3.0, 1.5)
_SCRIPT = """
import json, time
import torch
import physics
torch.set_num_threads(1)
imported = time.process_time()
terrain = physics.Terrain.from_name("hilly-3-30-0")
sim = physics.Simulator("biped-4x3", terrain, 400, sensors="high", noise=0.01, threads=1)
sim.step(torch.zeros(400, sim.n_voxels))
stepped = time.process_time()
import hebbtorch
from experiments.rollout import fused
network = hebbtorch.HebbianMLP([sim.n_readings] * 2 + [sim.n_voxels], population=(400,))
network.set_genomes(torch.zeros(400, network.n_genes))
fused.pack(sim, network, network.initial_state()).run(sim, 1)
print(json.dumps([imported, stepped, time.process_time()]))
"""


@dataclass(frozen=True)
class Start:
    """CPU time of a process since its start [s].

    Attributes:
        imported: when torch and the simulator were imported.
        stepped: after the first step of 400 worlds.
        closed: after the first step with a plastic network in the kernel.
    """

    imported: float
    stepped: float
    closed: float


def starts(setting: Setting) -> list[Measurement]:
    """Processes that find nothing compiled yet, and processes after them that find all."""
    with tempfile.TemporaryDirectory() as folder:
        caches = [Path(folder, str(k)) for k in range(setting.cold_starts)]
        cold = [start_process(cache) for cache in caches]
        warm = [start_process(caches[0]) for _ in range(setting.warm_starts)]
    return [*_rows("cold", cold, _COLD), *_rows("warm", warm, _WARM)]


def start_process(cache: Path) -> Start:
    """A process of its own, with a folder for its compile cache."""
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT],
        env={**os.environ, "TI_OFFLINE_CACHE_FILE_PATH": str(cache)},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return Start(*json.loads(done.stdout.splitlines()[-1]))


def _rows(cache: str, starts: list[Start], target: Target) -> list[Measurement]:
    return [
        Measurement(
            f"{cache} start: first step, with imports",
            "s",
            tuple(start.stepped for start in starts),
            more_is_better=False,
            target=target,
        ),
        Measurement(
            f"{cache} start: of which imports",
            "s",
            tuple(start.imported for start in starts),
            more_is_better=False,
        ),
        Measurement(
            f"{cache} start: closed loop, in addition",
            "s",
            tuple(start.closed - start.stepped for start in starts),
            more_is_better=False,
        ),
    ]
