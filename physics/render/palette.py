"""Colours of the pictures.

A voxel is orange when contracted, pale yellow at rest and blue when expanded: an axis that every
kind of colour vision tells apart, in print without colour by the captions. `PAPER` has the paper's
red, yellow and green (Fig. 1).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from physics.scene.material import AREA_RATIO_DELTA

Color = tuple[int, int, int]

SKY: Color = (247, 249, 251)
GRID: Color = (228, 233, 239)
GROUND: Color = (176, 168, 156)
GROUND_LINE: Color = (84, 76, 66)
RULER: Color = (44, 50, 58)
RULER_TICK: Color = (196, 204, 212)
RULER_TEXT: Color = (238, 242, 245)
INK: Color = (40, 46, 54)
FAINT_INK: Color = (82, 90, 101)
SHADE: Color = (38, 24, 16)
RAY: Color = (164, 84, 148)
HIT: Color = (112, 26, 94)
HATCH: Color = (20, 20, 24)
PAGE: Color = (255, 255, 255)


@dataclass(frozen=True)
class Scale:
    """Colours of voxels by their level.

    Attributes:
        contracted: The colour at level -1, most contracted.
        rest: The colour at level 0, at rest.
        expanded: The colour at level +1, most expanded.
    """

    contracted: Color
    rest: Color
    expanded: Color

    def color(self, level: float) -> Color:
        """The colour at a level; beyond -1 and +1 it no longer changes."""
        level = min(max(level, -1.0), 1.0)
        return mix(self.rest, self.expanded if level > 0 else self.contracted, abs(level))


SAFE = Scale(contracted=(199, 74, 0), rest=(252, 236, 178), expanded=(12, 88, 170))
PAPER = Scale(contracted=(168, 26, 34), rest=(255, 217, 84), expanded=(44, 158, 112))
SCALES: Mapping[str, Scale] = {"safe": SAFE, "paper": PAPER}


def area_level(area_ratio: np.ndarray) -> np.ndarray:
    """Level of an area ratio: -1 and +1 where an unloaded voxel settles at full actuation."""
    return (area_ratio - 1.0) / AREA_RATIO_DELTA


def mix(color: Color, other: Color, share: float) -> Color:
    """``color`` with ``share`` (0 to 1) of it replaced by ``other``."""
    red, green, blue = (
        round((1.0 - share) * a + share * b) for a, b in zip(color, other, strict=True)
    )
    return red, green, blue
