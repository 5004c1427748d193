"""The material of a voxel: masses, springs and limits.

Every number is one of the reference simulator (2D-VSR-Sim's defaults, as used in the
paper, Sec. III-A): a voxel is four rigid squares joined by 18 spring-dampers and kept
apart by 4 ropes; side-adjacent voxels are welded square to square.

Conventions: metres, kilograms, seconds, radians; y up. Squares (corners) of a voxel are
numbered 0 NW, 1 NE, 2 SE, 3 SW.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

DT = 1.0 / 60.0  # length of a control step and of an engine step [s]
VOXEL_SIDE = 3.0  # side of a voxel at rest [m]

SQUARE_SIDE = 0.4 * VOXEL_SIDE  # side of one rigid square [m]
SQUARE_HALF = SQUARE_SIDE / 2
SQUARE_OFFSET = VOXEL_SIDE / 2 - SQUARE_HALF  # |x|, |y| of a square's centre from its voxel's [m]
SQUARE_DENSITY = 0.25  # [kg/m^2]
SQUARE_MASS = SQUARE_DENSITY * SQUARE_SIDE**2  # 0.36 kg
SQUARE_INERTIA = SQUARE_MASS * SQUARE_SIDE**2 / 6  # 0.0864 kg m^2
DAMPING = 0.1  # linear and angular velocity damping [1/s]

FRICTION = math.sqrt(10.0 * 0.2)  # square on ground: sqrt(f1 f2)
SELF_FRICTION = 10.0  # square on square of one robot
RESTITUTION = 0.1  # of both: max(r1, r2)

SPRING_FREQUENCY = 8.0  # [Hz]
SPRING_DAMPING_RATIO = 0.3
AREA_RATIO_DELTA = 0.225  # the unloaded area ratio is 1 -+ this at actuation +-1

# (x, y) signs of the corners: of a square's centre in its voxel, and of a corner in a square.
CORNER_SIGNS = ((-1, 1), (1, 1), (1, -1), (-1, -1))
NW, NE, SE, SW = range(4)


def spring_constants(frequency: Any, damping: Any) -> tuple[Any, Any, Any]:
    """How soft a spring is in the solver (see physics/MODEL.md, springs).

    Args:
        frequency: The frequency of the spring [Hz], a number or an array.
        damping: its damping ratio.

    Returns:
        The softness g, with gamma = g K for an inverse effective mass K; g / (1 + g), the part of
        the impulse that an iteration takes back; and the bias per metre of stretch [1/s].
    """
    omega = 2 * math.pi * frequency
    stiffness = omega**2 * DT  # k dt over the effective mass
    damper = 2 * damping * omega  # d over the effective mass
    softness = 1 / (DT * (damper + stiffness))
    return softness, softness / (1 + softness), stiffness / (damper + stiffness) / DT


@dataclass(frozen=True)
class Material:
    """What a voxel is made of.

    Attributes:
        name: The name of the material.
        actuated: whether the voxel obeys its actuation; one that does not keeps its size.
        frequency: The frequency of its springs [Hz].
        damping: their damping ratio.
    """

    name: str
    actuated: bool = True
    frequency: float = SPRING_FREQUENCY
    damping: float = SPRING_DAMPING_RATIO


ACTUATED = Material("actuated")
PASSIVE = Material("passive", actuated=False)
STIFF = Material("stiff", actuated=False, frequency=30.0, damping=1.0)


def crossed_diagonals(x: Any, y: Any) -> Any:
    """Cross product of the diagonals of a quadrilateral: twice its area, with a sign.

    It is plain arithmetic, so that kernels, the simulator and pictures share it.

    Args:
        x: The abscissas of its four corners in order: numbers, arrays, tensors or lane vectors.
        y: Their ordinates.
    """
    return (x[2] - x[0]) * (y[3] - y[1]) - (x[3] - x[1]) * (y[2] - y[0])


@dataclass(frozen=True)
class SpringLengths:
    """Rest lengths of one family of springs [m] at actuation 0, +1 (contracted), -1 (expanded)."""

    rest: float
    contracted: float
    expanded: float


def _spring_families() -> tuple[SpringLengths, SpringLengths, SpringLengths]:
    """Side, side-cross and central springs: what they measure when the voxel's side shrinks
    and grows to sqrt(1 -+ AREA_RATIO_DELTA) of its length, the squares keeping their size."""

    def lengths(voxel_side: float) -> tuple[float, float, float]:
        gap = voxel_side - 2 * SQUARE_SIDE  # between facing squares
        return gap, math.hypot(gap, SQUARE_SIDE), (voxel_side - SQUARE_SIDE) * math.sqrt(2)

    rest = lengths(VOXEL_SIDE)
    contracted = lengths(VOXEL_SIDE * math.sqrt(1 - AREA_RATIO_DELTA))
    expanded = lengths(VOXEL_SIDE * math.sqrt(1 + AREA_RATIO_DELTA))
    side, cross, central = map(SpringLengths, rest, contracted, expanded)
    return side, cross, central


SIDE, CROSS, CENTRAL = _spring_families()
FAMILIES = (SIDE, CROSS, CENTRAL)


@dataclass(frozen=True)
class Spring:
    """A spring between two squares of a voxel.

    Attributes:
        square1, square2: squares joined, 0..3.
        corner1, corner2: corner of each square where the spring is tied, 0..3, or None for its
            centre. An anchor is ``SQUARE_HALF * CORNER_SIGNS[corner]`` in the square's frame.
        family: index into FAMILIES.
    """

    square1: int
    square2: int
    corner1: int | None
    corner2: int | None
    family: int


def _springs() -> tuple[Spring, ...]:
    """The 18 springs in solving order. Opposite sides alternate: consecutive springs share no
    square, so that a processor can overlap them (the order does not change the gaits)."""
    # A side joins square a to the next one, b. The facing corners are, on the outer edge of the
    # voxel (outer_a, outer_b) and on the inner edge (inner_a, inner_b).
    sides = {
        "N": (NW, NE, NE, NW, SE, SW),
        "S": (SE, SW, SW, SE, NW, NE),
        "E": (NE, SE, SE, NE, SW, NW),
        "W": (SW, NW, NW, SW, NE, SE),
    }
    springs = []
    for pair in ("NS", "EW"):
        for link in range(4):
            for name in pair:
                a, b, outer_a, outer_b, inner_a, inner_b = sides[name]
                corners, family = (
                    ((inner_a, inner_b), 0),
                    ((outer_a, outer_b), 0),
                    ((outer_a, inner_b), 1),
                    ((inner_a, outer_b), 1),
                )[link]
                springs.append(Spring(a, b, *corners, family))
    springs.append(Spring(NW, SE, None, None, 2))
    springs.append(Spring(NE, SW, None, None, 2))
    return tuple(springs)


SPRINGS = _springs()

ROPES = ((NW, NE), (SE, SW), (NE, SE), (SW, NW))  # squares kept at least ROPE_LENGTH apart
ROPE_LENGTH = SQUARE_SIDE  # [m]

# Settings of the sequential-impulse solver.
VELOCITY_ITERATIONS = 10
POSITION_ITERATIONS = 10
LINEAR_TOLERANCE = 0.005  # [m]
ANGULAR_TOLERANCE = math.radians(2.0)
MAX_TRANSLATION = 2.0  # per step [m]
MAX_ROTATION = math.pi / 2  # per step [rad]
MAX_CORRECTION = 0.2  # of a position error per iteration [m]
BAUMGARTE = 0.2  # share of a contact's depth that one position iteration mends
RESTITUTION_SPEED = 1.0  # slower approaches do not bounce [m/s]
