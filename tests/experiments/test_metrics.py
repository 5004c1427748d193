"""The numbers of a generation."""

import torch

from experiments.history import Row
from experiments.metrics import measure


def test_spread_is_the_mean_deviation_of_the_genes() -> None:
    genomes = torch.tensor([[0.0, 7.0], [2.0, 7.0], [4.0, 7.0]])  # deviations 2 and 0
    fitness = torch.tensor([1.0, 2.0, 3.0])
    row = Row.of(0, 1, fitness, seconds=5.0)
    numbers = measure(row, genomes, fitness > 2.5, [torch.full((3, 1, 2), -0.5)], 5.0)
    assert numbers["genome/spread"] == 1.0
    assert numbers["plasticity/mean_weight"] == 0.5
    assert numbers["time/evaluations_per_second"] == 0.6
