"""Terrains drawn from their names against the recorded profiles."""

from __future__ import annotations

from functools import partial

import numpy as np

from experiments.validate.case import Case, Check, Outcome, Setting, Skip, Tolerance, worst
from experiments.validate.recordings import Recordings
from physics import Terrain

__all__ = ["cases"]

_ERROR = Tolerance("at most", 1e-9)
_AS_MANY = Tolerance("within", 0.0)


def cases(recordings: Recordings) -> list[Case | Skip]:
    """One for all profiles whose names are of the catalogue."""
    pairs = []
    for name, recorded in recordings.profiles.items():
        try:
            pairs.append((recorded, Terrain.from_name(name)))
        except ValueError:  # a profile of their own, to be used as it is
            continue
    if not pairs:
        return [Skip("terrains", "no profiles in terrains.json")]
    return [Case("terrains", partial(_compare, pairs))]


def _compare(pairs: list[tuple[Terrain, Terrain]], setting: Setting) -> Outcome:
    rows, errors = [], []
    for recorded, ours in pairs:
        if len(recorded.xs) == len(ours.xs):
            errors.append(worst(np.stack([recorded.xs - ours.xs, recorded.ys - ours.ys])))
            continue
        points = float(len(recorded.xs)), float(len(ours.xs))
        rows.append(Check(recorded.name, "no such profile: points", *points, _AS_MANY))
    if errors:
        case = f"{len(errors)} terrains"
        rows.append(Check(case, "greatest error of a point [m]", 0.0, max(errors), _ERROR))
    return Outcome(tuple(rows))
