"""Genomes to fitness: every evaluation on its own terrain, with its own noise and damage."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor

from experiments.config import EvolveConfig
from experiments.rollout import controller
from experiments.rollout.episode import Episode, Outcome, start_episode
from experiments.rollout.scenarios import Scenarios
from experiments.rollout.team import gene_counts
from physics import Apparatus, Bodies, Engine, Morphology, Terrain

__all__ = ["Evaluator", "Fitness", "Objective", "fitness"]

Objective = Callable[[Episode], Tensor]
"""Runs the episodes of B individuals; returns their values, shape (B,) or (B, K)."""


class Evaluator:
    """Evaluates the populations of all runs of an evolution at once.

    Attributes:
        n_genes: Genes of one individual, G.
    """

    def __init__(self, config: EvolveConfig) -> None:
        self._config = config
        self._networks = controller.build(config, config.runs * config.population)
        self.n_genes: int = self._networks.n_genes

    def __call__(self, genomes: Tensor, generation: int) -> Outcome:
        """Run one episode for every individual.

        Args:
            genomes: Shape (runs, population, G).
            generation: The number of the generation, from 1; with the seed of a run and the index
                of an individual it decides the terrain, the noise, the damage and the initial
                weights.

        Returns:
            What came out for all individuals, run by run; N = runs * population.
        """
        config = self._config
        scenarios = Scenarios.training(
            config.terrain,
            (
                (config.seed + run, generation, individual)
                for run in range(config.runs)
                for individual in range(config.population)
            ),
        )
        return start_episode(
            config, genomes.flatten(0, 1), scenarios, network=self._networks
        ).finish()


class Fitness:
    """Evolution's own evaluation as a function of genomes; `fitness` makes it.

    Attributes:
        n_genes: Genes of one individual, G; of every individual, B numbers, for a list of bodies.
    """

    def __init__(
        self,
        config: EvolveConfig,
        shape: Morphology | Sequence[Morphology],
        sensors: str | Apparatus | Sequence[Apparatus],
        terrain: str | Terrain,
        engine: Engine | None,
        objective: Objective,
    ) -> None:
        self._config = config
        self._shape = shape
        self._sensors = sensors
        self._terrain = terrain
        self._engine = engine
        self._objective = objective
        several = not isinstance(shape, Morphology)
        count = 1 if isinstance(shape, Morphology) else len(shape)
        self._counts = gene_counts(config, Bodies.of(shape, sensors, count))
        self.n_genes: Any = self._counts if several else self._counts[0]

    def __call__(self, genomes: Tensor | Sequence[Tensor], generation: int) -> Tensor:
        """Evaluate genomes.

        Args:
            genomes: Shape (B, G), any B; for a list of B bodies also a list of B genomes, each of
                the length that its body needs.
            generation: The number of the generation, from 1.

        Returns:
            Values of shape (B,), or (B, K) for an objective with K values; NaN where the
            simulation failed.

        Raises:
            ValueError: the genomes are not (B, G), or not as many as bodies, or the generation is
                below 1.
        """
        self._check(genomes)
        if generation < 1:
            raise ValueError(f"generation: expected an integer >= 1, got {generation!r}")
        seed = self._config.seed
        scenarios = Scenarios.training(
            self._terrain, ((seed, generation, b) for b in range(len(genomes)))
        )
        episode = start_episode(
            self._config,
            genomes,
            scenarios,
            shape=self._shape,
            sensors=self._sensors,
            engine=self._engine,
        )
        values = self._objective(episode)
        failed = episode.sim.failed().to(values.device)
        return torch.where(failed.reshape(-1, *[1] * (values.ndim - 1)), torch.nan, values)

    def _check(self, genomes: Tensor | Sequence[Tensor]) -> None:
        """Raises unless the genomes are as many and as long as they must be."""
        if isinstance(self.n_genes, int):
            shape = tuple(getattr(genomes, "shape", ()))
            if len(shape) != 2 or shape[1] != self.n_genes:
                raise ValueError(f"genomes: expected shape (B, {self.n_genes}), got {shape}")
            return
        lengths = [tuple(genome.shape) for genome in genomes]
        if len(lengths) != len(self._counts):
            raise ValueError(
                f"genomes: expected {len(self._counts)}, one for each body, got {len(lengths)}"
            )
        for b, (length, count) in enumerate(zip(lengths, self._counts, strict=True)):
            if length != (count,):
                raise ValueError(
                    f"genomes: expected {count} genes for body {b}, got shape {length}; see n_genes"
                )


def fitness(
    config: EvolveConfig,
    shape: Morphology | Sequence[Morphology] | None = None,
    sensors: str | Apparatus | Sequence[Apparatus] | None = None,
    terrain: str | Terrain | None = None,
    engine: Engine | None = None,
    objective: Objective | None = None,
) -> Fitness:
    """Evolution's own evaluation as a plain function, for any optimizer.

    Individual b of a call gets the terrain, noise, damage and initial weights that an evolution
    with one run gives individual b of that generation: the values are evolution's, bit for bit,
    in batches of any size.

    Args:
        config: The options; its population and runs do not count.
        shape: A body in place of the options'; or a list of them, one for each individual of a
            call, which are evaluated together.
        sensors: An apparatus in place of the options', or a name, or for a list of bodies a list;
            for another body than the options' it is by default theirs, applied to that body.
        terrain: A Terrain, or another name, in place of the options'.
        engine: Settings of the physics engine in place of the defaults.
        objective: What to measure; by default the speed [m/s]. It is given the `Episode` before
            its first step, runs it as it likes and returns values of shape (B,) or (B, K).

    Returns:
        The function, (genomes (B, G), generation from 1) -> values, with its number of genes.

    Raises:
        ValueError: an option is wrong.
    """
    body = Morphology.from_name(config.shape) if shape is None else shape
    apparatus = config.sensors if sensors is None else sensors
    ground = config.terrain if terrain is None else terrain
    measure = objective or (lambda episode: episode.finish().speed)
    return Fitness(config, body, apparatus, ground, engine, measure)
