"""Runs recorded from the reference simulator, as arrays; README.md says what each holds.

The files are those that `hebbtorch validate` replays; the joint orders are kept here.
"""

from __future__ import annotations

import json
import re
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from experiments.validate.recordings import Recordings, Table
from experiments.validate.validation import OWN_COPY

RECORDINGS = Recordings(OWN_COPY)
GOLDEN_NETWORKS = OWN_COPY / "hebbian_golden.json"

Arrays = dict[str, np.ndarray]


def load(name: str) -> Arrays:
    """The arrays of a recorded run, by name; the caller's own."""
    return {key: array.copy() for key, array in _load(name).items()}


def joint_order(shape: str) -> list[list[Any]]:
    """Joints in recorded solving order: kind, bodies 1 and 2, anchors 1 and 2, rest length."""
    return json.loads((Path(__file__).parent / "joint_orders.json").read_text())[shape]


@lru_cache
def _load(name: str) -> Arrays:
    kinds = {
        "terrains": _terrains,
        r"\w+_voxel_step": _step,
        "single_voxel_drop": _drop,
        r"passive_\w+": _passive,
        r"sensors_(\w+)": _sensors,
        r"random_gaits_(\w+)": _random_gaits,
    }
    (build,) = (build for pattern, build in kinds.items() if re.fullmatch(pattern, name))
    return build(name)


def _terrains(name: str) -> Arrays:
    return {key: np.array([t.xs, t.ys]) for key, t in RECORDINGS.profiles.items()}


def _step(name: str) -> Arrays:
    table = RECORDINGS.table(name)
    return {
        "actuation": table.per_voxel("actuation", "a"),
        "state": _squares(table),
        "area_ratio": table.per_voxel("area_ratio", "area"),
    }


def _drop(name: str) -> Arrays:
    table = RECORDINGS.table(name)
    touching = table.numbers([f"{square}_touch" for square in ("NW", "NE", "SE", "SW")])
    return {
        "state": _squares(table),
        "touching": touching.astype(bool)[:, None, :],
        "false_events": table.numbers("toi_events").astype(np.int64),
    }


def _passive(name: str) -> Arrays:
    table = RECORDINGS.table(name)
    items = ("x", "y", "area_ratio", "touch")
    columns = [f"{voxel}_{item}" for voxel in table.morphology().voxel_names for item in items]
    voxels = table.numbers(columns).reshape(len(table), -1, 4)
    return {
        "centers": voxels[..., :2],
        "area_ratio": voxels[..., 2],
        "touching": voxels[..., 3].astype(bool),
    }


def _sensors(name: str) -> Arrays:
    shape = _shape(name)
    motion = RECORDINGS.table(f"sensors_poses_{shape}")
    touch = [column for column in motion.columns if column.endswith("_gtouch")]
    tables = {
        level: RECORDINGS.table(f"sensors_{shape}_{level}") for level in ("high", "medium", "low")
    }
    names = {f"names_{level}": np.array(table.columns[1:]) for level, table in tables.items()}
    return {
        "state": _squares(motion)[1:],  # row 0 is the start, before any step
        "touching": motion.numbers(touch)[1:].reshape(len(motion) - 1, -1, 4).astype(bool),
        "readings": tables["high"].numbers(tables["high"].columns[1:]),
        **names,
    }


def _random_gaits(name: str) -> Arrays:
    shape = _shape(name)
    params = RECORDINGS.table(f"random_gaits_params_{shape}")
    speeds = RECORDINGS.table(f"random_gaits_clean_{shape}")
    voxels = range((len(params.columns) - 2) // 2)
    modes = ("veto", "veto_dx", "noccd", "noself")
    return {
        "frequency": params.numbers("f"),
        "amplitude": params.numbers([f"amp{v}" for v in voxels]),
        "phase": params.numbers([f"phase{v}" for v in voxels]),
        **{
            ground: speeds.numbers([f"vel_{ground}_{mode}" for mode in modes])
            for ground in ("flat", "hilly")
        },
    }


def _squares(table: Table) -> np.ndarray:
    """State x, y, angle, vx, vy, omega of the squares, (rows, V, 4, 6)."""
    return np.concatenate(table.squares(table.morphology()), axis=-1)


def _shape(name: str) -> str:
    return {"worm": "worm-7x1", "biped": "biped-4x3"}[name.rsplit("_", 1)[1]]
