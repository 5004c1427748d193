"""Fitness: each life in a world of its own, whoever else is evaluated."""

from dataclasses import replace
from typing import Any

import pytest
import torch

from experiments.analysis.unseen import changed_conditions, reassess
from experiments.config import EvolveConfig
from experiments.rollout import (
    Episode,
    Evaluator,
    Scenarios,
    fitness,
    seeds,
    simulator,
    start_episode,
)
from experiments.runs.names import evaluation_file
from physics import Apparatus, Engine, Morphology, Simulator, Terrain


def genomes(config: EvolveConfig, seed: int = 0) -> torch.Tensor:
    n_genes = Evaluator(config).n_genes
    draw = torch.rand(
        config.runs, config.population, n_genes, generator=torch.Generator().manual_seed(seed)
    )
    return 2 * draw - 1


def alike(config: EvolveConfig) -> torch.Tensor:
    """The same individual, population times."""
    return genomes(config)[:, :1].expand(-1, config.population, -1)


@pytest.mark.parametrize("init", ["zeros", "uniform"])
def test_runs_side_by_side_are_the_runs_alone(tiny: EvolveConfig, init: str) -> None:
    both = replace(tiny, runs=2, init=init, damage="half")
    population = genomes(both)
    together = Evaluator(both)(population, 3).speed.reshape(2, tiny.population)
    for run in (0, 1):
        alone = replace(both, runs=1, seed=both.seed + run)
        assert torch.equal(Evaluator(alone)(population[run : run + 1], 3).speed, together[run])


def test_fitness_does_not_depend_on_the_population(tiny: EvolveConfig) -> None:
    population = genomes(tiny)
    full = Evaluator(tiny)(population, 1).speed
    fewer = replace(tiny, population=5)
    assert torch.equal(Evaluator(fewer)(population[:, :5], 1).speed, full[:5])


@pytest.mark.parametrize(
    "only",
    [{"noise": 0.0}, {"terrain": "flat", "noise": 0.5}],
    ids=["by terrain", "by noise"],
)
def test_every_evaluation_is_one_of_its_own(tiny: EvolveConfig, only: dict[str, Any]) -> None:
    config = replace(tiny, **only)
    evaluator, same = Evaluator(config), alike(config)
    first, second = evaluator(same, 1).speed, evaluator(same, 2).speed
    assert len(set(torch.cat((first, second)).tolist())) == 2 * tiny.population
    assert torch.equal(evaluator(same, 1).speed, first)


def test_a_terrain_with_seed_is_shared(tiny: EvolveConfig) -> None:
    fixed = replace(tiny, terrain="hilly-3-30-7", noise=0.0)
    speed = Evaluator(fixed)(alike(fixed), 1).speed
    assert (speed == speed[0]).all()


def test_uniform_weights_at_birth_differ_between_lives(tiny: EvolveConfig) -> None:
    config = replace(tiny, terrain="flat", noise=0.0, init="uniform")
    speed = Evaluator(config)(alike(config), 1).speed
    assert len(set(speed.tolist())) == tiny.population


def test_damage_strikes_at_half_of_the_life(tiny: EvolveConfig) -> None:
    areas = {}
    for damage in ("none", "half"):
        config = replace(tiny, shape="biped-4x3", noise=0.0, damage=damage, duration=2.0)
        sim = simulator(config, Scenarios([Terrain.from_name("flat")] * 2, [1, 2], [0, 0]))
        sim.reset()
        areas[damage] = []
        while sim.time < 2.0:
            sim.step(torch.ones(2, sim.n_voxels))
            areas[damage].append(sim.area_ratios())
    healthy, damaged = torch.stack(areas["none"]), torch.stack(areas["half"])
    differs = (healthy != damaged).flatten(1).any(1).tolist()
    assert differs.index(True) in (60, 61)  # 1 s is over after 60 steps, give or take rounding
    assert not torch.equal(damaged[-1, 0], damaged[-1, 1])  # other voxels in each world


def test_reassessment_is_on_the_predefined_terrains(tiny: EvolveConfig) -> None:
    config = replace(tiny, noise=0.0)
    champions = genomes(config)[0, :2]
    speeds = reassess(config, champions, seeds.unseen_terrain_seeds(3))
    for champion in range(2):
        for terrain in range(3):
            scenario = Scenarios([Terrain.from_name(f"hilly-3-30-{terrain}")], [0], [0])
            alone = (
                start_episode(config, champions[champion : champion + 1], scenario).finish().speed
            )
            assert torch.equal(speeds[champion, terrain], alone[0])


def test_other_terrains_or_seeds_are_another_file() -> None:
    """They do not replace what campaigns and figures read."""
    config = EvolveConfig(terrain="flat")
    names = [evaluation_file(config, *others) for others in ((), (10, 0), (9, 0), (10, 1))]
    usual, again, fewer, seeded = names
    assert usual == again == "evaluation-flat-none.csv"
    assert (fewer, seeded) == (
        "evaluation-flat-none-9-seed0.csv",
        "evaluation-flat-none-10-seed1.csv",
    )


