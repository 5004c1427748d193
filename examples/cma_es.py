"""Another optimizer: CMA-ES (pycma) evolves neuron-centric Hebbian rules for a worm.

Shows that `fitness` is a plain function of genomes: any optimizer can use it. Needs the extra
``optimizers``. Reaches 2.3 m/s in 13 s on one core.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import cma
import numpy as np
import torch

from experiments.config import EvolveConfig
from experiments.rollout import fitness


def main(arguments: Sequence[str] | None = None) -> float:
    """Evolves, and returns the best speed of the last generation [m/s]."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--generations", type=int, default=40)
    parser.add_argument("--population", type=int, default=32)
    parser.add_argument("--duration", type=float, default=15.0, help="of an episode [s]")
    options = parser.parse_args(arguments)
    config = EvolveConfig(
        shape="worm-7x1", sensors="low", sharing="neuron", duration=options.duration
    )
    evaluate = fitness(config)
    strategy = cma.CMAEvolutionStrategy(
        np.zeros(evaluate.n_genes), 1.0, {"popsize": options.population, "seed": 1, "verbose": -9}
    )
    best = float("-inf")
    for generation in range(1, options.generations + 1):
        genomes = strategy.ask()
        speeds = evaluate(torch.tensor(np.array(genomes), dtype=torch.float32), generation)
        speeds = speeds.nan_to_num(nan=-10.0)  # a world that failed is the worst
        strategy.tell(genomes, (-speeds).tolist())  # pycma minimizes
        best = float(speeds.max())
        print(f"generation {generation}: best {best:.2f} m/s, median {speeds.median():.2f} m/s")
    return best


if __name__ == "__main__":
    main()
