"""The Simulator's face: shapes, names, placement, time, and errors that say what to mend."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from physics import Damage, Morphology, Simulator, Terrain
from tests.oracle.world import OracleWorld
from tests.physics.worlds import DOUBLE, FLAT, gaits, small

# --- what can be seen ---------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_shapes_and_types(dtype):
    sim = Simulator("biped-4x3", FLAT, 3, sensors="high", dtype=dtype)
    assert (sim.n_worlds, sim.n_voxels, sim.n_readings) == (3, 10, 29)
    seen = {
        sim.reset(): (3, 29),
        sim.step(torch.zeros(3, 10)): (3, 29),
        sim.run(torch.zeros(4, 3, 10)): (3, 29),
        sim.set_poses(sim.mass_poses(), sim.mass_velocities()): (3, 29),
        sim.center_of_mass(): (3, 2),
        sim.voxel_centers(): (3, 10, 2),
        sim.area_ratios(): (3, 10),
        sim.actuation(): (3, 10),
        sim.mass_poses(): (3, 10, 4, 3),
        sim.mass_velocities(): (3, 10, 4, 3),
    }
    for tensor, shape in seen.items():
        assert (tuple(tensor.shape), tensor.dtype) == (shape, dtype)
    for flags, shape in ((sim.touching(), (3, 10)), (sim.failed(), (3,))):
        assert (tuple(flags.shape), flags.dtype) == (shape, torch.bool)
    poses, velocities = sim.mass_poses(), sim.mass_velocities()
    replayed = sim.replay(poses.expand(2, 3, 10, 4, 3), velocities.expand(2, 3, 10, 4, 3))
    assert tuple(replayed.shape) == (2, 3, 29)


def test_names_and_kinds_of_readings():
    sim = Simulator("worm-7x1", FLAT, sensors="high")
    assert len(sim.sensor_names) == len(sim.sensor_kinds) == sim.n_readings == 31
    assert sim.sensor_names[:4] == ("v0_0_area", "v0_0_touch", "v0_0_vel_x", "v0_0_vel_y")
    assert sim.sensor_names[-3:] == ("v6_0_lidar_0", "v6_0_lidar_1", "v6_0_lidar_2")
    assert sim.sensor_kinds[:4] == ("area", "touch", "velocity", "velocity")
    for sensors, readings in (("medium", 20), ("low", 8)):
        assert Simulator("biped-4x3", None, sensors=sensors).n_readings == readings


def test_without_sensors_there_are_no_readings():
    sim = Simulator("worm-2x1", FLAT)
    assert sim.sensor_names == ()
    assert sim.reset() is None
    assert sim.step(torch.zeros(1, 2)) is None
    assert sim.run(torch.zeros(2, 1, 2)) is None
    assert sim.set_poses(sim.mass_poses()) is None
    assert sim.replay(sim.mass_poses()[None], sim.mass_velocities()[None]) is None


@pytest.mark.parametrize("ground", ["flat", "hilly-3-30-0", "hilly-1-3-2", "uphill-20", None])
def test_robots_are_born_where_the_reference_puts_them(ground):
    terrain = Terrain.from_name(ground) if ground else None
    sim = Simulator("biped-4x3", terrain, dtype=DOUBLE)
    assert sim.mass_poses()[0].numpy() == pytest.approx(
        OracleWorld("biped-4x3", terrain).poses(), abs=1e-12
    )
    assert (sim.mass_velocities() == 0).all()
    assert sim.area_ratios().numpy() == pytest.approx(1.0, abs=1e-12)
    assert not sim.touching().any()


def test_centres_are_means_of_squares():
    sim = Simulator("biped-4x3", FLAT, 2, dtype=DOUBLE)
    sim.run(gaits(50, 2, 10))
    centres = sim.mass_poses()[..., :2].mean(2)
    assert sim.voxel_centers().numpy() == pytest.approx(centres.numpy(), abs=1e-12)
    assert sim.center_of_mass().numpy() == pytest.approx(centres.mean(1).numpy(), abs=1e-12)


def test_time_is_the_accumulated_clock():
    sim = small()
    assert sim.time == 0.0
    sim.run(torch.zeros(1800, 2, 2))
    assert sim.time < 30.0  # 1/60 does not add up: 30 s are 1801 steps
    sim.step(torch.zeros(2, 2))
    assert sim.time == sum([1 / 60] * 1801)
    assert sim.times.tolist() == [sim.time] * 2


def test_actuation_is_clipped_and_acts_in_its_own_step():
    sim, clipped = small(), small()
    start = sim.mass_poses()
    sim.step(torch.tensor([[3.0, -7.0], [0.5, 0.0]]))
    clipped.step(torch.tensor([[1.0, -1.0], [0.5, 0.0]]))
    assert sim.actuation().tolist() == [[1.0, -1.0], [0.5, 0.0]]
    assert torch.equal(sim.mass_poses(), clipped.mass_poses())
    moved = (sim.mass_poses() - start)[..., 0].abs().amax((1, 2))
    assert (moved > 1e-3).all()


def test_poses_are_copies():
    sim, other = small(), small()
    for seen in (sim.mass_poses(), sim.mass_velocities(), sim.actuation(), sim.reset()):
        seen.fill_(9.0)
    assert torch.equal(sim.step(torch.ones(2, 2)), other.step(torch.ones(2, 2)))
    assert torch.equal(sim.mass_poses(), other.mass_poses())


@pytest.mark.parametrize("angle", [0.0, math.pi - 1e-6, math.pi + 1e-6])
def test_poses_taken_can_be_set_again(angle):
    """Also upside down, where angles told in [-pi, pi] jump by a whole turn."""
    sim = Simulator("biped-4x3", None, gravity=0.0, dtype=DOUBLE)
    poses = sim.mass_poses()
    half = torch.tensor([-1.0, -1.0, 1.0]) if angle else torch.ones(3)
    poses = poses * half
    poses[..., 2] = angle + 1e-3 * torch.randn(1, 10, 4, generator=torch.Generator().manual_seed(0))
    other = Simulator("biped-4x3", None, gravity=0.0, dtype=DOUBLE)
    sim.set_poses(poses)
    other.set_poses(sim.mass_poses())
    for _ in range(5):
        sim.step(torch.zeros(1, 10))
        other.step(torch.zeros(1, 10))
    difference = sim.mass_poses() - other.mass_poses()
    assert difference[..., :2].abs().max() < 1e-9
    assert (sim.mass_poses() - poses)[..., :2].abs().max() < 0.01


def test_a_shape_may_be_drawn():
    drawn = Simulator([[1, 1, 1, 1], [1, 1, 1, 1], [1, 0, 0, 1]], FLAT, dtype=DOUBLE)
    named = Simulator(Morphology.from_name("biped-4x3"), FLAT, dtype=DOUBLE)
    actuations = gaits(20, 1, 10)
    for sim in (drawn, named):
        sim.run(actuations)
    assert torch.equal(drawn.mass_poses(), named.mass_poses())


def test_gravity_points_down():
    heights = []
    for gravity in (0.0, 1.6, 9.8, -1.0):
        sim = Simulator("box-1x1", None, gravity=gravity, dtype=DOUBLE)
        sim.run(torch.zeros(60, 1, 1))
        heights.append(sim.center_of_mass()[0, 1].item())
    assert heights[0] == 0.0
    assert heights[3] > 0.0
    assert np.array(heights[1:]) / heights[2] == pytest.approx([1.6 / 9.8, 1.0, -1.0 / 9.8])


# --- the process around it ------------------------------------------------------------------------


LOOKS = (
    *("readings", "actuation", "area_ratios", "center_of_mass", "failed"),
    *("mass_poses", "mass_velocities", "touching", "voxel_centers"),
)


def test_what_is_seen_belongs_to_the_caller():
    """Also where a view of the state would have the right shape and order."""
    for shape, lanes in (("box-1x1", None), ("worm-2x1", 1)):
        sim = Simulator(shape, FLAT, 3, sensors="low", lanes=lanes, threads=1)
        sim.run(torch.zeros(60, 3, sim.n_voxels))
        looks = [getattr(Simulator, name) for name in LOOKS]
        kept = [look(sim) for look in looks]
        before = [values.clone() for values in kept]
        sim.run(torch.ones(30, 3, sim.n_voxels))
        assert all(torch.equal(*pair) for pair in zip(kept, before, strict=True))
        now = [look(sim) for look in looks]
        for values in kept:
            values.fill_(1)
        assert all(torch.equal(look(sim), seen) for look, seen in zip(looks, now, strict=True))


def test_worlds_outlive_inference_mode():
    actions = torch.ones(5, 2, 2)
    expected = small()
    with torch.inference_mode():
        sim = small()
        sim.run(actions)
        sim.reset()
    sim.run(actions)
    expected.run(actions)
    expected.reset()
    expected.run(actions)
    assert torch.equal(sim.mass_poses(), expected.mass_poses())
    one = torch.tensor([True, False])
    for each in (sim, expected):
        each.reset(one)
        each.set_poses(each.mass_poses(), each.mass_velocities())
    assert torch.equal(sim.readings(), expected.readings())


def test_poses_that_require_a_gradient_leave_no_graph():
    sim = small()
    sim.set_poses(sim.mass_poses().requires_grad_(), sim.mass_velocities().requires_grad_())
    assert not sim.mass_poses().requires_grad


def test_defaults_of_the_process_change_nothing(monkeypatch):
    def end() -> torch.Tensor:
        sim = Simulator(
            "worm-2x1", [FLAT, Terrain.from_name("hilly-3-30-1")], 2, sensors="low", noise=0.1,
            damage=Damage(time=0.1), lifetime=[0.3, 0.5], seed=[3, 4],
        )  # fmt: skip
        actions = torch.full((20, 2, 2), 0.5, dtype=torch.float32, device="cpu")
        sim.run(actions)
        sim.reset(torch.tensor([True, False], device="cpu"), seeds=[9])
        sim.run(actions)
        sim.set_poses(sim.mass_poses(), sim.mass_velocities())
        return torch.cat([sim.readings().flatten(), sim.mass_poses().flatten(), sim.times])

    expected = end()
    torch.set_default_dtype(torch.float64)
    torch.set_default_device("meta")
    try:
        found = end()
    finally:
        torch.set_default_device(None)
        torch.set_default_dtype(torch.float32)
    assert torch.equal(found, expected)


def test_numbers_of_numpy_and_pytorch_are_numbers():
    sim = Simulator(
        "worm-2x1",
        FLAT,
        np.array(2),
        sensors="low",
        noise=np.float32(0.5),
        gravity=np.array(9.8),
        seed=np.array(3),
        lifetime=torch.tensor(2.0),
        threads=np.int64(1),
        lanes=torch.tensor(8),
    )
    plain = Simulator(
        "worm-2x1", FLAT, 2, sensors="low", noise=0.5, seed=3, lifetime=2.0, threads=1, lanes=8
    )
    assert torch.equal(sim.step(torch.ones(2, 2)), plain.step(torch.ones(2, 2)))
    sim.reset(seeds=np.array(4))
