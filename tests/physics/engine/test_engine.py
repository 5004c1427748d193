"""The engine in free flight: recorded runs, the slow oracle, closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from physics import Engine, Morphology, Simulator
from physics.scene import material
from tests.physics.worlds import DOUBLE, beside_oracle, distance, gaits
from tests.reference import load

FLOATS = [torch.float64, torch.float32]


# --- other programs -----------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", FLOATS)
@pytest.mark.parametrize(
    ("run", "shape", "position", "area"),
    [
        ("single", "box-1x1", 2e-5, 1e-5),
        ("two", "box-2x1", 3e-4, 2e-5),
        ("four", "box-2x2", 8e-3, 1.5e-3),  # the record has collisions of the robot with itself
    ],
)
def test_free_flight_follows_the_record(run, shape, position, area, dtype):
    record = load(f"{run}_voxel_step")
    sim = Simulator(shape, None, gravity=0.0, dtype=dtype)
    actuations = torch.from_numpy(record["actuation"]).reshape(-1, 1, sim.n_voxels)
    off_position, off_area = [], []
    for k in range(1, 361):
        sim.step(actuations[k - 1])
        ours = sim.mass_poses()[0, ..., :2].numpy()
        off_position.append(np.abs(ours - record["state"][k, ..., :2]).max())
        off_area.append(np.abs(sim.area_ratios()[0].numpy() - record["area_ratio"][k]).max())
    assert max(off_position) < position
    assert max(off_area) < area


@pytest.mark.parametrize("shape", ["biped-4x3", "worm-7x1"])
def test_free_flight_follows_the_oracle(shape):
    voxels = Morphology.of(shape).n_voxels
    worst, met = beside_oracle(shape, None, 0.0, gaits(60, 1, voxels))
    assert worst < 1e-11
    assert met["ropes"] > 0


def test_a_robot_torn_about_follows_the_oracle():
    """Squares far out of place and fast: clamped corrections, welds and ropes far off."""
    poses = Simulator("biped-4x3", None, dtype=DOUBLE).mass_poses()[0].numpy()
    random = np.random.default_rng(0)
    poses = poses + random.uniform(-0.35, 0.35, poses.shape)
    velocities = random.normal(scale=3.0, size=poses.shape)
    worst, met = beside_oracle("biped-4x3", None, 9.8, gaits(20, 1, 10), poses, velocities)
    assert worst < 1e-10
    assert met["ropes"] > 0


# --- closed forms -------------------------------------------------------------------------------


def test_a_robot_falls_freely_but_for_damping():
    """v <- q (v - g dt), y <- y + v dt with q = 1 - damping dt."""
    sim = Simulator("biped-4x3", None, gravity=9.8, dtype=DOUBLE)
    start = sim.mass_poses()
    steps, q = 120, 1 - material.DAMPING * material.DT
    sim.run(torch.zeros(steps, 1, 10))
    speed = -9.8 * material.DT * q * (1 - q**steps) / (1 - q)
    fallen = -9.8 * material.DT**2 * q / (1 - q) * (steps - q * (1 - q**steps) / (1 - q))
    assert (sim.mass_velocities()[..., 1] - speed).abs().max() < 1e-9
    assert (sim.mass_poses()[..., 1] - start[..., 1] - fallen).abs().max() < 1e-9
    assert (sim.mass_poses()[..., 0] - start[..., 0]).abs().max() < 1e-9
    assert (sim.mass_poses()[..., 2]).abs().max() < 1e-9


def test_no_square_moves_further_than_the_limits_of_a_step():
    sim = Simulator("box-1x1", None, gravity=0.0, dtype=DOUBLE, engine=Engine(damping=0.0))
    poses = sim.mass_poses()
    velocities = torch.zeros_like(poses)
    velocities[..., 0], velocities[..., 1] = 300.0, 400.0
    sim.set_poses(poses, velocities)
    sim.step(torch.zeros(1, 1))
    moved = sim.mass_poses() - poses
    assert moved[..., 0].numpy() == pytest.approx(2.0 * 0.6, abs=1e-9)
    assert moved[..., 1].numpy() == pytest.approx(2.0 * 0.8, abs=1e-9)


def momentum(sim: Simulator) -> np.ndarray:
    """Momentum along x and y and angular momentum about the origin."""
    x, y, _ = sim.mass_poses()[0].unbind(-1)
    vx, vy, omega = sim.mass_velocities()[0].unbind(-1)
    mass, inertia = material.SQUARE_MASS, material.SQUARE_INERTIA
    spin = inertia * omega + mass * (x * vy - y * vx)
    return np.array([float(part.sum()) for part in (mass * vx, mass * vy, spin)])


@pytest.mark.parametrize(("shape", "spin"), [("box-1x1", 1e-12), ("biped-4x3", 0.1)])
def test_momentum_is_conserved(shape, spin):
    """Springs act along their line, welds and ropes on both sides. Only the position stage of
    welds and ropes moves squares without turning their velocities: it changes the spin a little."""
    sim = Simulator(shape, None, gravity=0.0, dtype=DOUBLE, engine=Engine(damping=0.0))
    random = np.random.default_rng(1)
    velocities = torch.from_numpy(random.normal(scale=0.2, size=(1, sim.n_voxels, 4, 3)))
    sim.set_poses(sim.mass_poses(), velocities)
    before = momentum(sim)
    worst = np.zeros(3)
    for part in gaits(600, 1, sim.n_voxels, amplitude=0.3).split(60):
        sim.run(part)
        worst = np.maximum(worst, np.abs(momentum(sim) - before))
    assert np.abs(before).min() > 0.01
    assert (worst < [1e-12, 1e-12, spin]).all()


def spring_matrix(frequency: float) -> tuple[np.ndarray, np.ndarray]:
    """Masses (12,) and stiffness (12, 12) of a voxel about its rest: every spring swings the two
    points it joins, left alone, at this frequency."""
    masses = np.tile([material.SQUARE_MASS, material.SQUARE_MASS, material.SQUARE_INERTIA], 4)
    centres = np.array(material.CORNER_SIGNS) * material.SQUARE_OFFSET
    stiffness = np.zeros((12, 12))
    for spring in material.SPRINGS:
        ends = ((spring.square1, spring.corner1, 1.0), (spring.square2, spring.corner2, -1.0))
        arms = [
            np.zeros(2)
            if corner is None
            else np.array(material.CORNER_SIGNS[corner]) * material.SQUARE_HALF
            for _, corner, _ in ends
        ]
        line = (centres[spring.square1] + arms[0]) - (centres[spring.square2] + arms[1])
        n = line / np.hypot(*line)
        gradient = np.zeros(12)
        for (square, _, sign), r in zip(ends, arms, strict=True):
            gradient[3 * square : 3 * square + 3] = sign * np.array([*n, r[0] * n[1] - r[1] * n[0]])
        reduced_mass = 1 / (gradient**2 / masses).sum()
        stiffness += reduced_mass * (2 * math.pi * frequency) ** 2 * np.outer(gradient, gradient)
    return masses, stiffness


def test_a_voxel_swings_like_its_linear_model():
    """Small motions follow M v' = M v - dt K (x + dt v') - dt D v', D = 2 zeta / omega K: implicit
    Euler of a voxel of 8 Hz springs, up to the ten iterations' 5e-5 and to the square of 1e-6."""
    masses, stiffness = spring_matrix(8.0)
    damper = 2 * 0.3 / (2 * math.pi * 8.0) * stiffness
    dt = material.DT
    implicit = np.diag(masses) + dt * damper + dt**2 * stiffness
    sim = Simulator("box-1x1", None, gravity=0.0, dtype=DOUBLE, engine=Engine(damping=0.0))
    rest, random = sim.mass_poses().numpy(), np.random.default_rng(0)
    x, v = random.normal(scale=1e-6, size=12), random.normal(scale=1e-5, size=12)
    poses, velocities = rest + x.reshape(1, 1, 4, 3), v.reshape(1, 1, 4, 3)
    sim.set_poses(torch.from_numpy(poses), torch.from_numpy(velocities))
    for _ in range(40):
        v = np.linalg.solve(implicit, masses * v - dt * stiffness @ x)
        x = x + dt * v
        sim.step(torch.zeros(1, 1))
        assert sim.mass_poses().numpy() - rest == pytest.approx(x.reshape(1, 1, 4, 3), abs=2e-10)


