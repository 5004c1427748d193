"""What is recorded of an episode is what happened in it."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import torch

import hebbtorch
from experiments.analysis.freezing import learn, training_and_test
from experiments.analysis.recording import LAYERS, Recording, describe, observe, times_of, write
from experiments.analysis.term_sizes import TermSizes
from experiments.analysis.unseen import reassess
from experiments.rollout import controller, simulator
from physics.scene.clock import steps_in
from tests.experiments.champions import PLASTIC, random_champions, run_folder

TRAINING, _ = training_and_test(PLASTIC, 1, 0)
STEPS = steps_in(PLASTIC.duration)


@pytest.fixture(scope="module")
def recording() -> Recording:
    return observe(PLASTIC, random_champions().genomes, TRAINING)


def by_hand(seconds: float):
    """Activations (in, hidden, out) of every step, and the poses, through PyTorch."""
    config = replace(PLASTIC, duration=seconds)
    sim = simulator(config, TRAINING * 2)
    network = controller.build(config, 2)
    network.set_genomes(random_champions().genomes)
    state = network.initial_state()
    actuation = torch.zeros(2, sim.n_voxels)
    sim.reset()
    steps = []
    with torch.no_grad():
        for _ in range(steps_in(seconds)):
            x = sim.step(actuation)
            hidden = network.layers[0].activate(x, state.weights[0])
            actuation, state = network(x, state)
            steps.append(((x, hidden, actuation), sim.area_ratios(), sim.touching()))
    return network, steps


def test_times_are_those_of_the_paper() -> None:
    assert times_of(60.0) == [1.0, 15.0, 60.0]


def test_it_is_the_life_of_the_reassessment(recording: Recording) -> None:
    way = recording.way.astype(np.float64)
    assert way.shape == (2, STEPS, 2)
    speeds = reassess(PLASTIC, random_champions().genomes, [0])[:, 0]
    moved = (way[:, -1, 0] - way[:, 0, 0]) / ((STEPS - 1) / 60)
    assert moved == pytest.approx(speeds.numpy(), abs=1e-4)
    snapshots = learn(PLASTIC, random_champions().genomes, times_of(PLASTIC.duration), TRAINING)
    for ours, expected in zip(recording.weights, snapshots, strict=True):
        assert np.array_equal(ours, expected.movedim(0, 1).numpy())


def test_neurons_and_body_of_every_step(recording: Recording) -> None:
    _, steps = by_hand(0.3)  # the loops drift apart by rounding later on
    n = len(steps)
    for layer in range(len(LAYERS)):
        ours = recording.activations[layer][:, :n].astype(np.float32)
        expected = torch.stack([step[0][1 + layer] for step in steps], 1).numpy()
        np.testing.assert_allclose(ours, expected, rtol=0, atol=2e-3)
        assert np.abs(expected[:, -1] - expected[:, 0]).max() > 0.1
    areas = torch.stack([step[1] for step in steps], 1).numpy()
    np.testing.assert_allclose(recording.areas[:, :n], areas, rtol=0, atol=2e-3)
    assert np.array_equal(
        recording.touching[:, :n], torch.stack([step[2] for step in steps], 1).numpy()
    )


def test_histograms_count_every_activation(recording: Recording) -> None:
    for layer, activations in enumerate(recording.activations):
        counts = recording.histograms[:, layer]
        assert (counts.sum(1) == STEPS * activations.shape[2]).all()
        # The recording is in half precision: at the ends that cannot move much to another bin.
        for end, beyond in (
            (counts[:, :2], activations < -0.9),
            (counts[:, -2:], activations > 0.9),
        ):
            assert end.sum(1) == pytest.approx(beyond.sum((1, 2)), abs=3)


def test_the_last_ten_seconds_are_kept() -> None:
    config = replace(PLASTIC, duration=10.5)
    recording = observe(config, random_champions().genomes[:1], TRAINING)
    whole = steps_in(10.5)
    assert recording.way.shape == (1, whole, 2)
    assert recording.activations[0].shape[1] == recording.areas.shape[1] == steps_in(10.0)
    assert recording.histograms[0, 1].sum() == whole * 3
    end = np.histogram(recording.activations[1], 40, (-1, 1))[0]
    assert (recording.histograms[0, 1] - end).sum() == (whole - steps_in(10.0)) * 3


@pytest.mark.parametrize("sharing", ["full", "presynaptic"])
@pytest.mark.parametrize("eta", [0.5, "evolved"])
def test_sizes_of_terms_by_hand(sharing: str, eta: float | str) -> None:
    network = hebbtorch.HebbianMLP([2, 3, 1], sharing=sharing, eta=eta, population=(2,))
    torch.manual_seed(0)
    network.set_genomes(torch.randn(2, network.n_genes))
    sizes = TermSizes(network)
    expected = np.zeros((2, 4))
    for _ in range(3):
        activations = tuple(torch.randn(2, n) for n in network.sizes)
        sizes.add(activations)
        for layer, (pre, post) in enumerate(pairwise(activations)):
            synapses = network.layers[layer]
            shape = (2, synapses.n_out, synapses.n_in)
            rates = torch.as_tensor(synapses.learning_rate()).detach().expand(shape)
            rules = [c.detach().expand(shape) for c in synapses.coefficients()]
            for k, o, i in np.ndindex(shape):
                x, y, rate = float(pre[k, i]), float(post[k, o]), float(rates[k, o, i])
                for term, factor in enumerate((x * y, x, y, 1.0)):
                    expected[k, term] += abs(rate * float(rules[term][k, o, i]) * factor)
    assert sizes.total().numpy() == pytest.approx(expected, rel=1e-5)


def test_terms_are_those_of_the_second_before(recording: Recording) -> None:
    network, steps = by_hand(0.25)  # at a quarter of the episode, all there is
    sizes = TermSizes(network)
    for activations, _, _ in steps:
        sizes.add(activations)
    assert recording.terms[:, 1] == pytest.approx(sizes.total().numpy(), rel=1e-2)
    # The constant term is the same in every step: 15 of them, and 60 at the end of 61.
    assert recording.terms[:, 2, 3] / recording.terms[:, 1, 3] == pytest.approx(60 / len(steps))


def test_a_term_that_is_missing_has_no_share() -> None:
    config = replace(PLASTIC, terms="BCD")
    champions = random_champions(config)
    for run in describe(observe(config, champions.genomes, TRAINING)):
        for at_time in run["weights"]:
            assert at_time["terms"]["A"] == 0.0
            assert sum(at_time["terms"].values()) == pytest.approx(1.0)


def test_description_of_a_life_without_learning() -> None:
    config = replace(PLASTIC, eta=0.0)
    champions = random_champions(config)
    (run, _) = describe(observe(config, champions.genomes, TRAINING))
    assert run["weights"][2]["largest"] == 0.0
    assert set(run["weights"][2]["terms"].values()) == {None}
    assert run["layers"]["output"]["saturated"] == 0.0
    assert run["layers"]["output"]["middle"] == 1.0
    assert run["layers"]["output"]["period"] is None


def test_files(recording: Recording, tmp_path) -> None:
    folder = run_folder(tmp_path)
    path = write(folder)
    assert sorted(each.name for each in folder.iterdir()) == [
        "champion.safetensors",
        "recording.json",
        "recording.npz",
    ]
    summary = json.loads(path.read_text())
    assert summary["terrain"] == "hilly-3-30-0"
    assert summary["runs"] == json.loads(json.dumps(describe(recording)))
    with np.load(folder / "recording.npz") as arrays:
        assert sorted(arrays) == [
            "activations_hidden",
            "activations_output",
            "areas",
            "format",
            "histograms",
            "step",
            "terms",
            "times",
            "touching",
            "way",
            "weights_0",
            "weights_1",
        ]
        assert np.array_equal(arrays["weights_1"], recording.weights[1])
        assert np.array_equal(arrays["activations_output"], recording.activations[1])
