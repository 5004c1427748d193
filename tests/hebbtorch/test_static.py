"""The static baselines: gain, biases, recurrence, the authors' variant."""

import math

import pytest
import torch

import hebbtorch


def seeded(seed):
    return torch.Generator().manual_seed(seed)


def neuron(weights, inputs, bias):
    return sum(w * x for w, x in zip(weights, inputs, strict=True)) + bias


def test_gain_bias_and_activations_equal_scalar_loops():
    net = hebbtorch.StaticMLP(
        [3, 4, 2],
        gain=30.0,
        bias=True,
        output_activation="identity",
        input_activation="tanh",
        population=(2,),
        dtype=torch.float64,
    )
    genomes = torch.randn(2, net.n_genes, generator=seeded(1), dtype=torch.float64)
    net.set_genomes(genomes)
    assert net.n_genes == (3 + 1) * 4 + (4 + 1) * 2
    x = torch.randn(2, 3, generator=seeded(2), dtype=torch.float64)
    y, state = net(x)
    assert torch.equal(net(x, state)[0], y)
    for k in range(2):
        genes = [30 * gene for gene in genomes[k].tolist()]
        rows = [genes[3 * j : 3 * j + 3] for j in range(4)]
        inputs = [math.tanh(v) for v in x[k].tolist()]
        hidden = [math.tanh(neuron(rows[j], inputs, genes[12 + j])) for j in range(4)]
        outputs = [neuron(genes[16 + 4 * j : 20 + 4 * j], hidden, genes[24 + j]) for j in range(2)]
        assert y[k].tolist() == pytest.approx(outputs, abs=1e-12)


def test_a_gain_leaves_the_genome_as_it_is():
    net = hebbtorch.StaticMLP([3, 2], gain=10.0, bias=True)
    genome = torch.arange(8.0)
    net.set_genomes(genome)
    assert torch.equal(net.genomes(), genome)
    assert torch.equal(net.initial_state().weights[0], 10 * genome[:6].reshape(2, 3))


def test_recurrent_network_equals_scalar_loops():
    net = hebbtorch.StaticRNN([2, 3, 1], gain=2.0, bias=True, population=(2,), dtype=torch.float64)
    assert net.n_genes == 3 * (2 + 3) + 1 * 3 + 3 + 1
    genomes = torch.randn(2, net.n_genes, generator=seeded(3), dtype=torch.float64)
    net.set_genomes(genomes)
    inputs = torch.randn(6, 2, 2, generator=seeded(4), dtype=torch.float64)
    state, ours = None, []
    for x in inputs:
        y, state = net(x, state)
        ours.append(y)
    for k in range(2):
        genes = [2 * gene for gene in genomes[k].tolist()]
        hidden = [0.0] * 3
        for t in range(6):
            seen = inputs[t, k].tolist() + hidden
            hidden = [
                math.tanh(neuron(genes[5 * j : 5 * j + 5], seen, genes[15 + j])) for j in range(3)
            ]
            y = math.tanh(neuron(genes[18:21], hidden, genes[21]))
            assert ours[t][k].item() == pytest.approx(y, abs=1e-12)


def test_recurrent_individuals_restart_alone():
    net = hebbtorch.StaticRNN([2, 3, 1], population=(2,))
    _, state = net(torch.ones(2, 2))
    state = state.reset(torch.tensor([True, False]), net.initial_state())
    hidden = state.memory[0]["hidden"]
    assert (hidden[0] == 0).all()
    assert (hidden[1] != 0).all()


@pytest.mark.parametrize("bias", [False, True])
@pytest.mark.parametrize(("n_in", "n_out"), [(8, 10), (29, 10), (3, 7), (31, 7)])
def test_the_largest_hidden_layer_just_fits_the_hebbian_controllers_genes(n_in, n_out, bias):
    budget = hebbtorch.HebbianMLP([n_in, n_in, n_out]).n_genes
    hidden = hebbtorch.StaticRNN.largest_hidden(n_in, n_out, budget, bias=bias)
    fits = hebbtorch.StaticRNN([n_in, hidden, n_out], bias=bias).n_genes
    larger = hebbtorch.StaticRNN([n_in, hidden + 1, n_out], bias=bias).n_genes
    assert fits <= budget < larger


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: hebbtorch.StaticMLP([3, 2], gain=math.nan), "gain: expected a finite number"),
        (lambda: hebbtorch.StaticMLP([3, 2], activation="step"), "activation: expected a callable"),
        (lambda: hebbtorch.StaticRNN([3, 4, 4, 2]), r"sizes: expected \[in, hidden, out\]"),
        (lambda: hebbtorch.StaticRNN.largest_hidden(3, 2, 5), "n_genes: expected at least 6"),
    ],
)
def test_refused(build, message):
    with pytest.raises(ValueError, match=message):
        build()


def test_the_authors_hebbian_network_is_ours_with_two_terms_exchanged_and_a_constant_input():
    options = {"population": (2,), "dtype": torch.float64}
    theirs = hebbtorch.HebbianMLP([3, 4, 2], exchange_bc=True, constant_last_input=True, **options)
    ours = hebbtorch.HebbianMLP([3, 4, 2], **options)
    genomes = torch.rand(2, ours.n_genes, generator=seeded(5), dtype=torch.float64)
    theirs.set_genomes(genomes)
    exchanged = genomes.clone()
    blocks = {(block.layer, block.name): block.genes for block in ours.gene_blocks}
    for layer in (0, 1):
        exchanged[:, blocks[layer, "B"]] = genomes[:, blocks[layer, "C"]]
        exchanged[:, blocks[layer, "C"]] = genomes[:, blocks[layer, "B"]]
    ours.set_genomes(exchanged)
    a, b = theirs.initial_state(), ours.initial_state()
    for x in torch.rand(5, 2, 3, generator=seeded(6), dtype=torch.float64):
        y, a = theirs(x, a)
        with_one = x.clone()
        with_one[:, -1] = 1.0
        expected, b = ours(with_one, b)
        assert torch.equal(y, expected)
    assert all(map(torch.equal, a.weights, b.weights))
