"""What a monitor sees, against numbers worked out by hand."""

import math
import subprocess
import sys

import pytest
import torch
from torch import nn

import hebbtorch


class Recorder:
    """A writer that keeps what it is given, and refuses what TensorBoard's would."""

    def __init__(self):
        self.scalars, self.histograms = {}, {}

    def add_scalar(self, tag, scalar_value, global_step):
        self.scalars[tag, global_step] = float(scalar_value)

    def add_histogram(self, tag, values, global_step):
        assert not values.requires_grad
        self.histograms[tag, global_step] = values.numpy().copy()


def seeded(seed):
    return torch.Generator().manual_seed(seed)


def net_and_inputs(steps=7):
    net = hebbtorch.HebbianMLP([3, 4, 2], eta=0.5, population=(5,), dtype=torch.float64)
    net.set_genomes(2 * torch.rand(5, net.n_genes, generator=seeded(1), dtype=torch.float64) - 1)
    return net, torch.rand(steps, 5, 3, generator=seeded(2), dtype=torch.float64)


def test_every_measure_is_what_it_says():
    net, inputs = net_and_inputs()
    state = initial = net.initial_state("uniform", generator=seeded(3))
    states, outputs = [initial], []
    with hebbtorch.Monitor(net, every=3) as monitor:
        for x in inputs:
            y, state = net(x, state)
            states.append(state)
            outputs.append(y)
    summary = monitor.summary()
    sampled = [1, 4, 7]
    assert monitor.life.steps.tolist() == sampled
    old, new = (
        torch.stack([states[t - back].weights[1] for t in sampled]).detach() for back in (1, 0)
    )
    y = torch.stack([outputs[t - 1] for t in sampled]).detach()
    expected = {
        "weight_mean_abs": new.abs().mean(),
        "weight_max_abs": new.abs().amax((-2, -1)).mean(),
        "update_mean_abs": (new - old).abs().mean(),
        "drift_from_birth": (new[-1] - initial.weights[1]).abs().mean(),
        "sign_changes": (new * old < 0).double().mean(),
        "saturated": (y.abs() > 0.9).double().mean(),
    }
    for name, value in expected.items():
        assert summary[f"{name}/layer1"] == pytest.approx(value.item()), name
    shares = [summary[f"share_{term}/layer0"] for term in "ABCD"]
    assert sum(shares) == pytest.approx(1)
    layer, x = net.layers[0], inputs[[t - 1 for t in sampled]].unsqueeze(-2)
    hidden = torch.stack(
        [layer.activate(inputs[t - 1], states[t - 1].weights[0]) for t in sampled]
    ).unsqueeze(-1)
    a, b, c, d = layer.coefficients()
    parts = [
        (term * torch.ones_like(a)).abs().sum((-2, -1))
        for term in (a * x * hidden, b * x, c * hidden, d.expand(3, *d.shape))
    ]
    share = (parts[1] / sum(parts)).mean()
    assert shares[1] == pytest.approx(share.item())
    torch.testing.assert_close(monitor.life.weights[1], new[:, 0])
    torch.testing.assert_close(monitor.life.activations[1], y[:, 0])


def test_a_summary_of_one_individual_is_that_of_its_own_monitor():
    net, inputs = net_and_inputs()
    net.set_genomes(net.genomes().index_fill(0, torch.tensor([4]), 0.0))  # who never learns
    alone = hebbtorch.HebbianMLP([3, 4, 2], eta=0.5, dtype=torch.float64)
    alone.set_genomes(net.genomes()[2])
    with hebbtorch.Monitor(net, every=2) as monitor, hebbtorch.Monitor(alone, every=2) as own:
        state, other = net.initial_state(), alone.initial_state()
        for x in inputs:
            _, state = net(x, state)
            _, other = alone(x[2], other)
    assert monitor.summary(individual=2) == pytest.approx(own.summary())
    still = monitor.summary(individual=4)
    assert still["update_mean_abs/layer0"] == 0.0
    assert math.isnan(still["share_A/layer0"])
    shares = [monitor.summary()[f"share_{term}/layer0"] for term in "ABCD"]
    assert sum(shares) == pytest.approx(1)  # of those who do


def test_it_logs_to_any_writer_and_looks_no_longer_once_closed():
    net, inputs = net_and_inputs()
    recorder = Recorder()
    with hebbtorch.Monitor(net, every=2) as monitor:
        _, state = net(inputs[0])
        monitor.log(recorder, step=5)
    summary = monitor.summary()
    net(inputs[1], state)
    net(inputs[2], state)
    assert monitor.summary() == summary
    assert recorder.scalars == {(f"plasticity/{k}", 5): v for k, v in summary.items()}
    assert recorder.histograms["plasticity/weights/layer1", 5].shape == (2, 4)
    monitor.reset()
    assert monitor.summary() == {}


def test_it_changes_nothing():
    net, inputs = net_and_inputs()
    plain = seen = net.initial_state("uniform", generator=seeded(3))
    for x in inputs:
        _, plain = net(x, plain)
    with hebbtorch.Monitor(net, every=1):
        for x in inputs:
            _, seen = net(x, seen)
    assert all(map(torch.equal, plain.weights, seen.weights))


def test_it_finds_plastic_layers_anywhere():
    deep = nn.Sequential(nn.Linear(3, 3), hebbtorch.Stateful(hebbtorch.HebbianLinear(3, 2)))
    with hebbtorch.Monitor(deep, every=1) as monitor:
        deep(torch.rand(3))
        deep(torch.rand(3))
    assert monitor.life.steps.tolist() == [1, 2]
    with pytest.raises(ValueError, match="module: expected one with plastic layers, got Linear"):
        hebbtorch.Monitor(nn.Linear(2, 2))
    with pytest.raises(ValueError, match="every: expected a number of steps >= 1"):
        hebbtorch.Monitor(deep, every=0)


def test_it_writes_to_tensorboard_without_importing_it(tmp_path):
    code = "import sys, hebbtorch; sys.exit('tensorboard' in ' '.join(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    from torch.utils.tensorboard import SummaryWriter

    net, inputs = net_and_inputs()
    with hebbtorch.Monitor(net) as monitor, SummaryWriter(tmp_path) as writer:
        net(inputs[0])
        monitor.log(writer, 1)
    assert any(tmp_path.iterdir())
