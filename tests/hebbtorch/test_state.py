import copy

import pytest
import torch

import hebbtorch


def seeded(seed):
    return torch.Generator().manual_seed(seed)


def equal(a, b):
    return all(torch.equal(x, y) for x, y in zip(a.weights, b.weights, strict=True))


def test_births():
    net = hebbtorch.HebbianMLP([30, 20, 10], population=(6,))
    zeros = net.initial_state()
    assert [tuple(w.shape) for w in zeros.weights] == [(6, 20, 30), (6, 10, 20)]
    assert all((w == 0).all() for w in zeros.weights)
    uniform = torch.cat(
        [w.flatten() for w in net.initial_state("uniform", generator=seeded(1)).weights]
    )
    assert -1 <= uniform.min() < -0.99
    assert 0.99 < uniform.max() <= 1
    assert uniform.mean().abs() < 5 / (3 * uniform.numel()) ** 0.5  # 5 standard errors
    assert equal(
        net.initial_state("uniform", generator=seeded(1)),
        net.initial_state("uniform", generator=seeded(1)),
    )


def test_an_individuals_birth_can_be_reproduced_alone():
    runs = hebbtorch.HebbianMLP([3, 4, 2], population=(3, 5))
    one_run = hebbtorch.HebbianMLP([3, 4, 2], population=(5,))
    together = runs.initial_state("uniform", generator=[seeded(s) for s in (7, 8, 9)])
    for k, seed in enumerate((7, 8, 9)):
        alone = one_run.initial_state("uniform", generator=seeded(seed))
        assert equal(alone, hebbtorch.State(tuple(w[k] for w in together.weights)))


def test_precision_does_not_change_the_draws():
    double = hebbtorch.HebbianMLP([3, 2], dtype=torch.float64)
    single = hebbtorch.HebbianMLP([3, 2], dtype=torch.float32)
    drawn = double.initial_state("uniform", generator=seeded(1))
    assert equal(
        drawn.to(dtype=torch.float32), single.initial_state("uniform", generator=seeded(1))
    )


def test_reset_by_mask_restarts_some_and_leaves_the_others():
    net = hebbtorch.HebbianMLP([3, 4, 2], population=(4,))
    x = torch.rand(4, 3)
    _, state = net(x, net.initial_state())
    before = state.weights[0].clone()
    mask = torch.tensor([True, False, False, True])
    again = state.reset(mask, net.initial_state())
    for new, old in zip(again.weights, state.weights, strict=True):
        assert (new[mask] == 0).all()
        assert torch.equal(new[~mask], old[~mask])
        assert (old != 0).any()
    assert torch.equal(state.weights[0], before)
    # A failed individual's NaN does not outlive its reset.
    failed = hebbtorch.State(tuple(torch.full_like(w, torch.nan) for w in state.weights))
    assert (
        not failed.reset(torch.ones(4, dtype=torch.bool), net.initial_state())
        .weights[0]
        .isnan()
        .any()
    )


def test_detach_cuts_the_history():
    net = hebbtorch.HebbianMLP([3, 2])
    _, state = net(torch.rand(3), net.initial_state())
    assert state.weights[0].requires_grad
    assert not state.detach().weights[0].requires_grad
    assert equal(state, state.detach())


def test_l2_keeps_every_row_at_norm_one_and_frozen_weights_untouched():
    net = hebbtorch.HebbianMLP([5, 4, 3], normalize="l2", dtype=torch.float64)
    state = net.initial_state("uniform", generator=seeded(2))
    for _ in range(5):
        _, state = net(torch.rand(5, dtype=torch.float64), state)
    for w in state.weights:
        norms = w.norm(dim=-1)
        torch.testing.assert_close(norms, torch.ones_like(norms), rtol=0, atol=1e-15)
    initial = net.initial_state("uniform", generator=seeded(3))
    _, frozen = net(torch.rand(5, dtype=torch.float64), initial, plastic=False)
    assert equal(frozen, initial)


def test_l2_leaves_rows_of_zeros_at_zero():
    net = hebbtorch.HebbianMLP([3, 2], normalize="l2")
    net.set_genomes(torch.zeros(net.n_genes))
    y, state = net(torch.rand(3), net.initial_state())
    assert (state.weights[0] == 0).all()
    assert (y == 0).all()


def test_minmax_maps_every_row_onto_its_bounds_but_equal_weights():
    weights = torch.tensor([[1.0, 2.0, 5.0], [-3.0, -3.0, -3.0]], dtype=torch.float64)
    mapped = hebbtorch.minmax_rescale(weights)
    assert mapped.tolist() == [[-1.0, -0.5, 1.0], [-3.0, -3.0, -3.0]]


