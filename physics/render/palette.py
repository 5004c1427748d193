"""Colours of the pictures.

A voxel is red when contracted, yellow at rest and green when expanded, as in the paper's
Fig. 1. Red and green also differ in lightness, and the green leans to blue, so that readers
who do not tell red from green still tell the two apart; yellow is the lightest of the three.
"""

from __future__ import annotations

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
FAINT_INK: Color = (112, 121, 132)
SHADE: Color = (38, 24, 16)
RAY: Color = (205, 44, 66)
PAPER: Color = (255, 255, 255)

CONTRACTED: Color = (168, 26, 34)
REST: Color = (255, 217, 84)
EXPANDED: Color = (44, 158, 112)


def level_color(level: float) -> Color:
    """Colour of a voxel from its level: -1 contracted, 0 at rest, +1 expanded; clipped."""
    red, green, blue = (
        round(float(np.interp(level, (-1.0, 0.0, 1.0), channel)))
        for channel in zip(CONTRACTED, REST, EXPANDED, strict=True)
    )
    return red, green, blue


def area_level(area_ratio: np.ndarray) -> np.ndarray:
    """Level of an area ratio: -1 and +1 where an unloaded voxel settles at full actuation."""
    return (area_ratio - 1.0) / AREA_RATIO_DELTA


def mix(color: Color, other: Color, share: float) -> Color:
    """``color`` with ``share`` (0 to 1) of it replaced by ``other``."""
    red, green, blue = (
        round((1.0 - share) * a + share * b) for a, b in zip(color, other, strict=True)
    )
    return red, green, blue
