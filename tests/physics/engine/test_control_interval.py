"""A control step of several engine steps: one actuation, sensors and damage as without it."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

import hebbtorch
from experiments.rollout.episode import Episode
from physics import Damage, Engine, Simulator, Terrain
from tests.physics.worlds import gaits

INTERVAL = 6
WORLDS = 3
HILLS = Terrain.from_name("hilly-3-30-2")


def worlds(interval: int, damage: Damage | None = None) -> Simulator:
    return Simulator(
        "worm-2x1",
        HILLS,
        WORLDS,
        sensors="high",
        noise=0.1,
        damage=damage,
        control_interval=interval,
    )


def seen(sim: Simulator) -> Tensor:
    parts = (sim.mass_poses(), sim.mass_velocities(), sim.actuation(), sim.readings())
    return torch.cat([part.flatten(1) for part in parts], 1)


@pytest.mark.parametrize("mode", ["rest", "frozen", "random", "blind"])
def test_a_control_step_is_its_engine_steps(mode):
    """Also where voxels break, and work again, in the middle of a control step."""
    damage = Damage(probability=0.5, time=20 / 60, until=40 / 60, mode=mode)
    actuations = gaits(10, WORLDS, 2).float()
    slow, fast = worlds(INTERVAL, damage), worlds(1, damage)
    for actuation in actuations:
        slow.step(actuation)
        for _ in range(INTERVAL):
            fast.step(actuation)
        assert torch.equal(seen(slow), seen(fast))
        assert slow.time == fast.time
    at_once = worlds(INTERVAL, damage)
    at_once.run(actuations)
    assert torch.equal(seen(at_once), seen(slow))


@pytest.mark.parametrize("mode", ["rest", "frozen", "random"])
def test_a_network_in_the_kernel_acts_once_per_control_step(mode):
    """It acts and learns as the loop through torch does, whatever breaks meanwhile."""
    damage = Damage(probability=0.5, time=20 / 60, until=40 / 60, mode=mode)
    network = hebbtorch.HebbianMLP([worlds(1).n_readings, 2], population=(WORLDS,))
    draws = torch.Generator().manual_seed(0)
    network.set_genomes(2 * torch.rand(WORLDS, network.n_genes, generator=draws) - 1)
    ends, speeds = [], []
    for loop in ("torch", "fused"):
        sim = worlds(INTERVAL, damage)
        result = Episode(sim, network, 1.05, loop=loop).finish()
        assert sim.time == pytest.approx(66 / 60)  # 11 control steps, the last one in full
        ends.append(result.state.weights[0])
        speeds.append(result.speed)
    torch.testing.assert_close(ends[1], ends[0], rtol=0, atol=1e-4)
    torch.testing.assert_close(speeds[1], speeds[0], rtol=0, atol=1e-3)
    assert ends[0].abs().max() > 1e-3


def test_friction_is_that_of_the_engine():
    by_itself = Simulator("worm-2x1", HILLS, friction=0.3)
    of_the_engine = Simulator("worm-2x1", HILLS, engine=Engine(friction=0.3))
    other = Simulator("worm-2x1", HILLS)
    for sim in (by_itself, of_the_engine, other):
        sim.run(gaits(90, 1, 2).float())
    assert torch.equal(seen(by_itself), seen(of_the_engine))
    assert not torch.equal(seen(by_itself), seen(other))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"control_interval": 0}, "control_interval: expected an integer >= 1, got 0"),
        ({"control_interval": 1.5}, "control_interval: expected an integer >= 1, got 1.5"),
        ({"friction": -1.0}, "friction: expected a finite number >= 0, got -1.0"),
        ({"friction": 1.0, "engine": Engine(friction=0.5)}, "friction: expected it once"),
    ],
)
def test_bad_settings_are_told(settings, message):
    with pytest.raises(ValueError, match=message):
        Simulator("worm-2x1", HILLS, **settings)
