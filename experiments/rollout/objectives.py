"""What to measure of an episode besides its speed: objectives for `fitness`.

evaluate = fitness(config, objective=objectives.several(objectives.speed, objectives.upright))
values = evaluate(genomes, 1)  # (B, 2)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from experiments.rollout.episode import Episode

__all__ = [
    "Record",
    "distance_per_energy",
    "gait_frequency",
    "record",
    "several",
    "speed",
    "touch",
    "upright",
]


@dataclass(frozen=True)
class Record:
    """An episode of B robots, T control steps long.

    Attributes:
        speed: Mean velocity along x [m/s], shape (B,); NaN where the world failed.
        seconds: Length of a control step [s].
        power: Mean of the squared actuation over voxels, step by step, shape (T, B).
        area: Mean area ratio of the voxels, step by step, shape (T, B).
        touching: Share of the voxels that touch the ground, step by step, shape (T, B).
        up: Cosine of the mean angle of the body's squares, step by step, shape (T, B).
    """

    speed: Tensor
    seconds: float
    power: Tensor
    area: Tensor
    touching: Tensor
    up: Tensor


Measure = Callable[[Record], Tensor]


def record(episode: Episode) -> Record:
    """Run an episode to its end, one control step at a time."""
    sim, rows = episode.sim, []
    for _ in range(episode.n_steps):
        episode.run(1)
        angles = sim.mass_poses()[..., 2].flatten(1)
        heading = torch.atan2(angles.sin().mean(1), angles.cos().mean(1))
        rows.append(
            torch.stack(
                [
                    sim.actuation().square().mean(1),
                    sim.area_ratios().mean(1),
                    sim.touching().to(sim.dtype).mean(1),
                    heading.cos(),
                ]
            )
        )
    power, area, touching, up = torch.stack(rows, 1)
    return Record(episode.finish().speed, sim.time / episode.n_steps, power, area, touching, up)


def several(*measures: Measure) -> Callable[[Episode], Tensor]:
    """An objective of K measures at once, (B, K), or (B,) for one."""

    def objective(episode: Episode) -> Tensor:
        seen = record(episode)
        values = torch.stack([measure(seen).double() for measure in measures], 1)
        return values[:, 0] if len(measures) == 1 else values

    return objective


def speed(seen: Record) -> Tensor:
    """Mean velocity along x [m/s], shape (B,)."""
    return seen.speed


def distance_per_energy(seen: Record) -> Tensor:
    """Distance [m] over the time integral of the mean squared actuation [s], shape (B,)."""
    return seen.speed / (seen.power.double().mean(0) + 1e-3)


def upright(seen: Record) -> Tensor:
    """Share of the time in which the body is not upside down, shape (B,)."""
    return (seen.up > 0).double().mean(0)


def touch(seen: Record) -> Tensor:
    """Mean share of the voxels that touch the ground, shape (B,)."""
    return seen.touching.double().mean(0)


def gait_frequency(seen: Record) -> Tensor:
    """Frequency with most power in the mean area of the voxels [Hz], over the second half of the
    episode, shape (B,); 0 where the area does not change."""
    half = seen.area[len(seen.area) // 2 :].double()
    spectrum = torch.fft.rfft(half - half.mean(0), dim=0).abs()
    frequencies = torch.fft.rfftfreq(len(half), seen.seconds).to(spectrum)
    moves = spectrum.amax(0) > 1e-6
    return torch.where(moves, frequencies[spectrum.argmax(0)], 0.0)
