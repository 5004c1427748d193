"""A rigid square: position, velocity, and how an impulse changes them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from physics.scene import material

Vector = tuple[float, float]


def cross(a: Vector, b: Vector) -> float:
    return a[0] * b[1] - a[1] * b[0]


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1]


def minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1])


def clamp(value: float, low: float, high: float) -> float:
    return max(low, min(high, value))


@dataclass
class Square:
    """One of the four rigid squares of a voxel. Metres, radians, seconds."""

    x: float
    y: float
    angle: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    omega: float = 0.0
    mass: float = material.SQUARE_MASS
    inertia: float = material.SQUARE_INERTIA

    def arm(self, anchor: Vector) -> Vector:
        """A point given in the square's frame, seen from its centre along the world's axes."""
        c, s = math.cos(self.angle), math.sin(self.angle)
        return (c * anchor[0] - s * anchor[1], s * anchor[0] + c * anchor[1])

    def in_frame(self, r: Vector) -> Vector:
        """The inverse of ``arm``."""
        c, s = math.cos(self.angle), math.sin(self.angle)
        return (c * r[0] + s * r[1], -s * r[0] + c * r[1])

    def point(self, anchor: Vector) -> Vector:
        """The same point in the world."""
        r = self.arm(anchor)
        return (self.x + r[0], self.y + r[1])

    def velocity_at(self, r: Vector) -> Vector:
        """Velocity of the point at arm r: v + omega x r."""
        return (self.vx - self.omega * r[1], self.vy + self.omega * r[0])

    def push(self, impulse: Vector, r: Vector, turn: float = 0.0) -> None:
        """Change the velocity by an impulse at arm r, and an angular impulse."""
        self.vx += impulse[0] / self.mass
        self.vy += impulse[1] / self.mass
        self.omega += (cross(r, impulse) + turn) / self.inertia

    def shift(self, impulse: Vector, r: Vector, turn: float = 0.0) -> None:
        """The same on the position."""
        self.x += impulse[0] / self.mass
        self.y += impulse[1] / self.mass
        self.angle += (cross(r, impulse) + turn) / self.inertia

    def corners(self) -> list[Vector]:
        """The square's corners, counter-clockwise from the bottom left of its frame."""
        h = material.SQUARE_HALF
        return [self.point(corner) for corner in ((-h, -h), (h, -h), (h, h), (-h, h))]


def inverse_mass_along(n: Vector, square: Square, r: Vector) -> float:
    """1 / m + (r x n)^2 / I: how much a unit impulse along n changes the speed along n at r."""
    return 1 / square.mass + cross(r, n) ** 2 / square.inertia
