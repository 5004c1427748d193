"""The course of one robot: its body, what it senses and does, and the network that drives it.

Films, the report page and TensorBoard are made of it. The individual acts as in the re-assessment
on the terrain of the same seed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from torch import Tensor

import hebbtorch
from experiments.config import EvolveConfig
from experiments.rollout.control_loop import ControlLoop
from experiments.rollout.episode import start_episode
from experiments.rollout.scenarios import Scenarios
from physics import DT, Apparatus, Simulator, Terrain, steps_in
from physics.render import Frame

__all__ = ["Trajectory", "lidar_rays", "record"]

_DEFAULT_START = 20.0  # [s]: by then plastic robots have learned to walk (paper, Fig. 6)
_NEVER = 1 << 60  # [steps]
_NO_HIT = 0.97  # a lidar's reading beyond it may be noise on its range


@dataclass(frozen=True)
class Trajectory:
    """T instants of one robot with V voxels.

    Attributes:
        config: The options that the controller evolved under.
        terrain: The terrain that the robot moves on.
        apparatus: The robot's sensors.
        times: The times of the instants [s], shape (T,).
        poses: The poses of the squares, shape (T, V, 4, 3), float32.
        actuation: The actuation in force in the step that ends at each instant, shape (T, V).
        areas: The areas of the voxels over those at rest, shape (T, V).
        touching: whether voxels touch the ground, shape (T, V), bool.
        broken: whether voxels no longer work, shape (T, V), bool.
        readings: The readings of the sensors, shape (T, R).
        activations: The activations of each layer's neurons, inputs first, shape (T, neurons); none
            where the network is driven step by step through PyTorch.
        weight_times: when weights were looked at [s], shape (W,).
        weights: per layer, shape (W, out, in).
    """

    config: EvolveConfig
    terrain: Terrain
    apparatus: Apparatus
    times: np.ndarray
    poses: np.ndarray
    actuation: np.ndarray
    areas: np.ndarray
    touching: np.ndarray
    broken: np.ndarray
    readings: np.ndarray
    activations: tuple[np.ndarray, ...]
    weight_times: np.ndarray
    weights: tuple[np.ndarray, ...]

    @property
    def centers(self) -> np.ndarray:
        """Mean of the voxels' centres [m], shape (T, 2)."""
        return self.poses[..., :2].astype(np.float64).mean(axis=(1, 2))

    @property
    def speed(self) -> float:
        """Mean velocity along x over all instants [m/s]."""
        way = self.centers[-1, 0] - self.centers[0, 0]
        return float(way / (self.times[-1] - self.times[0]))

    @property
    def title(self) -> str:
        """Body, sensors, controller, damage and terrain."""
        config = self.config
        damage = "" if config.damage == "none" else ", voxels break"
        return (
            f"{config.shape}, {config.sensors} sensors, {config.controller}, "
            f"{self.terrain.name}{damage}"
        )

    def frames(self, chosen: np.ndarray | slice, *, by_area: bool = False) -> list[Frame]:
        """Instants ready to be drawn.

        Args:
            chosen: The indices of the instants.
            by_area: whether voxels are coloured by their area instead of their actuation.
        """
        return [self._frame(i, by_area) for i in np.arange(len(self.times))[chosen].tolist()]

    def _frame(self, i: int, by_area: bool) -> Frame:
        seen = lidar_rays(self.poses[i].astype(np.float64), self.readings[i], self.apparatus)
        return Frame(
            self.poses[i],
            float(self.times[i]),
            actuation=None if by_area else self.actuation[i],
            rays=None if seen is None else seen[0],
            hits=None if seen is None else seen[1],
            broken=self.broken[i],
        )


