"""Robots on the ground: the slow oracle, recorded falls, closed forms, the terrain window."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from physics import Engine, Simulator, Terrain
from physics.scene import material
from tests.physics.worlds import DOUBLE, beside_oracle, distance, gaits, turned
from tests.reference import load

FLAT = Terrain.from_name("flat")


def slope(degrees: float) -> Terrain:
    """Falls to the right through the origin, without walls."""
    fall = math.tan(math.radians(degrees))
    return Terrain.from_profile([-100.0, 500.0], [100.0 * fall, -500.0 * fall])


def at(sim: Simulator, x: float | torch.Tensor, y: float | torch.Tensor) -> torch.Tensor:
    """The present poses, moved so that the robots' centres are at (x, y)."""
    poses = sim.mass_poses()
    poses[..., :2] -= sim.center_of_mass()[:, None, None]
    poses[..., 0] += torch.as_tensor(x, dtype=poses.dtype).reshape(-1, 1, 1)
    poses[..., 1] += torch.as_tensor(y, dtype=poses.dtype).reshape(-1, 1, 1)
    return poses


# --- other programs -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "voxels", "ground", "steps", "seed"),
    [
        ("box-1x1", 1, "flat", 80, 0),
        ("biped-4x3", 10, "flat", 60, 0),
        ("biped-4x3", 10, "hilly-3-30-7", 80, 1),
        ("worm-7x1", 7, "hilly-3-30-7", 80, 0),
        ("worm-7x1", 7, "hilly-1-3-3", 80, 1),
    ],
)
def test_a_gait_follows_the_oracle(shape, voxels, ground, steps, seed):
    """To rounding, until a rope mended to exactly its length counts as short by one bit only."""
    terrain = Terrain.from_name(ground)
    worst, met = beside_oracle(shape, terrain, 9.8, gaits(steps, 1, voxels, seed))
    assert worst < 1e-10
    assert met["contacts"] > 10
    assert met["ropes"] > 0 or voxels == 1
    assert met["corners"] > 0 or ground != "hilly-1-3-3"


def test_a_robot_that_crosses_many_segments_follows_the_oracle():
    """It slides some 60 m, so that its window of terrain is filled several times."""
    terrain = Terrain.from_name("hilly-0.2-4-1")
    sim = Simulator("worm-2x1", terrain, dtype=DOUBLE)
    poses = sim.mass_poses()[0].numpy()
    velocities = np.zeros_like(poses)
    velocities[..., 0] = 60.0
    worst, met = beside_oracle("worm-2x1", terrain, 9.8, gaits(70, 1, 2), poses, velocities)
    assert worst < 1e-9
    assert met["contacts"] > 10


def test_a_robot_that_rolls_follows_the_oracle():
    """It lands with a spin and turns over, so that squares touch with one side after another."""
    sim = Simulator("box-2x2", FLAT, dtype=DOUBLE)
    poses = at(sim, 50.0, 8.1)[0].numpy()
    velocities = np.zeros_like(poses)
    spin, speed = -6.0, 8.0
    velocities[..., 0] = speed - spin * (poses[..., 1] - 8.1)
    velocities[..., 1] = spin * (poses[..., 0] - 50.0)
    velocities[..., 2] = spin
    actuations = gaits(80, 1, 4, amplitude=0.5)
    worst, met = beside_oracle("box-2x2", FLAT, 9.8, actuations, poses, velocities)
    assert worst < 1e-10
    assert met["contacts"] > 10


@pytest.mark.parametrize(
    ("run", "shape"),
    [
        ("single_voxel_drop", "box-1x1"),
        ("passive_biped", "biped-4x3"),
        ("passive_worm", "worm-7x1"),
    ],
)
def test_robots_settle_at_the_recorded_heights(run, shape):
    """The records hold false collision events, which shift voxels and leave stresses."""
    record = load(run)
    centres = record["centers"] if "centers" in record else record["state"].mean(2)
    sim = Simulator(shape, FLAT, dtype=DOUBLE)
    heights = []
    for _ in range(300):
        sim.step(torch.zeros(1, sim.n_voxels))
        heights.append(sim.voxel_centers()[0, :, 1].numpy())
    off = np.abs(np.array(heights) - centres[1:301, :, 1])
    assert off.max() < 0.11  # while bouncing
    assert off[-1].max() < 0.02
    assert abs(heights[-1].mean() - centres[300, :, 1].mean()) < 0.005
    touching = record["touching"][300]
    touching = touching.any(-1) if touching.ndim == 2 else touching
    if shape != "worm-7x1":  # two of its voxels hang in the air in the record
        assert np.array_equal(sim.touching()[0].numpy(), touching)


