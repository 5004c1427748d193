"""Contacts of squares with the ground and with each other: finding the points, solving them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from physics.scene import material
from physics.scene.terrain import Terrain
from tests.oracle.bodies import Square, Vector, clamp, dot, inverse_mass_along, minus

GROUND = Square(0.0, 0.0, mass=math.inf, inertia=math.inf)  # impulses do not move it
DEPTH = 50.0  # of the ground below its lowest point [m]
PREFERENCE = 0.1 * material.LINEAR_TOLERANCE  # of the ground's edges over others as deep [m]
ANOTHER_EDGE = 10**6  # in the number of a segment: its sides and what meets the body's own edges
TOUCHING = 1e-12  # squares that share a corner at the start do so up to rounding errors [m]
# Numbers of the bodies (-1: the ground), of body 1's edge or segment, of the edge of body 2, and
# of the clipped point.
Identity = tuple[int, int, int, int, int]


class Point:
    """One point of contact; the normal points from body 1 to body 2."""

    def __init__(
        self,
        body1: Square,
        body2: Square,
        place: Vector,
        normal: Vector,
        depth: float,
        friction: float,
        identity: Identity,
    ) -> None:
        self.body1, self.body2 = body1, body2
        self.depth, self.friction, self.identity = depth, friction, identity
        self.n = normal
        self.t = (normal[1], -normal[0])
        self.r1, self.r2 = minus(place, (body1.x, body1.y)), minus(place, (body2.x, body2.y))
        self.anchor1, self.anchor2 = body1.in_frame(self.r1), body2.in_frame(self.r2)
        self.jn = self.jt = 0.0  # accumulated impulses, kept from step to step
        self.jp = 0.0  # of the position stage, of one step

    def speed(self, direction: Vector) -> float:
        """Of body 2 against body 1 at the point."""
        v1, v2 = self.body1.velocity_at(self.r1), self.body2.velocity_at(self.r2)
        return dot(direction, minus(v2, v1))

    def inverse_mass(self, direction: Vector) -> float:
        return inverse_mass_along(direction, self.body1, self.r1) + inverse_mass_along(
            direction, self.body2, self.r2
        )

    def push(self, impulse: float, direction: Vector) -> None:
        x, y = impulse * direction[0], impulse * direction[1]
        self.body1.push((-x, -y), self.r1)
        self.body2.push((x, y), self.r2)

    def prepare(self) -> None:
        self.Kn, self.Kt = self.inverse_mass(self.n), self.inverse_mass(self.t)
        approach = -self.speed(self.n)
        bounces = approach > material.RESTITUTION_SPEED
        self.target = material.RESTITUTION * approach if bounces else 0.0
        self.jp = 0.0

    def warm_start(self) -> None:
        self.push(self.jn, self.n)
        self.push(self.jt, self.t)

    def solve_friction(self) -> None:
        limit = self.friction * self.jn
        total = clamp(self.jt - self.speed(self.t) / self.Kt, -limit, limit)
        change, self.jt = total - self.jt, total
        self.push(change, self.t)

    def solve_normal(self) -> None:
        total = max(self.jn - (self.speed(self.n) - self.target) / self.Kn, 0.0)
        change, self.jn = total - self.jn, total
        self.push(change, self.n)

    def solve_position(self) -> float:
        """Mend a share of the penetration; return the separation found (negative inside)."""
        r1, r2 = self.body1.arm(self.anchor1), self.body2.arm(self.anchor2)
        gap = minus(self.body2.point(self.anchor2), self.body1.point(self.anchor1))
        separation = dot(self.n, gap) - self.depth
        correction = material.BAUMGARTE * clamp(
            separation + material.LINEAR_TOLERANCE, -material.MAX_CORRECTION, 0.0
        )
        inverse_mass = inverse_mass_along(self.n, self.body1, r1)
        inverse_mass += inverse_mass_along(self.n, self.body2, r2)
        total = max(self.jp - correction / inverse_mass, 0.0)
        change, self.jp = total - self.jp, total
        self.body1.shift((-change * self.n[0], -change * self.n[1]), r1)
        self.body2.shift((change * self.n[0], change * self.n[1]), r2)
        return separation


Contact = list[Point]  # of two bodies, or of one with one segment: 1 or 2 points


def find_contacts(
    bodies: list[Square],
    terrain: Terrain | None,
    may_meet: Sequence[tuple[int, int]],
    before: list[Contact],
) -> list[Contact]:
    """Contacts of these pairs of bodies, then of the ground by bodies and segments; known points
    keep their impulses."""
    contacts = [_between(bodies, a, b) for a, b in may_meet]
    if terrain is not None:
        places = [(float(x), float(y)) for x, y in zip(terrain.xs, terrain.ys, strict=True)]
        for b, body in enumerate(bodies):
            contacts += _on_ground(b, body, places)
    known = {point.identity: point for contact in before for point in contact}
    for point in itertools.chain(*contacts):
        if point.identity in known:
            old = known[point.identity]
            point.jn, point.jt = old.jn, old.jt
    return [contact for contact in contacts if contact]


def _on_ground(b: int, body: Square, places: list[Vector]) -> list[Contact]:
    """Contacts of a body with the ground under the segments between these places."""
    bottom = min(y for _, y in places) - DEPTH
    return [
        _against_block(body, [start, end, (end[0], bottom), (start[0], bottom)], (-1, b, s))
        for s, (start, end) in enumerate(itertools.pairwise(places))
    ]


def _against_block(body: Square, block: list[Vector], numbers: tuple[int, int, int]) -> Contact:
    """Contact of a body with one quadrilateral of the ground, given clockwise from its top left.

    Separating axes: how far the body must move along the outward normal of each edge of the
    ground, or against that of each of its own, until they part. Of directions that are about
    equally far, the slanted top of the ground comes first, then its sides, then the body's.
    """
    corners = body.corners()
    ground = [(block[e], block[(e + 1) % 4]) for e in range(4)]
    own = [(corners[(e + 1) % 4], corners[e]) for e in range(4)]

    def depth(edge: tuple[Vector, Vector], others: list[Vector]) -> float:
        normal = _left_of(edge)
        return -min(dot(normal, minus(point, edge[0])) for point in others)

    depths = [depth(edge, corners) for edge in ground] + [depth(edge, block) for edge in own]
    if min(depths) < 0:
        return []
    best = 0
    for group in ((1, 2, 3), (4, 5, 6, 7)):
        least = min(group, key=lambda index: depths[index])
        if depths[least] < depths[best] - PREFERENCE:
            best = least
    if best < 4:
        named = (*numbers[:2], numbers[2] + ANOTHER_EDGE * best)
        return _against_edge(GROUND, body, *ground[best], material.FRICTION, named)
    # The body's edge is the reference; of the ground it meets the edge that faces it most.
    start, end = own[best - 4]
    normal = _left_of((start, end))
    facing = min(range(4), key=lambda e: dot(normal, _left_of(ground[e])))
    edge = ground[facing]
    if facing == 3:  # the left side: from its top down, like the right one
        edge = (edge[1], edge[0])
    tangent = (normal[1], -normal[0])
    found = []
    for i, place in enumerate(_clip(edge, start, tangent, 0.0, material.SQUARE_SIDE)):
        sunk = -dot(normal, minus(place, start))
        if sunk >= 0:
            named = (*numbers[:2], numbers[2] + ANOTHER_EDGE * (4 + facing), best - 4, i)
            out = (-normal[0], -normal[1])
            found.append(Point(GROUND, body, place, out, sunk, material.FRICTION, named))
    return found


def _left_of(edge: tuple[Vector, Vector]) -> Vector:
    """The unit normal on the left of an edge."""
    x, y = minus(edge[1], edge[0])
    length = math.hypot(x, y)
    return (-y / length, x / length)


def _between(bodies: list[Square], a: int, b: int) -> Contact:
    """Contact of two squares across the edge of least penetration (separating axes)."""
    apart = math.dist((bodies[a].x, bodies[a].y), (bodies[b].x, bodies[b].y))
    if apart > math.sqrt(2) * material.SQUARE_SIDE:
        return []
    least, reference = math.inf, (a, b, 0)
    for one, other in ((a, b), (b, a)):
        corners = bodies[one].corners()
        for e in range(4):
            start, end = corners[e], corners[(e + 1) % 4]
            along = minus(end, start)
            normal = (along[1] / material.SQUARE_SIDE, -along[0] / material.SQUARE_SIDE)
            depth = -min(dot(normal, minus(c, start)) for c in bodies[other].corners())
            if depth <= TOUCHING:
                return []
            if depth < least:
                least, reference = depth, (one, other, e)
    one, other, e = reference
    corners = bodies[one].corners()
    end, start = corners[e], corners[(e + 1) % 4]  # outwards is on the left of start -> end
    return _against_edge(
        bodies[one], bodies[other], start, end, material.SELF_FRICTION, (one, other, e)
    )


def _against_edge(
    body1: Square,
    body2: Square,
    start: Vector,
    end: Vector,
    friction: float,
    numbers: tuple[int, int, int],
) -> Contact:
    """Where body 2 is in an edge of body 1 or of the ground; outwards is on its left."""
    length = math.hypot(*minus(end, start))
    tangent = ((end[0] - start[0]) / length, (end[1] - start[1]) / length)
    normal = (-tangent[1], tangent[0])

    # The incident edge is the one of body 2 that faces the reference edge the most.
    corners = body2.corners()
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
            identity = (*numbers, e, i)
            contact.append(Point(body1, body2, place, normal, depth, friction, identity))
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
