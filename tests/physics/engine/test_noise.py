"""Noise of the readings: its distribution, its independence, and what decides it."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from scipy import stats

from physics import Apparatus, Damage, Sensor, Simulator
from tests.physics.worlds import DOUBLE

SIGMA = 0.1
WORLDS = 2000
# Five readings of each voxel: an odd number, and pairs that lie across two sensors.
FIVE = Apparatus(((Sensor("area"), Sensor("touch"), Sensor("lidar", angles=(-45, 0, 45))),))


def noise(
    steps: int,
    seed: int | list[int] = 0,
    dtype: torch.dtype = DOUBLE,
    sigma: float = SIGMA,
    worlds: int = WORLDS,
) -> np.ndarray:
    """Noise over sigma of voxels at rest in empty space, at the start and after each step: readings
    less those without noise, (1 + steps, worlds, 5)."""
    at_rest = torch.tensor([0.5, 0.0, 1.0, 1.0, 1.0], dtype=DOUBLE)
    sim = Simulator(
        "box-1x1",
        None,
        worlds,
        gravity=0.0,
        sensors=FIVE,
        noise=sigma,
        seed=seed,
        dtype=dtype,
    )
    readings = [sim.reset()]
    readings += [sim.step(torch.zeros(worlds, 1)) for _ in range(steps)]
    return ((torch.stack(readings).double() - at_rest) / sigma).numpy()


def correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])


def test_noise_is_standard_normal():
    """100,000 samples; each limit is five standard errors, or a p-value of 1e-4."""
    samples = noise(9).ravel()
    n = samples.size
    assert abs(samples.mean()) < 5 / math.sqrt(n)
    assert abs(samples.std() - 1) < 5 / math.sqrt(2 * n)
    assert abs(stats.skew(samples)) < 5 * math.sqrt(6 / n)
    assert abs(stats.kurtosis(samples)) < 5 * math.sqrt(24 / n)
    assert stats.kstest(samples, "norm").pvalue > 1e-4
    assert 3.9 < np.abs(samples).max() < 5.9  # the tails are there, up to 2^-25 of the draws


def test_every_reading_and_every_step_is_standard_normal():
    samples = noise(9)
    for axis in ((1,), (1, 2), (0, 1)):  # per step and reading, per step, per reading
        n = np.prod([samples.shape[k] for k in axis])
        assert np.abs(samples.mean(axis)).max() < 5 / math.sqrt(n)
        assert np.abs(samples.std(axis) - 1).max() < 5 / math.sqrt(2 * n)


@pytest.mark.parametrize("power", [1, 2])
def test_readings_steps_and_worlds_are_independent(power):
    """Neither values nor their sizes are correlated; limits are five standard errors."""
    samples = noise(9) ** power
    pairs = [(samples[..., i], samples[..., j]) for i in range(5) for j in range(i)]
    pairs += [(samples[lag:], samples[:-lag]) for lag in (1, 2)]
    pairs += [(samples[:, lag:], samples[:, :-lag]) for lag in (1, 2, 8)]
    pairs += [(samples[1:, :, 1:], samples[:-1, :, :-1])]
    for a, b in pairs:
        assert abs(correlation(a, b)) < 5 / math.sqrt(a.size)


def test_no_number_comes_twice():
    """Different seeds, steps and readings use different parts of the generator."""
    samples = np.concatenate([noise(9, seed=s, worlds=200).ravel() for s in (0, 1)])
    assert np.unique(samples.astype(np.float32)).size > 0.999 * samples.size


def test_noise_scales_with_sigma():
    fine, coarse = noise(2, sigma=0.01, worlds=64), noise(2, sigma=3.0, worlds=64)
    assert fine == pytest.approx(coarse, abs=1e-9)


def test_both_precisions_see_the_same_noise():
    assert noise(2, dtype=torch.float32, worlds=64) == pytest.approx(noise(2, worlds=64), abs=1e-5)


def test_a_seed_decides():
    assert np.array_equal(noise(1, seed=4, worlds=8), noise(1, seed=4, worlds=8))
    assert abs(correlation(noise(1, seed=4), noise(1, seed=5))) < 5 / math.sqrt(2 * 5 * WORLDS)


def test_a_worlds_own_seed_decides_wherever_it_stands():
    """Including seeds beyond 32 bits, and equal ones."""
    seeds = [7, 2**40 + 7, 7, 2**63, 0]
    together = noise(2, seed=seeds, worlds=5)
    for world, seed in enumerate(seeds):
        assert np.array_equal(together[:, world], noise(2, seed=[seed], worlds=1)[:, 0])
    assert np.array_equal(together[:, 0], together[:, 2])
    assert len({together[0, world, 0] for world in range(5)}) == 4


def test_random_damage_and_noise_are_independent():
    """Both are drawn from a world's seed and step."""
    sim = Simulator(
        "box-1x1",
        None,
        WORLDS,
        gravity=0.0,
        sensors=FIVE,
        noise=SIGMA,
        damage=Damage(probability=1.0, time=0.0, mode="random"),
        dtype=DOUBLE,
    )
    at_rest = torch.tensor([0.5, 0.0, 1.0, 1.0, 1.0], dtype=DOUBLE)
    readings = ((sim.reset() - at_rest) / SIGMA).numpy()
    sim.step(torch.zeros(WORLDS, 1))
    actuation = sim.actuation()[:, 0].numpy()
    for reading in readings.T:
        assert abs(correlation(reading, actuation)) < 5 / math.sqrt(WORLDS)
        assert abs(correlation(np.abs(reading), actuation)) < 5 / math.sqrt(WORLDS)
