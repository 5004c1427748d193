"""The rigid-body engine once more: slow, exact and straightforward, one robot, float64.

It is written from the description of the engine alone and shares with the fast solver only
the constants of the material, the shape and the terrain. What it leaves out, like the fast
solver: continuous collision detection, and the details of contacts that ReferenceWorld adds.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from physics.scene import material
from physics.scene.morphology import Morphology
from physics.scene.terrain import Terrain
from tests.oracle.bodies import Square, Vector
from tests.oracle.contacts import GROUND, Contact, Point, find_contacts
from tests.oracle.joints import Joint, Rope, Spring, Weld

SLEEP_SPEED, SLEEP_OMEGA, SLEEP_TIME = 0.01, math.radians(2.0), 0.5
CENTRE = (0.0, 0.0)


class OracleWorld:
    """One robot on one ground.

    Args:
        morphology: anything that Morphology.of takes.
        terrain: the ground, or None; without ground cell (gx, gy) is centred at (3 gx, 3 gy).
        gravity: downwards [m/s^2].
        joint_order: "natural" (voxel by voxel 18 springs and 4 ropes; then all welds), or the
            joints of a recorded order, see tests/reference/README.md.
        sleeping: whether a robot at rest for 0.5 s is stopped for good until the next actuation.
        self_collision: whether squares of the robot that no joint ties collide.
        even_segments_first: whether a body's contacts with even segments of the ground are solved
            before those with odd ones, as in the fast solver, instead of from left to right.

    Attributes:
        bodies: 4 V squares; change them freely between steps.
        contacts: those found after the last step.
        time: [s].
    """

    def __init__(
        self,
        morphology: Any,
        terrain: Terrain | None = None,
        gravity: float = 9.8,
        joint_order: str | Sequence[Sequence[Any]] = "natural",
        sleeping: bool = False,
        even_segments_first: bool = False,
        self_collision: bool = False,
    ) -> None:
        self.morphology = Morphology.of(morphology)
        self.terrain, self.gravity, self.sleeping = terrain, gravity, sleeping
        self.bodies = place(self.morphology, terrain)
        if isinstance(joint_order, str):
            self.joints = natural_joints(self.morphology, self.bodies)
        else:
            self.joints = recorded_joints(joint_order, self.bodies)
        self.even_segments_first = even_segments_first
        self.may_meet = unjoined(self.bodies, self.joints) if self_collision else []
        self.contacts: list[Contact] = []
        self.time, self.still_for, self.asleep = 0.0, 0.0, False
        self.detect()

    # --- one control step -----------------------------------------------------------------------

    def step(self, actuation: Sequence[float]) -> None:
        """One step of 1/60 s with this actuation, one number in [-1, 1] per voxel (clipped)."""
        if self.asleep:
            self.asleep, self.still_for = False, 0.0
        for joint in self.joints:
            if isinstance(joint, Spring):
                joint.actuate(min(1.0, max(-1.0, float(actuation[joint.voxel]))))
        dt = material.DT
        self.time += dt
        self.integrate_velocities(dt)
        points = [point for contact in self.contacts for point in contact]
        for point in points:
            point.prepare()
        for point in points:
            point.warm_start()
        for joint in self.joints:
            joint.prepare(dt)
        for _ in range(material.VELOCITY_ITERATIONS):
            self.solve_velocities()
        self.integrate_positions(dt)
        for _ in range(material.POSITION_ITERATIONS):
            if self.solve_positions():
                break
        if self.sleeping:
            self.fall_asleep(dt)
        self.detect()

    def integrate_velocities(self, dt: float) -> None:
        damping = 1.0 - material.DAMPING * dt
        for body in self.bodies:
            body.vy -= self.gravity * dt
            body.vx *= damping
            body.vy *= damping
            body.omega *= damping

    def solve_velocities(self) -> None:
        for joint in self.joints:
            joint.solve_velocity()
        for contact in self.contacts:
            for point in contact:
                point.solve_friction()
            self.solve_normals(contact)

    def solve_normals(self, contact: Contact) -> None:
        for point in contact:
            point.solve_normal()

    def integrate_positions(self, dt: float) -> None:
        for body in self.bodies:
            dx, dy, turn = body.vx * dt, body.vy * dt, body.omega * dt
            travel = math.hypot(dx, dy)
            if travel > material.MAX_TRANSLATION:
                dx, dy = (value * material.MAX_TRANSLATION / travel for value in (dx, dy))
            body.x += dx
            body.y += dy
            body.angle += min(material.MAX_ROTATION, max(-material.MAX_ROTATION, turn))

    def solve_positions(self) -> bool:
        """One position iteration; whether all was well before it."""
        separations = [self.solve_depth(point) for contact in self.contacts for point in contact]
        joints_well = [joint.solve_position() for joint in self.joints]
        return min(separations, default=0.0) >= -3 * material.LINEAR_TOLERANCE and all(joints_well)

    def solve_depth(self, point: Point) -> float:
        return point.solve_position()

    def fall_asleep(self, dt: float) -> None:
        still = all(
            math.hypot(body.vx, body.vy) <= SLEEP_SPEED and abs(body.omega) <= SLEEP_OMEGA
            for body in self.bodies
        )
        self.still_for = self.still_for + dt if still else 0.0
        if self.still_for >= SLEEP_TIME:
            self.asleep = True
            for body in self.bodies:
                body.vx = body.vy = body.omega = 0.0

    def detect(self) -> None:
        """Find the contacts of the present poses (needed after changing bodies by hand)."""
        self.contacts = find_contacts(self.bodies, self.terrain, self.may_meet, self.contacts)
        if self.even_segments_first:
            self.contacts.sort(key=_body_and_parity)

    # --- what can be seen -----------------------------------------------------------------------

    def poses(self) -> np.ndarray:
        """x, y, angle of the squares, shape (V, 4, 3)."""
        return np.array([(b.x, b.y, b.angle) for b in self.bodies]).reshape(-1, 4, 3)

    def velocities(self) -> np.ndarray:
        """vx, vy, omega of the squares, shape (V, 4, 3)."""
        return np.array([(b.vx, b.vy, b.omega) for b in self.bodies]).reshape(-1, 4, 3)

    def centers(self) -> np.ndarray:
        """Centres of the voxels, shape (V, 2)."""
        return self.poses()[:, :, :2].mean(axis=1)

    def touching(self) -> np.ndarray:
        """Whether each square touches the ground, shape (V, 4)."""
        grounded = [c[0].identity for c in self.contacts if c[0].body1 is GROUND]
        touched = {body for _, body, *_ in grounded}
        return np.array([b in touched for b in range(len(self.bodies))]).reshape(-1, 4)


def _body_and_parity(contact: Contact) -> tuple[int, int]:
    one, other, edge, _, _ = contact[0].identity
    return (-1, 0) if one >= 0 else (other, edge % 2)  # self-contacts stay first, in their order


def unjoined(bodies: list[Square], joints: list[Joint]) -> list[tuple[int, int]]:
    """The pairs of bodies that no joint ties, which is all that may collide, by their voxels."""
    number = {id(body): i for i, body in enumerate(bodies)}
    tied = {frozenset((number[id(j.body1)], number[id(j.body2)])) for j in joints}
    pairs = itertools.combinations(range(len(bodies)), 2)
    free = (pair for pair in pairs if frozenset(pair) not in tied)
    return sorted(free, key=lambda pair: (pair[0] // 4, pair[1] // 4, pair))


def place(morphology: Morphology, terrain: Terrain | None) -> list[Square]:
    """The squares at the start."""
    side, offset = material.VOXEL_SIDE, material.SQUARE_OFFSET
    centres = np.array([(side * x, side * y) for x, y in morphology.cells])
    if terrain is not None:
        centres[:, 0] += 11.0 + side / 2  # the leftmost cell is column 0
        above = centres[:, 1] - side / 2 - terrain.height(centres[:, 0])
        centres[:, 1] += 1.0 - above.min()
    return [
        Square(float(x + sx * offset), float(y + sy * offset))
        for x, y in centres
        for sx, sy in material.CORNER_SIGNS
    ]


def natural_joints(morphology: Morphology, bodies: list[Square]) -> list[Joint]:
    """Voxel by voxel its springs and its ropes; then the welds."""
    joints: list[Joint] = []
    for v in range(morphology.n_voxels):
        squares = bodies[4 * v : 4 * v + 4]
        for spring in material.SPRINGS:
            one, two = squares[spring.square1], squares[spring.square2]
            anchor1, anchor2 = _corner(spring.corner1), _corner(spring.corner2)
            lengths = material.FAMILIES[spring.family]
            joints.append(Spring(one, two, anchor1, anchor2, lengths, v))
        for a, b in material.ROPES:
            joints.append(Rope(squares[a], squares[b], CENTRE, CENTRE))
    for a, b in morphology.welds:
        # At the start nothing is turned, so the anchor in b's frame is a plain difference.
        at = (bodies[a].x - bodies[b].x, bodies[a].y - bodies[b].y)
        joints.append(Weld(bodies[a], bodies[b], CENTRE, at))
    return joints


def _corner(corner: int | None) -> Vector:
    if corner is None:
        return CENTRE
    sx, sy = material.CORNER_SIGNS[corner]
    return (sx * material.SQUARE_HALF, sy * material.SQUARE_HALF)


def recorded_joints(order: Sequence[Sequence[Any]], bodies: list[Square]) -> list[Joint]:
    """Joints from rows (kind, body1, body2, anchor1 x, y, anchor2 x, y, rest length or None)."""
    joints: list[Joint] = []
    for kind, a, b, x1, y1, x2, y2, rest in order:
        ends = (bodies[a], bodies[b], (x1, y1), (x2, y2))
        if kind == "spring":
            lengths = min(material.FAMILIES, key=lambda family: abs(family.rest - rest))
            joints.append(Spring(*ends, lengths, a // 4))
        else:
            joints.append({"rope": Rope, "weld": Weld}[kind](*ends))
    return joints
