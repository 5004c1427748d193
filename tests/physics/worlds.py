"""What the tests of the simulator start from: gaits, turned robots, a run beside the oracle."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from torch import Tensor

from physics import Engine, Simulator, Terrain
from tests.oracle.contacts import GROUND
from tests.oracle.world import OracleWorld

DOUBLE = torch.float64
FLAT = Terrain.from_name("flat")


def small(**settings: Any) -> Simulator:
    """Two robots of two voxels with low sensors."""
    return Simulator("worm-2x1", FLAT, 2, sensors="low", **settings)


def gaits(steps: int, worlds: int, voxels: int, seed: int = 0, amplitude: float = 1.0) -> Tensor:
    """Sines of random frequency and phase, one per world and voxel, (steps, worlds, voxels)."""
    random = np.random.default_rng(seed)
    frequency = random.uniform(0.5, 2.0, (worlds, voxels))
    phase = random.uniform(0.0, 2 * math.pi, (worlds, voxels))
    seconds = np.arange(steps)[:, None, None] / 60
    waves = amplitude * np.sin(2 * math.pi * frequency * seconds + phase)
    return torch.from_numpy(waves)


def turned(poses: Tensor, angle: float) -> Tensor:
    """The robots, each turned about its own centre."""
    result = poses.clone()
    centre = poses[..., :2].mean((1, 2), keepdim=True)
    c, s = math.cos(angle), math.sin(angle)
    turn = torch.tensor([[c, s], [-s, c]], dtype=poses.dtype)
    result[..., :2] = (poses[..., :2] - centre) @ turn + centre
    result[..., 2] += angle
    return result


def distance(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Largest difference of two tables of poses, angles compared up to whole turns."""
    difference = ours - theirs
    difference[..., 2] = np.remainder(difference[..., 2] + math.pi, 2 * math.pi) - math.pi
    return float(np.abs(difference).max())


def beside_oracle(
    shape: str,
    terrain: Terrain | None,
    gravity: float,
    actuations: Tensor,
    poses: np.ndarray | None = None,
    velocities: np.ndarray | None = None,
    self_collision: bool = False,
) -> tuple[float, dict[str, int]]:
    """Runs the simulator and the oracle in step, in float64.

    Args:
        shape, terrain, gravity: of both.
        actuations: (T, 1, V).
        poses, velocities: of the squares at the start, (V, 4, 3); None: as they start, at rest.
        self_collision: of both.

    Returns:
        Largest difference of poses and velocities on the way, and what the oracle met: active
        ropes, points of contact with the ground, squares on two segments at once, and pairs of
        squares in contact, summed over the steps.
    """
    engine = Engine(self_collision=self_collision)
    sim = Simulator(shape, terrain, gravity=gravity, dtype=DOUBLE, engine=engine)
    oracle = OracleWorld(
        shape, terrain, gravity, even_segments_first=True, self_collision=self_collision
    )
    if poses is not None and velocities is not None:
        sim.set_poses(torch.from_numpy(poses)[None], torch.from_numpy(velocities)[None])
        states = zip(poses.reshape(-1, 3).tolist(), velocities.reshape(-1, 3).tolist(), strict=True)
        for body, ((x, y, angle), (vx, vy, omega)) in zip(oracle.bodies, states, strict=True):
            body.x, body.y, body.angle = x, y, angle
            body.vx, body.vy, body.omega = vx, vy, omega
        oracle.detect()
    worst, met = 0.0, {"ropes": 0, "contacts": 0, "corners": 0, "self_contacts": 0}
    for actuation in actuations:
        sim.step(actuation)
        oracle.step(actuation[0].tolist())
        worst = max(worst, distance(sim.mass_poses()[0].numpy(), oracle.poses()))
        speeds = sim.mass_velocities()[0].numpy() - oracle.velocities()
        worst = max(worst, float(np.abs(speeds).max()))
        assert np.array_equal(sim.touching()[0].numpy(), oracle.touching().any(axis=1))
        _count(oracle, met)
    return worst, met


def _count(oracle: OracleWorld, met: dict[str, int]) -> None:
    grounded = [contact for contact in oracle.contacts if contact[0].body1 is GROUND]
    bodies = [contact[0].identity[1] for contact in grounded]
    met["ropes"] += sum(getattr(joint, "active", False) for joint in oracle.joints)
    met["contacts"] += sum(len(contact) for contact in grounded)
    met["corners"] += len(bodies) - len(set(bodies))
    met["self_contacts"] += len(oracle.contacts) - len(grounded)
