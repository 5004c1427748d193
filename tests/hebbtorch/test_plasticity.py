"""Rules, bounds, schedules and fixed weights against the scalar loops of `plasticity_oracle`."""

import itertools

import pytest
import torch

import hebbtorch
from hebbtorch.functional.activation import ACTIVATIONS
from tests.hebbtorch.plasticity_oracle import Layer

SIZES = [4, 3, 2]  # all different, so that a transposed matrix cannot pass
STEPS = 25
VARIANTS = {
    "plain": {},
    "attractor": {"normalize": "max", "average": 5, "every": 3},
    "averages": {"average": 4},
    "intervals": {"every": 4, "normalize": "l2"},
    "leaky": {"decay": 0.05, "clip": 0.4},
    "clipped then normalized": {"clip": 0.5, "normalize": "minmax"},
    "traces": {"trace_decay": 0.7},
    "traces in intervals": {"trace_decay": 0.5, "every": 2, "average": 3, "decay": 0.1},
    "fixed": {"fixed": True, "bias": True, "activation": "sigmoid"},
    "linear outputs": {"output_activation": "identity", "activation": "relu", "eta": "evolved"},
}


def seeded(seed):
    return torch.Generator().manual_seed(seed)


def table(tensor, layer, k):
    """A coefficient of individual k as a list [out][in]."""
    full = torch.as_tensor(tensor, dtype=torch.float64)
    return full.broadcast_to(2, layer.n_out, layer.n_in)[k].tolist()


