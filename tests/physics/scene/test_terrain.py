import math

import numpy as np
import pytest

from physics.scene.java_random import JavaRandom, java_gaussian_pairs
from physics.scene.terrain import Terrain
from tests.reference import load


def test_named_terrains_are_the_recorded_ones():
    recorded = load("terrains")
    assert len(recorded) == 25
    for name, (xs, ys) in recorded.items():
        terrain = Terrain.from_name(name)
        assert terrain.name == name
        np.testing.assert_allclose(terrain.xs, xs, rtol=0, atol=1e-9)
        np.testing.assert_allclose(terrain.ys, ys, rtol=0, atol=1e-9)


def java_gaussians(seed, count):
    """java.util.Random, one number at a time, as its public documentation states it."""
    state = (seed ^ 0x5DEECE66D) & ((1 << 48) - 1)

    def bits(n):
        nonlocal state
        state = (state * 0x5DEECE66D + 0xB) & ((1 << 48) - 1)
        return state >> (48 - n)

    def uniform():
        return ((bits(26) << 27) + bits(27)) / (1 << 53)

    numbers = []
    while len(numbers) < count:
        v1, v2 = 2 * uniform() - 1, 2 * uniform() - 1
        s = v1 * v1 + v2 * v2
        if 0 < s < 1:
            scale = math.sqrt(-2 * math.log(s) / s)
            numbers += [v1 * scale, v2 * scale]
    return numbers[:count]


@pytest.mark.parametrize("seed", [0, 42, 123456789012])
def test_normal_numbers_are_those_of_java(seed):
    (first,), (second,), (pairs,) = java_gaussian_pairs([seed], 300)
    first, second = first[:pairs], second[:pairs]
    numbers = np.stack((first, second), axis=1).ravel()
    assert 400 < len(numbers) <= 600
    assert numbers == pytest.approx(java_gaussians(seed, len(numbers)), abs=1e-13)


@pytest.mark.parametrize("name", ["hilly-3-30", "hilly-0.5-1", "steppy-1-5", "flatWithStart"])
def test_terrains_drawn_together_are_those_drawn_alone(name):
    seeds = [7, 0, 123456789012, 7, *range(20, 40)]
    for seed, terrain in zip(seeds, Terrain.from_open_name(name, seeds), strict=True):
        alone = Terrain.from_name(f"{name}-{seed}")
        assert terrain.name == alone.name
        assert np.array_equal(terrain.xs, alone.xs)
        assert np.array_equal(terrain.ys, alone.ys)


@pytest.mark.parametrize("name", ["hilly-3-30-7", "flat", "uphill-10", "hilly-3"])
def test_only_open_names_take_seeds(name):
    assert Terrain.from_open_name("hilly-3-30", []) == []
    with pytest.raises(ValueError, match=f"expected a name without its seed, .* got '{name}'"):
        Terrain.from_open_name(name, [1])


def test_short_bumps_reach_the_end_too():
    """Steps are at least 1 m long; here some 1,900 of them, drawn in several goes."""
    terrain = Terrain.from_name("hilly-0.5-1-3")
    g = java_gaussians(3, 4000)
    xs, ys = [10.0], [0.0]
    for across, up in zip(g[0::2], g[1::2], strict=True):
        if xs[-1] >= 1990:
            break
        xs.append(xs[-1] + max(1.0, (across * 0.25 + 1.0) * 1.0))
        ys.append(ys[-1] + up * 0.5)
    assert terrain.xs[1:-1] == pytest.approx(xs, abs=1e-9)
    assert terrain.ys[1:-1] == pytest.approx(ys, abs=1e-9)


def test_steppy_is_level_treads_each_with_a_ramp_behind_it():
    terrain = Terrain.from_name("steppy-1.5-4-4")
    g = java_gaussians(4, 2000)
    xs, ys = [10.0], [0.0]
    for across, up in zip(g[0::2], g[1::2], strict=True):
        if xs[-1] >= 1990:
            break
        xs += [xs[-1] + max(1.0, (across * 0.25 + 1.0) * 4.0)]
        xs += [xs[-1] + 0.5]
        ys += [ys[-1], ys[-1] + up * 1.5]
    assert terrain.xs[1:-1] == pytest.approx(xs, abs=1e-9)
    assert terrain.ys[1:-1] == pytest.approx(ys, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "start", "end"),  # as recorded
    [
        ("uphill-5", 5.0, 177.56837064036316),
        ("downhill-10.0", 348.82339178052206, 5.0),
    ],
)
def test_slopes(name, start, end):
    terrain = Terrain.from_name(name)
    x = np.array([10.0, 1000.0, 1990.0])
    assert terrain.height(x) == pytest.approx([start, (start + end) / 2, end], abs=1e-9)
    walls = terrain.ys[0] - terrain.ys[1], terrain.ys[-1] - terrain.ys[-2]
    assert walls == pytest.approx((95.0, 95.0), abs=1e-9)


