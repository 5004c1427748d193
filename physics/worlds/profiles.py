"""The profiles of all terrains of a batch in one table."""

from __future__ import annotations

import numpy as np

from physics.scene.terrain import Terrain

__all__ = ["pack_terrains", "padded", "segments_within"]

_PAD_STEP = 1e4  # distance of the points that make shorter profiles as long as the longest [m]
_ROUNDING = 0.01  # of abscissas, as float32 and float64 may differ [m]


def pack_terrains(
    terrains: list[Terrain] | None, extent: float, places: np.ndarray, n_places: int
) -> tuple[int, np.ndarray]:
    """Profiles as one array, and how many segments the window of a group must hold.

    Args:
        terrains: one per world, or None.
        extent: width of ground that a robot may need at once [m].
        places: where each world lies, (N,).
        n_places: all places, those without a world included.

    Returns:
        Segments per window (0 without ground), and points (n_places, K, 2), float64.
    """
    if terrains is None:
        return 0, np.zeros((n_places, 2, 2))
    unique = {id(t): t for t in terrains}
    longest = max(len(t.xs) for t in unique.values())
    profiles = {key: padded(t, longest) for key, t in unique.items()}
    packed = np.zeros((n_places, longest, 2))
    for place, terrain in zip(places, terrains, strict=True):
        packed[place] = profiles[id(terrain)]
    segments = max(segments_within(t.xs, extent) for t in unique.values())
    return segments, packed


def padded(terrain: Terrain, points: int) -> np.ndarray:
    """The profile, with points of no height (NaN) at its end that nothing meets."""
    own = len(terrain.xs)
    profile = np.empty((points, 2))
    profile[:own, 0], profile[:own, 1] = terrain.xs, terrain.ys
    if own < points:
        profile[own:, 0] = terrain.xs[-1] + _PAD_STEP * np.arange(1, points - own + 1)
        profile[own:, 1] = np.nan
    return profile


def segments_within(xs: np.ndarray, extent: float) -> int:
    """The most segments that an interval of this width can meet: the one it starts in, those that
    start within it, and one more because a window starts with an even segment."""
    reached = np.searchsorted(xs, xs + (extent + _ROUNDING), side="right") - np.arange(len(xs))
    return int(min(reached.max() + 2, len(xs)))
