"""Every sharing, bound and kind of learning rate against the scalar loops of `oracle`."""

import pytest
import torch

import hebbtorch
from tests.hebbtorch import oracle

SIZES = [4, 3, 2]  # all different, so that a transposed matrix cannot pass
GROUPS = ["touch", "area", "touch", "lidar"]
STEPS = 25


@pytest.mark.parametrize("eta", [0.05, "evolved"])
@pytest.mark.parametrize("normalize", [None, "l2", "minmax"])
@pytest.mark.parametrize("sharing", hebbtorch.SHARINGS[:-1])
@pytest.mark.parametrize("init", ["zeros", "uniform"])
def test_network_equals_scalar_loops(sharing, normalize, eta, init):
    if (init, sharing, normalize) == ("zeros", "presynaptic", "minmax"):
        pytest.skip("all neurons of a layer become equal but for rounding, which minmax magnifies")
    generator = torch.Generator().manual_seed(3)
    groups = GROUPS if sharing == "grouped" else None
    net = hebbtorch.HebbianMLP(
        SIZES,
        sharing=sharing,
        groups=groups,
        eta=eta,
        normalize=normalize,
        population=(2,),
        dtype=torch.float64,
    )
    genomes = 2 * torch.rand(2, net.n_genes, generator=generator, dtype=torch.float64) - 1
    net.set_genomes(genomes)
    inputs = torch.rand(STEPS, 2, SIZES[0], generator=generator, dtype=torch.float64)
    initial = state = net.initial_state(init, generator=generator)
    ys = []
    for x in inputs:
        y, state = net(x, state)
        ys.append(y)
    for k in range(2):
        outputs, weights = oracle.live(
            genomes[k].tolist(),
            SIZES,
            [w[k].tolist() for w in initial.weights],
            inputs[:, k].tolist(),
            sharing=sharing,
            groups=groups,
            eta=eta,
            normalize=normalize,
        )
        ours = torch.stack(ys)[:, k]
        torch.testing.assert_close(
            ours, torch.tensor(outputs, dtype=ours.dtype), rtol=0, atol=1e-12
        )
        for w, expected in zip(state.weights, weights, strict=True):
            torch.testing.assert_close(
                w[k], torch.tensor(expected, dtype=w.dtype), rtol=0, atol=1e-12
            )


@pytest.mark.parametrize(
    ("sharing", "rules"),
    [("full", 18), ("presynaptic", 5), ("postsynaptic", 7), ("grouped", 4), ("single", 1)],
)
def test_number_of_genes(sharing, rules):
    groups = GROUPS if sharing == "grouped" else None
    fixed = hebbtorch.HebbianMLP(SIZES, sharing=sharing, groups=groups)
    evolved = hebbtorch.HebbianMLP(SIZES, sharing=sharing, groups=groups, eta="evolved")
    assert (fixed.n_genes, evolved.n_genes) == (4 * rules, 5 * rules)


def test_each_coefficient_weighs_its_own_term():
    # Eq. (3) by hand: x = 2, y = 3, w = 10, eta = 0.1.
    values = {"A": 60.0, "B": 20.0, "C": 30.0, "D": 10.0}  # 10 * (x y, x, y, 1)
    for name, change in values.items():
        rule = hebbtorch.Rule(**{n: torch.tensor([[10.0 if n == name else 0.0]]) for n in values})
        new = hebbtorch.abcd_update(
            torch.tensor([[10.0]]), rule, 0.1, torch.tensor([2.0]), torch.tensor([3.0])
        )
        assert new.item() == pytest.approx(10.0 + 0.1 * change)


def test_static_network_equals_scalar_loops():
    generator = torch.Generator().manual_seed(4)
    net = hebbtorch.StaticMLP(SIZES, population=(2,), dtype=torch.float64)
    genomes = torch.randn(2, net.n_genes, generator=generator, dtype=torch.float64)
    net.set_genomes(genomes)
    assert net.n_genes == 4 * 3 + 3 * 2
    x = torch.randn(2, 4, generator=generator, dtype=torch.float64)
    y, state = net(x, net.initial_state())
    frozen, _ = net(x, state, plastic=False)
    assert torch.equal(y, frozen)
    for k in range(2):
        weights = [genomes[k, :12].reshape(3, 4).tolist(), genomes[k, 12:].reshape(2, 3).tolist()]
        outputs, _ = oracle.live([0.0] * 72, SIZES, weights, [x[k].tolist()])
        torch.testing.assert_close(y[k].tolist(), outputs[0], rtol=0, atol=1e-14)
