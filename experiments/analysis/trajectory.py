"""The course of one robot: its body, what it senses and does, and the network that drives it.

Films, figures, the report page and TensorBoard are made of it; `trajectory_file` keeps it on disk.
`record` lets an individual act as in the re-assessment on the terrain of the same seed; a loop of
one's own takes its course down with a `Recorder`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

import hebbtorch
from experiments.config import EvolveConfig
from experiments.rollout.control_loop import ControlLoop
from experiments.rollout.episode import start_episode
from experiments.rollout.scenarios import Scenarios
from physics import DT, Apparatus, Morphology, Simulator, Terrain, steps_in
from physics.render import Frame

__all__ = ["Recorder", "Trajectory", "lidar_rays", "record"]

_DEFAULT_START = 20.0  # [s]: by then plastic robots have learned to walk (paper, Fig. 6)
_NEVER = 1 << 60  # [steps]
_NO_HIT = 0.97  # a lidar's reading beyond it may be noise on its range


@dataclass(frozen=True)
class Trajectory:
    """T instants of one robot with V voxels.

    Attributes:
        config: The options that the controller evolved under; None of a loop of one's own.
        morphology: The body of the robot.
        terrain: The terrain that the robot moves on.
        apparatus: The robot's sensors.
        seconds: The length of a control step [s].
        times: The times of the instants [s], shape (T,).
        poses: The poses of the squares, shape (T, V, 4, 3), float32.
        actuation: The actuation in force in the step that ends at each instant, shape (T, V).
        areas: The areas of the voxels over those at rest, shape (T, V).
        touching: whether voxels touch the ground, shape (T, V), bool.
        broken: whether voxels no longer work, shape (T, V), bool.
        readings: The readings of the sensors, shape (T, R).
        rewards: The reward of the control step that ends at each instant, shape (T,); by default
            the velocity of the centre along x [m/s].
        activations: The activations of each layer's neurons, inputs first, shape (T, neurons); none
            where the network is driven step by step through PyTorch.
        weight_times: when weights were looked at [s], shape (W,).
        weights: per layer, shape (W, out, in).
    """

    config: EvolveConfig | None
    morphology: Morphology
    terrain: Terrain
    apparatus: Apparatus
    seconds: float
    times: np.ndarray
    poses: np.ndarray
    actuation: np.ndarray
    areas: np.ndarray
    touching: np.ndarray
    broken: np.ndarray
    readings: np.ndarray
    rewards: np.ndarray
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
        if config is None:
            return f"{self.morphology.name}, {self.terrain.name}"
        damage = "" if config.damage == "none" else ", voxels break"
        return (
            f"{config.shape}, {config.sensors} sensors, {config.controller}, "
            f"{self.terrain.name}{damage}"
        )

    @property
    def is_complete(self) -> bool:
        """Whether it has every control step from the first one on, so that it can be replayed."""
        steps = np.arange(1, len(self.times) + 1)
        return bool(np.allclose(self.times, steps * self.seconds, atol=self.seconds / 4))

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
    course = Recorder(sim, config=config, weights_every=weights_every)
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
            course.add(actuation=in_force, broken=broken, loop=episode.loop)
        else:
            course.pass_by()
    if len(course.times) < 2:
        raise ValueError(
            f"start: expected a time before the simulation of this robot fails, got "
            f"{first * DT:.1f} s; choose an earlier one, or another seed"
        )
    return course.finish()


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


class Recorder:
    """Takes down the course of one world of a simulator.

    recorder = Recorder(sim, world=3)
    for _ in range(600):
        sim.step(actuation)
        recorder.add()
    trajectory_file.save(recorder.finish(), Path("course.safetensors"))
    """

    def __init__(
        self,
        sim: Simulator,
        world: int = 0,
        *,
        config: EvolveConfig | None = None,
        weights_every: float = math.inf,
    ) -> None:
        """Looks at where the robot is; the course begins with the first `add`.

        Args:
            sim: the simulator, with ground.
            world: number of the world.
            config: the conditions, if they are an evolution's.
            weights_every: seconds between two looks at the weights of a control loop.

        Raises:
            ValueError: there is no such world, or no ground.
        """
        if not 0 <= world < sim.n_worlds:
            raise ValueError(f"world: expected 0 to {sim.n_worlds - 1}, got {world}")
        if sim.terrains is None:
            raise ValueError("sim: expected worlds with ground, got none; give a terrain")
        self._sim = sim
        self._world = world
        self._config = config
        self._weights_every = weights_every
        self._body = sim.bodies.unlike[int(sim.bodies.of_world[world])]
        self.times: list[float] = []
        self._columns: list[tuple[np.ndarray, ...]] = []
        self._activations: list[tuple[np.ndarray, ...]] = []
        self._weight_times: list[float] = []
        self._weights: list[tuple[np.ndarray, ...]] = []
        self.pass_by()

    def pass_by(self) -> None:
        """Let an instant go unrecorded; the velocity of the next one is measured from it."""
        self._last = float(self._sim.times[self._world]), self._center()

    def add(
        self,
        reward: float | None = None,
        *,
        actuation: Tensor | None = None,
        broken: Tensor | None = None,
        loop: ControlLoop | None = None,
    ) -> None:
        """Take down one instant, after a control step.

        Args:
            reward: of the step; by default the velocity along x since the last instant [m/s].
            actuation: that was in force in the step, (N, V); by default that of the simulator,
                which is right after `Simulator.step`.
            broken: which voxels were broken in it, (N, V); by default those that are now.
            loop: whose activations and weights are taken down too.
        """
        sim, body = self._sim, self._body
        before, start = self._last
        self.pass_by()
        time, center = self._last
        v = body.n_voxels
        voxels = (
            sim.mass_poses(),
            sim.actuation() if actuation is None else actuation,
            sim.area_ratios(),
            sim.touching(),
            sim.broken() if broken is None else broken,
        )
        columns = [self._of_world(each)[:v] for each in voxels]
        columns.append(self._of_world(sim.readings())[: body.apparatus.n_readings])
        speed = (center - start) / max(time - before, 1e-9)
        columns.append(np.array(speed if reward is None else reward, dtype=np.float64))
        self.times.append(time)
        self._columns.append(tuple(columns))
        if activations := getattr(loop, "activations", None):
            self._activations.append(tuple(self._of_world(layer) for layer in activations()))
        if loop is not None and time >= len(self._weight_times) * self._weights_every - DT / 2:
            self.look_at_weights(time, loop.state())

    def look_at_weights(self, time: float, state: hebbtorch.State) -> None:
        """Take down weights."""
        if math.isfinite(self._weights_every):
            self._weight_times.append(time)
            self._weights.append(tuple(self._of_world(layer) for layer in state.weights))

    def finish(self) -> Trajectory:
        """All of it.

        Raises:
            ValueError: there are fewer than two instants.
        """
        if len(self.times) < 2:
            raise ValueError(f"recorder: expected at least two instants, got {len(self.times)}")
        poses, actuation, areas, touching, broken, readings, rewards = (
            np.stack(column) for column in zip(*self._columns, strict=True)
        )
        terrains = self._sim.terrains
        assert terrains is not None
        return Trajectory(
            config=self._config,
            morphology=self._body.morphology,
            terrain=terrains[self._world],
            apparatus=self._body.apparatus,
            seconds=DT * self._sim.control_interval,
            times=np.array(self.times),
            poses=poses,
            actuation=actuation,
            areas=areas,
            touching=touching,
            broken=broken,
            readings=readings,
            rewards=rewards,
            activations=tuple(np.stack(layer) for layer in zip(*self._activations, strict=True)),
            weight_times=np.array(self._weight_times),
            weights=tuple(np.stack(layer) for layer in zip(*self._weights, strict=True)),
        )

    def _center(self) -> float:
        return float(self._sim.center_of_mass()[self._world, 0])

    def _of_world(self, values: Tensor) -> np.ndarray:
        """What values (N, ...) are in the world, as an array (...) of its own."""
        return values[self._world].detach().cpu().numpy().copy()


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