def test_reassessment_has_noise_that_follows_from_its_seed(tiny: EvolveConfig) -> None:
    champions, terrains = genomes(tiny)[0, :2], [0, 1]
    first = reassess(tiny, champions, terrains, seed=1)
    assert torch.equal(reassess(tiny, champions, terrains, seed=1), first)
    assert not torch.equal(reassess(tiny, champions, terrains, seed=2), first)


@pytest.mark.parametrize("init", ["zeros", "uniform"])
def test_fitness_is_evolutions_own_in_any_batch(tiny: EvolveConfig, init: str) -> None:
    config = replace(tiny, init=init, damage="half")
    population = genomes(config)[0]
    evolved = Evaluator(config)(population[None], 3).speed
    evaluate = fitness(config)
    assert torch.equal(evaluate(population, 3), evolved)
    assert torch.equal(evaluate(population[:3], 3), evolved[:3])
    more = evaluate(torch.cat([population, population]), 3)
    assert torch.equal(more[: len(population)], evolved)
    assert not torch.equal(more[len(population) :], evolved)  # individuals of their own
    assert not torch.equal(evaluate(population, 4), evolved)


def test_objects_replace_the_options_of_fitness(tiny: EvolveConfig) -> None:
    population, named = genomes(tiny)[0, :2], Terrain.from_name("hilly-1-10-3")
    usual = fitness(tiny)(population, 1)
    on_named = fitness(tiny, terrain=named)(population, 1)
    assert torch.equal(fitness(replace(tiny, terrain=named.name))(population, 1), on_named)
    assert torch.equal(fitness(tiny, terrain=named.name)(population, 1), on_named)
    body = Morphology.from_name(tiny.shape)
    apparatus = Apparatus.named(tiny.sensors, body)
    assert torch.equal(fitness(tiny, shape=body, sensors=apparatus)(population, 1), usual)
    slippery = fitness(tiny, engine=Engine(friction=0.1))(population, 1)
    assert (slippery != usual).all()
    wider = fitness(tiny, shape=Morphology.from_grid([[1, 1, 1]]))
    with pytest.raises(ValueError, match=r"genomes: expected shape \(B, \d+\), got"):
        wider(population, 1)


def test_an_objective_replaces_the_speed(tiny: EvolveConfig) -> None:
    population = genomes(tiny)[0, :2]

    def speed_and_height(episode: Episode) -> torch.Tensor:
        speed = episode.finish().speed
        return torch.stack([speed, episode.sim.center_of_mass()[:, 1].double()], 1)

    values = fitness(tiny, objective=speed_and_height)(population, 1)
    assert values.shape == (2, 2)
    assert torch.equal(values[:, 0], fitness(tiny)(population, 1))


def test_a_failed_simulation_has_no_fitness(
    tiny: EvolveConfig, monkeypatch: pytest.MonkeyPatch
) -> None:
    population = genomes(tiny)[0, :2]
    monkeypatch.setattr(Simulator, "failed", lambda sim: torch.tensor([True, False]))
    values = fitness(tiny, objective=lambda episode: torch.ones(2, 3))(population, 1)
    assert values.isnan().tolist() == [[True] * 3, [False] * 3]
    assert fitness(tiny)(population, 1).isnan().tolist() == [True, False]


@pytest.mark.parametrize(
    ("shape", "generation", "message"),
    [((2, 3), 1, "genomes: expected shape"), ((3,), 1, "genomes"), (None, 0, "generation")],
)
def test_wrong_arguments_of_fitness_are_named(
    tiny: EvolveConfig, shape: Any, generation: int, message: str
) -> None:
    given = genomes(tiny)[0] if shape is None else torch.zeros(shape)
    with pytest.raises(ValueError, match=f"{message}.* got"):
        fitness(tiny)(given, generation)


@pytest.mark.parametrize("loop", ["fused", "torch"])
def test_every_genome_may_have_a_body_of_its_own(tiny: EvolveConfig, loop: str) -> None:
    """In one batch, with the values of each body's own batch, bit for bit."""
    names = ["worm-2x1", "worm-3x1", "worm-2x1"]
    bodies = [Morphology.from_name(name) for name in names]
    config = replace(tiny, loop=loop, init="uniform", damage="half")
    evaluate = fitness(config, bodies)
    draws = torch.Generator().manual_seed(0)
    own = [torch.randn(count, generator=draws) for count in evaluate.n_genes]
    values = evaluate(own, 2)
    for b, body in enumerate(bodies):
        alone = fitness(config, body)
        assert evaluate.n_genes[b] == alone.n_genes
        assert alone(own[b].expand(3, -1), 2)[b] == values[b]


