"""Neuron-centric genes, initial weights, trained layers made plastic, interventions, recurrence."""

import math

import pytest
import torch
from torch import nn

import hebbtorch


def seeded(seed):
    return torch.Generator().manual_seed(seed)


def act(rows, inputs):
    """Outputs of one layer, scalar by scalar."""
    return [math.tanh(sum(w * v for w, v in zip(row, inputs, strict=True))) for row in rows]


@pytest.mark.parametrize(
    ("sizes", "evolved", "fixed"),
    [([8, 8, 10], 112, 86), ([29, 29, 10], 301, 233), ([31, 31, 7], 307, 238), ([3, 2], 20, 15)],
)
def test_numbers_of_neuron_centric_genes(sizes, evolved, fixed):
    n = sum(sizes)
    net = hebbtorch.HebbianMLP(sizes, sharing="neuron", eta="evolved")
    assert net.n_genes == evolved == 5 * n - sizes[0] - sizes[-1]
    assert fixed == 4 * n - sizes[0] - sizes[-1]
    assert hebbtorch.HebbianMLP(sizes, sharing="neuron").n_genes == fixed
    assert hebbtorch.HebbianLinear(3, 2, sharing="neuron").n_genes == 4 * 5 - 3 - 2


def test_a_neuron_centric_network_equals_its_equation():
    sizes = [3, 4, 2]
    net = hebbtorch.HebbianMLP(
        sizes, sharing="neuron", eta="evolved", population=(2,), dtype=torch.float64
    )
    net.set_genomes(2 * torch.rand(2, net.n_genes, generator=seeded(1), dtype=torch.float64) - 1)
    state = net.initial_state("uniform", generator=seeded(2))
    neurons = [net.layers[0].rules.pre, net.layers[0].rules.post, net.layers[1].rules.post]
    assert net.layers[1].rules.pre is neurons[1]
    assert (neurons[0].names, neurons[1].names, neurons[2].names) == (
        ["A", "B", "D"], ["A", "B", "C", "D"], ["A", "C", "D"],
    )  # fmt: skip
    x = torch.rand(2, 3, generator=seeded(3), dtype=torch.float64)
    y, after = net(x, state)
    for k in range(2):
        values = [x[k].tolist()]
        for weights in state.weights:
            rows = weights[k].tolist()
            values.append(
                [
                    math.tanh(sum(w * v for w, v in zip(row, values[-1], strict=True)))
                    for row in rows
                ]
            )
        assert y[k].tolist() == pytest.approx(values[-1], abs=1e-12)
        for layer in range(2):
            pre, post = (
                {n: getattr(g, n)[k, 0].tolist() for n in [*g.names, "eta_gene"]}
                for g in neurons[layer : layer + 2]
            )
            for j in range(sizes[layer + 1]):
                for i in range(sizes[layer]):
                    xi, yj = values[layer][i], values[layer + 1][j]
                    eta = 0.005 * (10 ** pre["eta_gene"][i] + 10 ** post["eta_gene"][j])
                    change = pre["B"][i] * xi + post["C"][j] * yj + pre["D"][i] * post["D"][j]
                    change += pre["A"][i] * post["A"][j] * xi * yj
                    expected = state.weights[layer][k, j, i].item() + eta * change
                    assert after.weights[layer][k, j, i].item() == pytest.approx(
                        expected, abs=1e-12
                    )


def test_missing_terms_have_no_neuron_genes():
    net = hebbtorch.HebbianMLP([3, 4, 2], sharing="neuron", terms="BD")
    assert net.n_genes == (3 + 4) + 9
    rule = net.layers[0].coefficients()
    assert rule.A.item() == rule.C.item() == 0


@pytest.mark.parametrize("init", ["uniform", "normal", "kaiming"])
def test_random_initial_weights(init):
    net = hebbtorch.HebbianMLP([200, 100], init=init, population=(3,))
    (weights,) = net.initial_state(generator=[seeded(s) for s in (4, 5, 6)]).weights
    expected = {"uniform": 1 / 3, "normal": 1.0, "kaiming": 2 / 200}[init]
    assert weights.var().item() == pytest.approx(expected, rel=0.05)
    assert weights.mean().abs() < 5 * math.sqrt(expected / weights.numel())
    alone = hebbtorch.HebbianMLP([200, 100], init=init)
    assert torch.equal(alone.initial_state(generator=seeded(5)).weights[0], weights[1])


def test_initial_weights_that_are_given_made_or_evolved():
    given = torch.arange(6.0).reshape(2, 3)
    layer = hebbtorch.HebbianLinear(3, 2, init=given, population=(4,))
    assert torch.equal(layer.initial_state().weights[0][3], given)
    assert "given" in layer.state_dict()

    def ones(shape, generator):
        return torch.ones(shape)

    assert (hebbtorch.HebbianLinear(3, 2, init=ones).initial_state().weights[0] == 1).all()
    evolved = hebbtorch.HebbianMLP([3, 2], init="evolved", population=(4,))
    assert evolved.n_genes == 4 * 6 + 6
    genomes = torch.arange(4.0 * 30).reshape(4, 30)
    evolved.set_genomes(genomes)
    first = evolved.initial_state(batch=(2,)).weights[0]
    assert torch.equal(first[1].flatten(1), genomes[:, -6:])
    with pytest.raises(ValueError, match="init: expected a layer built with init='evolved'"):
        layer.initial_state("evolved")
    mixed = hebbtorch.HebbianMLP([3, 2, 2], init=[given, "zeros"])
    assert torch.equal(mixed.initial_state().weights[0], given)


