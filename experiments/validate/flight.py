"""Momentum in free flight, without damping: nothing acts on the robot as a whole."""

from __future__ import annotations

import dataclasses
import math
from functools import partial

import numpy as np
import torch

from experiments.validate.case import Case, Outcome, Row, Setting, Tolerance, worst
from physics import Simulator, clock, material

__all__ = ["cases"]

_DURATION, _DRIVEN = 10.0, 5.0  # of the flight, and of the actuation in it [s]
_SPIN = 0.5  # [rad/s]
_VELOCITY = (1.0, 0.5)  # [m/s]
_DRIFT = Tolerance("at most", 1e-9)


def cases() -> list[Case]:
    """A voxel, and a robot of several.

    Springs and ropes act along the line between their ends, so a voxel keeps its angular
    momentum; a weld's impulse has as much lever as the weld is open, so a robot keeps it only
    nearly, in the reference too.
    """
    return [
        Case("free flight of a voxel", partial(_replay, "box-1x1", True)),
        Case("free flight of a biped", partial(_replay, "biped-4x3", False)),
    ]


def _replay(shape: str, keeps_spin: bool, setting: Setting) -> Outcome:
    engine = dataclasses.replace(setting.engine, damping=0.0)
    sim = Simulator(shape, None, gravity=0.0, dtype=torch.float64, engine=engine)
    poses = sim.mass_poses()
    arms = poses[..., :2] - sim.center_of_mass()
    velocities = torch.full_like(poses, _SPIN)
    velocities[..., 0] = _VELOCITY[0] - _SPIN * arms[..., 1]
    velocities[..., 1] = _VELOCITY[1] + _SPIN * arms[..., 0]
    sim.set_poses(poses, velocities)
    times = torch.from_numpy(clock.times(clock.steps_in(_DURATION)))
    generator = torch.Generator().manual_seed(setting.seed)
    phases = torch.rand(sim.n_voxels, generator=generator, dtype=torch.float64) * 2 * math.pi
    driven = (times < _DRIVEN).double()[:, None]
    history = [_momenta(sim)]
    for actuation in torch.sin(2 * math.pi * times[:, None] + phases) * driven:
        sim.step(actuation[None])
        history.append(_momenta(sim))
    drift = np.abs(np.array(history) / history[0] - 1)
    measures = {"linear": drift[:, :2]} | ({"angular": drift[:, 2:]} if keeps_spin else {})
    return Outcome(
        tuple(
            Row(
                f"free flight {shape} f64",
                f"relative drift of {kind} momentum",
                0.0,
                worst(d),
                _DRIFT,
            )
            for kind, d in measures.items()
        )
    )


def _momenta(sim: Simulator) -> np.ndarray:
    """Linear momentum along x and y [kg m/s] and angular momentum about the origin."""
    (x, y, _), (vx, vy, omega) = (
        values.double().flatten(0, -2).T.numpy()
        for values in (sim.mass_poses(), sim.mass_velocities())
    )
    orbital = material.SQUARE_MASS * (x * vy - y * vx)
    spin = material.SQUARE_INERTIA * omega
    return np.array(
        [material.SQUARE_MASS * vx.sum(), material.SQUARE_MASS * vy.sum(), (orbital + spin).sum()]
    )
