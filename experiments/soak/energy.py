"""Mechanical energy of robots, from what can be seen of them."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from physics import Simulator
from physics.scene import material

__all__ = ["energy_per_kg"]


def energy_per_kg(sim: Simulator, gravity: float = 9.8) -> Tensor:
    """Kinetic, potential and elastic energy of passive robots over their mass [J/kg], (N,) float64.

    Args:
        sim: N worlds, whose springs are at rest length without actuation.
        gravity: Downward acceleration [m/s^2].
    """
    poses, velocities = sim.mass_poses().double(), sim.mass_velocities().double()
    mass = material.SQUARE_MASS
    kinetic = 0.5 * mass * velocities[..., :2].square().sum(-1)
    kinetic += 0.5 * material.SQUARE_INERTIA * velocities[..., 2].square()
    potential = mass * gravity * poses[..., 1]
    total = (kinetic + potential).sum((1, 2)) + _elastic(poses).sum(1)
    return total / (4 * mass * sim.n_voxels)


def _elastic(poses: Tensor) -> Tensor:
    """Of the springs of every voxel [J], (N, V).

    A spring's stiffness is such that the two squares swing at SPRING_FREQUENCY along it, which
    depends on how far off their centres it pulls.
    """
    signs = torch.tensor(material.CORNER_SIGNS, dtype=torch.float64, device="cpu")
    total = torch.zeros(poses.shape[:2], dtype=torch.float64, device="cpu")
    for spring in material.SPRINGS:
        ends, arms = [], []
        for square, corner in (
            (spring.square1, spring.corner1),
            (spring.square2, spring.corner2),
        ):
            x, y, angle = poses[:, :, square].unbind(-1)
            ax, ay = (0.0, 0.0) if corner is None else signs[corner] * material.SQUARE_HALF
            arm = torch.stack(
                [ax * angle.cos() - ay * angle.sin(), ax * angle.sin() + ay * angle.cos()], -1
            )
            arms.append(arm)
            ends.append(torch.stack([x, y], -1) + arm)
        between = ends[1] - ends[0]
        length = between.norm(dim=-1).clamp(min=1e-9)
        direction = between / length[..., None]
        inverse_mass = 2 / material.SQUARE_MASS + sum(
            (arm[..., 0] * direction[..., 1] - arm[..., 1] * direction[..., 0]).square()
            / material.SQUARE_INERTIA
            for arm in arms
        )
        stiffness = (2 * math.pi * material.SPRING_FREQUENCY) ** 2 / inverse_mass
        stretch = length - material.FAMILIES[spring.family].rest
        total += 0.5 * stiffness * stretch.square()
    return total
