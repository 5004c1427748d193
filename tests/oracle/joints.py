"""The three kinds of joints, each by the textbook formula (no shared or cached terms).

``prepare`` is called once per step and applies the warm start, ``solve_velocity`` in each
velocity iteration, ``solve_position`` in each position iteration; the latter returns whether
the joint was within tolerance before its correction.
"""

from __future__ import annotations

import math

import numpy as np

from physics.scene import material
from tests.oracle.bodies import Square, Vector, clamp, dot, inverse_mass_along, minus


class Pair:
    """What springs and ropes share: two points of two squares, and the line between them."""

    def __init__(self, body1: Square, body2: Square, anchor1: Vector, anchor2: Vector) -> None:
        self.body1, self.body2 = body1, body2
        self.anchor1, self.anchor2 = anchor1, anchor2
        self.impulse = 0.0  # accumulated; kept from step to step

    def measure(self) -> float:
        """Update arms, direction (from point 2 to point 1) and K; return the length."""
        self.r1, self.r2 = self.body1.arm(self.anchor1), self.body2.arm(self.anchor2)
        line = minus(self.body1.point(self.anchor1), self.body2.point(self.anchor2))
        length = math.hypot(*line)
        self.n = (line[0] / length, line[1] / length)
        self.K = inverse_mass_along(self.n, self.body1, self.r1) + inverse_mass_along(
            self.n, self.body2, self.r2
        )
        return length

    def speed(self) -> float:
        """Rate of change of the length."""
        v1, v2 = self.body1.velocity_at(self.r1), self.body2.velocity_at(self.r2)
        return dot(self.n, minus(v1, v2))

    def apply(self, impulse: float) -> None:
        push = (impulse * self.n[0], impulse * self.n[1])
        self.body1.push(push, self.r1)
        self.body2.push((-push[0], -push[1]), self.r2)


class Spring(Pair):
    """Soft distance constraint: 8 Hz, damping ratio 0.3."""

    def __init__(
        self,
        body1: Square,
        body2: Square,
        anchor1: Vector,
        anchor2: Vector,
        lengths: material.SpringLengths,
        voxel: int,
    ) -> None:
        super().__init__(body1, body2, anchor1, anchor2)
        self.lengths, self.voxel = lengths, voxel
        self.rest = lengths.rest

    def actuate(self, a: float) -> None:
        if a >= 0:
            self.rest = self.lengths.rest - (self.lengths.rest - self.lengths.contracted) * a
        else:
            self.rest = self.lengths.rest + (self.lengths.expanded - self.lengths.rest) * (-a)

    def prepare(self, dt: float) -> None:
        length = self.measure()
        m = 1 / self.K
        w = 2 * math.pi * material.SPRING_FREQUENCY
        d = 2 * m * material.SPRING_DAMPING_RATIO * w
        k = m * w * w
        self.gamma = 1 / (dt * (d + dt * k))
        self.bias = (length - self.rest) * dt * k * self.gamma
        self.soft_mass = 1 / (self.K + self.gamma)
        self.apply(self.impulse)

    def solve_velocity(self) -> None:
        error = self.speed() + self.bias + self.gamma * self.impulse
        change = -self.soft_mass * error
        self.impulse += change
        self.apply(change)

    def solve_position(self) -> bool:
        return True


class Rope(Pair):
    """Lower limit of the distance of two centres; an equality while a step starts below it."""

    def prepare(self, dt: float) -> None:
        self.active = self.measure() < material.ROPE_LENGTH
        if self.active:
            self.apply(self.impulse)
        else:
            self.impulse = 0.0

    def solve_velocity(self) -> None:
        if self.active:
            change = -self.speed() / self.K
            self.impulse += change
            self.apply(change)

    def solve_position(self) -> bool:
        if not self.active:
            return True
        error = self.measure() - material.ROPE_LENGTH
        correction = -clamp(error, -material.MAX_CORRECTION, material.MAX_CORRECTION) / self.K
        shift = (correction * self.n[0], correction * self.n[1])
        self.body1.shift(shift, self.r1)
        self.body2.shift((-shift[0], -shift[1]), self.r2)
        return abs(error) < material.LINEAR_TOLERANCE


class Weld:
    """Two squares as one: no relative motion at the first one's centre, no relative turn."""

    def __init__(self, body1: Square, body2: Square, anchor1: Vector, anchor2: Vector) -> None:
        self.body1, self.body2 = body1, body2
        self.anchor1, self.anchor2 = anchor1, anchor2
        self.impulse = np.zeros(3)  # along x, along y, turning

    def measure(self) -> np.ndarray:
        """Update the arms; return the 3x3 block K."""
        b1, b2 = self.body1, self.body2
        self.r1, self.r2 = b1.arm(self.anchor1), b2.arm(self.anchor2)
        (x1, y1), (x2, y2) = self.r1, self.r2
        k00 = 1 / b1.mass + 1 / b2.mass + y1 * y1 / b1.inertia + y2 * y2 / b2.inertia
        k01 = -x1 * y1 / b1.inertia - x2 * y2 / b2.inertia
        k02 = -y1 / b1.inertia - y2 / b2.inertia
        k11 = 1 / b1.mass + 1 / b2.mass + x1 * x1 / b1.inertia + x2 * x2 / b2.inertia
        k12 = x1 / b1.inertia + x2 / b2.inertia
        k22 = 1 / b1.inertia + 1 / b2.inertia
        return np.array([[k00, k01, k02], [k01, k11, k12], [k02, k12, k22]])

    def apply(self, impulse: np.ndarray) -> None:
        x, y, turn = (float(value) for value in impulse)
        self.body1.push((x, y), self.r1, turn)
        self.body2.push((-x, -y), self.r2, -turn)

    def prepare(self, dt: float) -> None:
        self.K = self.measure()
        self.apply(self.impulse)

    def solve_velocity(self) -> None:
        b1, b2 = self.body1, self.body2
        slip = minus(b1.velocity_at(self.r1), b2.velocity_at(self.r2))
        change = -np.linalg.solve(self.K, [*slip, b1.omega - b2.omega])
        self.impulse += change
        self.apply(change)

    def solve_position(self) -> bool:
        b1, b2 = self.body1, self.body2
        K = self.measure()
        gap = minus(b1.point(self.anchor1), b2.point(self.anchor2))
        turn = math.remainder(b1.angle - b2.angle, 2 * math.pi)
        x, y, twist = (float(value) for value in -np.linalg.solve(K, [*gap, turn]))
        b1.shift((x, y), self.r1, twist)
        b2.shift((-x, -y), self.r2, -twist)
        return (
            math.hypot(*gap) <= material.LINEAR_TOLERANCE
            and abs(turn) <= material.ANGULAR_TOLERANCE
        )


Joint = Spring | Rope | Weld
