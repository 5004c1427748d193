"""The same champions with and without plasticity, and where something else is different."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from experiments.analysis import endurance, generalization, paired, recovery, registry
from experiments.analysis.unseen import speeds_on
from experiments.config import EvolveConfig
from experiments.rollout import Scenarios, seeds, simulator
from experiments.runs.archive import Archive
from experiments.runs.champions import Champions
from physics import Damage, Engine, Terrain
from physics.scene.clock import steps_in
from tests.experiments.champions import PLASTIC, STATIC, random_champions, run_folder
from tests.experiments.finished_runs import read_csv

TEST = Scenarios.unseen(PLASTIC.terrain, [1, 2], 0)
TRAINING = Scenarios.unseen(PLASTIC.terrain, [0], 0)


def test_modes_of_plasticity() -> None:
    champions = random_champions()
    plastic, newborn, after_a_second = paired.compare(PLASTIC, champions.genomes, TEST, TRAINING)
    assert torch.equal(plastic, speeds_on(PLASTIC, champions.genomes, TEST))
    # Weights are zero at first: frozen there, a robot is not actuated.
    still = speeds_on(replace(PLASTIC, eta=0.0), champions.genomes, TEST)
    assert torch.allclose(newborn, still, atol=1e-6)
    assert not torch.equal(after_a_second, newborn)
    (static,) = paired.compare(STATIC, random_champions(STATIC).genomes, TEST, TRAINING)
    assert static.shape == (2, 2)


def test_champions_and_their_predecessors_are_compared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(paired, "_TERRAINS", 3)
    monkeypatch.setattr(paired, "_TERRAINS_OF_ARCHIVE", 2)
    config = replace(PLASTIC, generations=50)
    folder = run_folder(tmp_path, config)
    archive = Archive.empty(config, len(random_champions().genomes[0]))
    for generation in (25, 50):
        archive = archive.with_generation(
            generation, random_champions(seed=generation).genomes[:, None], torch.ones(2, 1)
        )
    archive.save(folder)
    rows = read_csv(paired.write(folder))
    of_generation = {g: [row for row in rows if row["generation"] == g] for g in ("25", "50")}
    # Runs, terrains, and plastic, frozen at 0 s and at 1 s; the last generation's are champions.
    assert [len(own) for own in of_generation.values()] == [2 * 2 * 3, 2 * 3 * 3]
    assert {row["frozen_at"] for row in rows} == {"nan", "0.0", "1.0"}
    plastic = [row for row in of_generation["50"] if row["frozen_at"] == "nan"]
    test = Scenarios.unseen(config.terrain, [1, 2, 3], 0)
    expected = speeds_on(config, Champions.load(folder).genomes, test)
    assert [float(row["speed"]) for row in plastic] == expected.flatten().tolist()


def test_settings_differ_from_the_evolution_in_what_they_say(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(generalization, "_TERRAINS", 2)
    config = replace(PLASTIC, generations=2, population=4)
    folder = run_folder(tmp_path, config)
    rows = read_csv(registry.generalized(folder))
    names = [setting.name for setting in generalization.SETTINGS]
    assert list(dict.fromkeys(row["setting"] for row in rows)) == names
    assert len(rows) == 2 * 2 * len(names)
    speeds = {
        name: [float(row["speed"]) for row in rows if row["setting"] == name] for name in names
    }
    expected = speeds_on(
        config, random_champions().genomes, Scenarios.unseen("hilly-3-30", [0, 1], 0)
    )
    assert speeds["unseen"] == expected.flatten().tolist()
    # Each makes a difference, but for "blind" where all voxels broke: what sees nothing is at rest.
    assert len({tuple(own) for own in speeds.values()}) >= len(names) - 1
    training = [row["terrain"] for row in rows if row["setting"] == "training"]
    assert training == [
        f"hilly-3-30-{seeds.terrain_seed(run, 2, individual)}"
        for run in range(2)
        for individual in range(2)
    ]


def test_a_setting_reaches_the_simulator() -> None:
    sim = simulator(
        EvolveConfig(shape="worm-2x1", threads=1),
        TEST,
        gravity=1.0,
        engine=Engine(friction=0.1),
        damage=Damage(mode="blind", time=math.pi),
    )
    assert sim.n_worlds == 2


def test_long_episodes_go_on_where_ordinary_ones_end() -> None:
    genomes = random_champions().genomes
    scenarios = Scenarios.unseen(PLASTIC.terrain, [1], 0)
    speeds = endurance.speeds_by_window(PLASTIC, genomes, scenarios, 2 * PLASTIC.duration)
    assert speeds.shape == (2, 1, 20)
    ends = [
        1,
        *(steps_in((window + 1) * 2.0 / 20) for window in range(10)),
    ]  # the first step is no part
    steps = torch.tensor(ends).diff()
    half = (steps * speeds[:, :, :10]).sum(-1) / steps.sum()
    ordinary = speeds_on(PLASTIC, genomes, scenarios)
    assert half.flatten().tolist() == pytest.approx(ordinary.flatten().tolist(), abs=1e-5)


def test_damage_parts_an_episode_from_the_same_one_without() -> None:
    genomes = random_champions().genomes
    config = replace(PLASTIC, damage_time=0.4, damage_probability=1.0)
    before, after, undamaged = recovery.speeds_around(config, genomes, TEST).unbind(-1)
    # With and without, the two parts make the speed of the whole.
    steps = torch.tensor([1, steps_in(0.4), steps_in(config.duration)]).diff()
    for kind, rest in (("half", after), ("none", undamaged)):
        whole = (steps[0] * before + steps[1] * rest) / steps.sum()
        expected = speeds_on(replace(config, damage=kind), genomes, TEST)
        assert whole.tolist() == [pytest.approx(own, abs=1e-5) for own in expected.tolist()]
    # Which voxels break makes no difference before they do, and much of one after.
    others = recovery.speeds_around(replace(config, damage_voxels="0"), genomes, TEST)
    assert torch.equal(others[..., 0], before)
    assert torch.equal(others[..., 2], undamaged)
    assert not torch.isclose(others[..., 1], after, atol=1e-4).any()


@pytest.mark.parametrize("time", [0.0, 1.0])
def test_damage_at_an_end_parts_nothing(time: float) -> None:
    config = replace(PLASTIC, damage_time=time)
    with pytest.raises(ValueError, match="damage_time: expected damage within the episode of 1 s"):
        recovery.speeds_around(config, random_champions().genomes, TEST)


def test_a_long_terrain_is_terrains_in_a_row() -> None:
    parts = [Terrain.from_name("hilly-3-30", seed) for seed in (4, 5)]
    together = endurance.long_terrain("hilly-3-30", 4, 2)
    n = len(parts[0].xs)
    assert (together.xs[: n - 1] == parts[0].xs[:-1]).all()
    assert (together.ys[: n - 1] == parts[0].ys[:-1]).all()
    # The second begins where the first ended, and rises and falls as it did.
    rest = together.ys[n - 2 : -1]
    assert rest - rest[0] == pytest.approx(parts[1].ys[1:-1] - parts[1].ys[1])
    assert together.ys[-1] > rest[-1] + 50
