import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

import hebbtorch


@settings(derandomize=True, max_examples=40, deadline=None)
@given(
    sizes=st.lists(st.integers(1, 5), min_size=2, max_size=4),
    population=st.lists(st.integers(1, 3), max_size=2),
    sharing=st.sampled_from(hebbtorch.SHARINGS),
    eta=st.sampled_from([0.01, "evolved"]),
)
def test_genomes_come_back_as_they_were_set(sizes, population, sharing, eta):
    groups = [i % 2 for i in range(sizes[0])] if sharing == "grouped" else None
    net = hebbtorch.HebbianMLP(
        sizes, sharing=sharing, groups=groups, eta=eta, population=population
    )
    n = net.n_genes
    # A different value everywhere: a gene left out or doubled cannot pass.
    genomes = torch.arange(net.genomes().numel(), dtype=torch.float32).reshape(*population, n)
    net.set_genomes(genomes)
    assert torch.equal(net.genomes(), genomes)
    covered = [gene for block in net.gene_blocks for gene in range(n)[block.genes]]
    assert covered == list(range(n))
    # As many trainable numbers as genes: compact storage, shared rules once.
    assert sum(p.numel() for p in net.parameters()) == genomes.numel()


def test_gene_order_is_the_documented_one():
    net = hebbtorch.HebbianMLP([3, 2, 1], eta="evolved")
    net.set_genomes(torch.arange(40.0))
    rule = net.layers[0].coefficients()
    assert rule.A.tolist() == [[0, 1, 2], [3, 4, 5]]  # row-major, post-synaptic neuron first
    assert rule.B.tolist() == [[6, 7, 8], [9, 10, 11]]
    assert rule.C[0, 0] == 12
    assert rule.D[1, 2] == 23
    assert net.layers[0].rules.eta_gene.tolist() == [[24, 25, 26], [27, 28, 29]]
    assert net.layers[1].coefficients().A.tolist() == [[30, 31]]
    assert [b.name for b in net.gene_blocks] == ["A", "B", "C", "D", "eta"] * 2
    assert [b.layer for b in net.gene_blocks] == [0] * 5 + [1] * 5
    assert net.gene_blocks[5] == hebbtorch.GeneBlock(1, "A", slice(30, 32), (1, 2))


def test_single_is_one_rule_for_all_layers():
    net = hebbtorch.HebbianMLP([3, 2, 1], sharing="single", eta="evolved")
    net.set_genomes(torch.tensor([1.0, 2.0, 3.0, 4.0, 0.0]))
    for layer in net.layers:
        assert [c.item() for c in layer.coefficients()] == [1, 2, 3, 4]
    loaded = hebbtorch.HebbianMLP([3, 2, 1], sharing="single", eta="evolved")
    loaded.load_state_dict(net.state_dict())
    assert torch.equal(loaded.genomes(), net.genomes())
    assert torch.equal(net.double().genomes(), loaded.genomes().double())


def test_groups_are_columns_in_order_of_first_appearance():
    layer = hebbtorch.HebbianLinear(4, 2, sharing="grouped", groups=["t", "a", "t", "l"])
    layer.set_genomes(torch.arange(12.0))
    assert layer.coefficients().A.tolist() == [[0, 1, 0, 2]]
    assert layer.coefficients().D.tolist() == [[9, 10, 9, 11]]


@pytest.mark.parametrize(
    ("gene", "rate"), [(0.0, 0.01), (1.0, 0.1), (-1.0, 0.001), (0.5, 0.0316228)]
)
def test_eta_gene_is_decades_around_the_papers_rate(gene, rate):
    net = hebbtorch.HebbianMLP([2, 1], sharing="single", eta="evolved")
    net.set_genomes(torch.tensor([0.0, 0.0, 0.0, 1.0, gene]))
    assert net.layers[0].learning_rate().item() == pytest.approx(rate, rel=1e-5)
    _, state = net(torch.zeros(2), net.initial_state())
    assert state.weights[0].tolist() == [[pytest.approx(rate, rel=1e-5)] * 2]  # D alone, once