# --- closed forms -------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", ["box-1x1", "worm-7x1", "biped-4x3"])
def test_at_rest_squares_lie_five_millimetres_deep(shape):
    sim = Simulator(shape, FLAT, dtype=DOUBLE)
    sim.run(torch.zeros(600, 1, sim.n_voxels))
    _, y, angle = sim.mass_poses()[0].unbind(-1)
    lowest = y - material.SQUARE_HALF * (angle.cos().abs() + angle.sin().abs())
    assert 5.0 - lowest.min().item() == pytest.approx(material.LINEAR_TOLERANCE, abs=0.0005)
    assert sim.mass_velocities().abs().max() < 1e-3


@pytest.mark.parametrize("friction", [0.2, material.FRICTION])
@pytest.mark.parametrize("ratio", [0.95, 1.05])
def test_friction_holds_up_to_its_angle(friction, ratio):
    """On a slope of tan = ratio * friction a worm sticks or slides, with g (sin - friction cos)."""
    angle = math.atan(ratio * friction)
    engine = Engine(friction=friction, damping=0.0)
    sim = Simulator("worm-7x1", slope(math.degrees(angle)), dtype=DOUBLE, engine=engine)
    lift = material.VOXEL_SIDE / 2 - material.LINEAR_TOLERANCE
    x, y = 100.0 + lift * math.sin(angle), -100.0 * math.tan(angle) + lift * math.cos(angle)
    sim.set_poses(turned(at(sim, x, y), -angle))
    sim.run(torch.zeros(120, 1, 7))  # its stresses die out
    before, speed = sim.center_of_mass(), sim.mass_velocities()[..., 0].mean()
    sim.run(torch.zeros(60, 1, 7))
    gain = (sim.mass_velocities()[..., 0].mean() - speed).item() / math.cos(angle)
    if ratio < 1:
        assert (sim.center_of_mass() - before).norm() < 1e-6
    else:
        pull = 9.8 * (math.sin(angle) - friction * math.cos(angle))
        assert gain == pytest.approx(pull, rel=0.02)


def test_a_fast_impact_bounces_with_a_tenth_of_its_speed():
    """All squares of a voxel at one speed: what the ground gives back in its first step. The
    upper squares do not feel it yet, nor do the springs, at rest length, pull."""
    for speed, bounce in ((4.0, 0.4), (0.8, 0.0)):
        engine = Engine(damping=0.0, velocity_iterations=1)
        sim = Simulator("box-1x1", FLAT, gravity=0.0, dtype=DOUBLE, engine=engine)
        poses = at(sim, 100.0, 5.0 + material.VOXEL_SIDE / 2 - 0.001)
        velocities = torch.zeros_like(poses)
        velocities[..., 1] = -speed
        sim.set_poses(poses, velocities)
        sim.step(torch.zeros(1, 1))
        rising = sim.mass_velocities()[0, 0, 2:]  # contacts come last, so the target is met
        points = rising[:, 1] + rising[:, 2] * material.SQUARE_HALF
        assert points.numpy() == pytest.approx(bounce, abs=1e-9)


def test_flat_ground_is_the_same_everywhere():
    actuations = gaits(60, 1, 10)
    runs = []
    for x in (40.0, 1500.0):
        sim = Simulator("biped-4x3", FLAT, dtype=DOUBLE)
        sim.set_poses(at(sim, x, 5.0 + 4.6))
        sim.run(actuations)
        poses = sim.mass_poses()
        poses[..., 0] -= x
        runs.append(poses[0].numpy())
    assert distance(*runs) < 1e-10


# --- the terrain window -------------------------------------------------------------------------


@pytest.mark.parametrize("ground", ["hilly-3-30-4", "hilly-1-5-2", "steppy-1-8-3"])
def test_the_ground_is_felt_along_the_whole_terrain(ground):
    """Voxels put on the ground at many places at once, 1 cm deep or 1 cm above. The lowest
    corner is the first to touch a ground that is no steeper than the voxel stands."""
    terrain = Terrain.from_name(ground)
    x = torch.linspace(14.0, 1985.0, 400, dtype=DOUBLE)
    for depth in (0.01, -0.01):
        sim = Simulator("box-1x1", terrain, 400, dtype=DOUBLE)
        sim.set_poses(touching_by(depth, sim, terrain, x))
        assert bool(sim.touching().all()) == (depth > 0)
        assert bool(sim.touching().any()) == (depth > 0)


