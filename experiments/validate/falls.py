"""Robots that fall and come to rest without actuation.

The recorded falls contain false collision events, which shift the robots along x; heights and
areas compare.
"""

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
from experiments.validate.motion import DTYPES, follow
from experiments.validate.recordings import Recordings, Table
from physics import Morphology, Terrain
from physics.scene import material

__all__ = ["cases", "own_cases"]

_SETTLED = 60  # control steps at the end of a recording
_CENTRE, _CENTRE_SETTLED = 0.08, 0.01  # [m]
_VOXELS, _VOXELS_SETTLED = 0.12, 0.02  # [m]
_AREA_SETTLED = 0.02
_DEPTH, _DEPTH_TOLERANCE = 5.0, 0.5  # of a square at rest [mm]
_DEPTH_STEPS = 300


def cases(recordings: Recordings) -> list[Case]:
    """One for every table ``passive_*`` and ``*_drop``."""
    names = recordings.names(r"(passive_.*(?<!_poses)|.*_drop)")
    return [_case(recordings, match[0]) for match in names]


def own_cases() -> list[Case]:
    """What needs no recording: the depth of a voxel at rest."""
    return [Case("rest depth", _rest_depth)]


def _case(recordings: Recordings, name: str) -> Case:
    table = recordings.table(name)
    table.check_clock(first=0)
    # A note in brackets may follow the name.
    terrain_name = str(recordings.document(name).get("terrain", "flat")).split(" ")[0]
    terrain = recordings.terrain(terrain_name, f"{name}.json")
    heights, areas = _heights(table)
    return Case(name, partial(_replay, name, table.morphology(), terrain, heights, areas))


def _heights(table: Table) -> tuple[np.ndarray, np.ndarray]:
    """Heights of the voxels [m] and their area ratios, (rows, V) each."""
    morphology = table.morphology()
    voxels = morphology.voxel_names
    if f"{voxels[0]}_y" in table:
        heights = table.numbers([f"{voxel}_y" for voxel in voxels])
        return heights, table.numbers([f"{voxel}_area_ratio" for voxel in voxels])
    poses, _ = table.squares(morphology)
    return poses[..., 1].mean(axis=2), table.per_voxel("area_ratio", "area")


def _replay(
    name: str,
    morphology: Morphology,
    terrain: Terrain,
    heights: np.ndarray,
    areas: np.ndarray,
    setting: Setting,
) -> Outcome:
    rows: list[Check] = []
    panels = []
    for label, dtype in DTYPES.items():
        sim = setting.simulator(morphology, terrain, dtype=dtype)
        ours = follow(sim, np.zeros((len(heights) - 1, morphology.n_voxels)))
        own_heights = ours.centers[..., 1]
        centre = own_heights.mean(axis=1) - heights.mean(axis=1)
        voxels = own_heights - heights
        settled = slice(-_SETTLED, None)
        for measure, error, limit in (
            ("height of the centre [m]", centre, _CENTRE),
            ("height of the centre, settled [m]", centre[settled], _CENTRE_SETTLED),
            ("heights of the voxels [m]", voxels, _VOXELS),
            ("heights of the voxels, settled [m]", voxels[settled], _VOXELS_SETTLED),
            ("area ratios, settled", (ours.areas - areas)[settled], _AREA_SETTLED),
        ):
            text = f"greatest error of {measure}"
            rows.append(
                Check(f"{name} {label}", text, 0.0, worst(error), Tolerance("at most", limit))
            )
        panels.append(
            Panel(
                label,
                "time [s]",
                "height of the voxels [m]",
                "lines",
                heights,
                own_heights,
                np.arange(len(heights)) / 60,
            )
        )
    return Outcome(tuple(rows), (Picture(name, tuple(panels)),))


def _rest_depth(setting: Setting) -> Outcome:
    """How deep the lower squares of a voxel lie in flat ground."""
    rows = []
    for label, dtype in DTYPES.items():
        flat = Terrain.from_name("flat")
        sim = setting.simulator("box-1x1", flat, dtype=dtype)
        lower = follow(sim, np.zeros((_DEPTH_STEPS, 1))).poses[-1, 0, material.SE :]
        bottoms = lower[:, 1] - material.SQUARE_HALF
        depth = float(np.mean(flat.height(lower[:, 0]) - bottoms))
        tolerance = Tolerance("within", _DEPTH_TOLERANCE)
        rows.append(
            Check(
                f"rest {label}",
                "depth of a square in flat ground [mm]",
                _DEPTH,
                1e3 * depth,
                tolerance,
            )
        )
    return Outcome(tuple(rows))
