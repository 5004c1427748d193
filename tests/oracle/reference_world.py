"""The oracle with two details of the reference simulator that do not change the gaits.

With them it follows the recorded fall of a voxel to rounding errors, which proves the rest of
the oracle's contacts: detection, friction, restitution, warm start and positions.
"""

from __future__ import annotations

import math

from tests.oracle.bodies import cross
from tests.oracle.contacts import Contact, Point
from tests.oracle.world import OracleWorld

WORST_CONDITION = 1000.0


class ReferenceWorld(OracleWorld):
    """Two-point contacts as a block; corrections of depth turn a square about its old centre."""

    def solve_normals(self, contact: Contact) -> None:
        if len(contact) < 2:
            return super().solve_normals(contact)
        p, q = contact
        ends = ((p.body1, p.r1, q.r1), (p.body2, p.r2, q.r2))
        k_pq = sum(1 / b.mass + cross(r, p.n) * cross(s, q.n) / b.inertia for b, r, s in ends)
        det = p.Kn * q.Kn - k_pq * k_pq
        if p.Kn * p.Kn >= WORST_CONDITION * det:  # as good as one point: the deeper one
            return super().solve_normals([max(contact, key=lambda point: point.depth)])
        # Find accumulated impulses x >= 0 with K x + b >= 0 and x (K x + b) = 0.
        speeds = [point.speed(point.n) - point.target for point in contact]
        b_p = speeds[0] - (p.Kn * p.jn + k_pq * q.jn)
        b_q = speeds[1] - (k_pq * p.jn + q.Kn * q.jn)
        candidates = (
            ((k_pq * b_q - q.Kn * b_p) / det, (k_pq * b_p - p.Kn * b_q) / det, 0.0, 0.0),
            (-b_p / p.Kn, 0.0, 0.0, k_pq * -b_p / p.Kn + b_q),
            (0.0, -b_q / q.Kn, k_pq * -b_q / q.Kn + b_p, 0.0),
            (0.0, 0.0, b_p, b_q),
        )
        totals = next((c[:2] for c in candidates if min(c) >= 0), (p.jn, q.jn))
        for point, total in zip(contact, totals, strict=True):
            change, point.jn = total - point.jn, total
            point.push(change, point.n)
        return None

    def solve_depth(self, point: Point) -> float:
        before = [(b.x, b.y, b.angle) for b in (point.body1, point.body2)]
        separation = point.solve_position()
        for body, (x, y, angle) in zip((point.body1, point.body2), before, strict=True):
            dx, dy, turn = body.x - x, body.y - y, body.angle - angle
            c, s = math.cos(turn), math.sin(turn)
            body.x, body.y = x + c * dx - s * dy, y + s * dx + c * dy
        return separation
