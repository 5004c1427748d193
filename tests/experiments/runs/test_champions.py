"""The champions of a run: the fittest one, and what a failed one counts."""

import math

import pytest
import torch

from experiments.config import EvolveConfig
from experiments.runs.champions import Champions


@pytest.mark.parametrize(
    ("fitness", "best"),
    [
        ([1.0, 3.0, 2.0], 1),
        ([-1.0, -3.0, -0.5], 2),
        ([math.nan, -1.0, -0.5], 2),  # a failed one is worse than any, also than one that goes back
        ([-2.0, math.nan], 0),
        ([math.nan, math.nan], 0),
    ],
)
def test_the_best_run_is_the_one_with_the_fittest_champion(fitness: list[float], best: int) -> None:
    config = EvolveConfig(runs=len(fitness))
    champions = Champions(config, torch.zeros(len(fitness), 1), torch.tensor(fitness).double())
    assert champions.best_run == best
