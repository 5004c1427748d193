"""The numbers of a generation."""

import pytest
import torch

from experiments.evolution.metrics import measure

NONE_FAILED = torch.zeros(3, dtype=torch.bool)


def test_spread_is_the_mean_deviation_of_the_genes() -> None:
    genomes = torch.tensor([[0.0, 7.0], [2.0, 7.0], [4.0, -7.0]])
    numbers = measure(genomes, torch.tensor([False, False, True]), [], 5.0, 600)
    deviations = 2.0, 14 / 3**0.5
    assert numbers["genome/spread"] == pytest.approx(sum(deviations) / 2)
    assert numbers["genome/mean_abs"] == 4.5
    assert numbers["body/failed"] == pytest.approx(1 / 3)
    assert numbers["time/evaluations_per_second"] == 0.6
    assert numbers["time/robot_steps_per_second"] == 120.0


def test_weights_are_measured_layer_by_layer() -> None:
    weights = [torch.tensor([[-0.5, 1.0]] * 3), torch.tensor([[2.0], [-4.0], [0.0]])]
    numbers = measure(torch.zeros(3, 2), NONE_FAILED, weights, 1.0, 1)
    assert numbers["plasticity/weight_mean_abs/layer0"] == 0.75
    assert numbers["plasticity/weight_max_abs/layer0"] == 1.0
    assert numbers["plasticity/weight_mean_abs/layer1"] == 2.0
    assert numbers["plasticity/weight_max_abs/layer1"] == 4.0


def test_static_controllers_have_no_plasticity() -> None:
    numbers = measure(torch.zeros(3, 2), NONE_FAILED, [], 1.0, 1)
    assert not [tag for tag in numbers if tag.startswith("plasticity/")]


def test_diverged_weights_are_beyond_ten_medians_of_their_own_network() -> None:
    # Medians 1 and 3; the layers of a network count together.
    weights = [torch.tensor([[1.0, -11.0], [3.0, 11.0]]), torch.tensor([[0.5], [-2.0]])]
    numbers = measure(torch.zeros(2, 3), NONE_FAILED[:2], weights, 1.0, 1)
    assert numbers["plasticity/diverged"] == pytest.approx(1 / 6)
