"""The bodies that the paper's robots have (Sec. IV)."""

from collections.abc import Mapping, Sequence

__all__ = ["ALL_BODIES", "HIGH_BODIES", "SHAPES"]

SHAPES = ("biped-4x3", "worm-7x1")

# The low apparatus comes first: of the claims about it most is left to be said.
ALL_BODIES: Mapping[str, Sequence[str]] = {"sensors": ("low", "medium", "high"), "shape": SHAPES}
HIGH_BODIES: Mapping[str, Sequence[str]] = {"shape": SHAPES, "sensors": ("high",)}
"""Of the studies that the paper shows for the high apparatus alone."""
