"""Seeds: functions of what they are for, apart from each other."""

import numpy as np
import pytest

from experiments.rollout import Scenarios, seeds
from physics import Terrain


def test_a_seed_never_changes() -> None:
    # Recorded once: another value would silently turn every experiment into another one.
    assert seeds.derive(0, "terrain", 1, 0) == 5_673_172_075_150_970_713
    assert seeds.terrain_seed(0, 1, 0) == 1_807_772_377


def test_every_purpose_and_index_has_its_own_seed() -> None:
    keys = [
        (run, purpose, generation, individual)
        for run in range(3)
        for purpose in ("terrain", "world", "init")
        for generation in range(1, 20)
        for individual in range(40)
    ]
    drawn = [seeds.derive(*key) for key in keys]
    assert len(set(drawn)) == len(keys)
    assert all(0 <= seed < 2**63 for seed in drawn)


def test_indices_do_not_run_into_each_other() -> None:
    assert seeds.derive(1, "world", 11, 1) != seeds.derive(1, "world", 1, 11)
    assert seeds.derive(1, "world", 11, 1) != seeds.derive(1, "world", 1, 1, 1)


def test_evolution_never_meets_an_unseen_terrain() -> None:
    met = {
        seeds.terrain_seed(run, generation, individual)
        for run in range(5)
        for generation in range(1, 100)
        for individual in range(40)
    }
    assert len(met) > 0.999 * 5 * 99 * 40  # hardly any terrain is met twice
    assert not met & set(seeds.unseen_terrain_seeds(1_000_000))


def test_unseen_terrains_are_predefined() -> None:
    assert seeds.unseen_terrain_seeds(10) == list(range(10))


@pytest.mark.parametrize("count", [0, -1, 1_000_001])
def test_too_few_or_many_unseen_terrains_are_refused(count: int) -> None:
    with pytest.raises(ValueError, match=f"terrains: expected .* got {count}"):
        seeds.unseen_terrain_seeds(count)


def test_a_scenario_draws_its_weights_apart_from_its_noise_and_damage() -> None:
    individuals = [(run, 1, individual) for run in range(2) for individual in range(3)]
    for scenarios in (
        Scenarios.training("flat", individuals),
        Scenarios.unseen("flat", range(6), seed=1),
    ):
        assert len({*scenarios.world_seeds, *scenarios.init_seeds}) == 2 * 6


@pytest.mark.parametrize("ground", ["hilly-3-30", "steppy-1-5", "hilly-3-30-7", "flat"])
def test_each_individual_has_the_terrain_of_its_seed(ground: str) -> None:
    individuals = [(run, 2, index) for run in (0, 5) for index in range(4)]
    terrains = Scenarios.training(ground, individuals).terrains
    for terrain, individual in zip(terrains, individuals, strict=True):
        alone = Terrain.from_name(ground, seeds.terrain_seed(*individual))
        assert terrain.name == alone.name
        assert np.array_equal(terrain.ys, alone.ys)
    fixed = terrains[0]
    assert Scenarios.training(fixed, individuals).terrains == [fixed] * len(individuals)
    assert Scenarios.unseen(ground, []).terrains == []
