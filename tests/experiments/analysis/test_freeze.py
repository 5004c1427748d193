"""Frozen weights: taken from the life as it goes, and acting exactly as they are."""

import csv
import math
from dataclasses import replace

import pytest
import torch
from PIL import Image

from experiments.analysis import freezing
from experiments.analysis.freezing import Freezing, act, learn, training_and_test
from experiments.analysis.unseen import reassess
from experiments.rollout import controller, fused, simulator, start_episode
from experiments.runs.champions import Champions
from physics.scene.clock import steps_in
from tests.experiments.champions import PLASTIC, STATIC, random_champions, run_folder
from tests.experiments.commands import hebbtorch

TRAINING, TEST = training_and_test(PLASTIC, 2, seed=0)


@pytest.fixture(scope="module")
def champions() -> Champions:
    return random_champions()


@pytest.fixture(scope="module")
def snapshots(champions: Champions) -> freezing.Weights:
    return learn(PLASTIC, champions.genomes, [0.0, 0.5, 1.0], TRAINING)


def worlds_of_test(snapshots: freezing.Weights):
    """Worlds for all (second, run, terrain)."""
    return simulator(PLASTIC, TEST * snapshots[0].shape[:-2].numel())


def plastic_network(champions: Champions, snapshots: freezing.Weights):
    """The champions with their rules, in the order of `worlds_of_test`, and the weights given."""
    n_snapshots = len(snapshots[0])
    genomes = champions.genomes.repeat(n_snapshots, 1).repeat_interleave(len(TEST), 0)
    network = controller.build(PLASTIC, len(genomes))
    network.set_genomes(genomes)
    weights = [layer.flatten(0, 1).repeat_interleave(len(TEST), 0) for layer in snapshots]
    state = type(network.initial_state())(tuple(weights))
    return network, state


def test_terrains_to_learn_and_to_be_judged_on_differ() -> None:
    assert TRAINING.names == ["hilly-3-30-0"]
    assert TEST.names == ["hilly-3-30-1", "hilly-3-30-2"]
    assert len({*TRAINING.world_seeds, *TEST.world_seeds}) == 3


@pytest.mark.parametrize("init", ["zeros", "uniform"])
def test_snapshots_are_the_weights_of_a_life_so_long(champions: Champions, init: str) -> None:
    config = replace(PLASTIC, init=init)
    snapshots = learn(config, champions.genomes, [0.0, 0.5, 1.0], TRAINING)
    networks = controller.build(config, 2)
    networks.set_genomes(champions.genomes)
    scenarios = TRAINING * 2
    first = controller.initial_state(networks, init, scenarios.init_seeds).weights
    for layer, weights in enumerate(first):
        assert torch.equal(snapshots[layer][0], weights)
    for k, duration in ((1, 0.5), (2, 1.0)):
        shorter = replace(config, duration=duration)
        outcome = start_episode(shorter, champions.genomes, scenarios).finish()
        for layer, weights in enumerate(outcome.state.weights):
            assert torch.equal(snapshots[layer][k], weights)
    assert not torch.equal(snapshots[0][1], snapshots[0][2])


def test_frozen_weights_act_as_the_plastic_network_without_plasticity(
    champions: Champions, snapshots: freezing.Weights
) -> None:
    """The control loop by hand, with the network that has the rules, but does not use them."""
    network, state = plastic_network(champions, snapshots)
    sim = worlds_of_test(snapshots)
    sim.reset()
    actuation = torch.zeros(sim.n_worlds, sim.n_voxels)
    xs, times = [], []
    with torch.no_grad():
        for _ in range(steps_in(PLASTIC.duration)):
            readings = sim.step(actuation)
            actuation, state = network(readings, state, plastic=False)
            xs.append(sim.center_of_mass().double()[:, 0])
            times.append(sim.time)
    expected = ((xs[-1] - xs[0]) / (times[-1] - times[0])).reshape(3, 2, 2)
    ours = act(replace(PLASTIC, loop="torch"), snapshots, TEST)
    torch.testing.assert_close(ours, expected, rtol=0, atol=1e-9)
    assert ours[1:].abs().min() > 1e-4  # they do move
    fused_speeds = act(PLASTIC, snapshots, TEST)
    torch.testing.assert_close(fused_speeds, ours, rtol=0, atol=2e-3)  # sums in another order


