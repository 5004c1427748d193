"""Rules without some of their terms."""

from itertools import combinations

import pytest
import torch

import hebbtorch

SIZES = [4, 3, 2]
GROUPS = ["touch", "area", "touch", "lidar"]
SUBSETS = ["".join(letters) for n in (1, 2, 3) for letters in combinations("ABCD", n)]


def full_genomes(full, genomes, terms):
    """Genomes of the network with all terms: those given, and zero for the others' genes."""
    blocks, start = [], 0
    for block in full.gene_blocks:
        count = block.shape[0] * block.shape[1]
        if block.name in terms or block.name == "eta":
            blocks.append(genomes[..., start : start + count])
            start += count
        else:
            blocks.append(torch.zeros(*genomes.shape[:-1], count))
    assert start == genomes.shape[-1]
    return torch.cat(blocks, -1)


@pytest.mark.parametrize("terms", SUBSETS)
@pytest.mark.parametrize("sharing", ["full", "grouped", "single"])
@pytest.mark.parametrize(("eta", "normalize"), [(0.3, None), ("evolved", "l2")])
def test_a_missing_term_is_a_term_of_zeros(terms, sharing, eta, normalize):
    options = {
        "sharing": sharing,
        "groups": GROUPS if sharing == "grouped" else None,
        "eta": eta,
        "normalize": normalize,
        "population": (5,),
    }
    generator = torch.Generator().manual_seed(2)
    net = hebbtorch.HebbianMLP(SIZES, terms=terms, **options)
    full = hebbtorch.HebbianMLP(SIZES, **options)
    genes_per_term = full.n_genes // (5 if eta == "evolved" else 4)
    assert net.n_genes == genes_per_term * (len(terms) + (eta == "evolved"))
    genomes = 2 * torch.rand(5, net.n_genes, generator=generator) - 1
    net.set_genomes(genomes)
    assert torch.equal(net.genomes(), genomes)
    full.set_genomes(full_genomes(full, genomes, terms))
    for ours, theirs in zip(net.layers, full.layers, strict=True):
        for mine, other in zip(ours.coefficients(), theirs.coefficients(), strict=True):
            assert torch.equal(mine.broadcast_to(other.shape), other)
    state = expected = initial = net.initial_state("uniform", generator=generator)
    for _ in range(10):
        x = torch.rand(5, SIZES[0], generator=generator)
        y, state = net(x, state)
        y_expected, expected = full(x, expected)
        assert torch.equal(y, y_expected)
        for weights, others in zip(state.weights, expected.weights, strict=True):
            assert torch.equal(weights, others)
    assert not torch.equal(state.weights[0], initial.weights[0])


def test_all_terms_are_the_default():
    torch.manual_seed(1)
    default = hebbtorch.HebbianMLP(SIZES, eta="evolved")
    torch.manual_seed(1)
    explicit = hebbtorch.HebbianMLP(SIZES, eta="evolved", terms="ABCD")
    names = ["rules.A", "rules.B", "rules.C", "rules.D", "rules.eta_gene"]
    assert [name for name, _ in default.layers[0].named_parameters()] == names
    assert list(default.layers[0].state_dict()) == ["_extra_state", *names]
    assert torch.equal(default.genomes(), explicit.genomes())


def test_what_is_left_keeps_its_order_and_its_names():
    layer = hebbtorch.HebbianLinear(3, 2, terms="BD")
    layer.set_genomes(torch.arange(12.0))
    assert [(b.name, b.genes.start) for b in layer.gene_blocks] == [("B", 0), ("D", 6)]
    rule = layer.coefficients()
    assert rule.B.tolist() == [[0, 1, 2], [3, 4, 5]]
    assert rule.D.tolist() == [[6, 7, 8], [9, 10, 11]]
    assert rule.A.item() == rule.C.item() == 0
    assert list(layer.state_dict()) == ["_extra_state", "rules.B", "rules.D"]
    assert "terms='BD'" in repr(layer)


def test_a_network_without_a_term_follows_its_precision():
    net = hebbtorch.HebbianMLP([2, 1], terms="D").double()
    net.set_genomes(torch.tensor([1.0, 2.0]))
    x = torch.zeros(2, dtype=torch.float64)
    _, state = net(x, net.initial_state())
    assert state.weights[0].tolist() == [[0.01, 0.02]]


@pytest.mark.parametrize("terms", ["", "E", "DA", "AA", "abcd", "A B", None, ["A"]])
def test_other_terms_are_refused(terms):
    for build in (hebbtorch.HebbianLinear, lambda *n, **o: hebbtorch.HebbianMLP(n, **o)):
        with pytest.raises(ValueError, match="terms: expected .* got") as refusal:
            build(3, 2, terms=terms)
        assert "\n" not in str(refusal.value)
