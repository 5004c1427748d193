import numpy as np
import pytest

from physics.scene.damage import Damage


def test_a_world_breaks_as_its_seed_says_and_nothing_else():
    damage = Damage()
    masks = [damage.sample(seed, 10) for seed in range(5)]
    assert all((damage.sample(seed, 10) == mask).all() for seed, mask in enumerate(masks))
    assert len({mask.tobytes() for mask in masks}) == 5
    assert (Damage(time=5.0, mode="frozen").sample(3, 10) == masks[3]).all()


@pytest.mark.parametrize("probability", [0.0, 0.2, 0.5, 1.0])
def test_share_of_broken_voxels(probability):
    broken = np.concatenate([Damage(probability).sample(seed, 10) for seed in range(2000)])
    spread = np.sqrt(probability * (1 - probability) / len(broken))
    assert abs(broken.mean() - probability) <= 4 * spread


def test_voxels_break_independently_of_each_other_and_of_the_next_seed():
    masks = np.array([Damage().sample(seed, 4) for seed in range(4000)]) - 0.5
    correlation = np.corrcoef(np.hstack((masks[:-1], masks[1:])), rowvar=False)
    assert np.abs(correlation - np.eye(8)).max() < 0.07  # 4.4 standard errors


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"probability": 1.5}, r"probability in \[0, 1\], got 1.5"),
        ({"probability": float("nan")}, "probability"),
        ({"time": -1.0}, "time >= 0 s"),
        ({"time": float("inf")}, "finite time"),
        ({"time": 1e9}, "time: expected at most 35791393 s, which are 2.31 steps"),
        ({"until": 1e9}, "until: expected at most 35791393 s, which are 2.31 steps"),
        ({"until": 10.0}, "until > time = 30.0 s, got 10.0"),
        ({"mode": "broken"}, "mode in rest, frozen, random, blind, got 'broken'"),
    ],
)
def test_wrong_damage_is_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        Damage(**settings)


def test_seeds_are_not_negative():
    with pytest.raises(ValueError, match="seed >= 0, got -1"):
        Damage().sample(-1, 3)
