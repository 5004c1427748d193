"""Contacts of squares with the ground: finding the points, and solving them one by one."""

from __future__ import annotations

import math

from physics import material
from physics.terrain import Terrain
from tests.oracle.bodies import Square, Vector, clamp, dot, inverse_mass_along, minus

Identity = tuple[int, int, int, int]  # body, segment, incident edge, index of the clipped point


class Point:
    """One point of a square against one segment of the ground."""

    def __init__(
        self, body: Square, place: Vector, normal: Vector, depth: float, identity: Identity
    ) -> None:
        self.body, self.place, self.depth, self.identity = body, place, depth, identity
        self.n = normal
        self.t = (normal[1], -normal[0])
        self.r = minus(place, (body.x, body.y))
        c, s = math.cos(body.angle), math.sin(body.angle)
        self.anchor = (c * self.r[0] + s * self.r[1], -s * self.r[0] + c * self.r[1])
        self.jn = self.jt = 0.0  # accumulated impulses, kept from step to step
        self.jp = 0.0  # of the position stage, of one step

    def prepare(self) -> None:
        self.Kn = inverse_mass_along(self.n, self.body, self.r)
        self.Kt = inverse_mass_along(self.t, self.body, self.r)
        approach = -dot(self.n, self.body.velocity_at(self.r))
        bounces = approach > material.RESTITUTION_SPEED
        self.target = material.RESTITUTION * approach if bounces else 0.0
        self.jp = 0.0

    def warm_start(self) -> None:
        self.body.push((self.jn * self.n[0], self.jn * self.n[1]), self.r)
        self.body.push((self.jt * self.t[0], self.jt * self.t[1]), self.r)

    def solve_friction(self) -> None:
        change = -dot(self.t, self.body.velocity_at(self.r)) / self.Kt
        limit = material.FRICTION * self.jn
        total = clamp(self.jt + change, -limit, limit)
        change, self.jt = total - self.jt, total
        self.body.push((change * self.t[0], change * self.t[1]), self.r)

    def solve_normal(self) -> None:
        speed = dot(self.n, self.body.velocity_at(self.r))
        total = max(self.jn - (speed - self.target) / self.Kn, 0.0)
        change, self.jn = total - self.jn, total
        self.body.push((change * self.n[0], change * self.n[1]), self.r)

    def solve_position(self) -> float:
        """Mend a share of the penetration; return the separation found (negative inside)."""
        r = self.body.arm(self.anchor)
        moved = dot(self.n, minus(self.body.point(self.anchor), self.place))
        separation = moved - self.depth
        correction = material.BAUMGARTE * clamp(
            separation + material.LINEAR_TOLERANCE, -material.MAX_CORRECTION, 0.0
        )
        total = max(self.jp - correction / inverse_mass_along(self.n, self.body, r), 0.0)
        change, self.jp = total - self.jp, total
        self.body.shift((change * self.n[0], change * self.n[1]), r)
        return separation


Contact = list[Point]  # of one body with one segment: 1 or 2 points


def find_contacts(bodies: list[Square], terrain: Terrain, before: list[Contact]) -> list[Contact]:
    """Contacts in the order of bodies, then of segments; known points keep their impulses."""
    known = {point.identity: point for contact in before for point in contact}
    contacts = []
    for b, body in enumerate(bodies):
        xs = [x for x, _ in body.corners()]
        for s in range(len(terrain.xs) - 1):
            if max(xs) < terrain.xs[s] or min(xs) > terrain.xs[s + 1]:
                continue
            contact = _against_segment(b, body, s, terrain)
            for point in contact:
                if point.identity in known:
                    old = known[point.identity]
                    point.jn, point.jt = old.jn, old.jt
            if contact:
                contacts.append(contact)
    return contacts


def _against_segment(b: int, body: Square, s: int, terrain: Terrain) -> Contact:
    start = (float(terrain.xs[s]), float(terrain.ys[s]))
    end = (float(terrain.xs[s + 1]), float(terrain.ys[s + 1]))
    length = math.hypot(*minus(end, start))
    tangent = ((end[0] - start[0]) / length, (end[1] - start[1]) / length)
    normal = (-tangent[1], tangent[0])  # upwards: x grows along the segment

    # The incident edge is the one that faces the ground the most.
    corners = body.corners()
    edges = [(corners[e], corners[(e + 1) % 4]) for e in range(4)]

    def facing(edge: tuple[Vector, Vector]) -> float:
        along = minus(edge[1], edge[0])
        return dot(normal, (along[1], -along[0]))  # the edge's outward normal, not scaled

    e = min(range(4), key=lambda index: facing(edges[index]))
    clipped = _clip(edges[e], start, tangent, lowest=0.0, highest=length)
    contact = []
    for i, place in enumerate(clipped):
        depth = -dot(normal, minus(place, start))
        if depth >= 0:
            contact.append(Point(body, place, normal, depth, (b, s, e, i)))
    return contact


def _clip(
    edge: tuple[Vector, Vector], origin: Vector, tangent: Vector, lowest: float, highest: float
) -> list[Vector]:
    """The part of an edge whose coordinate along the tangent is within limits, or nothing."""
    p, q = edge
    a, b = dot(tangent, minus(p, origin)), dot(tangent, minus(q, origin))
    if max(a, b) < lowest or min(a, b) > highest:
        return []

    def at(coordinate: float) -> Vector:
        if a == b:
            return p
        share = (coordinate - a) / (b - a)
        return (p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1]))

    first = p if lowest <= a <= highest else at(clamp(a, lowest, highest))
    second = q if lowest <= b <= highest else at(clamp(b, lowest, highest))
    return [first, second]
