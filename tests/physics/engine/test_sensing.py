"""Sensors: recorded readings, slow formulas, windows at the start and after a long life."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from physics import Apparatus, Engine, Morphology, Sensor, Simulator, Terrain
from tests.oracle import sensors as oracle
from tests.physics.worlds import DOUBLE, gaits, turned
from tests.reference import load

HILLS = Terrain.from_name("hilly-3-30-0")


def recorded() -> tuple[torch.Tensor, torch.Tensor]:
    """Poses and velocities of one world after each step, two of (300, 1, 10, 4, 3)."""
    state = torch.from_numpy(load("sensors_biped")["state"])[:, None]
    return state[..., :3], state[..., 3:]


@pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float64, 1e-12), (torch.float32, 5e-6)])
@pytest.mark.parametrize("name", ["high", "medium", "low"])
def test_readings_follow_the_record(name, dtype, tolerance):
    record, morphology = load("sensors_biped"), Morphology.of("biped-4x3")
    apparatus = Apparatus.named(name, morphology, lidar_angles=(-30, 0, 30))
    sim = Simulator(morphology, HILLS, sensors=apparatus, dtype=dtype)
    ours = sim.replay(*recorded())[:, 0].numpy()
    assert list(sim.sensor_names) == list(record[f"names_{name}"])
    columns = [list(record["names_high"]).index(own) for own in sim.sensor_names]
    assert np.abs(ours - record["readings"][:, columns]).max() < tolerance
    assert sim.time == pytest.approx(5.0, abs=1e-9)


def test_touching_follows_the_record():
    sim = Simulator("biped-4x3", HILLS, dtype=DOUBLE)
    ours = []
    for poses in recorded()[0]:
        sim.set_poses(poses)
        ours.append(sim.touching()[0].numpy())
    theirs = load("sensors_biped")["touching"].any(axis=2)
    assert theirs.any()
    assert np.array_equal(ours, theirs)


def test_readings_of_a_run_follow_the_oracle():
    """Sensing as the robot runs, with windows and rays of another make than the paper's."""
    own = (
        Sensor("area"),
        Sensor("touch", interval=0.1),
        Sensor("velocity", interval=1.0),
        Sensor("lidar", angles=(-90, -20, 5, 70, 170), range=25.0),
    )
    terrain = Terrain.from_name("hilly-1-4-3")
    sim = Simulator("worm-2x1", terrain, sensors=Apparatus((own, own[1:])), dtype=DOUBLE)
    poses, velocities, touching, ours = [], [], [], []
    for actuation in gaits(150, 1, 2):
        ours.append(sim.step(actuation)[0].numpy())
        poses.append(sim.mass_poses()[0].numpy())
        velocities.append(sim.mass_velocities()[0].numpy())
        touching.append(np.repeat(sim.touching()[0].numpy()[:, None], 4, axis=1))
    poses, velocities, touching = map(np.array, (poses, velocities, touching))
    theirs = oracle.readings(sim.apparatus, poses, velocities, touching, terrain)
    assert touching.any()
    assert not touching.all()
    assert np.abs(np.array(ours) - theirs).max() < 1e-12


def test_lidar_sees_the_ground_from_anywhere():
    """300 voxels at random places over hills, turned at random, each ray against the oracle."""
    terrain = Terrain.from_name("hilly-2-6-5")
    random = np.random.default_rng(0)
    angles = tuple(range(-180, 180, 30))
    own = (Sensor("lidar", angles=angles, range=12.0),)
    sim = Simulator("box-1x1", terrain, 300, sensors=Apparatus((own,)), dtype=DOUBLE)
    x = random.uniform(20.0, 1980.0, 300)
    places = np.stack([x, terrain.height(x) + random.uniform(2.0, 12.0, 300)], 1)
    poses = sim.mass_poses()
    poses[..., :2] += torch.from_numpy(places)[:, None, None] - poses[..., :2].mean(2, keepdim=True)
    turns = random.uniform(-math.pi, math.pi, 300)
    poses = torch.stack([turned(p[None], t)[0] for p, t in zip(poses, turns, strict=True)])
    theirs = [
        [oracle.distance(*place, turn + math.radians(a), 12.0, terrain) / 12.0 for a in angles]
        for place, turn in zip(places.tolist(), turns.tolist(), strict=True)
    ]
    theirs = np.array(theirs)
    ours = sim.set_poses(poses).numpy()
    assert 0.2 < (theirs < 1).mean() < 0.8
    assert np.abs(ours - theirs).max() < 1e-9


def test_values_at_birth_and_without_ground():
    sim = Simulator("biped-4x3", None, sensors="high", dtype=DOUBLE)
    first = dict(zip(sim.sensor_names, sim.reset()[0].tolist(), strict=True))
    expected = {"area": 0.5, "touch": 0.0, "velocity": 0.5, "lidar": 1.0}
    for name, kind in zip(sim.sensor_names, sim.sensor_kinds, strict=True):
        assert first[name] == pytest.approx(expected[kind], abs=1e-12), name


@pytest.mark.parametrize("angle", [0.0, 2.0, math.pi, -2.5])
def test_velocity_is_told_in_the_voxels_own_frame(angle):
    """3 m/s along the voxel and 1 m/s across it, whichever way it is turned."""
    sim = Simulator(
        "box-1x1", None, gravity=0.0, sensors=Apparatus(((Sensor("velocity"),),)), dtype=DOUBLE
    )
    velocities = torch.zeros(1, 1, 4, 3, dtype=DOUBLE)
    velocities[..., 0] = 3 * math.cos(angle) - math.sin(angle)
    velocities[..., 1] = 3 * math.sin(angle) + math.cos(angle)
    poses = turned(sim.mass_poses(), angle)
    readings = sim.replay(poses[None], velocities[None])[-1, 0]
    expected = [0.5 + 0.5 * math.tanh(3 / 4), 0.5 + 0.5 * math.tanh(1 / 4)]
    assert readings.tolist() == pytest.approx(expected, abs=1e-12)


def test_area_of_a_deformed_voxel():
    """A voxel drawn out by 0.4 m to the right and 0.2 m upwards."""
    sim = Simulator("box-1x1", None, sensors=Apparatus(((Sensor("area"),),)), dtype=DOUBLE)
    poses = sim.mass_poses()
    poses[0, 0, [1, 2], 0] += 0.4
    poses[0, 0, [0, 1], 1] += 0.2
    ratio = 3.4 * 3.2 / 9
    reading = sim.set_poses(poses)
    assert sim.area_ratios().item() == pytest.approx(ratio, abs=1e-12)
    assert reading.item() == pytest.approx(0.5 + 0.5 * math.tanh(4 * (ratio - 1)), abs=1e-12)


def test_windows_hold_on_after_more_than_a_minute():
    """In a steady fall v_k = -g dt k; the average over L samples lies (L - 1) / 2 steps back."""
    sim = Simulator(
        "box-1x1",
        None,
        gravity=0.01,
        sensors=Apparatus(((Sensor("velocity"),),)),
        engine=Engine(damping=0.0),
        dtype=DOUBLE,
    )
    sim.run(torch.zeros(3680, 1, 1))
    times = np.cumsum(np.full(3760, 1 / 60))
    for k in range(3681, 3761):  # the first table of windows holds 3700 steps
        samples = int((times[:k] >= times[k - 1] - 0.5).sum())
        mean = -0.01 / 60 * (k - (samples - 1) / 2)
        reading = sim.step(torch.zeros(1, 1))[0, 1].item()
        assert reading == pytest.approx(0.5 + 0.5 * math.tanh(mean / 4), abs=1e-12), k
