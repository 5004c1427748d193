"""The bodies that the paper's robots have (Sec. IV)."""

from collections.abc import Mapping, Sequence

__all__ = ["ALL_BODIES", "HIGH_BODIES", "SHAPES"]

SHAPES = ("biped-4x3", "worm-7x1")

ALL_BODIES: Mapping[str, Sequence[str]] = {"shape": SHAPES, "sensors": ("low", "medium", "high")}
HIGH_BODIES: Mapping[str, Sequence[str]] = {"shape": SHAPES, "sensors": ("high",)}
"""Of the studies that the paper shows for the high apparatus alone."""
