"""Seeds and states of the evolution strategy: the same way again, also when resumed."""

import io
import math

import pytest
import torch

import hebbtorch
from tests.hebbtorch.evolving import evolve, sphere


@pytest.mark.parametrize("n_genes", [3, 5000])  # 5000: enough for torch to use its threads
def test_each_of_several_runs_is_the_run_of_its_own_seed(n_genes):
    threads = torch.get_num_threads()
    try:
        torch.set_num_threads(2)
        together = evolve(hebbtorch.EvolutionStrategy(n_genes, runs=3, seed=20), 5)
        genomes = together.ask()
        assert genomes.shape == (3, 40, n_genes)
        assert together.best.shape == (3, n_genes)
        assert together.best_fitness.shape == (3,)
        torch.set_num_threads(1)
        for run in range(3):
            alone = evolve(hebbtorch.EvolutionStrategy(n_genes, seed=20 + run), 5)
            assert torch.equal(alone.ask(), genomes[run])
            assert torch.equal(alone.best, together.best[run])
            assert torch.equal(alone.best_fitness, together.best_fitness[run])
    finally:
        torch.set_num_threads(threads)


def test_seeds_generations_and_runs_all_draw_differently():
    es = hebbtorch.EvolutionStrategy(50, runs=2, seed=0, sigma=1e-3)
    first = es.ask()
    assert not torch.equal(first[0], first[1])
    noise = []
    for _ in range(2):
        es.tell(torch.zeros(2, 40))
        genomes = es.ask()
        noise.append(genomes[:, 1:] - genomes[:, 1:].mean(1, keepdim=True))
    a, b = noise[0].flatten(1)
    for other in (b, noise[1][0].flatten()):
        assert torch.corrcoef(torch.stack([a, other]))[0, 1].abs() < 5 / math.sqrt(a.numel())


def test_results_do_not_depend_on_other_uses_of_randomness():
    plain = evolve(hebbtorch.EvolutionStrategy(4, seed=1), 3).ask()
    es = hebbtorch.EvolutionStrategy(4, seed=1)
    for _ in range(3):
        torch.manual_seed(0)
        fitness = sphere(es.ask(), 0.0)
        torch.rand(7)
        es.tell(fitness)
    assert torch.equal(es.ask(), plain)


@pytest.mark.parametrize("between_ask_and_tell", [False, True])
@pytest.mark.parametrize("runs", [1, 2])
def test_a_resumed_strategy_goes_on_bit_for_bit(runs, between_ask_and_tell):
    es = evolve(hebbtorch.EvolutionStrategy(6, runs=runs, seed=4), 3)
    if between_ask_and_tell:
        asked = es.ask()
    file = io.BytesIO()
    torch.save(es.state_dict(), file)
    file.seek(0)
    resumed = hebbtorch.EvolutionStrategy(6, runs=runs, seed=4)
    resumed.load_state_dict(torch.load(file, weights_only=True))
    assert torch.equal(resumed.best, es.best)
    assert torch.equal(resumed.best_fitness, es.best_fitness)
    if between_ask_and_tell:
        es.tell(sphere(asked, 0.0))
        resumed.tell(sphere(resumed.ask(), 0.0))
    evolve(es, 3)
    evolve(resumed, 3)
    assert resumed.generation == es.generation
    assert torch.equal(resumed.ask(), es.ask())


def test_a_saved_state_is_not_changed_by_going_on():
    es = evolve(hebbtorch.EvolutionStrategy(6, seed=4), 1)
    saved = es.state_dict()
    genomes = saved["genomes"].clone()
    resumed = hebbtorch.EvolutionStrategy(6, seed=4)
    resumed.load_state_dict(saved)
    evolve(es, 1)
    evolve(resumed, 1)
    assert torch.equal(saved["genomes"], genomes)


def test_genomes_asked_for_are_the_callers_own():
    changed, untouched = (hebbtorch.EvolutionStrategy(6, seed=4) for _ in range(2))
    changed.ask().zero_()
    untouched.ask()
    for es in (changed, untouched):
        es.tell(torch.arange(40.0))
    assert torch.equal(changed.ask(), untouched.ask())


def test_a_warm_start_begins_at_a_known_genome():
    known = torch.full((5,), 3.0)
    es = hebbtorch.EvolutionStrategy(5, population=200, sigma=0.1, seed=2, initial=known)
    first = es.ask()
    assert torch.equal(first[0], known)
    assert (first[1:] - known).std().item() == pytest.approx(0.1, rel=0.1)
    population = torch.rand(6, 5)
    whole = hebbtorch.EvolutionStrategy(5, population=6, initial=population)
    assert torch.equal(whole.ask(), population)
    runs = hebbtorch.EvolutionStrategy(5, population=6, runs=2, seed=2, initial=known)
    alone = hebbtorch.EvolutionStrategy(5, population=6, seed=3, initial=known)
    assert torch.equal(runs.ask()[1], alone.ask())
    with pytest.raises(ValueError, match=r"initial: expected finite genomes of 5 genes"):
        hebbtorch.EvolutionStrategy(5, initial=torch.zeros(4))
    with pytest.raises(ValueError, match=r"initial: expected shape \(5,\), \(40, 5\)"):
        hebbtorch.EvolutionStrategy(5, initial=torch.zeros(3, 5))


def test_a_schedule_of_sigma_and_the_best_ever_survive_a_resume():
    def schedule(generation):
        return 0.5 * 0.5**generation

    es = hebbtorch.EvolutionStrategy(400, population=40, sigma=schedule, seed=1)
    values = [3.0, 9.0, 1.0]
    for generation, top in enumerate(values):
        genomes = es.ask()
        if generation:
            spread = (genomes[1:] - genomes[1:].mean(0)).std().item()
            assert spread == pytest.approx(schedule(generation), rel=0.05)
        if top == 9.0:
            best = genomes[7].clone()
        fitness = torch.zeros(40)
        fitness[7] = top
        es.tell(fitness)
    assert (es.best_fitness, es.best_ever_fitness) == (1.0, 9.0)
    assert torch.equal(es.best_ever, best)
    resumed = hebbtorch.EvolutionStrategy(400, population=40, sigma=schedule, seed=1)
    resumed.load_state_dict(es.state_dict())
    assert torch.equal(resumed.best_ever, best)
    es.ask()
    es.tell(torch.full((40,), math.nan))
    assert es.best_ever_fitness == 9.0
    resumed.ask()
    resumed.tell(torch.full((40,), math.nan))
    assert torch.equal(es.ask(), resumed.ask())
    old = {k: v for k, v in es.state_dict().items() if not k.startswith("best_ever")}
    resumed.load_state_dict(old)
    assert resumed.best_ever_fitness.isnan()


def test_global_defaults_of_torch_change_nothing():
    plain = evolve(hebbtorch.EvolutionStrategy(5, 8, seed=1), 3).ask()
    try:
        torch.set_default_dtype(torch.float64)
        torch.set_default_device("meta")
        es = hebbtorch.EvolutionStrategy(5, 8, seed=1)
        for _ in range(3):
            es.tell(-es.ask().square().sum(-1))
        genomes = es.ask()
        es.tell([0.0] * 8)
    finally:
        torch.set_default_dtype(torch.float32)
        torch.set_default_device("cpu")
    assert torch.equal(genomes, plain)