def test_stateful_layer_is_the_network_with_its_state_inside():
    net = hebbtorch.HebbianMLP([3, 4, 2], population=(4,))
    layer = hebbtorch.Stateful(net, "uniform", generator=seeded(4))
    state = net.initial_state("uniform", generator=seeded(4))
    for plastic in (True, True, False, True):
        x = torch.rand(4, 3)
        expected, state = net(x, state, plastic=plastic)
        assert torch.equal(layer(x, plastic=plastic), expected)
    assert equal(layer.state, state)

    layer.detach()
    restored = hebbtorch.Stateful(copy.deepcopy(net))
    restored.load_state_dict(layer.state_dict())
    assert equal(restored.state, state)

    mask = torch.tensor([False, True, False, False])
    layer.reset(mask, generator=seeded(5))
    assert equal(layer.state, state.reset(mask, net.initial_state("uniform", generator=seeded(5))))
    layer.reset(generator=seeded(6))
    assert equal(layer.state, net.initial_state("uniform", generator=seeded(6)))


def test_stateful_layer_gives_gradients_through_time():
    layer = hebbtorch.Stateful(hebbtorch.HebbianLinear(3, 2))
    layer(torch.ones(3))
    layer(torch.ones(3)).sum().backward()
    assert layer.network.rules.D.grad.abs().min() > 0
    layer.detach()
    assert not layer.state.weights[0].requires_grad


def test_stateful_buffers_follow_the_module():
    layer = hebbtorch.Stateful(hebbtorch.HebbianLinear(3, 2), batch=(5,)).double()
    assert layer.weights_0.dtype == torch.float64
    assert layer(torch.rand(5, 3, dtype=torch.float64)).shape == (5, 2)
    layer.reset()
    assert layer.weights_0.shape == (5, 2, 3)
    assert layer.weights_0.dtype == torch.float64


def test_static_network_has_batch_dimensions_too():
    net = hebbtorch.StaticMLP([3, 2], population=(4,))
    state = net.initial_state(batch=(5,))
    x = torch.rand(5, 4, 3)
    y, _ = net(x, state)
    for k in range(5):
        assert torch.equal(y[k], net(x[k], net.initial_state())[0])


@pytest.mark.parametrize(
    ("x", "message"),
    [
        (torch.zeros(4, 2), r"x: expected torch.float32 of shape \(4, 3\).* got .* \(4, 2\)"),
        (torch.zeros(3), r"x: expected .* shape \(4, 3\)"),
        (torch.zeros(2, 4, 3), r"x: expected .* shape \(4, 3\)"),
        (torch.zeros(4, 3, dtype=torch.float64), "x: expected torch.float32 .* got torch.float64"),
    ],
)
@pytest.mark.parametrize("kind", [hebbtorch.HebbianMLP, hebbtorch.StaticMLP])
def test_wrong_inputs_are_refused(kind, x, message):
    net = kind([3, 2], population=(4,))
    with pytest.raises(ValueError, match=message):
        net(x, net.initial_state())


def test_wrong_states_are_refused():
    net = hebbtorch.HebbianMLP([3, 4, 2], population=(4,))
    other = hebbtorch.HebbianMLP([3, 4, 2], population=(5,)).initial_state()
    x = torch.zeros(4, 3)
    with pytest.raises(ValueError, match=r"state: expected weights of shape .* got \(5, 4, 3\)"):
        net(x, other)
    with pytest.raises(ValueError, match="state: expected the weights of 2 layers, got those of 1"):
        net(x, hebbtorch.State(net.initial_state().weights[:1]))
    with pytest.raises(ValueError, match="mask: expected a bool tensor of shape"):
        net.initial_state().reset(torch.zeros(5, dtype=torch.bool), net.initial_state())
    with pytest.raises(ValueError, match="mask: expected a bool tensor"):
        net.initial_state().reset(torch.zeros(4), net.initial_state())
    with pytest.raises(ValueError, match="init: expected one of"):
        net.initial_state("ones")
    with pytest.raises(ValueError, match="generator: expected one generator per entry"):
        net.initial_state("uniform", generator=[seeded(1)] * 3)
    with pytest.raises(ValueError, match="generator: expected one generator per entry"):
        hebbtorch.HebbianMLP([3, 3]).initial_state("uniform", generator=[seeded(1)] * 3)
