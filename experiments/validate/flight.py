"""Momentum in free flight, without damping: nothing acts on the robot as a whole."""

from __future__ import annotations

import dataclasses
import math
from functools import partial

import numpy as np
import torch

from experiments.validate.case import Case, Check, Outcome, Setting, Tolerance, worst
from experiments.validate.recordings import Recordings
from physics import Morphology, Simulator
from physics.scene import clock, material

__all__ = ["cases"]

_DURATION, _DRIVEN = 10.0, 5.0  # of the flight, and of the actuation in it [s]
_SPIN = 0.5  # [rad/s]
_VELOCITY = (1.0, 0.5)  # [m/s]
_DRIFT = Tolerance("at most", 1e-9)
_SPIN_FACTOR = 2.0  # times as much spin as the recorded robots, that started at rest, came to


def cases(recordings: Recordings) -> list[Case]:
    """A voxel and a robot of several; and every table ``*_voxel_step`` of welded voxels.

    Springs and ropes act along the line between their ends, so a voxel keeps its angular
    momentum. A weld's impulse has as much lever as the weld is open, so a robot keeps it only
    nearly, in the reference too: recorded robots that start at rest come to spin a little, and
    ours must not come to spin more.
    """
    found = [
        Case("free flight of a voxel", partial(_replay, "box-1x1", True)),
        Case("free flight of a biped", partial(_replay, "biped-4x3", False)),
    ]
    for match in recordings.names(r".*_voxel_step"):
        table = recordings.table(match[0])
        morphology = table.morphology()
        if morphology.n_voxels > 1:
            motion = table.per_voxel("actuation", "a"), *table.squares(morphology)
            found.append(Case(f"spin {match[0]}", partial(_spin, match[0], morphology, *motion)))
    return found


def _spin(
    name: str,
    morphology: Morphology,
    actuations: np.ndarray,
    poses: np.ndarray,
    velocities: np.ndarray,
    setting: Setting,
) -> Outcome:
    recorded = max(abs(_momenta(*now)[2]) for now in zip(poses, velocities, strict=True))
    sim = setting.simulator(morphology, None, gravity=0.0, dtype=torch.float64)
    sim.set_poses(torch.from_numpy(poses[:1]), torch.from_numpy(velocities[:1]))
    ours = 0.0
    for actuation in torch.from_numpy(actuations[:-1]):
        sim.step(actuation[None])
        ours = max(ours, abs(_momenta_of(sim)[2]))
    return Outcome(
        (
            Check(
                f"{name} f64",
                "greatest angular momentum from rest [kg m2/s]",
                recorded,
                ours,
                Tolerance("at most", _SPIN_FACTOR * recorded),
            ),
        )
    )


def _replay(shape: str, keeps_spin: bool, setting: Setting) -> Outcome:
    engine = dataclasses.replace(setting.engine, damping=0.0)
    sim = setting.simulator(shape, None, gravity=0.0, dtype=torch.float64, engine=engine)
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
    history = [_momenta_of(sim)]
    for actuation in torch.sin(2 * math.pi * times[:, None] + phases) * driven:
        sim.step(actuation[None])
        history.append(_momenta_of(sim))
    drift = np.abs(np.array(history) / history[0] - 1)
    measures = {"linear": drift[:, :2]} | ({"angular": drift[:, 2:]} if keeps_spin else {})
    return Outcome(
        tuple(
            Check(
                f"free flight {shape} f64",
                f"relative drift of {kind} momentum",
                0.0,
                worst(d),
                _DRIFT,
            )
            for kind, d in measures.items()
        )
    )


def _momenta_of(sim: Simulator) -> np.ndarray:
    """Those of the one world of ``sim``, see `_momenta`."""
    return _momenta(sim.mass_poses()[0].cpu().numpy(), sim.mass_velocities()[0].cpu().numpy())


def _momenta(poses: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    """Linear momentum along x and y [kg m/s] and angular momentum about the origin.

    Args:
        poses: The poses of the squares, (V, 4, 3) x, y [m], angle [rad].
        velocities: (V, 4, 3) vx, vy [m/s], omega [rad/s].
    """
    x, y, _ = poses.reshape(-1, 3).T
    vx, vy, omega = velocities.reshape(-1, 3).T
    orbital = material.SQUARE_MASS * (x * vy - y * vx)
    spin = material.SQUARE_INERTIA * omega
    return np.array(
        [material.SQUARE_MASS * vx.sum(), material.SQUARE_MASS * vy.sum(), (orbital + spin).sum()]
    )
