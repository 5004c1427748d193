"""What TensorBoard shows of the champions every few generations.

The best individual of a generation is the luckiest of its population, so that its fitness is
biased upwards. Here it is assessed again on fixed terrains, which evolution never meets and which
select nothing; meanwhile its network and its gait are looked at.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import reduce
from operator import add

import numpy as np
import torch
from torch import Tensor

import hebbtorch
from experiments.analysis.measures import gait_measures
from experiments.config import EvolveConfig
from experiments.rollout.episode import Episode, start_episode
from experiments.rollout.scenarios import Scenarios
from experiments.runs.archive import ARCHIVE_INTERVAL
from physics import DT
from physics.render import Frame

__all__ = [
    "Observation",
    "Observer",
    "film_seconds",
    "is_filmed",
    "is_observed",
    "validation_tags",
]

_FIRST = 500_000  # seed of the validation; re-assessments count from 0, evolution from 1,000,000
_OTHERS = ("flat", "steppy-1-10")  # kinds of terrain besides the evolution's
_OWN, _OTHER, _DAMAGED = 4, 2, 4  # episodes on its kind, on each other kind, with damage
_WINDOW = 4.0  # [s] at the end, in which the gait is looked at
_FILM, _FILM_STEPS = 2.0, 6  # length of the film [s] at the end, control steps between pictures
_SHORT = 100  # generations of an evolution that is looked at twice as often as others


@dataclass(frozen=True)
class Observation:
    """What was seen of the champion of one run.

    Attributes:
        metrics: numbers by their tags; None where there is nothing to tell.
        frames: the last seconds of the first episode; none if it failed.
        weights: The weights of each layer at the end, shape (out, in); none for a static
            controller.
        rules: the coefficients A, B, C and D of each layer, by "A/layer0" and so on.
    """

    metrics: dict[str, float | None]
    frames: list[Frame]
    weights: list[np.ndarray]
    rules: dict[str, np.ndarray]


def is_observed(generation: int, generations: int) -> bool:
    """Whether champions are looked at in this generation."""
    return generation in (1, generations) or generation % _interval(generations) == 0


def is_filmed(generation: int, generations: int) -> bool:
    """Whether they are shown in pictures too, which takes longer."""
    return generation in (1, generations) or generation % (2 * _interval(generations)) == 0


def film_seconds(config: EvolveConfig) -> float:
    """Length of the films of champions [s]."""
    return min(_FILM, config.duration / 2)


def validation_tags(config: EvolveConfig) -> list[str]:
    """Tags of the validation: one for each kind of terrain, and one for damage."""
    return [f"validation/{kind}" for kind in _kinds(config)] + ["validation/damage"]


class Observer:
    """Looks at the champions of an evolution.

    Attributes:
        terrain: The terrain of the first episode, which is filmed.
    """

    def __init__(self, config: EvolveConfig) -> None:
        self._config = config
        kinds = _kinds(config)
        self._of_kind = [kind for kind, count in kinds.items() for _ in range(count)]
        parts = [
            Scenarios.unseen(kind, range(_FIRST, _FIRST + count)) for kind, count in kinds.items()
        ]
        self._scenarios = reduce(add, parts)
        self._damaged = Scenarios.unseen(config.terrain, range(_FIRST, _FIRST + _DAMAGED))
        self.terrain = self._scenarios.terrains[0]

    @torch.no_grad()
    def __call__(self, genomes: Tensor) -> list[Observation]:
        """Look at the champion of each run.

        Args:
            genomes: shape (runs, G).
        """
        whole = replace(self._config, damage="none")
        watch = _Watch(self._start(whole, genomes, self._scenarios), len(self._scenarios))
        of_terrains = watch.follow(film_seconds(whole)).reshape(len(genomes), -1)
        damaged = self._start(replace(whole, damage="half"), genomes, self._damaged)
        of_damage = damaged.finish().speed.cpu().reshape(len(genomes), -1)
        observations = []
        for run in range(len(genomes)):
            speeds: dict[str, list[float]] = {}
            for kind, speed in zip(self._of_kind, of_terrains[run].tolist(), strict=True):
                speeds.setdefault(f"validation/{kind}", []).append(speed)
            validation = {tag: _mean(values) for tag, values in speeds.items()}
            validation["validation/damage"] = _mean(of_damage[run].tolist())
            observations.append(watch.observation(run, validation))
        return observations

    def _start(self, config: EvolveConfig, genomes: Tensor, scenarios: Scenarios) -> Episode:
        """Every champion in every scenario."""
        every = genomes.repeat_interleave(len(scenarios), 0)
        return start_episode(config, every, scenarios * len(genomes))


class _Watch:
    """Follows episodes, and looks closer at the first one of each champion."""

    def __init__(self, episode: Episode, n_each: int) -> None:
        self._episode = episode
        self._first = slice(None, None, n_each)
        network = episode.network
        self._n_each = n_each
        self._monitor: hebbtorch.Monitor | None = None
        if isinstance(network, hebbtorch.HebbianMLP):
            second = episode.sim.control_steps(1.0)
            self._monitor = hebbtorch.Monitor(network, every=second)
        self._areas: list[Tensor] = []
        self._touching: list[Tensor] = []
        self._frames: list[tuple[float, Tensor, Tensor]] = []
        self._weights: tuple[Tensor, ...] = ()

    def follow(self, film_seconds: float) -> Tensor:
        """Let the episodes go on to their end, with a look at the networks once per second, and
        at the bodies in the last seconds.

        Args:
            film_seconds: How much of the end of the episode is filmed [s].

        Returns:
            Their speeds [m/s], NaN where one failed.
        """
        episode, sim = self._episode, self._episode.sim
        steps = episode.n_steps
        window = steps - min(sim.control_steps(_WINDOW), steps // 2)
        film = steps - sim.control_steps(film_seconds)
        episode.run(1, self._monitor)
        while (done := episode.steps_done) < steps:
            ahead = max(1, window - done)
            end = done + ahead
            is_filmed = end > film and end % _FILM_STEPS == 0
            in_force = sim.actuation()[self._first] if is_filmed else None
            episode.run(ahead, self._monitor)
            if end > window:
                self._areas.append(sim.area_ratios()[self._first])
                if not self._touching or end % _FILM_STEPS == 0:
                    self._touching.append(sim.touching()[self._first])
            if in_force is not None:
                self._frames.append((sim.time, sim.mass_poses()[self._first], in_force))
        if self._monitor is not None:
            self._monitor.close()
            self._weights = tuple(layer[self._first] for layer in episode.state().weights)
        return episode.finish().speed.cpu()

    def observation(self, run: int, validation: Mapping[str, float | None]) -> Observation:
        """All that was seen of one champion."""
        sim = self._episode.sim
        touching = torch.stack(self._touching)[:, run].float()
        gait = gait_measures(
            torch.stack(self._areas)[:, run].cpu().numpy(), sim.control_interval * DT
        )
        metrics: dict[str, float | None] = {
            **validation,
            **{f"body/{name}": value for name, value in gait.items()},
            "body/touch": touching.mean().item(),
            **self._plasticity(run),
        }
        failed = bool(sim.failed()[self._first][run])
        frames = [
            Frame(poses[run].cpu().numpy(), time, actuation=in_force[run].cpu().numpy())
            for time, poses, in_force in ([] if failed else self._frames)
        ]
        weights = [layer[run].cpu().numpy() for layer in self._weights]
        return Observation(metrics, frames, weights, dict(self._rules(run)))

    def _plasticity(self, run: int) -> dict[str, float | None]:
        """What the monitor saw of one champion; the sizes of weights are told of the population."""
        if self._monitor is None:
            return {}
        seen = self._monitor.summary(individual=run * self._n_each)
        return {
            f"plasticity/{name}": None if np.isnan(value) else value
            for name, value in seen.items()
            if not name.startswith("weight_")
        }

    def _rules(self, run: int) -> Iterator[tuple[str, np.ndarray]]:
        """Coefficients of one champion, by their names."""
        network = self._episode.network
        if not isinstance(network, hebbtorch.HebbianMLP):
            return
        for k, layer in enumerate(network.layers):
            shape = self._weights[k].shape[1:]
            for term, coefficients in layer.named_coefficients().items():
                if layer.rules.rule.name != "abcd" or term in layer.rules.terms:
                    wide = coefficients.expand(*network.population, *shape)
                    yield f"{term}/layer{k}", wide[self._first][run].detach().cpu().numpy()


def _interval(generations: int) -> int:
    """Generations from one look at the champions to the next: what it takes stays about 2 %."""
    return ARCHIVE_INTERVAL if generations <= _SHORT else 2 * ARCHIVE_INTERVAL


def _kinds(config: EvolveConfig) -> dict[str, int]:
    """Kinds of terrain and the number of episodes on each, the evolution's first."""
    return {config.terrain: _OWN} | {kind: _OTHER for kind in _OTHERS if kind != config.terrain}


def _mean(speeds: list[float]) -> float | None:
    """Mean of the episodes that did not fail; None if all did."""
    known = [speed for speed in speeds if not np.isnan(speed)]
    return sum(known) / len(known) if known else None
