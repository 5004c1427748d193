"""Conditions of worlds: each has its own, and the usual ones change no bit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

import hebbtorch
from experiments.rollout.episode import Episode
from physics import Damage, Morphology, Simulator, Terrain
from physics.scene.material import DT, SPRING_DAMPING_RATIO, SPRING_FREQUENCY
from tests.physics.worlds import gaits

FLAT = Terrain.from_name("flat")
HILLS = Terrain.from_name("hilly-3-30-2")


def worms(n: int = 3, **settings: Any) -> Simulator:
    return Simulator("worm-2x1", HILLS, n, sensors="high", **settings)


def seen(sim: Simulator) -> Tensor:
    parts = (sim.mass_poses(), sim.mass_velocities(), sim.actuation(), sim.readings())
    return torch.cat([part.flatten(1) for part in parts], 1)


# --- of every world -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "usual", "other"),
    [
        ("gravity", 9.8, 1.6),
        ("friction", math.sqrt(2), 0.3),
        ("spring_frequency", SPRING_FREQUENCY, 4.0),
        ("spring_damping", SPRING_DAMPING_RATIO, 0.8),
    ],
)
def test_worlds_have_conditions_of_their_own(name: str, usual: float, other: float) -> None:
    """Those with the usual ones move as in a batch where all have them, bit for bit; the others
    as in a batch where all are like them."""
    actuations = gaits(90, 3, 2).float()
    mixed, common = worms(**{name: [usual, other, usual]}), worms()
    for sim in (mixed, common):
        sim.run(actuations)
    assert torch.equal(seen(mixed)[[0, 2]], seen(common)[[0, 2]])
    assert not torch.equal(seen(mixed)[1], seen(common)[1])
    alike = worms(**{name: other})
    alike.run(actuations)
    assert torch.equal(seen(alike)[1], seen(mixed)[1])
    again = worms(**{name: [usual, other, usual]})
    again.run(actuations)
    again.reset(torch.tensor([True, True, False]))
    again.run(actuations)
    assert torch.equal(seen(again)[:2], seen(mixed)[:2])


def test_each_world_falls_by_its_own_gravity() -> None:
    gravity = [0.0, 1.6, 9.8, -1.0]
    sim = Simulator("box-1x1", None, 4, gravity=gravity)
    sim.run(torch.zeros(60, 4, 1))
    heights = sim.center_of_mass()[:, 1].numpy()
    assert heights / heights[2] == pytest.approx(np.array(gravity) / 9.8, abs=1e-4)


def test_friction_decides_whether_a_robot_slides_down_a_slope() -> None:
    """A slope of 20 degrees holds a robot at rest if friction is over its tangent."""
    slope = Terrain.from_name("downhill-20")
    limit = math.tan(math.radians(20))
    sim = Simulator("box-2x1", slope, 2, friction=[0.7 * limit, 1.3 * limit])
    sim.run(torch.zeros(120, 2, 2))
    start = sim.center_of_mass()
    sim.run(torch.zeros(60, 2, 2))
    way = (sim.center_of_mass() - start).norm(dim=1)
    assert way[0] > 1.0
    assert way[1] < 0.05


def test_springs_give_way_by_the_square_of_their_period() -> None:
    sim = Simulator("box-1x2", FLAT, 2, spring_frequency=[8.0, 4.0], spring_damping=1.0)
    sim.run(torch.zeros(600, 2, 2))
    sag = 3.0 - (sim.voxel_centers()[:, 1, 1] - sim.voxel_centers()[:, 0, 1])
    assert sag[1] / sag[0] == pytest.approx(4.0, rel=0.1)


# --- noise --------------------------------------------------------------------------------------


def test_noise_of_each_kind_of_sensor() -> None:
    sigma = {"area": 0.1, "lidar": 0.01}
    still, noisy = worms(), worms(noise=sigma)
    for sim in (still, noisy):
        sim.run(torch.zeros(20, 3, 2))
    same = still.readings() == noisy.readings()
    kinds = np.array(still.sensor_kinds)
    assert same[:, np.isin(kinds, ["touch", "velocity"])].all()
    assert not same[:, np.isin(kinds, ["area", "lidar"])].any()
    all_alike = worms(noise=0.1)
    all_alike.run(torch.zeros(20, 3, 2))
    assert torch.equal(
        all_alike.readings()[:, kinds == "area"], noisy.readings()[:, kinds == "area"]
    )


# --- control ------------------------------------------------------------------------------------


@pytest.mark.parametrize("delay", [1, 3])
@pytest.mark.parametrize("interval", [1, 4])
def test_commands_wait_for_the_delay(delay: int, interval: int) -> None:
    actuations = gaits(12, 3, 2).float()
    late = worms(control_delay=delay, control_interval=interval)
    late.run(actuations)
    waiting = torch.cat([torch.zeros(delay, 3, 2), actuations[:-delay]])
    shifted = worms(control_interval=interval)
    shifted.run(waiting)
    assert torch.equal(seen(late), seen(shifted))
    late.reset()
    late.step(torch.ones(3, 2))
    assert (late.actuation() == 0).all()  # nothing is left of the last episode


def test_the_low_pass_is_of_first_order() -> None:
    cutoff = 3.0
    sim = worms(actuation_cutoff=cutoff)
    share, expected = 1 - math.exp(-2 * math.pi * cutoff * DT), torch.zeros(3, 2)
    for actuation in 2 * gaits(20, 3, 2):
        sim.step(actuation)
        expected = expected + share * (actuation.clamp(-1, 1) - expected)
        assert torch.allclose(sim.actuation(), expected.float(), atol=1e-6)


@pytest.mark.parametrize(
    "settings",
    [
        {"control_delay": 2},
        {"actuation_cutoff": 2.0},
        {"control_delay": 1, "actuation_cutoff": 5.0, "control_interval": 3, "gravity": [9, 5, 2]},
        {"noise": {"touch": 0.1}, "spring_frequency": 6.0, "damage": Damage(time=0.3)},
    ],
)
def test_a_network_in_the_kernel_acts_under_them_as_through_torch(settings: Any) -> None:
    network = hebbtorch.HebbianMLP([worms().n_readings, 2], population=(3,))
    draws = torch.Generator().manual_seed(0)
    network.set_genomes(2 * torch.rand(3, network.n_genes, generator=draws) - 1)
    outcomes = []
    for loop in ("torch", "fused"):
        sim = worms(**settings)
        outcomes.append(Episode(sim, network, 0.7, loop=loop).finish())
    one, other = outcomes
    torch.testing.assert_close(one.state.weights, other.state.weights, rtol=0, atol=1e-4)
    torch.testing.assert_close(one.speed, other.speed, rtol=0, atol=1e-3)
    assert one.state.weights[0].abs().max() > 1e-3


# --- materials ----------------------------------------------------------------------------------

BODY = [[3, 2, 4], [1, 0, 1]]


def test_bodies_of_evogym() -> None:
    shape = Morphology.from_evogym([[0, 0, 0, 0], [0, *BODY[0]], [0, *BODY[1]]])
    assert shape.grid.astype(int).tolist() == [[1, 1, 1], [1, 0, 1]]
    names = [each.name for each in shape.materials]  # from the bottom row
    assert names == ["stiff", "stiff", "actuated", "passive", "actuated"]
    assert not shape.is_uniform
    assert Morphology.from_evogym([[3, 4]]).is_uniform


def test_only_actuated_voxels_obey() -> None:
    sim = Simulator(Morphology.from_evogym(BODY), None, gravity=0.0)
    sim.run(torch.ones(120, 1, 5))
    ratios = sim.area_ratios()[0].tolist()
    assert sim.actuation()[0].tolist() == [0, 0, 1, 0, 1]
    assert ratios[2] < 0.85 > ratios[4]
    assert abs(ratios[3] - 1) < 0.1 < abs(ratios[2] - 1)
    assert ratios[0] == pytest.approx(1.0, abs=0.05)


def test_stiff_voxels_give_way_least() -> None:
    towers = [Morphology.from_evogym([[code], [code]]) for code in (1, 2, 3)]
    sags = []
    for tower in towers:
        sim = Simulator(tower, FLAT)
        sim.run(torch.zeros(600, 1, 2))
        below, above = sim.voxel_centers()[0, :, 1].tolist()
        sags.append(3.0 - (above - below))
    assert sags[1] == pytest.approx(sags[2], abs=1e-4)
    assert sags[0] < 0.2 * sags[1]


@pytest.mark.parametrize("body", [[[5]], [[-1]], [[3, 0, 3]], [[0, 0]], [3, 3], [[1.5]]])
def test_other_bodies_are_refused(body: Any) -> None:
    with pytest.raises(ValueError, match="shape: expected"):
        Morphology.from_evogym(body)


def test_plain_arrays_name_the_way_to_evogyms_codes() -> None:
    with pytest.raises(ValueError, match=r"Morphology\.from_evogym"):
        Morphology.of(np.array(BODY))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"gravity": [1.0, 2.0]}, "gravity: expected one number or 3, got 2"),
        ({"gravity": [1.0, math.nan, 2.0]}, "gravity: expected a finite number, got nan"),
        ({"friction": [-1.0, 1.0, 1.0]}, "friction: expected a finite number >= 0, got -1"),
        ({"spring_frequency": 0.0}, "spring_frequency: expected a finite number >= 0.1, got 0"),
        ({"spring_damping": "much"}, "spring_damping: expected a finite number >= 0"),
        ({"noise": {"smell": 0.1}}, "noise: expected kinds of area, touch, velocity, lidar"),
        ({"noise": {"area": -0.1}}, "noise: expected a finite number >= 0, got -0.1"),
        ({"control_delay": -1}, "control_delay: expected an integer >= 1, got -1"),
        ({"actuation_cutoff": -1.0}, "actuation_cutoff: expected a finite number >= 0"),
    ],
)
def test_bad_conditions_are_told(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        worms(**settings)
