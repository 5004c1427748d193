"""Readings along recorded poses."""

from __future__ import annotations

from functools import partial

import numpy as np
import torch

from experiments.validate.case import (
    Case,
    Check,
    Outcome,
    Panel,
    Picture,
    Setting,
    Skip,
    Tolerance,
    worst,
)
from experiments.validate.recordings import Recordings
from physics import Apparatus, Morphology, Terrain

__all__ = ["RECORDED_RAYS", "cases"]

RECORDED_RAYS = (-30.0, 0.0, 30.0)  # of the reference's lidar [degrees]
_LEVELS = ("low", "medium", "high")
_ERROR = Tolerance("at most", 1e-9)


def cases(recordings: Recordings) -> list[Case | Skip]:
    """One for every table ``sensors_<shape>_<level>``."""
    matches = recordings.names(r"sensors_(?!poses_)([^_]+)_(.+)")
    return [_case(recordings, match[0], match[1], match[2]) for match in matches]


def _case(recordings: Recordings, name: str, shape: str, level: str) -> Case | Skip:
    motion_name = f"sensors_poses_{shape}"
    document_name = name if recordings.document(name) else "sensors"
    terrain = recordings.document(document_name).get("terrain")
    if level not in _LEVELS:
        return Skip(name, f"no apparatus {level}")
    if not recordings.has(motion_name):
        return Skip(name, f"no table {motion_name}")
    if terrain is None:
        return Skip(name, "no terrain in sensors.json")
    readings, motion = recordings.table(name), recordings.table(motion_name)
    morphology = recordings.robot(shape, name)
    columns = [column for column in readings.columns if column != "t"]
    readings.check_clock(first=1)
    motion.check_clock(first=0)  # row 0 is the start, before any step
    poses, velocities = motion.squares(morphology)
    steps = len(readings)
    if len(motion) <= steps:
        raise ValueError(
            f"{motion.path.name}: expected the start and {steps} steps in column t, as in "
            f"{readings.path.name}, got {len(motion)} rows"
        )
    return Case(
        name,
        partial(
            _replay,
            name,
            Apparatus.named(level, morphology, RECORDED_RAYS),
            morphology,
            recordings.terrain(terrain, f"{document_name}.json"),
            columns,
            readings.numbers(columns),
            poses[1 : steps + 1],
            velocities[1 : steps + 1],
        ),
    )


def _replay(
    name: str,
    apparatus: Apparatus,
    morphology: Morphology,
    terrain: Terrain,
    columns: list[str],
    recorded: np.ndarray,
    poses: np.ndarray,
    velocities: np.ndarray,
    setting: Setting,
) -> Outcome:
    sim = setting.simulator(morphology, terrain, sensors=apparatus, dtype=torch.float64)
    sensed = sim.replay(torch.from_numpy(poses)[:, None], torch.from_numpy(velocities)[:, None])
    assert sensed is not None  # every level has sensors
    names = list(sim.sensor_names)
    in_place = sum(ours == theirs for ours, theirs in zip(names, columns, strict=False))
    common = [column for column in columns if column in names]
    ours = sensed[:, 0, [names.index(column) for column in common]].cpu().numpy()
    theirs = recorded[:, [columns.index(column) for column in common]]
    rows = (
        Check(
            name,
            "readings of the same name and place",
            len(columns),
            in_place,
            Tolerance("within", 0),
        ),
        Check(name, "greatest error of a reading", 0.0, worst(ours - theirs), _ERROR),
    )
    return Outcome(rows, (Picture(name, _panels(common, theirs, ours)),))


def _panels(columns: list[str], recorded: np.ndarray, ours: np.ndarray) -> tuple[Panel, ...]:
    """The first reading of every kind of sensor."""
    first = {column.split("_", 2)[2]: index for index, column in reversed([*enumerate(columns)])}
    return tuple(
        Panel(
            columns[index],
            "time [s]",
            "reading",
            "lines",
            recorded[:, [index]],
            ours[:, [index]],
            np.arange(1, len(ours) + 1) / 60,
        )
        for kind, index in sorted(first.items())
        if kind in ("area", "touch", "vel_x", "lidar_0")
    )
