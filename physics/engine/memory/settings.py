"""Settings of the engine."""

from __future__ import annotations

from dataclasses import dataclass

from physics import checks
from physics.backend import Features
from physics.scene import material
from physics.scene.morphology import Morphology

__all__ = ["Engine"]


@dataclass(frozen=True)
class Engine:
    """Settings of the engine; the defaults are the reference's.

    Attributes:
        friction: coefficient between a square and the ground.
        damping: linear and angular velocity damping [1/s].
        velocity_iterations, position_iterations: The iterations of the sequential-impulse solver in
            each step.
        ropes: whether squares of a voxel are kept from passing through each other.
        self_collision: whether squares of the robot that no joint ties keep out of each other.
        continuous: whether squares that land are stopped where they touch the ground, instead of
            as deep in it as their speed takes them in a step (continuous collision detection). It
            costs a tenth of the speed, and champions' speeds come no nearer to those of the
            reference with its own detection than by default (FIDELITY.md).
    """

    friction: float = material.FRICTION
    damping: float = material.DAMPING
    velocity_iterations: int = material.VELOCITY_ITERATIONS
    position_iterations: int = material.POSITION_ITERATIONS
    ropes: bool = True
    self_collision: bool = True
    continuous: bool = False

    def features(self, morphology: Morphology) -> Features:
        """What the kernels must have to simulate this robot."""
        return Features(self.self_collision and morphology.n_voxels > 1, self.continuous)

    def __post_init__(self) -> None:
        for name in ("friction", "damping"):
            checks.finite(name, getattr(self, name), 0.0)
        for name in ("velocity_iterations", "position_iterations"):
            checks.positive_integer(name, getattr(self, name))
