"""Bodies and controllers evolve together: voxels of EvoGym's kinds on a grid of 5 x 3.

Each body is tried by eight controllers with one shared rule; the best bodies stay, others are
mutants of them. All bodies of a generation are simulated in one batch, eight worlds of each, in
which a body costs what it costs alone. Takes about two minutes on one core.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
import torch

from experiments.config import EvolveConfig
from experiments.rollout import fitness
from physics import Morphology

CONTROLLERS = 8


def random_body(draws: np.random.Generator) -> np.ndarray:
    """A body that holds together and has an actuator."""
    while True:
        body = draws.choice([0, 1, 2, 3, 4], (3, 5), p=[0.3, 0.1, 0.2, 0.2, 0.2])
        if is_body(body):
            return body


def mutant(body: np.ndarray, draws: np.random.Generator) -> np.ndarray:
    """The body with one or two other voxels."""
    while True:
        other = np.where(draws.random(body.shape) < 0.1, draws.integers(0, 5, body.shape), body)
        if is_body(other) and (other != body).any():
            return other


def is_body(body: np.ndarray) -> bool:
    """Whether it is a robot."""
    try:
        Morphology.from_evogym(body)
    except ValueError:
        return False
    return bool((body >= 3).any())


def main(arguments: Sequence[str] | None = None) -> float:
    """Evolves, prints the best body, and returns its speed [m/s]."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--generations", type=int, default=20)
    parser.add_argument("--bodies", type=int, default=16)
    parser.add_argument("--duration", type=float, default=10.0, help="of an episode [s]")
    options = parser.parse_args(arguments)
    draws = np.random.default_rng(1)
    config = EvolveConfig(sharing="single", init="uniform", duration=options.duration)

    elite: list[tuple[float, np.ndarray, torch.Tensor]] = []
    for generation in range(1, options.generations + 1):
        bodies, genomes = [], []
        for _ in range(options.bodies):
            parent = elite[draws.integers(len(elite))] if elite and draws.random() < 0.8 else None
            bodies.append(mutant(parent[1], draws) if parent else random_body(draws))
            centre = parent[2] if parent else torch.zeros(4)
            noise = torch.from_numpy(draws.normal(0, 0.5, (CONTROLLERS, 4))).float()
            genomes.append(centre + noise)
        shapes = [Morphology.from_evogym(body) for body in bodies for _ in range(CONTROLLERS)]
        evaluate = fitness(config, shapes, "medium", "flat")
        values = evaluate(torch.cat(genomes), generation).nan_to_num(nan=-10.0)
        for body, own, speeds in zip(bodies, genomes, values.split(CONTROLLERS), strict=True):
            elite.append((float(speeds.max()), body, own[speeds.argmax()]))
        elite = sorted(elite, key=lambda each: -each[0])[: max(1, options.bodies // 4)]
        print(f"generation {generation}: best {elite[0][0]:.2f} m/s")
    print(elite[0][1])
    return elite[0][0]


if __name__ == "__main__":
    main()
