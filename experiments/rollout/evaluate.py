"""Genomes to fitness: every evaluation on its own terrain, with its own noise and damage."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from torch import Tensor

from experiments.config import EvolveConfig, fresh_terrain
from experiments.rollout import controller, seeds
from experiments.rollout.episode import Life, live
from physics import Damage, Simulator, Terrain

__all__ = ["Evaluator", "lives", "world"]


class Evaluator:
    """Evaluates the populations of all runs of an evolution at once.

    Attributes:
        n_genes: genes of one individual, G.
    """

    def __init__(self, config: EvolveConfig) -> None:
        self._config = config
        self._networks = controller.build(config, config.runs * config.population)
        self.n_genes: int = self._networks.n_genes

    def __call__(self, genomes: Tensor, generation: int) -> Life:
        """Let every individual live once.

        Args:
            genomes: shape (runs, population, G).
            generation: from 1; with the seed of a run and the index of an individual it decides
                the terrain, the noise, the damage and the weights at birth.

        Returns:
            The lives of all individuals, run by run; N = runs * population.
        """
        config = self._config
        individuals = [
            (config.seed + run, generation, individual)
            for run in range(config.runs)
            for individual in range(config.population)
        ]
        terrains = [
            Terrain.from_name(fresh_terrain(config.terrain, seeds.terrain_seed(*each)))
            for each in individuals
        ]
        worlds = [seeds.derive(run, "world", *rest) for run, *rest in individuals]
        births = [seeds.derive(run, "init", *rest) for run, *rest in individuals]
        self._networks.set_genomes(genomes.flatten(0, 1))
        return lives(config, self._networks, terrains, worlds, births)


def lives(
    config: EvolveConfig,
    networks: controller.Controller,
    terrains: list[Terrain],
    worlds: list[int],
    births: list[int],
) -> Life:
    """Let every network of a population live once, each in a world of its own.

    Args:
        config: the conditions: shape, sensors, noise, damage, duration.
        networks: N of them, with genomes.
        terrains: N terrains.
        worlds: N seeds of noise and damage.
        births: N seeds of the weights at birth.
    """
    sim = world(config, terrains, worlds)
    state = controller.birth(networks, config.init, births)
    return live(sim, networks, config.duration, state=state, loop=config.loop)


def world(
    config: EvolveConfig, terrains: list[Terrain], world_seeds: list[int], **physics: Any
) -> Simulator:
    """The worlds in which the robots of an evolution live.

    Args:
        config: the conditions: shape, sensors, noise, damage (at half of the duration).
        terrains: N terrains.
        world_seeds: N seeds of noise and damage.
        physics: keywords of `Simulator` in place of what the evolution has, such as gravity.
    """
    damage = physics.pop("damage", Damage.from_name(config.damage))
    return Simulator(
        config.shape,
        terrains,
        n_worlds=len(terrains),
        sensors=config.sensors,
        noise=config.noise,
        control_interval=config.control_interval,
        device=config.device,
        seed=world_seeds,
        damage=None if damage is None else replace(damage, time=config.duration / 2),
        threads=config.threads,
        **physics,
    )
