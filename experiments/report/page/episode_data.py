"""An episode as data of a page: small integers, packed and compressed."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np

from experiments.analysis.trajectory import Trajectory
from physics.render import voxel_outlines

__all__ = ["EVERY", "WEIGHTS_EVERY", "episode_data"]

EVERY = 2
"""Control steps between two instants of an episode on a page: 30 per second."""

WEIGHTS_EVERY = 0.5
"""Seconds between two looks at the weights."""

_CENTIMETRES = 100.0
_MOST_SYNAPSES = 4000  # of a layer; of a larger one, so many are chosen evenly
_SPEED_WINDOW = 1.0  # [s]
_MARGIN = 40.0  # of ground beyond the robot's way [m]


def episode_data(course: Trajectory, name: str, *, inside: bool) -> dict[str, Any]:
    """What the scripts of a page need to show an episode.

    Args:
        course: The recorded episode of the robot, at even intervals.
        name: The name of the episode, for its title.
        inside: whether to include the network: weights and activations.

    Returns:
        JSON-ready. Arrays are objects with type, shape, scale and data: numbers divided by the
        scale, changes along the first axis, little-endian, compressed by zlib, in base64.
    """
    outlines = np.stack([voxel_outlines(poses.astype(np.float64)) for poses in course.poses])
    data: dict[str, Any] = {
        "name": name,
        "title": course.title,
        "speed": round(course.speed, 4),
        "times": [round(time, 4) for time in course.times.tolist()],
        "momentary": _momentary_speed(course),
        "ground": _ground(course),
        "outlines": _packed(outlines, 1 / _CENTIMETRES, "int16"),
        "actuation": _packed(course.actuation, 1 / 127, "int8"),
        "broken": _packed(course.broken, 1.0, "int8"),
        "layers": [],
    }
    if inside and course.activations:
        names = ["inputs", *(f"layer {k}" for k in range(len(course.activations) - 1))]
        data["neurons"] = [layer.shape[1] for layer in course.activations]
        data["neuron_names"] = names
        data["activations"] = _packed(np.concatenate(course.activations, 1), 1 / 127, "int8")
    if inside and len(course.weights):
        data["weight_times"] = [round(time, 4) for time in course.weight_times.tolist()]
        data["layers"] = [_layer(weights) for weights in course.weights]
    return data


def _layer(weights: np.ndarray) -> dict[str, Any]:
    """Weights of a layer over time, by the signed root of their share of the largest one."""
    finite = np.nan_to_num(weights.astype(np.float64), posinf=0.0, neginf=0.0)
    largest = float(np.abs(finite).max()) or 1.0
    levels = np.sign(finite) * np.sqrt(np.abs(finite) / largest)
    n = levels[0].size
    if n > _MOST_SYNAPSES:
        chosen = np.linspace(0, n - 1, _MOST_SYNAPSES).round().astype(int)
        levels = levels.reshape(len(levels), -1)[:, chosen]
    return {
        "largest": largest,
        "synapses": n,
        "mean_abs": [float(f"{value:.4g}") for value in np.abs(finite).mean(axis=(1, 2))],
        "levels": _packed(levels, 1 / 127, "int8"),
    }


def _momentary_speed(course: Trajectory) -> list[float]:
    """Speed along x over the last second, or since the beginning [m/s]."""
    x, times = course.centers[:, 0], course.times
    before = np.searchsorted(times, times - _SPEED_WINDOW)
    before = np.minimum(before, np.maximum(np.arange(len(times)) - 1, 0))
    lengths = np.maximum(times - times[before], 1e-9)
    speeds = (x - x[before]) / lengths
    return [round(speed, 3) for speed in speeds.tolist()]


def _ground(course: Trajectory) -> list[list[float]]:
    """Points of the ground along the robot's way [m]."""
    x = course.centers[:, 0]
    left, right = float(x.min()) - _MARGIN, float(x.max()) + _MARGIN
    terrain = course.terrain
    inner = terrain.xs[(terrain.xs > left) & (terrain.xs < right)]
    xs = np.concatenate([[left], inner, [right]])
    return np.stack([xs, terrain.height(xs)], axis=-1).round(3).tolist()


def _packed(values: np.ndarray, scale: float, kind: str) -> dict[str, Any]:
    """An array as the scripts read it; see `episode_data`."""
    limits = np.iinfo(kind)
    scaled = np.nan_to_num(np.asarray(values, dtype=np.float64) / scale)
    whole = np.clip(scaled.round(), limits.min, limits.max).astype(kind)
    changes = np.diff(whole, axis=0, prepend=np.zeros_like(whole[:1]))  # wraps around, as sums do
    little = changes.astype(np.dtype(kind).newbyteorder("<"))
    content = zlib.compress(little.tobytes(), 9)
    return {
        "type": kind,
        "shape": list(whole.shape),
        "scale": scale,
        "data": base64.b64encode(content).decode(),
    }