def test_a_trained_layer_made_plastic_does_what_it_did_until_its_rules_are_set():
    for bias in (True, False):
        linear = nn.Linear(5, 3, bias=bias)
        x = torch.rand(4, 5)
        layer = hebbtorch.HebbianLinear.from_linear(linear, population=(4,), fixed=True)
        y, state = layer(x, plastic=False)
        torch.testing.assert_close(y, linear(x))
        _, state = layer(x, state)
        torch.testing.assert_close(layer(x, state)[0], linear(x))  # rules of zero
        layer.set_genomes(torch.rand(4, layer.n_genes))
        assert not torch.allclose(layer(x, layer(x)[1])[0], linear(x))
    double = hebbtorch.HebbianLinear.from_linear(nn.Linear(2, 2).double(), activation="tanh")
    assert double.initial_state().weights[0].dtype == torch.float64


def stepped(net, state, steps=4, seed=1):
    for x in torch.rand(steps, *net.population, net.sizes[0], generator=seeded(seed)):
        _, state = net(x, state)
    return state


def test_interventions_in_a_life():
    net = hebbtorch.HebbianMLP([3, 4, 2], population=(2,), eta=0.5)
    state = stepped(net, net.initial_state("uniform", generator=seeded(2)))
    mask = torch.tensor([True, False])

    frozen = stepped(net, state.freeze(mask))
    free = stepped(net, state)
    for was, now, other in zip(state.weights, frozen.weights, free.weights, strict=True):
        assert torch.equal(was[0], now[0])
        assert torch.equal(now[1], other[1])
    thawed = stepped(net, frozen.freeze(torch.zeros(2, dtype=torch.bool)))
    assert not torch.equal(thawed.weights[0][0], frozen.weights[0][0])

    without = hebbtorch.HebbianMLP([3, 4, 2], population=(2,), eta=0.5, terms="BCD")
    for ours, theirs in zip(net.layers, without.layers, strict=True):
        for term in "BCD":
            getattr(theirs.rules, term).data = getattr(ours.rules, term).data
    dropped, expected = stepped(net, state.drop("A", mask)), stepped(without, state)
    assert torch.equal(dropped.weights[0][0], expected.weights[0][0])
    assert torch.equal(dropped.weights[0][1], free.weights[0][1])

    other = hebbtorch.HebbianMLP([3, 4, 2], population=(2,), eta="evolved")
    swapped, expected = stepped(net, state.swap_rules(other)), stepped(other, state)
    torch.testing.assert_close(swapped.weights, expected.weights)

    shuffled = state.shuffle(seeded(3), mask)
    for was, now in zip(state.weights, shuffled.weights, strict=True):
        assert not torch.equal(was[0], now[0])
        assert torch.equal(was[0].flatten().sort()[0], now[0].flatten().sort()[0])
        assert torch.equal(was[1], now[1])

    again = state.freeze().reset(mask, net.initial_state())
    assert (again.weights[0][0] == 0).all()
    assert torch.equal(again.weights[0][1], state.weights[0][1])


def test_a_plastic_recurrent_network_equals_scalar_loops():
    net = hebbtorch.HebbianRNN([2, 3, 1], eta=0.3, dtype=torch.float64)
    state = net.initial_state("uniform", generator=seeded(1))
    weights = [w.tolist() for w in state.weights]
    rules = [[c.tolist() for c in layer.coefficients()] for layer in net.layers]
    hidden = [0.0] * 3
    for x in torch.rand(8, 2, generator=seeded(2), dtype=torch.float64):
        y, state = net(x, state)
        values = [x.tolist() + hidden]
        for rows in weights:
            values.append(
                [
                    math.tanh(sum(w * v for w, v in zip(row, values[-1], strict=True)))
                    for row in rows
                ]
            )
        assert y.tolist() == pytest.approx(values[-1], abs=1e-12)
        hidden = values[1]
        for k, rows in enumerate(weights):
            a, b, c, d = rules[k]
            for j, row in enumerate(rows):
                for i in range(len(row)):
                    pre, post = values[k][i], values[k + 1][j]
                    change = a[j][i] * pre * post + b[j][i] * pre + c[j][i] * post + d[j][i]
                    row[i] += 0.3 * change
    assert state.weights[0].tolist() == [pytest.approx(row, abs=1e-10) for row in weights[0]]
    layer = hebbtorch.Stateful(net)
    assert layer(torch.rand(2, dtype=torch.float64)).shape == (1,)
    assert layer.hidden_0.shape == (1, 3)
