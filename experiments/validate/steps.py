"""Free robots that answer to steps of their actuation: no gravity, no ground."""

from __future__ import annotations

from functools import partial

import numpy as np

from experiments.validate.case import (
    Case,
    Check,
    Outcome,
    Panel,
    Picture,
    Setting,
    Tolerance,
    worst,
)
from experiments.validate.motion import DTYPES, Track, follow
from experiments.validate.recordings import Recordings, Table
from physics import Morphology

__all__ = ["cases"]

# Of position [m] and area ratio, by the number of voxels; the last is for more. From four voxels
# on, squares of a robot touch each other at their corners, and runs part sooner.
_TOLERANCES = {1: (2e-4, 1e-4), 2: (1e-3, 2e-4)}
_TOLERANCE_OF_MORE = (0.02, 5e-3)


def cases(recordings: Recordings) -> list[Case]:
    """One for every table ``*_voxel_step``."""
    return [_case(recordings.table(m[0]), m[0]) for m in recordings.names(r".*_voxel_step")]


def _case(table: Table, name: str) -> Case:
    table.check_clock(first=0)
    morphology = table.morphology()
    actuations = table.per_voxel("actuation", "a")
    poses, _ = table.squares(morphology)
    areas = table.per_voxel("area_ratio", "area")
    return Case(name, partial(_replay, name, morphology, actuations, Track(poses, areas)))


def _replay(
    name: str, morphology: Morphology, actuations: np.ndarray, recorded: Track, setting: Setting
) -> Outcome:
    at_most = _TOLERANCES.get(morphology.n_voxels, _TOLERANCE_OF_MORE)
    rows, panels = [], []
    for label, dtype in DTYPES.items():
        sim = setting.simulator(morphology, None, gravity=0.0, dtype=dtype)
        ours = follow(sim, actuations[:-1])
        errors = np.abs(ours.poses - recorded.poses)[..., :2].max(axis=(1, 2, 3))
        measures = (
            ("greatest error of position [m]", errors),
            ("greatest error of area ratio", ours.areas - recorded.areas),
        )
        for (measure, error), limit in zip(measures, at_most, strict=True):
            rows.append(
                Check(f"{name} {label}", measure, 0.0, worst(error), Tolerance("at most", limit))
            )
        panels.append(
            Panel(
                f"{label}: at most {worst(errors):.2g} m off",
                "time [s]",
                "area ratio of the voxels",
                "lines",
                recorded.areas,
                ours.areas,
                np.arange(len(errors)) / 60,
            )
        )
    return Outcome(tuple(rows), (Picture(name, tuple(panels)),))
