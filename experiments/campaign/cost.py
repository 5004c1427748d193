"""What a condition takes: evaluations, robot-steps, minutes on this machine, bytes on disk."""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterable

import torch

from experiments.config import EvolveConfig
from experiments.evolution.observation import film_seconds, is_filmed, is_observed
from experiments.rollout import controller
from experiments.rollout.episode import start_episode
from experiments.rollout.scenarios import Scenarios
from physics import Morphology, Terrain, steps_in

__all__ = ["disk_bytes", "evaluations", "robot_steps", "seconds_left", "seconds_per_robot_step"]

_WARM_UP, _STRETCH = 60, 30  # robot-steps: after the first, the robots have landed
_SECONDS = 0.4  # that a measurement takes at least
_TERRAINS = 8

# Sizes of what an evolution writes [bytes].
_GENE = 4
_HISTORY_ROW = 100 + 64  # in history.csv and in the checkpoint
_EVENTS = 1_900  # per generation and TensorBoard run, of which the overview is one
_OBSERVED = 8_000  # besides, where champions are looked at
_PICTURES = 25_000  # where pictures are logged, without the film
_FILM_SECOND = 80_000  # of a film
_LIFE = 60_000, 5_000  # of the champion's episode, and more for each of its seconds
_FIXED = 10_000


def evaluations(config: EvolveConfig) -> int:
    """Episodes in an evolution, of all its runs."""
    return config.runs * config.population * config.generations


def robot_steps(config: EvolveConfig) -> int:
    """Steps of the simulator in an evolution, of all robots."""
    return evaluations(config) * steps_in(config.duration)


def seconds_left(progress: Iterable[tuple[EvolveConfig, int, float]]) -> float | None:
    """Time that evolutions still take, from the time that their generations took so far [s].

    It goes by robot-steps times voxels, to which the time is about proportional.

    Args:
        progress: The options of each evolution, the generations it has done and the time they took
            [s]; 0 if that is not known.

    Returns:
        None if the time of no generation is known.
    """
    spent = done = left = 0.0
    for config, generation, seconds in progress:
        work = robot_steps(config) * Morphology.from_name(config.shape).n_voxels
        share = generation / config.generations
        if seconds:
            spent += seconds
            done += work * share
        left += work * (1 - share)
    return left * spent / done if done else None


def seconds_per_robot_step(config: EvolveConfig) -> float:
    """Time of a robot-step in a batch as large as the evolution's, measured now [s].

    It leaves out what comes between the episodes, some hundredths of the whole.
    """
    n = config.runs * config.population
    terrains = [Terrain.from_name(config.terrain, seed) for seed in range(min(n, _TERRAINS))]
    scenarios = Scenarios(
        [terrains[k % len(terrains)] for k in range(n)], list(range(n)), list(range(n))
    )
    networks = controller.build(config, n)
    draws = torch.Generator().manual_seed(0)
    genomes = 2 * torch.rand(n, networks.n_genes, generator=draws) - 1
    episode = start_episode(config, genomes, scenarios, network=networks)
    interval = config.control_interval
    episode.run(-(-_WARM_UP // interval))  # compiles, too
    control_steps = -(-_STRETCH // interval)
    stretches: list[float] = []
    while sum(stretches) < _SECONDS:
        started = time.perf_counter()
        episode.run(control_steps)
        stretches.append(time.perf_counter() - started)
    # The median: what else runs on the machine may hold up one of them for long.
    return statistics.median(stretches) / (n * control_steps * interval)


def disk_bytes(config: EvolveConfig) -> int:
    """About what an evolution leaves on disk, without analyses and figures."""
    genes = controller.build(config, 1).n_genes
    genomes = config.runs * (config.population + 2) * genes * _GENE  # checkpoint and champions
    rows = config.generations * config.runs * _HISTORY_ROW
    generations = range(1, config.generations + 1)
    observed = sum(is_observed(each, config.generations) for each in generations)
    filmed = sum(is_filmed(each, config.generations) for each in generations)
    logged = (config.runs + 1) * (config.generations * _EVENTS + observed * _OBSERVED)
    pictures = filmed * (_PICTURES + round(_FILM_SECOND * film_seconds(config)))
    episode = _LIFE[0] + round(_LIFE[1] * config.duration)
    archived = config.runs * genes * _GENE * observed
    return genomes + rows + logged + pictures + episode + archived + _FIXED