def test_fresh_rules_are_uniform_draws_that_the_seed_decides():
    torch.manual_seed(1)
    net = hebbtorch.HebbianMLP([30, 30, 10])
    genome = net.genomes()
    torch.manual_seed(1)
    assert torch.equal(hebbtorch.HebbianMLP([30, 30, 10]).genomes(), genome)
    assert -1 <= genome.min() < -0.99
    assert 0.99 < genome.max() <= 1
    assert genome.mean().abs() < 5 / (3 * genome.numel()) ** 0.5  # 5 standard errors


def test_genomes_are_converted_to_the_networks_precision():
    net = hebbtorch.HebbianMLP([2, 1], population=(3,))
    genomes = torch.rand(3, 8, dtype=torch.float64)
    net.set_genomes(genomes)
    assert torch.equal(net.genomes(), genomes.float())


@pytest.mark.parametrize(
    ("genomes", "message"),
    [
        (torch.zeros(3, 7), r"genomes: expected shape \(3, 8\).*got \(3, 7\)"),
        (torch.zeros(8), r"genomes: expected shape \(3, 8\).*got \(8,\)"),
        (torch.zeros(4, 8), r"genomes: expected shape \(3, 8\).*got \(4, 8\)"),
        (
            torch.full((3, 8), torch.nan),
            "genomes: expected genes that are finite in torch.float32, got 24 NaN",
        ),
        (torch.full((3, 8), torch.inf), "genomes: .* finite"),
        (torch.full((3, 8), 1e300, dtype=torch.float64), "genomes: .* finite in torch.float32"),
        (
            torch.zeros(3, 8, dtype=torch.int64),
            "genomes: expected .* floating dtype, got torch.int64",
        ),
        ([[0.0] * 8] * 3, "genomes: expected a tensor .* got list"),
    ],
)
def test_wrong_genomes_are_refused_and_change_nothing(genomes, message):
    net = hebbtorch.HebbianMLP([2, 1], population=(3,))
    before = net.genomes()
    with pytest.raises(ValueError, match=message):
        net.set_genomes(genomes)
    assert torch.equal(net.genomes(), before)


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        (([3],), {}, "sizes: expected the neurons of two or more layers"),
        (([3, 0],), {}, "sizes: expected"),
        (([3, 2.5],), {}, "sizes: expected"),
        ((7,), {}, "sizes: expected"),
        (([3, 2],), {"sharing": "none"}, "sharing: expected one of .* got 'none'"),
        (([3, 2],), {"sharing": "grouped"}, "groups: expected one label per input"),
        (([3, 2],), {"groups": ["a"] * 3}, "groups: expected one label per input"),
        (([3, 2],), {"sharing": "grouped", "groups": ["a"]}, "groups: expected 3 labels.* got 1"),
        (([3, 2],), {"eta": "fast"}, "eta: expected a finite number or 'evolved', got 'fast'"),
        (([3, 2],), {"eta": float("nan")}, "eta: expected a finite number"),
        (([3, 2],), {"normalize": "l1"}, "normalize: expected None, 'l2', .* got 'l1'"),
        (([3, 2],), {"population": 40}, r"population: expected a tuple .* got 40"),
        (([3, 2],), {"population": (0,)}, "population: expected"),
    ],
)
def test_wrong_arguments_are_refused(arguments, options, message):
    with pytest.raises(ValueError, match=message):
        hebbtorch.HebbianMLP(*arguments, **options)


def test_a_layer_refuses_to_have_no_neurons():
    with pytest.raises(ValueError, match="sizes: expected"):
        hebbtorch.HebbianLinear(0, 2)
    with pytest.raises(ValueError, match="sizes: expected"):
        hebbtorch.StaticMLP([2])
