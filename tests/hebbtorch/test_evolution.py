import math
from itertools import pairwise

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

import hebbtorch
from hebbtorch.ask_tell import next_population, ranking
from tests.hebbtorch.evolving import evolve, sphere


@pytest.mark.parametrize("optimum", [0.0, 3.0])  # 3 lies outside of the first population's cube
def test_reaches_the_optimum_of_a_sphere(optimum):
    es = hebbtorch.EvolutionStrategy(10, sigma=0.05, seed=1)
    es.tell(sphere(es.ask(), optimum))
    first = es.best_fitness.item()
    evolve(es, 150, optimum)
    # The mean of 10 parents scatters by sigma / sqrt(10) per gene: 10 genes * 0.05^2 / 10 at
    # the optimum, and the best child is no farther than a typical one, 10 * 0.05^2.
    assert es.best_fitness > -10 * 0.05**2
    assert first < -1.0
    assert (es.best - optimum).abs().max() < 0.1


def test_a_translated_problem_gives_the_translated_children():
    # Offspring depends on genomes only through the parents' mean (exact in powers of two).
    generator = torch.Generator()
    genomes = torch.randint(-8, 8, (8, 5), generator=generator.manual_seed(1)).double() / 8
    order = [3, 1, 0, 2, 4, 5, 6, 7]
    here = next_population(genomes, order, 4, 0.35, generator.manual_seed(2))
    there = next_population(genomes + 4, order, 4, 0.35, generator.manual_seed(2))
    torch.testing.assert_close(there, here + 4, rtol=0, atol=1e-14)


def test_one_generation_is_algorithm_1():
    es = hebbtorch.EvolutionStrategy(400, population=40, sigma=0.35, parents=0.25, seed=3)
    first = es.ask()
    assert first.shape == (40, 400)
    assert -1 <= first.min() < -0.99
    assert 0.99 < first.max() <= 1
    fitness = torch.randn(40, generator=torch.Generator().manual_seed(0))
    es.tell(fitness)
    best = fitness.argsort(descending=True)
    assert torch.equal(es.best, first[best[0]])
    assert es.best_fitness == fitness[best[0]].double()
    second = es.ask()
    assert torch.equal(second[0], first[best[0]])  # the elite, unchanged
    mutations = second[1:] - first[best[:10]].mean(0)  # a quarter of 40 are parents
    n = mutations.numel()
    assert mutations.std().item() == pytest.approx(0.35, abs=5 * 0.35 / math.sqrt(2 * n))
    assert abs(mutations.mean().item()) < 5 * 0.35 / math.sqrt(n)
    # Normal, not uniform or so: the fourth moment is 3 sigma^4 (standard error sqrt(96 / n)).
    assert (mutations / 0.35).pow(4).mean().item() == pytest.approx(3, abs=5 * math.sqrt(96 / n))


def test_without_noise_in_fitness_the_best_never_gets_worse():
    es = hebbtorch.EvolutionStrategy(20, population=12, seed=5)
    best = -math.inf
    for _ in range(40):
        es.tell(sphere(es.ask(), 0.0))
        assert es.best_fitness >= best
        best = es.best_fitness.item()


def test_best_is_of_the_last_told_population():
    es = hebbtorch.EvolutionStrategy(3, population=4, seed=5)
    es.ask()
    es.tell([1.0, 9.0, 2.0, 3.0])
    second = es.ask()
    es.tell([0.0, 1.0, 5.0, 2.0])  # on new terrain the elite may score lower
    assert es.best_fitness == 5
    assert torch.equal(es.best, second[2])
    assert es.generation == 2


@settings(derandomize=True, max_examples=100, deadline=None)
@given(st.lists(st.sampled_from([math.nan, -math.inf, math.inf, -1.0, 0.0, 2.0]), min_size=1))
def test_ranking_puts_nan_last_and_keeps_ties_in_order(fitness):
    order = ranking(torch.tensor(fitness))
    assert sorted(order) == list(range(len(fitness)))
    for before, after in pairwise(order):
        a, b = fitness[before], fitness[after]
        if math.isnan(a):
            assert math.isnan(b)
            assert before < after
        elif not math.isnan(b):
            assert a > b or (a == b and before < after)


def test_nan_is_never_best_nor_parent():
    es = hebbtorch.EvolutionStrategy(6, population=8, sigma=1e-4, seed=1)
    first = es.ask()
    fitness = torch.tensor([math.nan, -5.0, math.nan, -math.inf, math.nan, -1.0, math.nan, -9.0])
    es.tell(fitness)
    assert torch.equal(es.best, first[5])
    assert es.best_fitness == -1
    second = es.ask()
    assert torch.equal(second[0], first[5])
    parents_mean = (first[5] + first[1]) / 2  # a quarter of 8 are parents
    assert (second[1:] - parents_mean).abs().max() < 5e-4