@torch.inference_mode()
def record(
    config: EvolveConfig,
    genome: Tensor,
    *,
    seed: int = 0,
    start: float | None = None,
    seconds: float | None = None,
    every: int = 1,
    weights_every: float = math.inf,
    freeze_at: float = math.inf,
) -> Trajectory:
    """Let one individual act and record its course.

    Args:
        config: The options that the controller evolved under.
        genome: The champion's genome, shape (G,).
        seed: The seed of terrain, sensor noise, damage and initial weights.
        start: when the recording begins [s]; by default after the robot has learned to walk.
        seconds: length of the recording [s], cut at the end of the episode; by default all of it.
        every: control steps between two instants.
        weights_every: seconds between two looks at the weights.
        freeze_at: when learning stops [s].

    Raises:
        ValueError: start or seconds are out of range, or the simulation of this individual fails
            before the recording begins.
    """
    first, last = _window(config.duration, start, seconds)
    frozen_from = steps_in(freeze_at) if math.isfinite(freeze_at) else _NEVER
    first, last, frozen_from = (
        -(-step // config.control_interval) for step in (first, last, frozen_from)
    )
    config = replace(config, threads=1)  # one robot gains nothing from more
    scenarios = Scenarios.unseen(config.terrain, [seed])
    episode = start_episode(config, genome[None], scenarios)
    sim = episode.sim
    course = _Course(weights_every)
    course.look_at_weights(0.0, episode.state())
    step = 0
    while step < last:
        # A step at a time where something is recorded, as many as possible before.
        ahead = every if step >= first - 1 else min(first - 1, frozen_from) - step
        if step < frozen_from:
            ahead = min(ahead, frozen_from - step)
        ahead = max(1, min(ahead, last - step))
        if step == frozen_from:
            episode.freeze()
        if ahead > 1:
            episode.run(ahead - 1)
        in_force, broken = sim.actuation(), sim.broken()
        episode.run(1)
        step += ahead
        if sim.failed()[0]:
            break
        if step >= first:
            course.add(sim, in_force, broken, episode.loop)
    if len(course.times) < 2:
        raise ValueError(
            f"start: expected a time before the simulation of this robot fails, got "
            f"{first * DT:.1f} s; choose an earlier one, or another seed"
        )
    return course.finish(config, scenarios.terrains[0], sim.apparatus)


def lidar_rays(
    poses: np.ndarray, readings: np.ndarray, apparatus: Apparatus
) -> tuple[np.ndarray, np.ndarray] | None:
    """What a robot sees: its lidars' rays, as long as they read.

    Args:
        poses: The poses of the squares, shape (V, 4, 3).
        readings: The robot's readings, shape (R,).
        apparatus: The sensors of the robot.

    Returns:
        Start and end of each ray [m], shape (K, 2, 2), and whether it ends on something, shape
        (K,); None without lidar.
    """
    rays: list[tuple[np.ndarray, np.ndarray]] = []
    hits: list[bool] = []
    reading = 0
    for squares, sensors in zip(poses, apparatus.sensors, strict=True):
        for sensor in sensors:
            if sensor.kind == "lidar":
                center = squares[:, :2].mean(axis=0)
                shares = readings[reading : reading + sensor.n_readings]
                angles = _voxel_angle(squares) + np.radians(sensor.angles)
                directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
                ends = center + sensor.range * shares[:, None] * directions
                rays += [(center, end) for end in ends]
                hits += (shares < _NO_HIT).tolist()
            reading += sensor.n_readings
    return (np.array(rays), np.array(hits)) if rays else None


@dataclass
class _Course:
    """A trajectory in the making."""

    weights_every: float
    times: list[float] = field(default_factory=list)
    columns: list[tuple[np.ndarray, ...]] = field(default_factory=list)
    activations: list[tuple[np.ndarray, ...]] = field(default_factory=list)
    weight_times: list[float] = field(default_factory=list)
    weights: list[tuple[np.ndarray, ...]] = field(default_factory=list)

    def add(self, sim: Simulator, in_force: Tensor, broken: Tensor, loop: ControlLoop) -> None:
        """Note one instant."""
        readings = sim.readings()
        columns = (sim.mass_poses(), in_force, sim.area_ratios(), sim.touching(), readings, broken)
        self.times.append(sim.time)
        self.columns.append(tuple(_of_one(each) for each in columns))
        if activations := getattr(loop, "activations", None):
            self.activations.append(tuple(_of_one(layer) for layer in activations()))
        if sim.time >= len(self.weight_times) * self.weights_every - DT / 2:
            self.look_at_weights(sim.time, loop.state())

    def look_at_weights(self, time: float, state: hebbtorch.State) -> None:
        """Note the weights."""
        if math.isfinite(self.weights_every):
            self.weight_times.append(time)
            self.weights.append(tuple(_of_one(layer) for layer in state.weights))

    def finish(self, config: EvolveConfig, terrain: Terrain, apparatus: Apparatus) -> Trajectory:
        """All of it."""
        poses, actuation, areas, touching, readings, broken = (
            np.stack(column) for column in zip(*self.columns, strict=True)
        )
        return Trajectory(
            config=config,
            terrain=terrain,
            apparatus=apparatus,
            times=np.array(self.times),
            poses=poses,
            actuation=actuation,
            areas=areas,
            touching=touching,
            broken=broken,
            readings=readings,
            activations=tuple(np.stack(layer) for layer in zip(*self.activations, strict=True)),
            weight_times=np.array(self.weight_times),
            weights=tuple(np.stack(layer) for layer in zip(*self.weights, strict=True)),
        )


def _of_one(values: Tensor) -> np.ndarray:
    """Values of the only world, shape (1, ...), as an array (...) of its own."""
    return values[0].detach().cpu().numpy().copy()


def _window(duration: float, start: float | None, seconds: float | None) -> tuple[int, int]:
    """First and last engine step to record, from 1."""
    if seconds is not None and not seconds > 0:
        raise ValueError(f"seconds: expected a number > 0, got {seconds}")
    if start is None:
        start = 0.0 if seconds is None else max(0.0, min(_DEFAULT_START, duration - seconds))
    if not 0 <= start < duration:
        raise ValueError(f"start: expected a time within the episode of {duration} s, got {start}")
    end = duration if seconds is None else min(duration, start + seconds)
    first = max(1, round(start / DT))
    return first, max(steps_in(end), first + 1)


def _voxel_angle(squares: np.ndarray) -> float:
    """Mean direction of the upper and the lower side of a voxel with squares (4, 3) [rad]."""
    nw, ne, se, sw = squares[:, :2]
    upper, lower = ne - nw, se - sw
    x, y = upper / np.linalg.norm(upper) + lower / np.linalg.norm(lower)
    return math.atan2(y, x)
