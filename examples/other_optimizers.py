"""Other libraries' optimizers in place of Algorithm 1: pycma, EvoTorch and pyribs, by ask and tell.

Each evolves the neuron-centric rules of a worm on hilly terrain. Needs the extra ``optimizers``.
python examples/other_optimizers.py      # prints speeds [m/s]
"""

from __future__ import annotations

from collections.abc import Callable

import cma
import numpy as np
import torch
from evotorch import Problem
from evotorch.algorithms import CEM
from ribs.archives import GridArchive
from ribs.emitters import GaussianEmitter
from ribs.schedulers import Scheduler

from experiments.config import EvolveConfig
from experiments.rollout import fitness

POPULATION = 40
Evaluate = Callable[[torch.Tensor, int], torch.Tensor]  # genomes, generation -> speeds


def with_pycma(evaluate: Evaluate, n_genes: int, generations: int, seed: int) -> list[float]:
    """Best speed of each generation under CMA-ES."""
    options = {"popsize": POPULATION, "seed": seed + 1, "verbose": -9}
    es, course = cma.CMAEvolutionStrategy(np.zeros(n_genes), 0.5, options), []
    for generation in range(1, generations + 1):
        genomes = es.ask()
        speeds = evaluate(torch.tensor(np.stack(genomes), dtype=torch.float32), generation)
        speeds = speeds.nan_to_num(nan=-1e3)
        es.tell(genomes, (-speeds).tolist())  # it minimizes
        course.append(speeds.max().item())
    return course


def with_evotorch(evaluate: Evaluate, n_genes: int, generations: int, seed: int) -> list[float]:
    """Best speed of each generation under the cross-entropy method."""
    course: list[float] = []

    def speeds(genomes: torch.Tensor) -> torch.Tensor:
        values = evaluate(genomes, len(course) + 1).float().nan_to_num(nan=-1e3)
        course.append(values.max().item())
        return values

    options = {"solution_length": n_genes, "initial_bounds": (-1, 1), "vectorized": True}
    problem = Problem("max", speeds, **options, seed=seed)
    CEM(problem, popsize=POPULATION, parenthood_ratio=0.25, stdev_init=0.5).run(generations)
    return course


def with_pyribs(evaluate: Evaluate, n_genes: int, generations: int, seed: int) -> list[float]:
    """Best speed of each generation under MAP-Elites; what differs is how large the genes are."""
    archive = GridArchive(solution_dim=n_genes, dims=[10], ranges=[(0.4, 0.9)], seed=seed)
    options = {"x0": np.zeros(n_genes), "batch_size": POPULATION, "seed": seed}
    emitter = GaussianEmitter(archive, sigma=0.5, **options)
    scheduler, course = Scheduler(archive, [emitter]), []
    for generation in range(1, generations + 1):
        genomes = torch.tensor(scheduler.ask(), dtype=torch.float32)
        speeds = evaluate(genomes, generation).nan_to_num(nan=-1e3)
        scheduler.tell(speeds.numpy(), genomes.abs().mean(1, keepdim=True).numpy())
        course.append(speeds.max().item())
    return course


def main(generations: int = 40, duration: float = 10.0, seed: int = 0) -> dict[str, list[float]]:
    """Best speed of each generation, by library."""
    rules = {"sharing": "neuron", "eta": "evolved"}
    evaluate = fitness(EvolveConfig(shape="worm-7x1", duration=duration, seed=seed, **rules))
    libraries = {"pycma": with_pycma, "EvoTorch": with_evotorch, "pyribs": with_pyribs}
    return {n: f(evaluate, evaluate.n_genes, generations, seed) for n, f in libraries.items()}


if __name__ == "__main__":
    for name, course in main().items():
        print(f"{name}: {course[0]:.2f} m/s at first, {course[-1]:.2f} m/s at last")