def test_they_act_in_the_kernel_as_the_plastic_network_does(
    champions: Champions, snapshots: freezing.Weights
) -> None:
    network, state = plastic_network(champions, snapshots)
    sim = worlds_of_test(snapshots)
    sim.reset()
    loop = fused.pack(sim, network, state, plastic=False)
    loop.run(sim, 1)
    start, began = sim.center_of_mass().double(), sim.time
    loop.run(sim, steps_in(PLASTIC.duration) - 1)
    speed = (sim.center_of_mass().double() - start)[:, 0] / (sim.time - began)
    assert torch.equal(act(PLASTIC, snapshots, TEST), speed.reshape(3, 2, 2))


def test_without_weights_a_robot_is_passive(snapshots: freezing.Weights) -> None:
    sim = simulator(PLASTIC, TEST)
    sim.reset()
    nothing = torch.zeros(2, sim.n_voxels)
    sim.step(nothing)
    start, began = sim.center_of_mass().double(), sim.time
    for _ in range(steps_in(PLASTIC.duration) - 1):
        sim.step(nothing)
    passive = (sim.center_of_mass().double() - start)[:, 0] / (sim.time - began)
    speeds = act(PLASTIC, snapshots, TEST)
    assert not any(layer[0].any() for layer in snapshots)  # at the beginning
    for run in range(2):
        assert torch.equal(speeds[0, run], passive)
        assert not torch.equal(speeds[2, run], passive)


def test_weights_set_by_hand_give_the_actuation_that_they_say() -> None:
    """Hidden neurons saturate on the areas (about 0.5), and outputs take a sign from them."""
    config = replace(PLASTIC, sensors="low", noise=0.0)
    signs = torch.tensor([1.0, -1.0, 1.0])
    n_in = controller.build(config, 1).sizes[0]
    into = torch.full((1, 1, n_in, n_in), 100.0)
    out = signs.reshape(1, 1, 3, 1) * torch.full((1, 1, 3, n_in), 100.0)
    sim = simulator(config, TEST)
    sim.reset()
    sim.step(torch.zeros(2, 3))
    start, began = sim.center_of_mass().double(), sim.time
    for _ in range(steps_in(config.duration) - 1):
        sim.step(signs.expand(2, 3))
    expected = (sim.center_of_mass().double() - start)[:, 0] / (sim.time - began)
    ours = act(config, (into, out), TEST)[0, 0]
    torch.testing.assert_close(ours, expected, rtol=0, atol=1e-4)  # tanh rounds to just below 1
    opposite = act(config, (into, -out), TEST)[0, 0]
    assert (opposite - expected).abs().min() > 1e-2


@pytest.mark.parametrize("damage", ["none", "half"])
def test_frozen_networks_meet_what_reassessed_ones_meet(damage: str) -> None:
    static = random_champions(replace(STATIC, damage=damage))
    weights = controller.build(STATIC, 2)
    weights.set_genomes(static.genomes)
    layers = tuple(layer[None] for layer in weights.initial_state().weights)
    config = replace(PLASTIC, damage=damage)
    speeds = act(config, layers, training_and_test(config, 2, seed=7)[1])
    assert torch.equal(speeds[0], reassess(static.config, static.genomes, [1, 2], seed=7))


