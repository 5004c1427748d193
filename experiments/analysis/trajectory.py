"""The course of one robot: its body, what it senses and does, and the network that drives it.

Films, figures, the report page and TensorBoard are made of it; `recorder` takes it down,
`trajectory_file` keeps it on disk.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from experiments.config import EvolveConfig
from physics import Apparatus, Morphology, Terrain
from physics.render import Frame

__all__ = ["Trajectory", "lidar_rays"]

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


def _voxel_angle(squares: np.ndarray) -> float:
    """Mean direction of the upper and the lower side of a voxel with squares (4, 3) [rad]."""
    nw, ne, se, sw = squares[:, :2]
    upper, lower = ne - nw, se - sw
    x, y = upper / np.linalg.norm(upper) + lower / np.linalg.norm(lower)
    return math.atan2(y, x)
