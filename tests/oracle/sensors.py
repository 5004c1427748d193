"""Readings from a history of poses: plain numpy, one voxel and one ray at a time."""

from __future__ import annotations

import math

import numpy as np

from physics.scene import material
from physics.scene.sensors import Apparatus, Sensor
from physics.scene.terrain import Terrain

NW, NE, SE, SW = range(4)
SOLID = 50.0  # ground under the lowest point [m]; the reference has as much


def readings(
    apparatus: Apparatus,
    poses: np.ndarray,
    velocities: np.ndarray,
    touching: np.ndarray,
    terrain: Terrain | None,
) -> np.ndarray:
    """What a robot senses after each step of its life, from the first one on.

    Args:
        apparatus: its sensors.
        poses: x, y, angle of the squares after each step, shape (T, V, 4, 3).
        velocities: vx, vy, omega of the squares, shape (T, V, 4, 3).
        touching: whether each square touches the ground, shape (T, V, 4).
        terrain: the ground, for the lidar.

    Returns:
        Readings, shape (T, R), before noise.
    """
    times, time = [], 0.0
    for _ in poses:
        time += material.DT
        times.append(time)
    columns = []
    for v, sensors in enumerate(apparatus.sensors):
        for sensor in sensors:
            if sensor.kind == "area":
                columns.append([_area(pose) for pose in poses[:, v]])
            elif sensor.kind == "touch":
                raw = [float(squares.any()) for squares in touching[:, v]]
                columns.append(_averages(raw, times, sensor.interval))
            elif sensor.kind == "velocity":
                raw = [_velocity(p, u) for p, u in zip(poses[:, v], velocities[:, v], strict=True)]
                for axis in range(2):
                    means = _averages([value[axis] for value in raw], times, sensor.interval)
                    columns.append([0.5 + 0.5 * math.tanh(m / 4) for m in means])
            else:
                rays = [_lidar(sensor, pose, terrain) for pose in poses[:, v]]
                columns += [[ray[i] for ray in rays] for i in range(len(sensor.angles))]
    return np.array(columns).T


def area_ratio(pose: np.ndarray) -> float:
    """Area of the quadrilateral of the four outer corners, over the area at rest."""
    outer = []
    for (x, y, angle), (sx, sy) in zip(pose, material.CORNER_SIGNS, strict=True):
        ax, ay = sx * material.SQUARE_HALF, sy * material.SQUARE_HALF
        c, s = math.cos(angle), math.sin(angle)
        outer.append((x + c * ax - s * ay, y + s * ax + c * ay))
    pairs = zip(outer, outer[1:] + outer[:1], strict=True)
    twice = sum(x1 * y2 - x2 * y1 for (x1, y1), (x2, y2) in pairs)
    return abs(twice) / 2 / material.VOXEL_SIDE**2


def voxel_angle(pose: np.ndarray) -> float:
    """Mean direction of SW -> SE and NW -> NE, between centres of squares."""
    bottom, top = pose[SE, :2] - pose[SW, :2], pose[NE, :2] - pose[NW, :2]
    x, y = bottom / math.hypot(*bottom) + top / math.hypot(*top)
    return math.atan2(y, x)


def _area(pose: np.ndarray) -> float:
    return 0.5 + 0.5 * math.tanh(4 * (area_ratio(pose) - 1))


def _velocity(pose: np.ndarray, velocity: np.ndarray) -> tuple[float, float]:
    """Mean velocity of the squares along and across the voxel."""
    vx, vy = velocity[:, :2].mean(axis=0)
    c, s = math.cos(voxel_angle(pose)), math.sin(voxel_angle(pose))
    return (c * vx + s * vy, -s * vx + c * vy)


def _averages(samples: list[float], times: list[float], interval: float) -> list[float]:
    """Mean, at each time t, of the samples taken from t - interval to t."""
    means = []
    for k, now in enumerate(times):
        window = [samples[j] for j in range(k + 1) if times[j] >= now - interval]
        means.append(sum(window) / len(window))
    return means


def _lidar(sensor: Sensor, pose: np.ndarray, terrain: Terrain | None) -> list[float]:
    x, y = pose[:, :2].mean(axis=0)
    angle = voxel_angle(pose)
    return [
        distance(float(x), float(y), angle + math.radians(ray), sensor.range, terrain)
        / sensor.range
        for ray in sensor.angles
    ]


def distance(x: float, y: float, angle: float, reach: float, terrain: Terrain | None) -> float:
    """Distance along a ray to the ground, at most ``reach``.

    The ground is one convex quadrilateral per segment; one that holds the ray's origin is
    not seen.
    """
    if terrain is None:
        return reach
    dx, dy = math.cos(angle), math.sin(angle)
    nearest = reach
    for (x1, y1), (x2, y2) in zip(
        zip(terrain.xs[:-1], terrain.ys[:-1], strict=True),
        zip(terrain.xs[1:], terrain.ys[1:], strict=True),
        strict=True,
    ):
        if x2 < x - reach or x1 > x + reach:
            continue
        low = terrain.ys.min() - SOLID
        entry, leave = -math.inf, math.inf
        corners = [(x1, low), (x2, low), (x2, y2), (x1, y1)]  # counter-clockwise
        for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
            nx, ny = by - ay, ax - bx  # outwards
            ahead = nx * dx + ny * dy
            outside = nx * (x - ax) + ny * (y - ay)
            if ahead == 0:
                if outside > 0:
                    entry = math.inf
            elif ahead < 0:
                entry = max(entry, -outside / ahead)
            else:
                leave = min(leave, -outside / ahead)
        if 0 < entry <= leave:
            nearest = min(nearest, entry)
    return nearest
