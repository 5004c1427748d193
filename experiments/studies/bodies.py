"""The bodies that the paper's robots have (Sec. IV)."""

from collections.abc import Mapping, Sequence

__all__ = ["ALL_BODIES", "HIGH_BODIES", "INTERVALS", "LOW_AND_HIGH", "SHAPES"]

SHAPES = ("biped-4x3", "worm-7x1")

# The low apparatus comes first: of the claims about it most is left to be said.
ALL_BODIES: Mapping[str, Sequence[str]] = {"sensors": ("low", "medium", "high"), "shape": SHAPES}
HIGH_BODIES: Mapping[str, Sequence[str]] = {"shape": SHAPES, "sensors": ("high",)}
"""Of the studies that the paper shows for the high apparatus alone."""

LOW_AND_HIGH: Mapping[str, Sequence[str]] = {"sensors": ("low", "high"), "shape": SHAPES}
"""Of the controls."""

INTERVALS: Mapping[str, Sequence[int]] = {"control_interval": (1, 12)}
"""Control at every engine step, as in the paper, and every 0.2 s: slower than the springs."""
