"""One episode: the order of acting and sensing, and how speed is measured."""

from dataclasses import replace
from functools import partial
from typing import Any

import pytest
import torch

import hebbtorch
from experiments.config import EvolveConfig
from experiments.rollout import Episode, Outcome, Scenarios, controller, fused, simulator
from experiments.rollout.control_loop import Loop, control_loop
from physics import Simulator, Terrain
from physics.scene import clock

N = 3


def live(sim: Simulator, network: Any, duration: float, trace: bool = False, **options) -> Outcome:
    sim.reset(seeds=list(range(N)))  # the first episode of these seeds, whatever came before
    return Episode(sim, network, duration, **options).finish(trace=trace)


def begun(config: EvolveConfig):
    terrains = [Terrain.from_name("hilly-3-30", seed=i) for i in range(N)]
    sim = simulator(config, Scenarios(terrains, list(range(N)), list(range(N))))
    networks = controller.build(config, N)
    genomes = torch.rand(N, networks.n_genes, generator=torch.Generator().manual_seed(1)) * 2 - 1
    networks.set_genomes(genomes)
    return sim, networks


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"terms": "BD"},
        {"normalize": "l2"},
        {"normalize": "minmax"},
        {"controller": "mlp"},
    ],
    ids=["hebbian", "terms", "l2", "minmax", "mlp"],
)
@pytest.mark.parametrize(
    ("loop", "tolerance"),
    [("torch", 0.0), ("fused", 1e-4)],  # float32 sums in another order, half a second long
)
def test_a_life_is_the_loop_of_the_paper(
    tiny: EvolveConfig, options: dict[str, Any], loop: Any, tolerance: float
) -> None:
    config = replace(tiny, **options)
    life = live(*begun(config), config.duration, loop=loop, trace=True)

    sim, networks = begun(config)
    state = networks.initial_state()
    sim.reset()
    readings = sim.step(torch.zeros(N, sim.n_voxels))  # the first step has no actuation
    way, times = [sim.center_of_mass()], [sim.time]
    while sim.time < config.duration:
        actuation, state = networks(readings, state)
        readings = sim.step(actuation)
        way.append(sim.center_of_mass())
        times.append(sim.time)
    _, state = networks(readings, state)  # learns from the last readings, too

    def assert_close(ours: torch.Tensor, expected: torch.Tensor) -> None:
        torch.testing.assert_close(ours, expected, rtol=0, atol=tolerance)

    speed = (way[-1] - way[0]).double()[:, 0] / (times[-1] - times[0])
    torch.testing.assert_close(life.speed, speed, rtol=1e-6, atol=1e-6 + 2 * tolerance)
    assert_close(life.trace, torch.stack(way).double())
    for ours, expected in zip(life.state.weights, state.weights, strict=True):
        assert_close(ours, expected)
    assert speed.abs().min() > 1e-2  # they do move
    assert not life.failed.any()


def test_keeping_a_trace_changes_nothing(tiny: EvolveConfig) -> None:
    for loop in ("fused", "torch"):
        with_trace = live(*begun(tiny), tiny.duration, loop=loop, trace=True)
        without = live(*begun(tiny), tiny.duration, loop=loop)
        assert torch.equal(with_trace.speed, without.speed)
        assert without.trace is None


def test_other_networks_are_driven_through_torch(tiny: EvolveConfig) -> None:
    class Backwards(hebbtorch.HebbianMLP):
        def forward(self, x, state, plastic=True):
            y, state = super().forward(x, state, plastic)
            return -y, state

    sim, networks = begun(tiny)
    other = Backwards(networks.sizes, population=(N,))
    other.set_genomes(networks.genomes())
    own = live(sim, networks, tiny.duration, loop="torch")
    assert not torch.equal(live(sim, other, tiny.duration).speed, own.speed)
    with pytest.raises(ValueError, match="loop: expected auto or torch .* got fused for Backwards"):
        live(sim, other, tiny.duration, loop="fused")


def test_own_layers_in_an_own_network_are_driven_through_torch(tiny: EvolveConfig) -> None:
    """The kernel would take them for the ones they replace."""

    class Decay(hebbtorch.HebbianLinear):
        def update(self, weights, pre, post):
            return 0.5 * super().update(weights, pre, post)

    sizes, expected = begun(tiny)[1].sizes, live(*begun(tiny), tiny.duration).speed
    for make in (Decay, partial(hebbtorch.HebbianLinear, normalize="l2")):
        sim, networks = begun(tiny)
        other = make(sizes[1], sizes[2], population=(N,))
        other.set_genomes(networks.layers[1].genomes())
        networks.layers[1] = other
        stepwise = live(sim, networks, tiny.duration, loop="torch").speed
        assert torch.equal(live(sim, networks, tiny.duration).speed, stepwise)
        assert not torch.equal(stepwise, expected)


def test_a_life_starts_at_birth_whatever_came_before(tiny: EvolveConfig) -> None:
    sim, networks = begun(tiny)
    first = live(sim, networks, tiny.duration)
    assert torch.equal(live(sim, networks, tiny.duration).speed, first.speed)


def test_weights_at_birth_matter(tiny: EvolveConfig) -> None:
    sim, networks = begun(tiny)
    state = networks.initial_state("uniform", generator=torch.Generator().manual_seed(0))
    given: Outcome = live(sim, networks, tiny.duration, state=state)
    default: Outcome = live(sim, networks, tiny.duration)
    assert not torch.equal(given.speed, default.speed)
    zero = live(sim, networks, tiny.duration, state=networks.initial_state())
    assert torch.equal(zero.speed, default.speed)