@pytest.mark.parametrize(("actuation", "ratio"), [(1.0, 0.775), (-1.0, 1.225), (0.0, 1.0)])
def test_unloaded_steady_area(actuation, ratio):
    sim = Simulator("box-1x1", None, gravity=0.0, dtype=DOUBLE)
    sim.run(torch.full((180, 1, 1), actuation))
    assert sim.area_ratios().item() == pytest.approx(ratio, abs=1e-12)


def test_ropes_keep_squares_apart():
    """Squares pressed together: a rope mends a gap of up to 0.2 m in one position stage."""
    gaps = {}
    for ropes in (True, False):
        sim = Simulator("box-1x1", None, gravity=0.0, dtype=DOUBLE, engine=Engine(ropes=ropes))
        poses = sim.mass_poses()
        poses[..., :2] *= 1.05 / 1.8  # centres 1.05 m apart instead of 1.8
        velocities = -20.0 * poses
        sim.set_poses(poses, velocities)
        sim.step(torch.zeros(1, 1))
        x, y, _ = sim.mass_poses()[0, 0].unbind(-1)
        gaps[ropes] = [float(gap) for gap in (x[1] - x[0], x[2] - x[3], y[1] - y[2], y[0] - y[3])]
    assert gaps[True] == pytest.approx([material.ROPE_LENGTH] * 4, abs=1e-8)
    assert max(gaps[False]) < material.ROPE_LENGTH - 0.1


