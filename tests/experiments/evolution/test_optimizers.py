"""CMA-ES behind the calls of Algorithm 1: runs alone, resume by replay, and what is refused."""

import io
from dataclasses import replace

import pytest
import torch
from torch import Tensor

from experiments.config import EvolveConfig
from experiments.evolution.optimizers import optimizer_of

pytest.importorskip("cma")
CONFIG = EvolveConfig(optimizer="cma", population=12, sigma=0.5, runs=2, seed=3)


def sphere(genomes: Tensor) -> Tensor:
    return -(genomes - 2.0).square().sum(-1).double()


def evolved(config: EvolveConfig, generations: int, n_genes: int = 6):
    strategy = optimizer_of(config, n_genes)
    for _ in range(generations):
        strategy.tell(sphere(strategy.ask()))
    return strategy


@pytest.mark.parametrize("optimizer", ["cma", "sep-cma"])
def test_it_reaches_an_optimum(optimizer: str) -> None:
    strategy = evolved(replace(CONFIG, optimizer=optimizer), 60)
    assert (strategy.best_fitness > -1e-4).all()
    assert (strategy.best - 2.0).abs().max() < 0.05


def test_each_run_is_the_run_of_its_own_seed_whatever_else_is_random() -> None:
    together = evolved(CONFIG, 5)
    torch.manual_seed(0)
    for run in range(2):
        alone = evolved(replace(CONFIG, runs=1, seed=3 + run), 5)
        assert torch.equal(alone.ask(), together.ask()[run])
        assert torch.equal(alone.best, together.best[run])


def test_a_resumed_strategy_goes_on_bit_for_bit_from_plain_tensors() -> None:
    strategy = evolved(CONFIG, 4)
    file = io.BytesIO()
    torch.save(strategy.state_dict(), file)
    file.seek(0)
    resumed = optimizer_of(CONFIG, 6)
    resumed.load_state_dict(torch.load(file, weights_only=True))
    assert torch.equal(resumed.best_fitness, strategy.best_fitness)
    for _ in range(3):
        genomes = strategy.ask()
        assert torch.equal(resumed.ask(), genomes)
        for each in (strategy, resumed):
            each.tell(sphere(genomes))


def test_failed_individuals_count_as_worst() -> None:
    strategy = optimizer_of(replace(CONFIG, runs=1), 6)
    fitness = torch.full((12,), torch.nan, dtype=torch.float64)
    fitness[5] = -7.0
    genomes = strategy.ask()
    strategy.tell(fitness)
    assert torch.equal(strategy.best, genomes[5])
    assert strategy.ask().isfinite().all()


def test_refused() -> None:
    with pytest.raises(ValueError, match="optimizer: expected sep-cma or es for 2000 genes"):
        optimizer_of(CONFIG, 2000)
    with pytest.raises(ValueError, match="state: expected n_genes 6, got 5"):
        optimizer_of(CONFIG, 6).load_state_dict(optimizer_of(CONFIG, 5).state_dict())
    with pytest.raises(ValueError, match="optimizer: expected one of es, cma, sep-cma"):
        replace(CONFIG, optimizer="adam").validate()
