"""Long runs: statistics of recorded gaits, and robots driven as hard as can be."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.stats import spearmanr

from physics import Morphology, Simulator, Terrain
from physics.scene.clock import steps_in, times
from tests.physics.worlds import gaits
from tests.reference import load


def mean_speeds(robot: str, shape: str, ground: str, starts: int) -> np.ndarray:
    """Our speeds in the recorded gaits of 30 s, averaged over slightly shifted starts, (100,)."""
    record, t = load(f"random_gaits_{robot}"), times(steps_in(30.0))
    phase = 2 * np.pi * record["frequency"][:, None] * t[:-1, None, None] + record["phase"]
    waves = np.tile(record["amplitude"] * np.sin(phase), (1, starts, 1))
    names = [f"hilly-3-30-{i % 20}" if ground == "hilly" else ground for i in range(100)]
    terrains_met = {name: Terrain.from_name(name) for name in names}
    sim = Simulator(shape, [terrains_met[name] for name in names] * starts, 100 * starts)
    poses = sim.mass_poses()
    poses[..., 0] += 4e-6 * torch.arange(starts).repeat_interleave(100)[:, None, None]
    sim.set_poses(poses)
    sim.step(torch.zeros(100 * starts, sim.n_voxels))
    first = sim.center_of_mass()[:, 0].double()
    sim.run(torch.from_numpy(waves))
    gone = sim.center_of_mass()[:, 0].double() - first
    return (gone / (t[-1] - t[0])).reshape(starts, 100).mean(0).numpy()


@pytest.mark.parametrize("ground", ["flat", "hilly"])
def test_random_gaits_of_the_worm(ground):
    """Against the reference without its false collision events. Slightly wrong engines fall out:
    4 velocity iterations or friction 1.2 give a mean error of 0.03 m/s, no ropes 0.021."""
    ours = mean_speeds("worm", "worm-7x1", ground, starts=1)
    theirs = load("random_gaits_worm")[ground][:, 2]
    assert spearmanr(ours, theirs).statistic > 0.975
    assert np.abs(ours - theirs).mean() < 0.02


def test_random_gaits_of_the_biped():
    """It is chaotic: means over four starts, against the mean of four recorded variants. The
    wrong engines: no ropes gives a correlation of 0.59, friction 1.0 an error of 0.12 m/s."""
    ours = mean_speeds("biped", "biped-4x3", "hilly", starts=4)
    theirs = load("random_gaits_biped")["hilly"].mean(1)
    assert spearmanr(ours, theirs).statistic > 0.92
    assert np.abs(ours - theirs).mean() < 0.10
    assert abs((ours - theirs).mean()) < 0.03


@pytest.mark.parametrize(
    "shape", ["box-1x1", "worm-7x1", "biped-4x3", "comb-7x2", "T-5x4", "ball-5", "box-10x10"]
)
def test_robots_survive_full_amplitude_at_random(shape):
    """5 s of +1 and -1 at random, new every half second or at every step, on hills."""
    voxels = Morphology.of(shape).n_voxels
    terrains = [Terrain.from_name(f"hilly-3-30-{seed}") for seed in range(8)]
    sim = Simulator(shape, terrains, 8, sensors="high")
    random = torch.Generator().manual_seed(1)
    signs = torch.randint(0, 2, (300, 8, voxels), generator=random).float() * 2 - 1
    signs[:, :4] = signs[::30, :4].repeat_interleave(30, 0)
    for part in signs.split(60):
        readings = sim.run(part)
        poses = sim.mass_poses()
        assert torch.isfinite(readings).all()
        assert torch.isfinite(poses).all()
        assert torch.isfinite(sim.mass_velocities()).all()
        assert not sim.failed().any()
        assert sim.area_ratios().min() > 0.4
        assert sim.area_ratios().max() < 1.6
        for world, terrain in enumerate(terrains):
            x, y, _ = poses[world].unbind(-1)
            assert (y.numpy() - terrain.height(x.numpy())).min() > 0.2  # 0.595 at rest
        assert sim.mass_velocities().abs().max() < 60.0


def test_a_minute_in_single_precision_keeps_its_geometry():
    """After a minute of a gait, at rest again, welds hold and voxels have their area, also far
    from the origin, where float32 tells 0.06 mm."""
    sim = Simulator("biped-4x3", Terrain.from_name("flat"), 8)
    poses = sim.mass_poses()
    poses[..., 0] += torch.linspace(0.0, 900.0, 8)[:, None, None]
    sim.set_poses(poses)
    sim.run(gaits(steps_in(60.0), 8, 10).float())
    sim.run(torch.zeros(240, 8, 10))
    assert not sim.failed().any()
    assert (sim.area_ratios() - 1).abs().max() < 0.2
    x, y, angle = sim.mass_poses().flatten(1, 2).unbind(-1)
    for one, two in sim.morphology.welds:
        gap = torch.hypot(x[:, one] - x[:, two], y[:, one] - y[:, two])
        assert (gap - 1.2).abs().max() < 0.002
        assert torch.sin(angle[:, one] - angle[:, two]).abs().max() < 0.01