# --- symmetries ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "iterations", "tolerance"), [("box-1x1", 10, 1e-6), ("biped-4x3", 200, 1e-3)]
)
def test_left_and_right_are_alike(shape, iterations, tolerance):
    """Up to the order of the joints, whose effect more iterations make small."""
    morphology = Morphology.of(shape)
    mirror = [morphology.cells.index((morphology.width - 1 - x, y)) for x, y in morphology.cells]
    actuations = gaits(100, 1, morphology.n_voxels, amplitude=0.3)
    flip = torch.tensor([-1.0, 1.0, -1.0])
    velocities = torch.randn(
        1, morphology.n_voxels, 4, 3, generator=torch.Generator().manual_seed(0)
    )
    sim, mirrored = (
        Simulator(
            shape, None, gravity=0.0, dtype=DOUBLE, engine=Engine(velocity_iterations=iterations)
        )
        for _ in range(2)
    )
    start = sim.mass_poses()
    sim.set_poses(start, velocities)
    mirrored.set_poses(start, velocities[:, mirror][:, :, [1, 0, 3, 2]] * flip)
    sim.run(actuations)
    mirrored.run(actuations[:, :, mirror])
    poses = mirrored.mass_poses()[:, mirror][:, :, [1, 0, 3, 2]] * flip
    poses[..., 0] += 2 * start[..., 0].mean()
    assert distance(sim.mass_poses().numpy(), poses.numpy()) < tolerance


@pytest.mark.parametrize(
    ("shift", "speed"), [((1000.0, 500.0), (0.0, 0.0)), ((0.0, 0.0), (7.0, -3.0))]
)
def test_flight_is_the_same_elsewhere_and_under_way(shift, speed):
    actuations = gaits(100, 1, 10)
    here, there = (
        Simulator("biped-4x3", None, gravity=0.0, dtype=DOUBLE, engine=Engine(damping=0.0))
        for _ in range(2)
    )
    offset = torch.tensor([*shift, 0.0], dtype=DOUBLE)
    drift = torch.tensor([*speed, 0.0], dtype=DOUBLE)
    poses = there.mass_poses()
    there.set_poses(poses + offset, drift.expand_as(poses))
    here.run(actuations)
    there.run(actuations)
    back = there.mass_poses() - offset - drift * there.time
    assert distance(here.mass_poses()[0].numpy(), back[0].numpy()) < 1e-11