def test_genomes_that_do_not_fit_their_bodies_are_told(tiny: EvolveConfig) -> None:
    bodies = [Morphology.from_name(name) for name in ("worm-2x1", "worm-3x1")]
    evaluate = fitness(tiny, bodies)
    own = [torch.zeros(count) for count in evaluate.n_genes]
    with pytest.raises(ValueError, match="genomes: expected 2, one for each body, got 3"):
        evaluate([*own, own[0]], 1)
    with pytest.raises(ValueError, match="genomes: expected .* genes for body 0, got shape"):
        evaluate(own[::-1], 1)


def test_teams_can_be_frozen_and_looked_at(tiny: EvolveConfig) -> None:
    """Weights of every robot's networks, in the kernel and in torch."""
    bodies = [Morphology.from_name(name) for name in ("worm-2x1", "worm-3x1", "worm-2x1")]
    weights = {}
    for loop in ("fused", "torch"):
        config = replace(tiny, loop=loop, noise=0.0)
        counts = fitness(config, bodies).n_genes
        own = [torch.linspace(-1, 1, count) for count in counts]
        episode = start_episode(
            config, own, Scenarios.training("flat", [(0, 1, b) for b in range(3)]), shape=bodies
        )
        episode.run(5)
        episode.freeze()
        frozen = episode.state()
        episode.run(5)
        assert all(map(torch.equal, frozen.weights, episode.state().weights))
        weights[loop] = frozen.weights
    assert len(weights["fused"]) == 4
    for ours, theirs in zip(weights["fused"], weights["torch"], strict=True):
        assert ours.shape == theirs.shape
        assert torch.allclose(ours, theirs, atol=1e-4)


# --- noise by kind, and when and where voxels break --------------------------------------------


def test_noise_may_differ_by_kind_of_sensor(tiny: EvolveConfig) -> None:
    """Every kind that is not named has the common noise; the kernel is the same one."""
    config = replace(tiny, sensors="high", noise=0.2, noise_area=0.0, noise_lidar=0.5)
    assert tiny.noises() == tiny.noise
    noises = config.noises()
    assert noises == {"area": 0.0, "touch": 0.2, "velocity": 0.2, "lidar": 0.5}
    scenarios = Scenarios.training("flat", [(0, 1, b) for b in range(64)])
    noisy = simulator(config, scenarios).readings()
    clean = simulator(replace(config, noise=0.0, noise_lidar=0.0), scenarios)
    spread = (noisy - clean.readings()).std(0)
    wanted = torch.tensor([noises[kind] for kind in clean.sensor_kinds])
    assert torch.allclose(spread, wanted, rtol=0.3)
    assert torch.equal(
        Evaluator(replace(tiny, noise_area=0.01, noise=0.0, sensors="low"))(genomes(tiny), 1).speed,
        Evaluator(replace(tiny, noise=0.01, sensors="low"))(genomes(tiny), 1).speed,
    )


def test_when_and_where_voxels_break(tiny: EvolveConfig) -> None:
    config = replace(
        tiny, damage="half", damage_time=0.1, damage_until=0.3, damage_voxels="1", duration=0.5
    )
    config.validate()
    episode = start_episode(
        config, genomes(config)[0], Scenarios.training("flat", [(0, 1, b) for b in range(8)])
    )
    broken = []
    for _ in range(episode.n_steps):
        broken.append(episode.sim.broken())
        episode.run(1)
    steps = torch.stack(broken)
    assert not steps[:, :, 0].any()
    assert steps[:, 0, 1].nonzero().flatten().tolist() == list(range(7, 18))  # after a sum of DTs
    assert (steps[:, :, 1] == steps[:, :1, 1]).all()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"damage_voxels": "0,7"}, "damage_voxels: expected numbers from 0 to 1"),
        ({"damage_voxels": "all"}, "damage_voxels: expected numbers of voxels such as"),
        ({"damage_until": 0.1}, "damage_until: expected more than 0.25 s"),
        ({"damage_time": -1.0}, "damage_time: expected a finite number >= 0"),
        ({"noise_touch": -0.1}, "noise_touch: expected a finite number >= 0"),
    ],
)
def test_bad_damage_and_noise_are_told(
    tiny: EvolveConfig, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        replace(tiny, **options).validate()


def test_champions_can_meet_other_conditions() -> None:
    changes = changed_conditions(["gravity=5", "noise_lidar=0.1", "damage_voxels=0"])
    assert changes == {"gravity": 5, "noise_lidar": 0.1, "damage_voxels": "0"}
    for wrong in ("gravity", "shape=worm-7x1", "wind=3", "gravity="):
        with pytest.raises(ValueError, match="change: expected NAME=VALUE with one of noise, "):
            changed_conditions([wrong])