def test_parts_of_a_batch_change_nothing(
    snapshots: freezing.Weights, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = act(PLASTIC, snapshots, TEST)
    monkeypatch.setattr(freezing, "_MOST_WORLDS", 5)  # two networks on two terrains, at most
    assert torch.equal(act(PLASTIC, snapshots, TEST), whole)


def test_every_second_of_every_run_is_there(champions: Champions) -> None:
    measured = freezing.freeze(champions, n_terrains=2)
    seconds = learn(PLASTIC, champions.genomes, [0.0, 1.0], TRAINING)
    expected = act(PLASTIC, seconds, TEST)
    assert measured.speeds.shape == (2, 2, 2)
    for run in range(2):
        for second in range(2):
            assert torch.equal(measured.speeds[run, second], expected[second, run])


def test_median_and_deviation_over_runs() -> None:
    nan = math.nan
    speeds = torch.tensor([[[1.0, 3.0]], [[4.0, nan]], [[12.0, 12.0]], [[nan, nan]]]).double()
    freezing = Freezing("", ["a", "b"], speeds)  # means over terrains: 2, 4, 12, none
    assert freezing.middle.tolist() == [4.0]
    assert freezing.spread is not None
    assert freezing.spread.item() == pytest.approx(math.sqrt((16 + 4 + 36) / 2))
    assert Freezing("", ["a", "b"], speeds[:1]).spread is None


def test_the_command_writes_a_table_and_a_picture(tmp_path, monkeypatch, capsys) -> None:
    folder = run_folder(tmp_path)
    assert hebbtorch(f"freeze {folder} --terrains 2", monkeypatch) == 0
    name = "freeze-2-seed0"  # not freeze.csv, which is for three terrains
    rows = list(csv.reader((folder / f"{name}.csv").read_text().splitlines()))
    assert rows[0] == ["run", "second", "terrain", "speed"]
    measured = freezing.freeze(random_champions(), 2)
    assert rows[1:] == [
        [str(run), str(second), f"hilly-3-30-{1 + terrain}", repr(speed)]
        for run, of_run in enumerate(measured.speeds.tolist())
        for second, of_second in enumerate(of_run)
        for terrain, speed in enumerate(of_second)
    ]
    with Image.open(folder / f"{name}.png") as picture:
        assert picture.format == "PNG"
    shown = capsys.readouterr().out
    assert f"frozen at  1 s: {measured.middle[1]:.2f}" in shown
    assert f"wrote {folder / (name + '.png')}" in shown


def test_the_picture_of_something_else_is_left_alone(tmp_path, monkeypatch, capsys) -> None:
    folder = run_folder(tmp_path)
    gait = folder / "gait.png"
    gait.write_bytes(b"a gait")
    assert hebbtorch(f"freeze {folder} --out {folder / 'gait.csv'}", monkeypatch) == 2
    assert "out: expected a name whose picture" in capsys.readouterr().err
    assert gait.read_bytes() == b"a gait"
    assert not (folder / "gait.csv").exists()


@pytest.mark.parametrize(
    ("config", "options", "message"),
    [
        (STATIC, "", "run: expected plastic champions, got the mlp of"),
        (PLASTIC, "--terrains 0", "terrains: expected an integer >= 1, got 0"),
        (PLASTIC, "--out {tmp}/missing/file.csv", "out: expected a file in an existing folder"),
        (PLASTIC, "--out {tmp}/file.png", "out: expected a CSV file"),
        (PLASTIC, "--out {tmp}", "out: expected a new file or a CSV file, which is replaced"),
        (PLASTIC, "--out {tmp}/run/champion.safetensors", "out: expected a new file or a CSV file"),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(
    config, options, message, tmp_path, monkeypatch, capsys
) -> None:
    folder = run_folder(tmp_path, config)
    before = sorted(tmp_path.rglob("*"))
    assert hebbtorch(f"freeze {folder} {options.format(tmp=tmp_path)}", monkeypatch) == 2
    complaint = capsys.readouterr().err
    assert message in complaint
    assert len(complaint.splitlines()) == 1
    assert sorted(tmp_path.rglob("*")) == before
