"""Another optimizer: SNES of EvoTorch evolves Hebbian rules, a population as one tensor.

Needs the extra ``optimizers``. Takes a minute on one core.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import torch
from evotorch import Problem
from evotorch.algorithms import SNES

from experiments.config import EvolveConfig
from experiments.rollout import fitness


def main(arguments: Sequence[str] | None = None) -> float:
    """Evolves, and returns the best speed found [m/s]."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--generations", type=int, default=40)
    parser.add_argument("--population", type=int, default=32)
    parser.add_argument("--duration", type=float, default=15.0, help="of an episode [s]")
    options = parser.parse_args(arguments)
    config = EvolveConfig(shape="worm-4x1", sensors="low", duration=options.duration)
    evaluate = fitness(config)
    generation = 0

    def speeds(genomes: torch.Tensor) -> torch.Tensor:
        nonlocal generation
        generation += 1  # every generation meets terrains of its own
        found = evaluate(genomes.clone(), generation).nan_to_num(nan=-10.0).to(genomes.dtype)
        print(f"generation {generation}: best {float(found.max()):.2f} m/s")
        return found

    problem = Problem(
        "max",
        speeds,
        solution_length=evaluate.n_genes,
        initial_bounds=(-1, 1),
        vectorized=True,
        seed=1,
    )
    searcher = SNES(problem, stdev_init=0.5, popsize=options.population)
    searcher.run(options.generations)
    return float(searcher.status["best_eval"])


if __name__ == "__main__":
    main()
