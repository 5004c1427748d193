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
from experiments.analysis.term_sizes import TermSizes
from experiments.config import EvolveConfig
from experiments.rollout import fused
from experiments.rollout.episode import Episode, start_episode
from experiments.rollout.scenarios import Scenarios
from experiments.runs.archive import ARCHIVE_INTERVAL
from physics import DT
from physics.render.draw import Frame

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
_SATURATED = 0.9  # an activation beyond it counts as saturated
_SHORT = 100  # generations of an evolution that is looked at twice as often as others


@dataclass(frozen=True)
class Observation:
    """What was seen of the champion of one run.

    Attributes:
        metrics: numbers by their tags; None where there is nothing to tell.
        frames: the last seconds of the first episode; none if it failed.
        weights: of each layer at the end, shape (out, in); none for a static controller.
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
        terrain: of the first episode, which is filmed.
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
        self._terms = TermSizes(network) if isinstance(network, hebbtorch.HebbianMLP) else None
        self._born = episode.state().weights
        self._samples: list[dict[str, Tensor]] = []
        self._areas: list[Tensor] = []
        self._touching: list[Tensor] = []
        self._frames: list[tuple[float, Tensor, Tensor]] = []
        self._weights: tuple[Tensor, ...] = ()

    def follow(self, film_seconds: float) -> Tensor:
        """Let the episodes go on to their end, with a look at the networks once per second, and
        at the bodies in the last seconds.

        Args:
            film_seconds: at the end that are filmed [s].

        Returns:
            Their speeds [m/s], NaN where one failed.
        """
        episode, sim = self._episode, self._episode.sim
        steps = episode.n_steps
        window = steps - min(sim.control_steps(_WINDOW), steps // 2)
        film = steps - sim.control_steps(film_seconds)
        second = sim.control_steps(1.0)
        episode.run(1)
        while (done := episode.steps_done) < steps:
            ahead = 1
            if done < window:
                ahead = max(1, min(second - done % second, window - done, steps - done))
            is_sampled = self._terms is not None and (done + ahead) % second == 0
            if is_sampled and ahead > 1:
                episode.run(ahead - 1)
                ahead = 1
            before = episode.state().weights if is_sampled else ()
            end = done + ahead
            is_filmed = end > film and end % _FILM_STEPS == 0
            in_force = sim.actuation()[self._first] if is_filmed else None
            episode.run(ahead)
            if is_sampled:
                self._sample(before)
            if end > window:
                self._areas.append(sim.area_ratios()[self._first])
                if not self._touching or end % _FILM_STEPS == 0:
                    self._touching.append(sim.touching()[self._first])
            if in_force is not None:
                self._frames.append((sim.time, sim.mass_poses()[self._first], in_force))
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
        weights = [layer[run].cpu().numpy() for layer in self._weights if self._terms is not None]
        return Observation(metrics, frames, weights, dict(self._rules(run)))

    def _sample(self, before: tuple[Tensor, ...]) -> None:
        """Note what the step of learning did that was made last."""
        sample: dict[str, Tensor] = {}
        now = self._episode.state().weights
        for k, (first, old, new) in enumerate(zip(self._born, before, now, strict=True)):
            first, old, new = (each[self._first].flatten(1) for each in (first, old, new))
            sample[f"update_mean_abs/layer{k}"] = (new - old).abs().mean(1)
            sample[f"drift_from_birth/layer{k}"] = (new - first).abs().mean(1)
            sample[f"sign_changes/layer{k}"] = (new * old < 0).float().mean(1)
        if isinstance(self._episode.loop, fused.FusedLoop) and self._terms is not None:
            activations = self._episode.loop.activations()
            self._terms.add(activations)
            for k, layer in enumerate(activations[1:]):
                saturated = layer[self._first].abs() > _SATURATED
                sample[f"saturated/layer{k}"] = saturated.float().mean(1)
        self._samples.append(sample)

    def _plasticity(self, run: int) -> dict[str, float | None]:
        """Means over the samples of an episode; of the drift, the last one."""
        values: dict[str, float | None] = {}
        for name in self._samples[0] if self._samples else ():
            course = torch.stack([sample[name][run] for sample in self._samples])
            value = course[-1] if name.startswith("drift") else course.mean()
            values[f"plasticity/{name}"] = value.item()
        if self._terms is not None and any("saturated/layer0" in each for each in self._samples):
            for k, sizes in enumerate(self._terms.by_layer()):
                own = sizes[self._first][run]
                shares = (own / own.sum()).tolist() if float(own.sum()) > 0 else [None] * len(own)
                for term, share in zip("ABCD", shares, strict=True):
                    values[f"plasticity/share_{term}/layer{k}"] = share
        return values

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