def test_all_nan_keeps_the_elite_and_goes_on():
    es = hebbtorch.EvolutionStrategy(6, population=8, seed=1)
    es.ask()
    es.tell(torch.arange(8.0))
    elite = es.ask()[0]
    es.tell(torch.full((8,), math.nan))
    assert torch.equal(es.best, elite)
    assert es.best_fitness.isnan()
    third = es.ask()
    assert torch.equal(third[0], elite)
    assert third.isfinite().all()
    es.tell(sphere(third, 0.0))
    assert es.best_fitness == sphere(third, 0.0).max()


def test_parents_are_the_fraction_rounded_down():
    count = {(0.25, 40): 10, (0.25, 43): 10, (0.29, 100): 29, (1.0, 7): 7, (0.5, 2): 1}
    for (parents, population), expected in count.items():
        es = hebbtorch.EvolutionStrategy(1, population=population, parents=parents)
        assert es.n_parents == expected


def test_calls_in_the_wrong_order_are_refused():
    es = hebbtorch.EvolutionStrategy(3, population=4)
    with pytest.raises(ValueError, match=r"tell: expected ask\(\) first"):
        es.tell(torch.zeros(4))
    with pytest.raises(ValueError, match="best: expected a tell"):
        es.best  # noqa: B018
    with pytest.raises(ValueError, match="best: expected a tell"):
        es.best_fitness  # noqa: B018
    es.ask()
    with pytest.raises(ValueError, match="ask: expected tell"):
        es.ask()
    es.tell(torch.zeros(4))
    with pytest.raises(ValueError, match=r"tell: expected ask\(\) first"):
        es.tell(torch.zeros(4))


@pytest.mark.parametrize(("runs", "shape"), [(1, (3,)), (1, (1, 4)), (2, (4,)), (2, (4, 2))])
def test_fitness_of_the_wrong_shape_is_refused_and_may_be_told_again(runs, shape):
    es = hebbtorch.EvolutionStrategy(3, population=4, runs=runs)
    es.ask()
    with pytest.raises(ValueError, match=r"fitness: expected shape .*4.* got"):
        es.tell(torch.zeros(shape))
    es.tell(torch.zeros((4,) if runs == 1 else (2, 4)))
    assert es.generation == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n_genes": 0}, "n_genes: expected an integer of at least 1, got 0"),
        ({"population": 1}, "population: expected an integer of at least 2"),
        ({"population": 4.0}, "population: expected an integer"),
        ({"runs": 0}, "runs: expected an integer"),
        ({"seed": 1.5}, "seed: expected an integer, got 1.5"),
        ({"sigma": 0.0}, "sigma: expected a positive number"),
        ({"sigma": math.nan}, "sigma: expected a positive number"),
        ({"parents": 0.01}, "parents: expected a fraction"),
        ({"parents": 1.5}, "parents: expected a fraction"),
    ],
)
def test_wrong_arguments_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        hebbtorch.EvolutionStrategy(**{"n_genes": 3, **options})


@pytest.mark.parametrize(
    ("name", "other"), [("seed", 1), ("sigma", 0.1), ("population", 8), ("parents", 0.5)]
)
def test_the_state_of_another_strategy_is_refused(name, other):
    saved = hebbtorch.EvolutionStrategy(3).state_dict()
    with pytest.raises(ValueError, match=f"state: expected (n_)?{name} = "):
        hebbtorch.EvolutionStrategy(3, **{name: other}).load_state_dict(saved)
    with pytest.raises(ValueError, match=r"state: expected genomes of torch.float64"):
        hebbtorch.EvolutionStrategy(3, dtype=torch.float64).load_state_dict(saved)


def test_evolves_a_network_by_the_documented_calls():
    strategy: hebbtorch.AskTell = hebbtorch.EvolutionStrategy(hebbtorch.StaticMLP([2, 1]).n_genes)
    net = hebbtorch.StaticMLP([2, 1], population=(40,))
    for _ in range(40):
        net.set_genomes(strategy.ask())
        y, _ = net(torch.ones(40, 2), net.initial_state())
        strategy.tell(y.squeeze(-1).detach())  # maximal at large weights
    assert strategy.best_fitness > 0.99


def test_numpy_integers_are_integers():
    es = hebbtorch.EvolutionStrategy(np.int64(3), np.int32(8), runs=np.int8(1), seed=np.int64(4))
    assert torch.equal(es.ask(), hebbtorch.EvolutionStrategy(3, 8, seed=4).ask())
    with pytest.raises(ValueError, match="population: expected an integer"):
        hebbtorch.EvolutionStrategy(3, True)
