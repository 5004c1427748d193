"""What TensorBoard shows of the champions every few generations.

The best individual of a generation is the luckiest of its population, so that its fitness is
biased upwards. Here it is assessed again on fixed terrains, which evolution never meets and which
select nothing; meanwhile its network and its gait are looked at.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

import hebbtorch
from experiments.analysis.measures import gait_measures
from experiments.analysis.term_sizes import TermSizes
from experiments.config import EvolveConfig, fresh_terrain
from experiments.rollout import controller, fused, seeds
from experiments.rollout.episode import Stepwise, driver
from experiments.rollout.evaluate import world
from experiments.runs.archive import ARCHIVE_INTERVAL
from physics import Simulator, Terrain
from physics.render.draw import Frame
from physics.scene.material import DT

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
_WINDOW = 5.0  # [s] at the end, in which the gait is looked at
_FILM, _FILM_STEPS = 2.0, 5  # length of the film [s] at the end, control steps between pictures
_SECOND = 60  # control steps
_SATURATED = 0.9  # an activation beyond it counts as saturated
_FILM_EVERY = 2 * ARCHIVE_INTERVAL


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
    return generation in (1, generations) or generation % ARCHIVE_INTERVAL == 0


def is_filmed(generation: int, generations: int) -> bool:
    """Whether they are shown in pictures too, which takes longer."""
    return generation in (1, generations) or generation % _FILM_EVERY == 0


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
        self._episodes = [
            (fresh_terrain(kind, _FIRST + i), _FIRST + i)
            for kind, count in kinds.items()
            for i in range(count)
        ]
        self.terrain = Terrain.from_name(self._episodes[0][0])

    @torch.no_grad()
    def __call__(self, genomes: Tensor) -> list[Observation]:
        """Look at the champion of each run.

        Args:
            genomes: shape (runs, G).
        """
        whole = replace(self._config, damage="none")
        sim, network, drive = self._start(whole, genomes, self._episodes)
        watch = _Watch(len(self._episodes), network)
        watch.follow(sim, drive, whole.duration, film_seconds(whole))
        of_terrains = watch.speeds(sim).reshape(len(genomes), -1)
        of_damage = self._damaged(genomes)
        observations = []
        for run in range(len(genomes)):
            speeds: dict[str, list[float]] = {}
            for kind, speed in zip(self._of_kind, of_terrains[run].tolist(), strict=True):
                speeds.setdefault(f"validation/{kind}", []).append(speed)
            validation = {tag: _mean(values) for tag, values in speeds.items()}
            validation["validation/damage"] = _mean(of_damage[run].tolist())
            observations.append(watch.observation(run, sim, validation))
        return observations

    def _damaged(self, genomes: Tensor) -> Tensor:
        """Speeds with voxels that break at half of the episode, shape (runs, episodes) [m/s]."""
        config = replace(self._config, damage="half")
        sim, network, drive = self._start(config, genomes, self._episodes[:_DAMAGED])
        watch = _Watch(_DAMAGED, network)
        watch.run_on(sim, drive, config.duration)
        return watch.speeds(sim).reshape(len(genomes), -1)

    def _start(
        self, config: EvolveConfig, genomes: Tensor, episodes: list[tuple[str, int]]
    ) -> tuple[Simulator, controller.Controller, fused.Brain | Stepwise]:
        """Every champion in every episode, ready to begin."""
        n_runs, n_each = len(genomes), len(episodes)
        terrains = [Terrain.from_name(name) for name, _ in episodes] * n_runs
        worlds = [seeds.derive(0, "unseen", seed) for _, seed in episodes] * n_runs
        inits = [seeds.derive(0, "unseen-init", seed) for _, seed in episodes] * n_runs
        network = controller.build(config, n_runs * n_each)
        network.set_genomes(genomes.repeat_interleave(n_each, 0))
        sim = world(config, terrains, worlds)
        drive = driver(sim, network, controller.birth(network, config.init, inits), config.loop)
        sim.reset()
        return sim, network, drive


class _Watch:
    """Follows episodes, and looks closer at the first one of each champion."""

    def __init__(self, n_each: int, network: controller.Controller) -> None:
        self._first = slice(None, None, n_each)
        self._network = network
        self._plastic = isinstance(network, hebbtorch.HebbianMLP)
        self._begin: tuple[Tensor, float] | None = None
        self._samples: list[dict[str, Tensor]] = []
        self._areas: list[Tensor] = []
        self._touching: list[Tensor] = []
        self._frames: list[tuple[float, Tensor, Tensor]] = []
        self._weights: tuple[Tensor, ...] = ()
        self._terms = TermSizes(network) if isinstance(network, hebbtorch.HebbianMLP) else None

    def run_on(self, sim: Simulator, drive: fused.Brain | Stepwise, duration: float) -> None:
        """Let the episodes go on to their end."""
        steps = sim.control_steps(duration)
        drive.run(sim, 1)
        self._begin = sim.center_of_mass(), sim.time
        drive.run(sim, steps - 1)

    def follow(
        self, sim: Simulator, drive: fused.Brain | Stepwise, duration: float, film_seconds: float
    ) -> None:
        """The same, with a look at the network once per second, and at the body at the end."""
        steps = sim.control_steps(duration)
        window = steps - sim.control_steps(min(_WINDOW, duration / 2))
        film = steps - sim.control_steps(film_seconds)
        second = max(1, _SECOND // sim.control_interval)
        born = drive.state().weights
        drive.run(sim, 1)
        self._begin, done = (sim.center_of_mass(), sim.time), 1
        while done < steps:
            if done >= window:
                ahead = 1
            else:
                ahead = max(1, min(second - done % second, window - done))
            is_sampled = self._plastic and (done + ahead) % second == 0
            if is_sampled and ahead > 1:
                drive.run(sim, ahead - 1)
                ahead, done = 1, done + ahead - 1
            before = drive.state().weights if is_sampled else ()
            in_force = sim.actuation()
            drive.run(sim, ahead)
            done += ahead
            if is_sampled:
                self._sample(drive, born, before)
            if done > window:
                self._areas.append(sim.area_ratios()[self._first])
                self._touching.append(sim.touching()[self._first])
            if done > film and done % _FILM_STEPS == 0:
                self._frames.append(
                    (sim.time, sim.mass_poses()[self._first], in_force[self._first])
                )
        self._weights = tuple(layer[self._first] for layer in drive.state().weights)

    def speeds(self, sim: Simulator) -> Tensor:
        """Mean velocity of every episode [m/s], NaN where it failed."""
        assert self._begin is not None
        center, time = self._begin
        way = (sim.center_of_mass() - center)[:, 0].double()
        return torch.where(sim.failed(), torch.nan, way / (sim.time - time)).cpu()

    def observation(
        self, run: int, sim: Simulator, validation: Mapping[str, float | None]
    ) -> Observation:
        """All that was seen of one champion."""
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
        weights = [layer[run].cpu().numpy() for layer in self._weights] if self._plastic else []
        return Observation(metrics, frames, weights, dict(self._rules(run)))

    def _sample(
        self,
        drive: fused.Brain | Stepwise,
        born: tuple[Tensor, ...],
        before: tuple[Tensor, ...],
    ) -> None:
        """Note what a step of learning did, of each champion's first episode."""
        sample: dict[str, Tensor] = {}
        now = drive.state().weights
        for k, (first, old, new) in enumerate(zip(born, before, now, strict=True)):
            first, old, new = (each[self._first].flatten(1) for each in (first, old, new))
            sample[f"update_mean_abs/layer{k}"] = (new - old).abs().mean(1)
            sample[f"drift_from_birth/layer{k}"] = (new - first).abs().mean(1)
            sample[f"sign_changes/layer{k}"] = (new * old < 0).float().mean(1)
        if isinstance(drive, fused.Brain) and self._terms is not None:
            activations = drive.activations()
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
        if self._terms is not None and self._samples:
            for k, sizes in enumerate(self._terms.by_layer()):
                own = sizes[self._first][run]
                shares = (own / own.sum()).tolist() if float(own.sum()) > 0 else [None] * len(own)
                for term, share in zip("ABCD", shares, strict=True):
                    values[f"plasticity/share_{term}/layer{k}"] = share
        return values

    def _rules(self, run: int) -> Iterator[tuple[str, np.ndarray]]:
        """Coefficients of one champion, by their names."""
        if not isinstance(self._network, hebbtorch.HebbianMLP):
            return
        for k, layer in enumerate(self._network.layers):
            shape = self._weights[k].shape[1:]
            for term, coefficients in zip("ABCD", layer.coefficients(), strict=True):
                if term in layer.rules.terms:
                    wide = coefficients.expand(*self._network.population, *shape)
                    yield f"{term}/layer{k}", wide[self._first][run].detach().cpu().numpy()


def _kinds(config: EvolveConfig) -> dict[str, int]:
    """Kinds of terrain and the number of episodes on each, the evolution's first."""
    return {config.terrain: _OWN} | {kind: _OTHER for kind in _OTHERS if kind != config.terrain}


def _mean(speeds: list[float]) -> float | None:
    """Mean of the episodes that did not fail; None if all did."""
    known = [speed for speed in speeds if not np.isnan(speed)]
    return sum(known) / len(known) if known else None
