"""The plastic step as ordinary differentiable torch code."""

import pytest
import torch
from torch.func import functional_call, vmap

import hebbtorch


@pytest.mark.parametrize("normalize", [None, "l2", "minmax"])
@pytest.mark.parametrize("eta", [0.3, "evolved"])
@pytest.mark.parametrize("sharing", hebbtorch.SHARINGS)
def test_gradcheck_of_three_steps(sharing, eta, normalize):
    generator = torch.Generator().manual_seed(5)
    groups = ["a", "b", "a"] if sharing == "grouped" else None
    net = hebbtorch.HebbianMLP(
        [3, 2, 2],
        sharing=sharing,
        groups=groups,
        eta=eta,
        normalize=normalize,
        population=(2,),
        dtype=torch.float64,
    )
    genomes = torch.rand(2, net.n_genes, generator=generator, dtype=torch.float64)
    net.set_genomes(genomes)
    names, parameters = zip(*net.named_parameters(), strict=True)
    x = torch.rand(2, 3, generator=generator, dtype=torch.float64)
    initial = net.initial_state("uniform", generator=generator)

    def three_steps(x, first, second, *parameters):
        state = hebbtorch.State((first, second))
        for _ in range(3):
            y, state = functional_call(net, dict(zip(names, parameters, strict=True)), (x, state))
        return y, *state.weights

    leaves = [t.detach().clone().requires_grad_() for t in (x, *initial.weights, *parameters)]
    assert torch.autograd.gradcheck(three_steps, leaves)


def test_gradients_stay_finite_where_a_row_of_weights_is_zero():
    weights = torch.tensor([[0.0, 0.0], [3.0, 4.0]], dtype=torch.float64, requires_grad=True)
    bounded = hebbtorch.l2_normalize(weights)
    assert bounded.tolist() == [[0.0, 0.0], [0.6, 0.8]]
    bounded.sum().backward()
    assert weights.grad is not None
    # d(w / |w|) = (I - n n^T) / |w|, summed over outputs: ((1, 1) - 1.4 (0.6, 0.8)) / 5.
    expected = torch.tensor([[1.0, 1.0], [0.16 / 5, -0.12 / 5]], dtype=torch.float64)
    torch.testing.assert_close(weights.grad, expected)


@pytest.mark.parametrize("mapped", ["w", "x", "y", "xy", "B", "e", "ABCD", "wABCDexy"])
def test_vmap_over_any_argument_of_the_pure_step_equals_a_loop(mapped):
    generator = torch.Generator().manual_seed(6)
    shapes = {"w": (2, 3), **dict.fromkeys("ABCD", (2, 3)), "e": (), "x": (3,), "y": (2,)}
    values = {
        name: torch.randn(
            (5, *shape) if name in mapped else shape, generator=generator, dtype=torch.float64
        )
        for name, shape in shapes.items()
    }

    def update(w, a, b, c, d, e, x, y):
        return hebbtorch.abcd_update(w, hebbtorch.Rule(a, b, c, d), e, x, y)

    in_dims = tuple(0 if name in mapped else None for name in shapes)
    looped = [
        update(*(v[k] if name in mapped else v for name, v in values.items())) for k in range(5)
    ]
    together = vmap(update, in_dims=in_dims)(*values.values())
    torch.testing.assert_close(together, torch.stack(looped), rtol=0, atol=1e-15)


def test_vmap_over_genomes_and_states_equals_a_population():
    generator = torch.Generator().manual_seed(7)
    many = hebbtorch.HebbianMLP([3, 4, 2], normalize="l2", population=(6,), dtype=torch.float64)
    one = hebbtorch.HebbianMLP([3, 4, 2], normalize="l2", dtype=torch.float64)
    initial = many.initial_state("uniform", generator=generator)
    x = torch.rand(6, 3, generator=generator, dtype=torch.float64)
    parameters = {name: p.detach() for name, p in many.named_parameters()}

    def step(parameters, x, state):
        return functional_call(one, parameters, (x, state))

    y, state = vmap(step)(parameters, x, initial)
    expected_y, expected = many(x, initial)
    torch.testing.assert_close(y, expected_y, rtol=0, atol=1e-15)
    for w, e in zip(state.weights, expected.weights, strict=True):
        torch.testing.assert_close(w, e, rtol=0, atol=1e-15)


def test_the_step_writes_into_nothing_it_was_given():
    net = hebbtorch.HebbianMLP([3, 4, 2], normalize="l2", population=(2,))
    state = net.initial_state("uniform", generator=torch.Generator().manual_seed(8))
    x = torch.rand(2, 3)
    given = [x, *state.weights, *net.parameters()]
    versions = [t._version for t in given]
    with torch.no_grad():
        _, new = net(x, state)
    assert [t._version for t in given] == versions
    assert all((a != b).any() for a, b in zip(new.weights, state.weights, strict=True))


def test_an_optimizer_trains_the_rules():
    torch.manual_seed(9)
    net = hebbtorch.HebbianMLP([2, 5, 1], eta=0.1)
    optimizer = torch.optim.Adam(net.parameters(), lr=0.05)
    inputs = torch.tensor([[1.0, 0.0], [0.0, 1.0]])
    losses = []
    for _ in range(60):
        state = net.initial_state()
        loss = torch.tensor(0.0)
        for step in range(10):
            y, state = net(inputs[step % 2], state)
            target = 0.8 if step % 2 else -0.8
            loss = loss + (y - target).square().sum() * (step >= 4)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    assert losses[0] > 2.0  # 6 scored steps, each near 0.64 for an output near 0
    assert losses[-1] < 0.1 * losses[0]


def test_frozen_at_any_step():
    net = hebbtorch.HebbianMLP([3, 4, 2])
    state = net.initial_state("uniform", generator=torch.Generator().manual_seed(10))
    x = torch.rand(3)
    _, learnt = net(x, state)
    y, same = net(x, learnt, plastic=False)
    assert same is learnt
    plastic_y, changed = net(x, learnt)
    assert torch.equal(y, plastic_y)  # the output is computed before the update
    assert not torch.equal(changed.weights[0], learnt.weights[0])
