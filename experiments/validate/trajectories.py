"""Cases of recorded trajectories: the same actuation moves the robot in the same way."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch

from experiments.analysis import trajectory_file
from experiments.analysis.trajectory import Trajectory
from experiments.validate.case import Case, Check, Outcome, Setting, Skip, Tolerance, worst
from physics import DT

__all__ = ["cases"]

_STEPS = 20  # that are compared: later, rounding decides
_POSITION = Tolerance("at most", 1e-3)  # [m]


def cases(files: Sequence[Path]) -> list[Case | Skip]:
    """A case for each trajectory that has every control step from the first one on.

    Args:
        files: that `hebbtorch record` or `trajectory_file.save` wrote.

    Raises:
        ValueError: one cannot be read.
    """
    found: list[Case | Skip] = []
    for file in files:
        course, name = trajectory_file.load(file), f"trajectory {file.stem}"
        if course.is_complete:
            found.append(Case(name, partial(_replay, name, course)))
        else:
            found.append(Skip(name, "every control step from the start; record with --every 1"))
    return found


def _replay(name: str, course: Trajectory, setting: Setting) -> Outcome:
    """Moves a robot by the recorded actuation, which was in force, and compares."""
    conditions: dict[str, Any] = {}
    if (config := course.config) is not None:
        conditions = {
            "gravity": config.gravity,
            "friction": config.friction,
            "spring_frequency": config.spring_frequency,
            "spring_damping": config.spring_damping,
        }
    sim = setting.simulator(
        course.morphology,
        course.terrain,
        sensors=course.apparatus,
        control_interval=round(course.seconds / DT),
        threads=1,
        **conditions,
    )
    errors = []
    for actuation, poses in zip(course.actuation[:_STEPS], course.poses[:_STEPS], strict=True):
        sim.step(torch.from_numpy(actuation)[None])
        errors.append(sim.mass_poses()[0, ..., :2].cpu().numpy() - poses[..., :2])
    measure = f"position, first {len(errors)} steps [m]"
    return Outcome((Check(name, measure, 0.0, worst(np.stack(errors)), _POSITION),))
