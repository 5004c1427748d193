"""The controls: what the options of static networks and of the paper's own code make of them."""

from dataclasses import replace

import pytest
import torch

import hebbtorch
from experiments.analysis.freezing import act, learn
from experiments.analysis.unseen import speeds_on
from experiments.config import EvolveConfig
from experiments.report.finished_runs import label
from experiments.rollout import controller
from experiments.rollout.evaluate import Evaluator
from experiments.rollout.scenarios import Scenarios

pytestmark = pytest.mark.slow

CONFIG = EvolveConfig(shape="worm-3x1", sensors="high", duration=0.5, population=4, threads=1)
STATIC = replace(CONFIG, controller="mlp")


def built(config: EvolveConfig) -> controller.Controller:
    return controller.build(config, 2)


def test_options_of_static_networks_reach_them() -> None:
    plain, tuned = built(STATIC), built(replace(STATIC, gain=30.0, bias=True))
    assert type(tuned) is hebbtorch.StaticMLP
    n_in, hidden, n_out = tuned.sizes
    assert tuned.n_genes == plain.n_genes + hidden + n_out
    tuned.set_genomes(torch.full((2, tuned.n_genes), 0.5))
    assert (tuned.initial_state().weights[0] == 15.0).all()
    tanh = built(replace(STATIC, input_activation="tanh"))
    genes = torch.randn(2, plain.n_genes)
    plain.set_genomes(genes)
    tanh.set_genomes(genes)
    x = torch.rand(2, n_in)
    assert torch.equal(tanh(x)[0], plain(x.tanh(), plain.initial_state())[0])


@pytest.mark.parametrize("bias", [False, True])
def test_a_recurrent_network_has_no_more_genes_than_the_plastic_one(bias: bool) -> None:
    recurrent, plastic = built(replace(STATIC, controller="rnn", bias=bias)), built(CONFIG)
    assert isinstance(recurrent, hebbtorch.StaticRNN)
    n_in, hidden, n_out = recurrent.sizes
    assert (n_in, n_out) == (plastic.sizes[0], plastic.sizes[-1])
    one_more = (hidden + 1) * (n_in + hidden + 1 + n_out + bias) + n_out * bias
    assert recurrent.n_genes <= plastic.n_genes < one_more


def test_options_of_the_papers_code_reach_plastic_networks() -> None:
    network = built(replace(CONFIG, exchange_bc=True, constant_last_input=True))
    assert isinstance(network, hebbtorch.HebbianMLP)
    assert network.constant_last_input
    assert all(layer.rules.exchange_bc for layer in network.layers)


def test_options_of_plasticity_reach_the_layers() -> None:
    options = {"average": 10, "every": 4, "decay": 0.01, "clip": 3.0, "normalize": "max"}
    network = built(replace(CONFIG, rule="abcd", init="kaiming", fixed=True, bias=True, **options))
    assert isinstance(network, hebbtorch.HebbianMLP)
    for layer in network.layers:
        assert layer.plasticity.options() == {
            "average": 10, "every": 4, "decay": 0.01, "clip": 3.0, "trace_decay": 0.0,
        }  # fmt: skip
        assert (layer.normalize, layer.init) == ("max", "kaiming")
        assert layer.fixed is not None
        assert layer.bias is not None
    n_in, hidden, n_out = network.sizes
    neuron = built(replace(CONFIG, sharing="neuron", eta="evolved"))
    assert neuron.n_genes == 5 * (n_in + hidden + n_out) - n_in - n_out
    assert built(replace(CONFIG, rule="oja")).n_genes == n_in * hidden + hidden * n_out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rule": "stdp"}, "^rule: expected one of"),
        ({"rule": "oja", "terms": "AB"}, "^terms, exchange_bc: expected neither"),
        ({"average": 0}, "^average: expected an integer >= 1"),
        ({"every": 2.5}, "^every: expected an integer >= 1"),
        ({"decay": 1.5}, "^decay: expected a number from 0 to 1"),
        ({"clip": -1.0}, "^clip: expected a finite number >= 0"),
        ({"init": "ones"}, "^init: expected one of"),
        ({"sharing": "neuron", "rule": "oja"}, "^sharing: expected another one"),
    ],
)
def test_wrong_options_of_plasticity_are_refused(options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(CONFIG, **options).validate()


@pytest.mark.parametrize(
    "options",
    [
        {"controller": "mlp", "gain": 30.0, "bias": True, "input_activation": "tanh"},
        {"controller": "rnn", "gain": 30.0},
        {"exchange_bc": True, "constant_last_input": True},
    ],
)
def test_every_control_moves_a_robot(options: dict) -> None:
    config = replace(CONFIG, **options)
    config.validate()
    evaluator = Evaluator(config)
    genomes = torch.randn(1, 4, evaluator.n_genes, generator=torch.Generator().manual_seed(0))
    episodes = evaluator(genomes, 1)
    assert not episodes.failed.any()
    assert len(set(episodes.speed.tolist())) == 4


def test_frozen_weights_keep_the_constant_input() -> None:
    scenarios = Scenarios.unseen(CONFIG.terrain, [0], 0)
    genomes = torch.randn(2, built(CONFIG).n_genes, generator=torch.Generator().manual_seed(1))
    speeds = []
    for constant in (False, True):
        config = replace(CONFIG, constant_last_input=constant)
        # Learned under the same option, so that only what frozen networks see differs.
        weights = learn(replace(config, constant_last_input=False), genomes, [0.5], scenarios)
        speeds.append(act(config, weights, scenarios))
    assert (speeds[0] != speeds[1]).all()


def test_frozen_networks_keep_what_is_not_plastic() -> None:
    config = replace(CONFIG, fixed=True, bias=True)
    genomes = torch.randn(2, built(config).n_genes, generator=torch.Generator().manual_seed(2))
    still = replace(config, eta=0.0)  # learns nothing: frozen or not makes no difference
    test = Scenarios.unseen(CONFIG.terrain, [1, 2], 0)
    weights = learn(still, genomes, [0.0, 0.5], Scenarios.unseen(CONFIG.terrain, [0], 0))
    speeds = act(still, weights, test, genomes)
    expected = speeds_on(still, genomes, test)
    assert torch.allclose(speeds, expected.expand(2, 2, 2), atol=1e-6)
    assert speeds.abs().max() > 0.01


def test_controls_have_names() -> None:
    assert label(replace(STATIC, gain=30.0, bias=True)) == "MLP, gain 30, biases"
    assert label(replace(STATIC, controller="rnn")) == "RNN"
    assert label(replace(CONFIG, control_interval=12)) == "every 12 steps"
