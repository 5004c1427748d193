"""An individual's life is the same, bit for bit, alone and in any batch."""

import pytest
import torch

import hebbtorch

STEPS = 12


@pytest.fixture(autouse=True)
def _restore_threads():
    threads = torch.get_num_threads()
    yield
    torch.set_num_threads(threads)


def population_of(n, sizes, dtype, **options):
    """A network of n individuals, their inputs (steps, n, in) and their initial weights."""
    generator = torch.Generator().manual_seed(11)
    net = hebbtorch.HebbianMLP(sizes, population=(n,), dtype=dtype, **options)
    net.set_genomes(2 * torch.rand(n, net.n_genes, generator=generator, dtype=dtype) - 1)
    inputs = torch.rand(STEPS, n, sizes[0], generator=generator, dtype=dtype)
    return net, inputs, net.initial_state("uniform", generator=generator)


@torch.no_grad()
def live(net, inputs, state):
    for x in inputs:
        y, state = net(x, state)
    return [y, *state.weights]


def assert_alone_equals_batch(n, sizes, dtype, members, population=(), **options):
    """Members of n individuals, as networks of their own of the given population dimensions."""
    net, inputs, state = population_of(n, sizes, dtype, **options)
    together = live(net, inputs, state)
    alone = hebbtorch.HebbianMLP(sizes, population=population, dtype=dtype, **options)
    for k in members:
        alone.set_genomes(net.genomes()[k].reshape(*population, -1))
        initial = hebbtorch.State(
            tuple(w[k].reshape(*population, *w.shape[1:]).clone() for w in state.weights)
        )
        x = inputs[:, k].reshape(STEPS, *population, -1)
        for ours, theirs in zip(live(alone, x, initial), together, strict=True):
            assert torch.equal(ours.reshape(theirs[k].shape), theirs[k])


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("normalize", [None, "l2", "minmax"])
@pytest.mark.parametrize("n_in", [1, 3, 29, 48])
@pytest.mark.parametrize("n_out", [1, 7, 10])
def test_forty_together_equal_each_alone(n_in, n_out, normalize, dtype):
    assert_alone_equals_batch(40, [n_in, n_out], dtype, range(40), normalize=normalize)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("n", [1, 2, 7, 400])
def test_population_sizes(n, dtype):
    options = {"normalize": "l2", "eta": "evolved"}
    assert_alone_equals_batch(n, [29, 29, 10], dtype, {0, n // 2, n - 1}, **options)
    assert_alone_equals_batch(n, [29, 29, 10], dtype, {n - 1}, population=(1,), **options)


@pytest.mark.parametrize("sharing", hebbtorch.SHARINGS)
def test_sharings(sharing):
    groups = [i % 3 for i in range(29)] if sharing == "grouped" else None
    assert_alone_equals_batch(
        7, [29, 10, 7], torch.float32, range(7), sharing=sharing, groups=groups, eta="evolved"
    )


def test_threads_do_not_change_a_bit():
    net, inputs, state = population_of(400, [29, 29, 10], torch.float32, normalize="l2")
    lifetimes = []
    for threads in (1, 2, 3):
        torch.set_num_threads(threads)
        lifetimes.append(live(net, inputs, state))
    for other in lifetimes[1:]:
        assert all(torch.equal(a, b) for a, b in zip(lifetimes[0], other, strict=True))


def test_population_dimensions_are_only_a_shape():
    net, inputs, state = population_of(12, [5, 4, 3], torch.float32)
    grid = hebbtorch.HebbianMLP([5, 4, 3], population=(3, 4))
    grid.set_genomes(net.genomes().reshape(3, 4, -1))
    folded = hebbtorch.State(tuple(w.reshape(3, 4, *w.shape[1:]) for w in state.weights))
    line, square = live(net, inputs, state), live(grid, inputs.reshape(STEPS, 3, 4, 5), folded)
    assert all(torch.equal(a, b.reshape(a.shape)) for a, b in zip(line, square, strict=True))


def test_batch_dimensions_are_further_lives_under_the_same_rules():
    net, _, _ = population_of(3, [5, 4, 2], torch.float64)
    batched = net.initial_state(batch=(6,))
    assert [w.shape for w in batched.weights] == [(6, 3, 4, 5), (6, 3, 2, 4)]
    x = torch.rand(STEPS, 6, 3, 5, dtype=torch.float64)
    together = live(net, x, batched)
    for k in range(6):
        alone = live(net, x[:, k], net.initial_state())
        assert all(torch.equal(a, b[k]) for a, b in zip(alone, together, strict=True))


def test_other_individuals_do_not_matter_even_when_they_fail():
    net, inputs, state = population_of(5, [29, 10], torch.float32, normalize="l2")
    before = live(net, inputs, state)
    poisoned = inputs.clone()
    poisoned[:, 2] = torch.nan
    after = live(net, poisoned, state)
    others = [0, 1, 3, 4]
    assert all(torch.equal(a[others], b[others]) for a, b in zip(before, after, strict=True))
    assert after[0][2].isnan().all()