def test_a_robot_that_goes_on_has_ground_under_it():
    """Wherever it was, also where the window's places were just enough for the ground."""
    xs = np.array([0.0, 10.0, 18.4, 24.3, 27.8, 37.9, 57.9, 77.9, 97.9])
    terrain = Terrain.from_profile(xs, np.full(len(xs), 5.0))
    x = torch.linspace(13.0, 45.0, 80)
    sim = Simulator("box-1x1", terrain, 80, friction=0.0)
    sim.set_poses(at(sim, x, 6.5), torch.tensor([20.0, 0.0, 0.0]).expand(80, 1, 4, 3))
    sim.run(torch.zeros(100, 80, 1))
    assert bool((sim.center_of_mass()[:, 0] > x + 20).all())
    assert bool((sim.mass_poses()[..., 1] > 5.5).all())


def touching_by(depth: float, sim: Simulator, terrain: Terrain, x: torch.Tensor) -> torch.Tensor:
    """Poses at these places, so deep in the ground [m]."""
    sim.set_poses(at(sim, x, 0.0))
    poses = sim.mass_poses()
    reach = np.linspace(-0.6, 0.6, 1201)  # below a square; corners of the ground are near
    below = terrain.height(poses[..., 0].numpy()[..., None] + reach).max(-1)
    gap = poses[..., 1].numpy() - material.SQUARE_HALF - below
    poses[..., 1] -= torch.from_numpy(gap.min(axis=(1, 2)) + depth).reshape(-1, 1, 1)
    return poses


def test_a_robot_that_leaves_the_ground_stands_still():
    """It slides off an end; whatever longer terrains are in the batch."""
    short = Terrain.from_profile([0.0, 30.0], [5.0, 5.0])
    long = Terrain.from_profile(np.arange(0.0, 80.0, 10.0), np.full(8, 5.0))
    ends = []
    for terrains in ([short], [short, long]):
        sim = Simulator("worm-2x1", terrains, len(terrains), dtype=DOUBLE)
        poses = at(sim, 26.0, 6.5)
        velocities = torch.zeros_like(poses)
        velocities[..., 0] = 15.0
        sim.set_poses(poses, velocities)
        for _ in range(60):
            sim.step(torch.zeros(len(terrains), 2))
        assert sim.left_ground()[0]
        gone = sim.mass_poses()[0]
        time = sim.times[0]
        sim.run(torch.ones(60, len(terrains), 2))
        ends.append(sim.mass_poses()[0])
        assert torch.equal(ends[-1], gone)
        assert not sim.failed().any()
        assert sim.times[0] == time
        assert 30.0 < sim.center_of_mass()[0, 0] < 30.3
        assert not sim.mass_velocities()[0].any()
    assert sim.left_ground().tolist() == [True, False]
    assert sim.center_of_mass()[1, 0] > 30.3
    assert torch.equal(*ends)
    sim.reset()
    assert not sim.left_ground().any()


def test_a_robot_stands_still_beside_a_ground_elsewhere():
    elsewhere = Terrain.from_profile([100.0, 200.0], [5.0, 5.0])
    sim = Simulator("worm-2x1", [elsewhere, FLAT], 2)
    assert sim.left_ground().tolist() == [True, False]
    start = sim.mass_poses()
    sim.run(torch.zeros(60, 2, 2))
    assert torch.equal(sim.mass_poses()[0], start[0])
    assert not torch.equal(sim.mass_poses()[1], start[1])
    sim.set_poses(at(sim, 150.0, 7.0).float())
    assert not sim.left_ground().any()
    assert not Simulator("worm-2x1", None).left_ground().any()


def test_a_wall_stops_a_robot():
    """Thrown at the left wall at 30 m/s, a worm does not end up in it."""
    sim = Simulator("worm-3x1", FLAT, dtype=DOUBLE)
    poses = at(sim, 20.0, 7.0)
    velocities = torch.zeros_like(poses)
    velocities[..., 0] = -30.0
    sim.set_poses(poses, velocities)
    for _ in range(120):
        sim.step(torch.zeros(1, 3))
    x, y, _ = sim.mass_poses()[0].unbind(-1)
    wall = np.interp(y.numpy(), [5.0, 100.0], [10.0, 0.0])
    assert (x.numpy() - wall).min() > 0.5
