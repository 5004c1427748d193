"""Pruning takes the right synapses, and what is left acts as it is."""

import csv

import pytest
import torch

from experiments.analysis.freezing import act, freeze, learn, training_and_test
from experiments.analysis.pruning import FRACTIONS, KINDS, order, prune, pruned
from tests.experiments.champions import PLASTIC, random_champions

# Two networks, 2-2-1: four synapses into the hidden layer, and two out of it.
WEIGHTS = (
    torch.tensor([[[0.1, -5.0], [2.0, 0.3]], [[1.0, 1.0], [-6.0, 0.0]]]),
    torch.tensor([[[-3.0, 0.2]], [[4.0, -2.0]]]),
)


def left(kind: str, fraction: float) -> list[list[float]]:
    """The synapses of both networks after pruning, hidden layer first."""
    layers = pruned(WEIGHTS, order(WEIGHTS, kind), fraction)
    assert [layer.shape for layer in layers] == [layer.shape for layer in WEIGHTS]
    return [[round(w, 6) for layer in layers for w in layer[k].flatten().tolist()] for k in (0, 1)]


def test_the_largest_or_the_smallest_of_the_whole_network_go_first() -> None:
    assert left("largest", 0.5) == [[0.1, 0, 0, 0.3, 0, 0.2], [1, 1, 0, 0, 0, 0]]
    assert left("smallest", 0.5) == [[0, -5, 2, 0, -3, 0], [0, 0, -6, 0, 4, -2]]
    assert left("largest", 0.2) == [[0.1, 0, 2, 0.3, -3, 0.2], [1, 1, 0, 0, 4, -2]]


def test_random_synapses_follow_from_the_seed_and_differ_between_networks() -> None:
    weights = (torch.ones(2, 10, 10), torch.ones(2, 5, 10))
    first = order(weights, "random", seed=3)
    assert torch.equal(first, order(weights, "random", seed=3))
    assert not torch.equal(first, order(weights, "random", seed=4))
    assert not torch.equal(first[0], first[1])
    assert torch.equal(first.sort(1).values, torch.arange(150).expand(2, -1))
    kept = [
        torch.cat([layer.flatten(1) for layer in pruned(weights, first, fraction)], 1)
        for fraction in (0.2, 0.6)
    ]
    assert [(one == 0).sum(1).tolist() for one in kept] == [[30, 30], [90, 90]]
    assert (kept[1] <= kept[0]).all()  # what is gone stays gone


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_pruned_at_fraction_zero_and_everything_at_one(kind: str) -> None:
    for layer, before in zip(pruned(WEIGHTS, order(WEIGHTS, kind), 0.0), WEIGHTS, strict=True):
        assert torch.equal(layer, before)
    assert not any(layer.any() for layer in pruned(WEIGHTS, order(WEIGHTS, kind), 1.0))


def test_pruned_champions(tmp_path) -> None:
    champions = random_champions()
    pruning = prune(champions, n_terrains=2)
    assert pruning.speeds.shape == (2, len(KINDS), len(FRACTIONS), 2)
    frozen = freeze(champions, n_terrains=2).speeds[:, -1]  # at the end of an episode, whole
    for kind in range(len(KINDS)):
        assert torch.equal(pruning.speeds[:, kind, 0], frozen)

    training, test = training_and_test(PLASTIC, 2, 0)
    weights = tuple(layer[0] for layer in learn(PLASTIC, champions.genomes, [1.0], training))
    half = pruned(weights, order(weights, "smallest"), FRACTIONS[5])
    expected = act(PLASTIC, tuple(layer[None] for layer in half), test)[0]
    assert torch.equal(pruning.speeds[:, KINDS.index("smallest"), 5], expected)
    assert not torch.equal(expected, frozen)

    rows = list(csv.DictReader(pruning.write(tmp_path / "pruned.csv").read_text().splitlines()))
    assert list(rows[0]) == ["run", "which", "fraction", "terrain", "speed"]
    assert len(rows) == pruning.speeds.numel()
    for row in rows:
        at = (
            int(row["run"]),
            KINDS.index(row["which"]),
            FRACTIONS.index(float(row["fraction"])),
            test.names.index(row["terrain"]),
        )
        assert float(row["speed"]) == pruning.speeds[at].item()