def oracles(net, state, k, rule, options):
    made = []
    for index, (layer, weights) in enumerate(zip(net.layers, state.weights, strict=True)):
        is_last = index == len(net.layers) - 1
        plan = {n: options[n] for n in ("normalize", "average", "every", "decay") if n in options}
        plan |= {n: options[n] for n in ("clip", "trace_decay") if n in options}
        plan["activation"] = options.get("activation", "tanh")
        if is_last and "output_activation" in options:
            plan["activation"] = options["output_activation"]
        if "fixed" in options:
            plan |= {"fixed": layer.fixed[k].tolist(), "alpha": layer.alpha[k].tolist()}
            plan["bias"] = layer.bias[k, :, 0].tolist()
        names = layer.named_coefficients()
        coefficients = {name: table(c.detach(), layer, k) for name, c in names.items()}
        eta = layer.learning_rate()
        rate = table(eta.detach() if isinstance(eta, torch.Tensor) else eta, layer, k)
        made.append(Layer(weights[k].tolist(), rule, coefficients, rate, **plan))
    return made


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("rule", ["abcd", "hebb", "oja", "bcm", "differential"])
def test_network_equals_scalar_loops(rule, variant):
    options = {"eta": 0.1, **VARIANTS[variant]}
    net = hebbtorch.HebbianMLP(SIZES, rule=rule, population=(2,), dtype=torch.float64, **options)
    net.set_genomes(2 * torch.rand(2, net.n_genes, generator=seeded(1), dtype=torch.float64) - 1)
    state = net.initial_state("uniform", generator=seeded(2))
    scalar = [oracles(net, state, k, rule, options) for k in range(2)]
    inputs = torch.rand(STEPS, 2, SIZES[0], generator=seeded(3), dtype=torch.float64)
    modulation = 2 * torch.rand(STEPS, 2, generator=seeded(4), dtype=torch.float64) - 1
    learns = torch.rand(STEPS, 2, generator=seeded(5)) < 0.7
    for t, x in enumerate(inputs):
        before = state.weights
        y, state = net(x, state, learns[t], modulation=modulation[t])
        for k in range(2):
            values = x[k].tolist()
            for layer in scalar[k]:
                values = layer.step(values, bool(learns[t, k]), modulation[t, k].item())
            assert y[k].tolist() == pytest.approx(values, abs=1e-9)
            for old, new in zip(before, state.weights, strict=True):
                assert learns[t, k] or torch.equal(old[k], new[k])
    for k, index in itertools.product(range(2), range(2)):
        expected = torch.tensor(scalar[k][index].weights, dtype=torch.float64)
        torch.testing.assert_close(state.weights[index][k], expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("rule", ["abcd", "bcm", "differential"])
def test_an_individual_is_the_same_alone_and_in_a_batch(rule, variant):
    options = {"rule": rule, **VARIANTS[variant], "eta": 1e-4}
    net = hebbtorch.HebbianMLP([29, 29, 10], population=(7,), **options)
    alone = hebbtorch.HebbianMLP([29, 29, 10], **options)
    net.set_genomes(2 * torch.rand(7, net.n_genes, generator=seeded(1)) - 1)
    alone.set_genomes(net.genomes()[4])
    state = net.initial_state("uniform", generator=seeded(2))
    single = alone.initial_state(torch.zeros(1, 1))
    single = single._replace(weights=tuple(w[4].clone() for w in state.weights))
    with torch.no_grad():
        for x in torch.rand(12, 7, 29, generator=seeded(3)):
            y, state = net(x, state)
            y_alone, single = alone(x[4], single)
            assert torch.equal(y[4], y_alone)
    assert y.isfinite().all()
    assert all(torch.equal(w[4], s) for w, s in zip(state.weights, single.weights, strict=True))


@pytest.mark.parametrize("name", ACTIVATIONS)
def test_activations_do_not_depend_on_the_batch(name):
    x = 4 * torch.randn(7, 13, generator=seeded(1))
    together = ACTIVATIONS[name](x)
    assert all(torch.equal(ACTIVATIONS[name](row), y) for row, y in zip(x, together, strict=True))


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("rule", ["abcd", "oja", "bcm", "differential"])
def test_gradcheck(rule, variant):
    options = {"rule": rule, "eta": 0.3, **VARIANTS[variant]}
    if options.get("activation") == "relu":
        options["activation"] = "softsign"  # relu has a kink
    net = hebbtorch.HebbianMLP([3, 2, 2], dtype=torch.float64, **options)
    net.set_genomes(torch.rand(net.n_genes, generator=seeded(1), dtype=torch.float64))
    x = torch.rand(3, 3, generator=seeded(2), dtype=torch.float64)
    m = torch.rand(3, generator=seeded(3), dtype=torch.float64)
    initial = net.initial_state("uniform", generator=seeded(4))

    def three_steps(genome, first, second, m):
        state = initial._replace(weights=(first, second))
        for t in range(3):
            call = (x[t], state)
            y, state = torch.func.functional_call(
                net, net.decode(genome), call, {"modulation": m[t]}
            )
        return y, *state.weights

    leaves = [net.genomes(), *initial.weights, m]
    assert torch.autograd.gradcheck(three_steps, [t.clone().requires_grad_() for t in leaves])


def test_defaults_are_the_plain_step():
    net = hebbtorch.HebbianMLP([3, 4, 2])
    plain = {"rule": "abcd", "average": 1, "every": 1, "decay": 0.0, "clip": None}
    plain |= {"activation": "tanh", "output_activation": None, "bias": False, "fixed": False}
    same = hebbtorch.HebbianMLP([3, 4, 2], init="zeros", **plain)
    same.set_genomes(net.genomes())
    x = torch.rand(3)
    _, state = net(x)
    assert state.memory == ()
    rule = net.layers[0].coefficients()
    expected = hebbtorch.abcd_update(torch.zeros(4, 3), rule, 0.01, x, torch.zeros(4))
    assert torch.equal(state.weights[0], expected)
    assert all(map(torch.equal, same(x)[1].weights, state.weights))


def test_oja_finds_the_first_principal_component_of_norm_one():
    layer = hebbtorch.HebbianLinear(
        5, 1, rule="oja", activation="identity", eta=0.01, dtype=torch.float64
    )
    mixing = torch.randn(5, 5, generator=seeded(1), dtype=torch.float64)
    patterns = torch.randn(4000, 5, generator=seeded(2), dtype=torch.float64) @ mixing / 3
    _, vectors = torch.linalg.eigh(patterns.T @ patterns)
    state = layer.initial_state("uniform", generator=seeded(3))
    with torch.no_grad():
        for x in patterns:
            _, state = layer(x, state)
    w = state.weights[0][0]
    assert abs(torch.nn.functional.cosine_similarity(w, vectors[:, -1], dim=0)) > 0.995
    assert w.norm().item() == pytest.approx(1, abs=0.05)


def test_oja_and_bcm_settle_at_their_fixed_points():
    x = torch.tensor([0.6, 0.8], dtype=torch.float64)
    options = {"activation": "identity", "eta": 0.05, "dtype": torch.float64}
    start = torch.tensor([[0.3, 0.1]])
    for rule in ("oja", "bcm"):
        layer = hebbtorch.HebbianLinear(2, 1, rule=rule, init=start, **options)
        state = layer.initial_state()
        with torch.no_grad():
            for _ in range(4000):
                y, state = layer(x, state)
        if rule == "oja":
            assert state.weights[0].norm().item() == pytest.approx(1, abs=1e-9)
        assert y.item() == pytest.approx(1, abs=1e-9)
    assert state.memory[0]["theta"].item() == pytest.approx(1, abs=1e-9)


def test_differential_learns_nothing_in_the_first_step():
    layer = hebbtorch.HebbianLinear(3, 2, rule="differential", init="uniform")
    state = layer.initial_state()
    _, first = layer(torch.rand(3), state)
    assert torch.equal(first.weights[0], state.weights[0])
    _, second = layer(torch.rand(3), first)
    assert not torch.equal(second.weights[0], first.weights[0])


def test_classical_rules_begin_with_a_coefficient_of_one():
    for rule in ("hebb", "oja", "bcm", "differential"):
        net = hebbtorch.HebbianMLP(SIZES, rule=rule)
        assert net.n_genes == 4 * 3 + 3 * 2
        assert (net.genomes() == 1).all()


def test_updates_happen_in_every_kth_step_of_each_individuals_own_life():
    net = hebbtorch.HebbianMLP([3, 2], every=3, population=(2,))
    state = net.initial_state()
    changed = []
    for t in range(8):
        if t == 4:
            state = state.reset(torch.tensor([False, True]), net.initial_state())
        before = state.weights[0]
        _, state = net(torch.rand(2, 3), state)
        changed.append((state.weights[0] != before).flatten(1).any(1).tolist())
    assert [t + 1 for t in range(8) if changed[t][0]] == [3, 6]
    assert [t + 1 for t in range(8) if changed[t][1]] == [3, 7]


def test_one_factor_of_zero_learns_nothing_and_keeps_its_trace():
    layer = hebbtorch.HebbianLinear(3, 2, trace_decay=0.9, dtype=torch.float64)
    x = torch.rand(3, dtype=torch.float64)
    zero, one = torch.tensor(0.0, dtype=torch.float64), torch.tensor(1.0, dtype=torch.float64)
    _, state = layer(x, modulation=zero)
    assert (state.weights[0] == 0).all()
    trace = state.memory[0]["trace"]
    assert (trace != 0).all()
    _, state = layer(x, state, plastic=False)
    assert (state.weights[0] == 0).all()
    torch.testing.assert_close(state.memory[0]["trace"], 1.9 * trace)
    _, state = layer(x, state, modulation=one)
    torch.testing.assert_close(state.weights[0], 2.71 * trace)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"average": 0}, "average: expected a number of steps >= 1, got 0"),
        ({"every": 1.5}, "every: expected a number of steps >= 1, got 1.5"),
        ({"decay": -0.1}, "decay: expected a number from 0 to 1"),
        ({"clip": 0.0}, "clip: expected a positive number or None"),
        ({"trace_decay": 2.0}, "trace_decay: expected a number from 0 to 1"),
        ({"rule": "stdp"}, "rule: expected one of .* got 'stdp'"),
        ({"rule": lambda w, x, y: x * y}, "rule: expected coefficients named"),
        ({"rule": "oja", "terms": "AB"}, "terms, exchange_bc: expected neither with rule 'oja'"),
        ({"rule": "oja", "sharing": "neuron"}, "'neuron' is for 'abcd' alone"),
        ({"rule": ["abcd", "oja", "hebb"]}, "rule: expected one for all or 2, got 3"),
        ({"activation": "step"}, "activation: expected a callable or one of"),
        ({"init": torch.zeros(5)}, "init: expected weights that broadcast to"),
    ],
)
def test_wrong_arguments_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        hebbtorch.HebbianMLP(SIZES, **options)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"plastic": torch.ones(3)}, r"plastic: expected True, False or a bool tensor of shape"),
        ({"plastic": torch.ones(2, dtype=torch.bool)}, r"shape \(3,\), got torch.bool of shape"),
        ({"modulation": torch.ones(2)}, r"modulation: expected a floating tensor of shape \(3,\)"),
    ],
)
def test_wrong_masks_are_refused(call, message):
    net = hebbtorch.HebbianMLP([4, 2], population=(3,))
    with pytest.raises(ValueError, match=message):
        net(torch.zeros(3, 4), **call)


def test_a_state_without_the_memory_of_the_rule_is_refused():
    net = hebbtorch.HebbianMLP([4, 2], rule="bcm", average=3)
    bare = hebbtorch.State((torch.zeros(2, 4),))
    with pytest.raises(ValueError, match=r"expected a memory with \['post_window', 'pre_window'"):
        net(torch.zeros(4), bare)


def test_a_rule_of_ones_own_in_one_layer():
    def leaky(w, x, y, c, d=0.5):
        return c * x * y - d * w

    net = hebbtorch.HebbianMLP([3, 2, 2], rule=["abcd", leaky], eta=0.5, dtype=torch.float64)
    assert [b.name for b in net.gene_blocks] == ["A", "B", "C", "D", "c", "d"]
    assert (net.layers[1].rules.d == 0.5).all()
    assert (net.layers[1].rules.c != 0).all()
    x = torch.rand(3, dtype=torch.float64)
    state = net.initial_state("uniform")
    hidden = net.layers[0].activate(x, state.weights[0])
    y, after = net(x, state)
    w = state.weights[1]
    change = net.layers[1].rules.c * hidden * y[:, None] - 0.5 * w
    torch.testing.assert_close(after.weights[1], w + 0.5 * change)
