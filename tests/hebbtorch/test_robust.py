"""What a user of PyTorch may do with a module, and what is refused."""

from __future__ import annotations

import copy
import io

import numpy as np
import pytest
import torch
from torch import nn

import hebbtorch
from hebbtorch.functional.bounds import l2_normalize

KINDS = [hebbtorch.HebbianMLP, hebbtorch.StaticMLP]


def life(net, x, steps=5):
    state = net.initial_state(batch=x.shape[:-1])
    with torch.no_grad():
        for _ in range(steps):
            y, state = net(x, state)
    return y, state


def some_inputs(*shape: int) -> torch.Tensor:
    return 2 * torch.rand(*shape, generator=torch.Generator().manual_seed(0)) - 1


@pytest.mark.parametrize("normalize", [None, "l2", "minmax"])
def test_strides_change_no_bit(normalize):
    """A sum over numbers that lie apart may take another order."""
    net = hebbtorch.HebbianMLP([29, 29, 10], normalize=normalize)
    x = some_inputs(64, 29)
    y, state = life(net, x)
    there = torch.zeros(29, 64).t().copy_(x)
    assert not there.is_contiguous()
    y_there, state_there = life(net, there)
    assert torch.equal(y_there, y)
    assert all(map(torch.equal, state_there.weights, state.weights))
    turned = hebbtorch.State(tuple(w.mT.contiguous().mT for w in state.weights))
    assert torch.equal(net(x, turned)[0], net(x, state)[0])


def test_a_network_made_on_meta_is_complete_once_loaded():
    options = {"sharing": "grouped", "groups": [0, 1, 0], "terms": "BD"}
    net = hebbtorch.HebbianMLP([3, 4, 2], **options)
    x = some_inputs(3)
    for assign in (False, True):
        with torch.device("meta"):
            other = hebbtorch.HebbianMLP([3, 4, 2], **options)
        if not assign:
            other = other.to_empty(device="cpu")
        other.load_state_dict(net.state_dict(), assign=assign)
        for made in (other, copy.deepcopy(other)):
            assert torch.equal(life(made, x)[0], life(net, x)[0])


def test_a_state_of_another_precision_than_the_rules_is_refused():
    net = hebbtorch.HebbianMLP([3, 4, 2])
    state = net.initial_state()
    net.double()
    with pytest.raises(ValueError, match="state: expected weights of torch.float64, as the rules"):
        net(some_inputs(3), state)
    net(some_inputs(3).double(), state.to(dtype=torch.float64))


def test_fresh_weights_fit_or_are_refused():
    net = hebbtorch.HebbianMLP([3, 2])
    state = life(net, some_inputs(4, 3))[1]
    mask = torch.tensor([True, False, False, True])
    again = state.reset(mask, net.initial_state())  # one initial state for all
    assert torch.equal(again.weights[0][mask], torch.zeros(2, 2, 3))
    assert torch.equal(again.weights[0][~mask], state.weights[0][~mask])
    for fresh in (
        net.initial_state(batch=(2,)),
        net.initial_state().to(dtype=torch.float64),
        hebbtorch.HebbianMLP([1, 1]).initial_state(),
    ):
        with pytest.raises(ValueError, match=r"fresh: expected torch.float32 .* \(4, 2, 3\)"):
            state.reset(mask, fresh)
    with pytest.raises(ValueError, match="expected the weights of 1 layers, got those of 2"):
        state.reset(mask, hebbtorch.HebbianMLP([3, 2, 2]).initial_state())


def test_states_are_not_changed_from_elsewhere():
    static = hebbtorch.StaticMLP([3, 2])
    given = static.initial_state()
    before = given.weights[0].clone()
    static.set_genomes(torch.zeros(static.n_genes))
    assert torch.equal(given.weights[0], before)

    layer = hebbtorch.Stateful(hebbtorch.HebbianMLP([3, 2]), "uniform")
    saved = layer.state
    before = saved.weights[0].clone()
    zeros = {k: torch.zeros_like(v) for k, v in layer.state_dict().items() if "weights" in k}
    layer.load_state_dict({**layer.state_dict(), **zeros})
    assert torch.equal(saved.weights[0], before)
    assert torch.equal(layer.state.weights[0], torch.zeros(2, 3))


def test_a_wrong_state_leaves_a_stateful_network_as_it_was():
    layer = hebbtorch.Stateful(hebbtorch.HebbianMLP([3, 4, 2]), "uniform")
    before = [weights.clone() for weights in layer.state.weights]
    shorter = hebbtorch.State(layer.state.weights[:1])
    narrower = hebbtorch.HebbianMLP([3, 3, 2]).initial_state()
    for wrong in (shorter, narrower, layer.state.weights):
        with pytest.raises(ValueError, match="state: expected .*weights of"):
            layer.state = wrong
    assert all(map(torch.equal, layer.state.weights, before))


def test_a_state_can_be_saved():
    state = hebbtorch.HebbianMLP([3, 4, 2]).initial_state("uniform")
    file = io.BytesIO()
    torch.save(state, file)
    file.seek(0)
    loaded = torch.load(file)
    assert isinstance(loaded, hebbtorch.State)
    assert all(map(torch.equal, loaded.weights, state.weights))


