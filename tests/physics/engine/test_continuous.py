"""Continuous collision detection: squares that land stop where they touch the ground."""

from __future__ import annotations

import math

import pytest
import torch
from torch import Tensor

from physics import Engine, Simulator, Terrain
from physics.scene import material
from tests.physics.worlds import DOUBLE, gaits, turned

LOOKS_BACK = Engine(continuous=True)
FLAT = 5.0  # height of flat ground [m]
SLOPE = math.radians(20)


def lowest(sim: Simulator) -> Tensor:
    """Height of the lowest corner of each square over flat ground [m], (V, 4)."""
    _, y, angle = sim.mass_poses()[0].unbind(-1)
    reach = material.SQUARE_HALF * (angle.cos().abs() + angle.sin().abs())
    return y - reach - FLAT


def falling(engine: Engine, turn: float = 0.0, sideways: float = 0.0) -> Simulator:
    sim = Simulator("box-1x1", Terrain.from_name("flat"), dtype=DOUBLE, engine=engine)
    poses = turned(sim.mass_poses(), turn)
    poses[..., 0] += 20.0
    velocities = torch.zeros_like(poses)
    velocities[..., 0] = sideways
    sim.set_poses(poses, velocities)
    return sim


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_a_landing_square_is_as_deep_as_one_at_rest(turn):
    depths = {}
    for engine in (Engine(), LOOKS_BACK):
        sim = falling(engine, turn)
        while not bool(sim.touching().any()):
            sim.step(torch.zeros(1, 1))
        depths[engine.continuous] = -lowest(sim).min().item()
    assert depths[True] == pytest.approx(material.LINEAR_TOLERANCE, abs=1e-6)
    assert depths[False] > 2 * material.LINEAR_TOLERANCE


def test_it_is_set_back_along_its_way_and_keeps_its_velocity():
    plain, ours = falling(Engine(), sideways=3.0), falling(LOOKS_BACK, sideways=3.0)
    while not bool(plain.touching().any()):
        before = ours.mass_poses()[0, 0]
        for sim in (plain, ours):
            sim.step(torch.zeros(1, 1))
    for corner in (2, 3):  # SE, SW
        start, end = before[corner], plain.mass_poses()[0, 0, corner]
        height = start[1] - material.SQUARE_HALF - FLAT
        part = height / (start[1] - end[1])  # of the step, until it touches
        expected = start + part * (end - start)
        expected[1] -= material.LINEAR_TOLERANCE
        assert torch.allclose(ours.mass_poses()[0, 0, corner], expected, atol=1e-9)
    upper = (0, 1)  # squares that touch nothing stay where they are
    assert torch.equal(ours.mass_poses()[0, 0, upper], plain.mass_poses()[0, 0, upper])
    assert torch.equal(ours.mass_velocities(), plain.mass_velocities())


def test_on_a_slope_it_sinks_along_the_normal():
    rise = math.tan(SLOPE)
    slope = Terrain.from_profile([0.0, 1000.0], [0.0, 1000.0 * rise])
    sim = Simulator("box-1x1", slope, dtype=DOUBLE, engine=LOOKS_BACK)
    poses = turned(sim.mass_poses(), SLOPE)
    poses[..., 1] += 1.0
    sim.set_poses(poses)
    while not bool(sim.touching().any()):
        sim.step(torch.zeros(1, 1))
    centre = sim.mass_poses()[0, 0, 2:, :2]  # the lower squares lie flat on the slope
    heights = (centre[:, 1] - rise * centre[:, 0]) * math.cos(SLOPE) - material.SQUARE_HALF
    assert heights.tolist() == pytest.approx([-material.LINEAR_TOLERANCE] * 2, abs=1e-6)


def test_robots_that_stand_are_left_alone():
    """The worm is at rest from the start on, so none of its squares ever lands."""
    sims = []
    for engine in (Engine(), LOOKS_BACK):
        sim = Simulator("worm-3x1", Terrain.from_name("flat"), dtype=DOUBLE, engine=engine)
        poses = sim.mass_poses()
        poses[..., 1] += FLAT + material.SQUARE_HALF - 0.005 - poses[..., 1].min()
        sim.set_poses(poses)
        sim.run(0.02 * gaits(60, 1, 3))
        sims.append(sim)
    assert bool(sims[0].touching().all())
    assert torch.equal(sims[0].mass_poses(), sims[1].mass_poses())


@pytest.mark.long
def test_worlds_do_not_influence_each_other():
    actuations = gaits(90, 20, 10)
    terrains = [Terrain.from_name(f"hilly-3-30-{seed}") for seed in range(20)]
    ends = []
    for chosen, lanes in ((range(20), 16), (range(20), 8), (range(11, 12), 1)):
        sim = Simulator(
            "biped-4x3",
            [terrains[world] for world in chosen],
            len(chosen),
            engine=LOOKS_BACK,
            lanes=lanes,
        )
        sim.run(actuations[:, list(chosen)])
        ends.append(sim.mass_poses())
    assert torch.equal(ends[0], ends[1])
    assert torch.equal(ends[0][11:12], ends[2])
    plain = Simulator("biped-4x3", terrains, 20)
    plain.run(actuations)
    assert not torch.equal(ends[0], plain.mass_poses())