def test_a_narrow_program_for_the_last_worlds_changes_no_bit() -> None:
    """Twenty worlds are a group of 16 and a narrow program in it, or three groups of 8."""
    results = []
    for lanes in (8, 16):
        sim = Simulator("worm-2x1", None, 20, sensors="high", noise=0.1, threads=1, lanes=lanes)
        networks = hebbtorch.HebbianMLP([sim.n_readings, 3, 2], population=(20,))
        genomes = torch.rand(20, networks.n_genes, generator=torch.Generator().manual_seed(5))
        networks.set_genomes(2 * genomes - 1)
        loop = fused.pack(sim, networks, networks.initial_state())
        for steps in (100, 3, 60):
            loop.run(sim, steps)
        results.append((sim.mass_poses(), *loop.activations(), *loop.state().weights))
    assert all(torch.equal(*pair) for pair in zip(*results, strict=True))
    assert all(part.std(0).max() > 0 for part in results[0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda items: items[:1], r"controller: expected a tensor of shape \(groups=2"),
        (lambda items: items.double(), "controller: expected torch.float32 in the order"),
        (lambda items: items.mT.contiguous().mT, "controller: expected .* got .* with strides"),
    ],
    ids=["other worlds", "another type", "another order"],
)
def test_a_network_for_other_worlds_is_refused(change: Any, message: str) -> None:
    """A kernel takes what it is given for what it was compiled for."""
    sim = Simulator("worm-2x1", None, 16, sensors="high", lanes=8)
    networks = hebbtorch.HebbianMLP([sim.n_readings, 2], population=(16,))
    loop = fused.pack(sim, networks, networks.initial_state())
    loop.run(sim, 1)
    with pytest.raises(ValueError, match=message):
        replace(loop, items=change(loop.items)).run(sim, 1)


def test_frozen_in_the_middle_the_weights_stay_and_the_robot_goes_on(tiny: EvolveConfig) -> None:
    ends = []
    for loop in ("fused", "torch"):
        sim, networks = begun(tiny)
        episode = Episode(sim, networks, tiny.duration, loop=loop)
        episode.run(episode.n_steps // 2)
        episode.freeze()
        frozen, before = episode.state().weights, sim.actuation()
        outcome = episode.finish()
        assert all(map(torch.equal, outcome.state.weights, frozen))
        assert frozen[0].any()
        assert not torch.equal(sim.actuation(), before)
        ends.append(sim.mass_poses())
    torch.testing.assert_close(*ends, rtol=0, atol=1e-4)  # sums in another order


def test_both_loops_stop_learning_when_a_world_is_over(tiny: EvolveConfig) -> None:
    """World 0 ends early; its weights stay as they were then."""
    ends = [0.1] + [10.0] * (N - 1)
    weights = {}
    for loop in ("fused", "torch"):
        networks = begun(tiny)[1]
        short = Simulator(
            tiny.shape, Terrain.from_name("flat"), N, sensors=tiny.sensors, lifetime=ends
        )
        control = control_loop(short, networks, networks.initial_state(), loop)
        control.run(short, 8)
        before = control.state().weights[0].clone()
        control.run(short, 6)
        after = control.state().weights[0]
        assert torch.equal(before[0], after[0])
        assert not torch.equal(before[1], after[1])
        weights[loop] = after
    torch.testing.assert_close(weights["fused"], weights["torch"])


@pytest.mark.parametrize("loop", ["fused", "torch"])
def test_speed_of_a_robot_that_leaves_the_ground_is_that_up_to_then(
    tiny: EvolveConfig, loop: Loop
) -> None:
    """It slides off a slope too steep for friction; another one is nowhere above its ground."""
    edge = 20.0
    slope = Terrain.from_profile([0, edge], [60, 0])
    elsewhere = Terrain.from_profile([100, 200], [0, 0])
    terrains = [slope, Terrain.from_name("flat"), elsewhere]
    sim = Simulator(tiny.shape, terrains, N, sensors=tiny.sensors)
    outcome = Episode(sim, begun(tiny)[1], 3.0, loop=loop).finish(trace=True)
    assert outcome.trace is not None
    assert sim.left_ground().tolist() == [True, False, True]
    assert not outcome.failed.any()
    x = outcome.trace[:, :, 0]  # from the end of the first step on
    steps = int(x[:, 0].diff().nonzero()[-1]) + 1
    assert x[steps, 0] > edge >= x[steps - 1, 0]
    seconds = clock.time_after(1 + steps) - clock.time_after(1)
    assert 0 < seconds < 2.9
    whole = sim.time - clock.time_after(1)
    ways = (x[[steps, -1, -1], range(N)] - x[0]).tolist()
    expected = [ways[0] / seconds, ways[1] / whole, 0.0]
    assert outcome.speed.tolist() == pytest.approx(expected)


def test_speeds_of_parts_are_those_between_their_ends(
    tiny: EvolveConfig, monkeypatch: pytest.MonkeyPatch
) -> None:
    ends = [0.1, 0.25, tiny.duration]
    sim, networks = begun(tiny)
    way = live(sim, networks, tiny.duration, trace=True).trace
    assert way is not None
    steps = [0, *(clock.steps_in(end) - 1 for end in ends)]  # the trace begins with the first step
    places = way[steps, :, 0]
    expected = places.diff(dim=0).T / (torch.tensor(steps).diff() * clock.DT)
    sim.reset(seeds=list(range(N)))
    episode = Episode(sim, networks, tiny.duration)
    # Rounding: the way is the same, the times are sums of float64.
    assert torch.allclose(episode.speeds(ends), expected, rtol=1e-9, atol=1e-12)
    monkeypatch.setattr(Simulator, "failed", lambda sim: torch.tensor([True, False, False]))
    episode = Episode(sim, networks, tiny.duration)
    assert episode.speeds(ends).isnan().tolist() == [[True] * 3, [False] * 3, [False] * 3]
