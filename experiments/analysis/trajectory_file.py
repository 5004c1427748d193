"""Trajectories on disk, in one documented file: format 1.

A file is of safetensors, written by `experiments.io.tensors` with a digest over its content; every
reader of safetensors can open it. Its metadata hold one JSON object under "hebbtorch" -> "config":

- format: 1. kind: "trajectory".
- config: the conditions, as in a run's config.json; null of a loop of one's own.
- body: name, grid (top row first, 0 or 1), materials of the voxels.
- sensors: for each voxel, its sensors with kind, interval, angles and range.
- terrain: its name. seconds: length of a control step.
- neurons: of each layer, inputs first. layers: shape (out, in) of each layer of weights.

and these tensors, T instants of V voxels and R readings:

- times (T,) [s]; poses (T, V, 4, 3), x and y [m] and angle of the squares NW, NE, SE, SW.
- actuation (T, V), in force in the step that ends at the instant; areas (T, V) over those at rest.
- touching, broken (T, V) bool; readings (T, R); rewards (T,).
- activations (T, all neurons); weight_times (W,) [s]; weights (W, all synapses), layer by layer.
- terrain (K, 2), the points of the profile [m].
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch

from experiments.analysis.trajectory import Trajectory
from experiments.config import EvolveConfig
from experiments.io.formats import require_format
from experiments.io.tensors import read_tensors, write_tensors
from physics import Apparatus, Morphology, Sensor, Terrain

__all__ = ["SUFFIX", "load", "save"]

SUFFIX = ".safetensors"
_FORMAT, _KIND = 1, "trajectory"
_COLUMNS = ("times", "poses", "actuation", "areas", "touching", "broken", "readings", "rewards")
_TENSORS = (*_COLUMNS, "activations", "weight_times", "weights", "terrain")


def save(course: Trajectory, path: Path) -> None:
    """Write a trajectory; the file is replaced in one instant.

    Args:
        course: what to write.
        path: ends in .safetensors, in an existing folder.

    Raises:
        ValueError: the path is none of these.
    """
    check_path(path)
    arrays = {name: getattr(course, name) for name in (*_COLUMNS, "weight_times")}
    arrays["activations"] = _side_by_side(course.activations, len(course.times))
    arrays["weights"] = _side_by_side(course.weights, len(course.weight_times))
    arrays["terrain"] = np.stack([course.terrain.xs, course.terrain.ys], 1)
    about = {
        "format": _FORMAT,
        "kind": _KIND,
        "config": None if course.config is None else json.loads(course.config.to_json()),
        "body": course.morphology.description(),
        "sensors": [
            [dataclasses.asdict(sensor) for sensor in own] for own in course.apparatus.sensors
        ],
        "terrain": course.terrain.name,
        "seconds": course.seconds,
        "neurons": [layer.shape[1] for layer in course.activations],
        "layers": [layer.shape[1:] for layer in course.weights],
    }
    tensors = {name: torch.from_numpy(np.ascontiguousarray(a)) for name, a in arrays.items()}
    write_tensors(path, tensors, json.dumps(about))


def load(path: Path) -> Trajectory:
    """Read what `save` wrote.

    Args:
        path: of the file.

    Raises:
        ValueError: it is missing, damaged, in a newer format, or holds something else.
    """
    if not path.is_file():
        raise ValueError(f"trajectory: expected a file that `hebbtorch record` wrote, got {path}")
    try:
        tensors, text = read_tensors(path, _TENSORS)
        about = json.loads(text)
        if about["kind"] != _KIND:
            raise ValueError(f"it holds a {about['kind']!r}")
        require_format(about.get("format"), _FORMAT)
        return _unpacked({name: each.numpy() for name, each in tensors.items()}, about)
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise ValueError(
            f"{path}: expected a trajectory that `hebbtorch record` wrote; {error}"
        ) from error


def check_path(path: Path) -> None:
    """Raises unless a trajectory can be written there."""
    if path.suffix != SUFFIX or path.is_dir() or not path.parent.is_dir():
        raise ValueError(
            f"out: expected a name ending in {SUFFIX} in an existing folder, got {str(path)!r}"
        )


def _side_by_side(layers: tuple[np.ndarray, ...], rows: int) -> np.ndarray:
    """Arrays (rows, ...) as one, (rows, all their numbers)."""
    if not layers:
        return np.zeros((rows, 0), dtype=np.float32)
    return np.concatenate([layer.reshape(rows, -1) for layer in layers], 1)


def _apart(table: np.ndarray, shapes: Sequence[tuple[int, ...]]) -> tuple[np.ndarray, ...]:
    """Undoes `_side_by_side`."""
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes])
    parts = np.split(table, ends[:-1], axis=1) if shapes else []
    return tuple(part.reshape(-1, *shape) for part, shape in zip(parts, shapes, strict=True))


def _unpacked(arrays: dict[str, np.ndarray], about: dict[str, Any]) -> Trajectory:
    """The trajectory of a file's content."""
    terrain = arrays.pop("terrain")
    sensors = tuple(tuple(Sensor(**sensor) for sensor in own) for own in about["sensors"])
    neurons = [(count,) for count in about["neurons"]]
    layers = [tuple(shape) for shape in about["layers"]]
    config = about["config"]
    return Trajectory(
        config=None if config is None else EvolveConfig.from_json(json.dumps(config)),
        morphology=Morphology.from_description(about["body"]),
        terrain=Terrain.from_profile(terrain[:, 0], terrain[:, 1], about["terrain"]),
        apparatus=Apparatus(sensors),
        seconds=about["seconds"],
        activations=_apart(arrays.pop("activations"), neurons),
        weights=_apart(arrays.pop("weights"), layers),
        **arrays,
    )
