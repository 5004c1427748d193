"""Conditions of a batch of worlds: gravity, friction, springs, noise, and how control acts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from physics import checks
from physics.scene import material
from physics.scene.morphology import Morphology
from physics.scene.sensors import KINDS, Apparatus

__all__ = ["Conditions"]


@dataclass(frozen=True, eq=False)
class Conditions:
    """What holds in N worlds.

    Attributes:
        gravity: downward acceleration [m/s^2], (N,).
        friction: coefficient between a square and the ground, (N,).
        spring_frequency: The frequency of soft voxels [Hz], (N,).
        spring_damping: damping ratio of soft voxels, (N,).
        noise: standard deviation of the noise of each kind of sensor, in units of its range.
        control_interval: engine steps in a control step.
        control_delay: control steps that a command waits before it acts.
        lowpass: share of its way to the command that the actuation goes in an engine step.
    """

    gravity: np.ndarray
    friction: np.ndarray
    spring_frequency: np.ndarray
    spring_damping: np.ndarray
    noise: Mapping[str, float]
    control_interval: int
    control_delay: int
    lowpass: float

    @classmethod
    def of(
        cls,
        n_worlds: int,
        gravity: Any,
        friction: Any,
        spring_frequency: Any,
        spring_damping: Any,
        noise: Any,
        control_interval: int,
        control_delay: int,
        actuation_cutoff: float | None,
    ) -> Conditions:
        """Checks what `Simulator` was told; its docstring says what each argument is.

        Raises:
            ValueError: one of them is wrong; the message names it.
        """
        interval = checks.positive_integer("control_interval", control_interval)
        if control_delay != 0:
            control_delay = checks.positive_integer("control_delay", control_delay)
        lowpass = 1.0
        if actuation_cutoff is not None:
            cutoff = checks.finite("actuation_cutoff", actuation_cutoff, 0.0)
            lowpass = -math.expm1(-2 * math.pi * cutoff * material.DT)
        return cls(
            _per_world("gravity", gravity, n_worlds, -math.inf),
            _per_world("friction", friction, n_worlds, 0.0),
            _per_world("spring_frequency", spring_frequency, n_worlds, _LEAST_FREQUENCY),
            _per_world("spring_damping", spring_damping, n_worlds, 0.0),
            _noise_by_kind(noise),
            interval,
            control_delay,
            lowpass,
        )

    def varied(self, morphology: Morphology) -> bool:
        """Whether kernels must look up gravity, friction and springs world by world."""
        alike = all(len(np.unique(values)) == 1 for values in (self.gravity, self.friction))
        usual = (self.spring_frequency == material.SPRING_FREQUENCY).all() and (
            self.spring_damping == material.SPRING_DAMPING_RATIO
        ).all()
        return not (alike and usual and morphology.is_uniform)

    def springs(self, chosen: np.ndarray, morphology: Morphology) -> np.ndarray:
        """What springs and actuators of voxels are like, (k, V, 4): 1 + g, -g / (1 + g), bias,
        and whether there is an actuator; see `material.spring_constants`.

        Args:
            chosen: numbers of k worlds.
            morphology: The shape of the robots; the frequency and damping of its materials are
                scaled as those of soft voxels are in each world.
        """
        table = np.empty((len(chosen), morphology.n_voxels, 4))
        frequency = self.spring_frequency[chosen] / material.SPRING_FREQUENCY
        damping = self.spring_damping[chosen] / material.SPRING_DAMPING_RATIO
        for voxel, own in enumerate(morphology.materials):
            softness, relax, bias = material.spring_constants(
                frequency * own.frequency, damping * own.damping
            )
            table[:, voxel, 0], table[:, voxel, 1] = 1 + softness, -relax
            table[:, voxel, 2], table[:, voxel, 3] = bias, own.actuated
        return table

    def reading_noise(self, apparatus: Apparatus) -> list[float]:
        """Standard deviation of the noise of each reading, R numbers."""
        return [self.noise[kind] for kind in apparatus.kinds]


_LEAST_FREQUENCY = 0.1  # [Hz]


def _per_world(name: str, value: Any, n_worlds: int, least: float) -> np.ndarray:
    """A number for every world, from one or from N of them, (N,) float64."""
    if checks.is_sequence(value) and not isinstance(value, str):
        values = [checks.finite(name, each, least) for each in value]
        if len(values) != n_worlds:
            raise ValueError(f"{name}: expected one number or {n_worlds}, got {len(values)}")
        return np.array(values, dtype=np.float64)
    return np.full(n_worlds, checks.finite(name, value, least))


def _noise_by_kind(noise: Any) -> dict[str, float]:
    """The noise of every kind of sensor; kinds that a mapping leaves out have none."""
    if not isinstance(noise, Mapping):
        return dict.fromkeys(KINDS, checks.finite("noise", noise, 0.0))
    if unknown := [kind for kind in noise if kind not in KINDS]:
        raise ValueError(f"noise: expected kinds of {', '.join(KINDS)}, got {unknown[0]!r}")
    return {kind: checks.finite("noise", noise.get(kind, 0.0), 0.0) for kind in KINDS}
