"""The numbers of a generation."""

import pytest
import torch

from experiments.evolution.metrics import measure
from experiments.runs.history import Row


def test_spread_is_the_mean_deviation_of_the_genes() -> None:
    genomes = torch.tensor([[0.0, 7.0], [2.0, 7.0], [4.0, 7.0]])  # deviations 2 and 0
    fitness = torch.tensor([1.0, 2.0, 3.0])
    row = Row.of(0, 1, fitness, seconds=5.0)
    numbers = measure(row, genomes, fitness > 2.5, [torch.full((3, 1, 2), -0.5)], 5.0)
    assert numbers["genome/spread"] == 1.0
    assert numbers["plasticity/mean_weight"] == 0.5
    assert numbers["time/evaluations_per_second"] == 0.6


def test_diverged_weights_are_beyond_ten_medians_of_their_own_network() -> None:
    fitness = torch.zeros(2)
    # Medians 1 and 3; the layers of a network count together.
    hidden = torch.tensor([[[1.0, -11.0]], [[3.0, 11.0]]])
    output = torch.tensor([[[0.5]], [[-2.0]]])
    row = Row.of(0, 1, fitness, seconds=1.0)
    numbers = measure(row, torch.zeros(2, 3), fitness > 1, [hidden, output], 1.0)
    assert numbers["plasticity/diverged"] == pytest.approx(1 / 6)
    assert numbers["plasticity/mean_weight"] == pytest.approx(28.5 / 6)
    assert numbers["plasticity/largest_weight"] == 11.0