def test_random_integers_and_uniform_numbers_are_those_of_java():
    """Published values of java.util.Random(42): nextInt(10) twice; nextDouble()."""
    numbers = JavaRandom(42)
    assert [numbers.below(10), numbers.below(10)] == [0, 3]
    assert JavaRandom(42).uniform() == pytest.approx(0.7275636800328681, abs=1e-16)


def test_flat_with_start_is_tilted_under_the_robot_and_then_level():
    tilts = []
    for seed in range(40):
        terrain = Terrain.from_name(f"flatWithStart-{seed}")
        assert terrain.xs.tolist() == [0.0, 10.0, 34.0, 1990.0, 2000.0]
        assert terrain.ys[2:4].tolist() == [5.0, 5.0]
        tilts.append(math.degrees(math.asin((terrain.ys[1] - 5.0) / 24.0)))
    assert -10 < min(tilts) < -7 < 7 < max(tilts) < 10


def test_heights_lie_on_the_segments():
    terrain = Terrain.from_profile([0, 2, 3], [1.0, 5.0, -1.0])
    assert terrain.height([[-1, 0, 1], [2.5, 3, 9]]).tolist() == [[1, 1, 3], [2, -1, -1]]


def test_a_terrain_cannot_be_changed():
    ys = np.zeros(3)
    terrain = Terrain.from_profile([0, 1, 2], ys)
    ys[0] = 7.0
    assert terrain.ys[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        terrain.ys[0] = 1.0


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("hills-3-30-0", "expected one of flat, hilly-h-w-seed.* got 'hills-3-30-0'"),
        ("", "expected one of"),
        (None, "expected one of"),
        ("hilly-3-30", r"expected hilly-h-w-seed \(3 field\(s\)\), got 'hilly-3-30' \(2"),
        ("flat-1", r"expected flat \(0 field"),
        ("hilly-3-0-1", "expected w = a length > 0"),
        ("hilly-3-30-1.5", "expected seed = an integer >= 0, got '1.5'"),
        ("hilly-three-30-1", "expected h = a height"),
        ("hilly-nan-30-1", "expected h = a height"),
        ("hilly- 3-30-1", "expected h = a height"),
        ("hilly-3_0-30-1", "expected h = a height"),
        ("hilly-\u0663-30-1", "expected h = a height"),  # another script's three
        ("hilly-3-30-1\n", "expected seed = an integer"),
        ("hilly-3-30-1_0", "expected seed = an integer"),
        ("hilly-1e308-30-0", "expected coordinates within 1e.07 m"),
        ("hilly-3-1e300-0", "expected coordinates within 1e.07 m"),
        ("uphill-90", "expected a = an angle"),
    ],
)
def test_unknown_names_are_refused(name, message):
    with pytest.raises(ValueError, match=message):
        Terrain.from_name(name)


@pytest.mark.parametrize(
    ("xs", "ys", "message"),
    [
        ([0.0], [0.0], "of one length >= 2"),
        ([0, 1], [0, 1, 2], r"got shapes \(2,\) and \(3,\)"),
        ([0, 2, 2], [0, 0, 0], r"increasing xs, got xs\[1\] = 2.0, xs\[2\] = 2.0"),
        ([0, 1], [0, float("nan")], "finite"),
        ([0, float("inf")], [0, 0], "finite"),
    ],
)
def test_odd_profiles_are_refused(xs, ys, message):
    with pytest.raises(ValueError, match=message):
        Terrain.from_profile(xs, ys)


@pytest.mark.parametrize(
    ("name", "full"),
    [
        ("hilly-3-30", "hilly-3-30-5"),
        ("hilly-3-30-7", "hilly-3-30-7"),
        ("steppy-1-10", "steppy-1-10-5"),
        ("flatWithStart", "flatWithStart-5"),
        ("flatWithStart-7", "flatWithStart-7"),
        ("uphill-10", "uphill-10"),
        ("flat", "flat"),
    ],
)
def test_a_seed_is_added_where_the_name_leaves_it_open(name: str, full: str) -> None:
    assert Terrain.from_name(name, seed=5).name == full
    profile, whole = Terrain.from_name(name, seed=5), Terrain.from_name(full)
    assert np.array_equal(profile.xs, whole.xs)
    assert np.array_equal(profile.ys, whole.ys)


@pytest.mark.parametrize("name", ["hilly-3-30", "flatWithStart"])
def test_an_open_name_needs_a_seed(name: str) -> None:
    with pytest.raises(ValueError, match="terrain: expected .*seed"):
        Terrain.from_name(name)


@pytest.mark.parametrize("name", ["hilly-3", "uphill", "mountain", ""])
def test_a_seed_does_not_complete_a_wrong_name(name: str) -> None:
    with pytest.raises(ValueError, match="terrain: expected"):
        Terrain.from_name(name, seed=5)