def test_l2_in_half_precision():
    for numbers in ([300.0, 1.0, 2.0], [3e-4, 3e-4, 0.0]):
        rows = torch.tensor([numbers])
        expected = rows / rows.norm()
        halves = l2_normalize(rows.half())
        assert halves.dtype == torch.float16
        torch.testing.assert_close(halves.float(), expected, rtol=2e-3, atol=1e-3)


def test_a_parametrized_rule_has_no_genes_and_says_why():
    net = hebbtorch.HebbianMLP([3, 2])
    nn.utils.parametrize.register_parametrization(net.layers[0].rules, "A", nn.Identity())
    life(net, some_inputs(3))
    with pytest.raises(ValueError, match="expected the terms ABCD to be plain parameters"):
        net.n_genes  # noqa: B018


@pytest.mark.parametrize("kind", KINDS)
def test_networks_are_born_by_the_same_call(kind):
    net = kind([3, 2], population=(4,))
    for init in ("zeros", "uniform"):
        state = net.initial_state(init, batch=(5,), generator=torch.Generator().manual_seed(1))
        assert state.weights[0].shape == (5, 4, 2, 3)
        assert net(some_inputs(5, 4, 3), state)[0].shape == (5, 4, 2)
    with pytest.raises(ValueError, match="init: expected one of"):
        net.initial_state("ones")
    with pytest.raises(ValueError, match=r"batch: expected a tuple of sizes .* got 3"):
        net.initial_state(batch=3)
    assert net.initial_state(batch=(0,)).weights[0].shape == (0, 4, 2, 3)


@pytest.mark.parametrize("kind", KINDS)
def test_numpy_integers_are_integers_and_bools_are_not(kind):
    net = kind([np.int64(3), 2], population=(np.int32(4),))
    assert (net.sizes, net.population) == ((3, 2), (4,))
    assert all(type(n) is int for n in (*net.sizes, *net.population))
    with pytest.raises(ValueError, match="population: expected a tuple of positive sizes"):
        kind([3, 2], population=(True,))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: hebbtorch.HebbianMLP([2, 2], sharing="grouped", groups=torch.tensor([0, 1])),
            r"groups: expected labels that compare by value, .* groups.tolist\(\)",
        ),
        (
            lambda: hebbtorch.HebbianMLP([2, 2]).initial_state("uniform", generator=3),
            r"generator: expected one generator per entry .* got 1 \['int'\]",
        ),
        (
            lambda: hebbtorch.HebbianMLP([2, 2])(torch.zeros(2), (torch.zeros(2, 2),)),
            "state: expected the weights of 1 layers, got tuple",
        ),
        (
            lambda: hebbtorch.EvolutionStrategy(3, dtype=torch.int64),
            "dtype: expected a floating dtype, got torch.int64",
        ),
        (
            lambda: hebbtorch.EvolutionStrategy(3, parents=float("nan")),
            "parents: expected a fraction .* got nan",
        ),
    ],
    ids=["groups", "generator", "state", "dtype", "parents"],
)
def test_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_a_strategy_refuses_what_is_not_its_own():
    strategy = hebbtorch.EvolutionStrategy(3, population=4)
    strategy.ask()
    with pytest.raises(ValueError, match="fitness: expected real numbers, got torch.complex64"):
        strategy.tell(torch.zeros(4, dtype=torch.complex64))
    state = strategy.state_dict() | {"genomes": torch.zeros(1, 4, 2)}
    with pytest.raises(ValueError, match=r"state: expected genomes of .* shape \(1, 4, 3\)"):
        strategy.load_state_dict(state)


class Own(hebbtorch.Evolvable):
    """One parameter of each shape given."""

    def __init__(self, *shapes: tuple[int, ...], dtypes=(torch.float32, torch.float32)) -> None:
        super().__init__()
        self.population = (4,)
        self.own = nn.ParameterList(
            torch.zeros(shape, dtype=dtype) for shape, dtype in zip(shapes, dtypes, strict=False)
        )

    def gene_parameters(self):
        return [(index, "weight", parameter) for index, parameter in enumerate(self.own)]


def test_own_networks_have_genes_by_individual():
    assert Own((4, 2, 3), (4, 1, 3)).n_genes == 9
    assert Own((4, 2, 3), (4, 3)).n_genes == 9
    assert Own((4,), (4, 1, 2, 3)).n_genes == 7
    with pytest.raises(ValueError, match=r"weight of layer 1 of shape \(\*\(4,\), \.\.\.\)"):
        Own((4, 2, 3), (3, 4)).gene_blocks  # noqa: B018
    wide_first = Own((4, 1, 1), (4, 1, 1), dtypes=(torch.float64, torch.float32))
    with pytest.raises(ValueError, match="got 4 NaN or infinite"):
        wide_first.set_genomes(torch.full((4, 2), 1e300, dtype=torch.float64))
    assert torch.equal(wide_first.genomes(), torch.zeros(4, 2, dtype=torch.float64))
