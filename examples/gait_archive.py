"""An archive of gaits (MAP-Elites with pyribs): fast worms for every frequency and touch fraction.

Shows an objective with several values: speed, gait frequency, share of voxels on the ground. Needs
the extra ``optimizers``. Takes three minutes on one core.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
import torch
from ribs.archives import GridArchive
from ribs.emitters import EvolutionStrategyEmitter
from ribs.schedulers import Scheduler

from experiments.config import EvolveConfig
from experiments.rollout import fitness, objectives


def main(arguments: Sequence[str] | None = None) -> GridArchive:
    """Fills the archive, prints its best gaits, and returns it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--generations", type=int, default=40)
    parser.add_argument("--population", type=int, default=32)
    parser.add_argument("--duration", type=float, default=10.0, help="of an episode [s]")
    options = parser.parse_args(arguments)
    config = EvolveConfig(shape="worm-4x1", sensors="low", duration=options.duration)
    measures = (objectives.speed, objectives.gait_frequency, objectives.touch)
    evaluate = fitness(config, terrain="flat", objective=objectives.several(*measures))
    archive = GridArchive(
        solution_dim=evaluate.n_genes, dims=(15, 10), ranges=[(0, 15), (0, 1)], seed=1
    )
    emitter = EvolutionStrategyEmitter(
        archive, x0=np.zeros(evaluate.n_genes), sigma0=0.5, batch_size=options.population, seed=1
    )
    scheduler = Scheduler(archive, [emitter])
    for generation in range(1, options.generations + 1):
        genomes = torch.tensor(scheduler.ask(), dtype=torch.float32)
        found = evaluate(genomes, generation).nan_to_num(nan=0.0).numpy()
        scheduler.tell(found[:, 0], found[:, 1:])
        print(
            f"generation {generation}: {len(archive)} gaits, best {archive.stats.obj_max:.2f} m/s"
        )
    gaits = archive.data(["measures", "objective"], return_type="tuple")
    for (frequency, touch), speed in sorted(zip(*gaits, strict=True), key=lambda row: -row[1])[:5]:
        print(f"{speed:.2f} m/s at {frequency:.1f} Hz, {touch:.0%} of the voxels on the ground")
    return archive


if __name__ == "__main__":
    main()
