"""Everything the kernel knows of networks, against the torch loop in float64 for one second."""

from typing import Any

import pytest
import torch

import hebbtorch
from experiments.rollout import fused
from experiments.rollout.control_loop import TorchLoop, control_loop
from physics import Simulator, Terrain

N = 3
STEPS = 60  # one second
F64 = torch.float64

# A program is compiled for each set of features, so they come together in few networks.
PLASTIC: dict[str, dict[str, Any]] = {
    "neuron-centric": {"sharing": "neuron", "eta": "evolved", "normalize": "l2", "init": "kaiming"},
    "attractor": {
        "normalize": "max",
        "average": 10,
        "every": 4,
        "decay": 0.01,
        "clip": 0.8,
        "init": "uniform",
        "eta": 0.1,
    },
    "recurrent": {
        "normalize": "minmax",
        "average": 3,
        "fixed": True,
        "bias": True,
        "constant_last_input": True,
        "exchange_bc": True,
        "init": "evolved",
    },
}
MASK = torch.tensor([True, False, True])


def seeded(seed: int) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def worlds() -> Simulator:
    terrains = [Terrain.from_name("hilly-3-30", seed=i) for i in range(N)]
    sim = Simulator("worm-2x1", terrains, N, sensors="low", noise=0.01, dtype=F64, seed=1)
    sim.reset()
    return sim


def begun(network: Any) -> tuple[Any, hebbtorch.State]:
    network.set_genomes(2 * torch.rand(N, network.n_genes, generator=seeded(2), dtype=F64) - 1)
    return network, network.initial_state(generator=seeded(3))


@torch.no_grad()
def assert_loops_agree(network: Any, state: hebbtorch.State) -> None:
    assert fused.why_not(network, state) is None
    one, other = worlds(), worlds()
    kernel, plain = control_loop(one, network, state, "fused"), TorchLoop(other, network, state)
    assert isinstance(kernel, fused.FusedLoop)
    for steps in (STEPS // 2, STEPS - STEPS // 2):
        kernel.run(one, steps)
        plain.run(other, steps)
    torch.testing.assert_close(one.mass_poses(), other.mass_poses(), rtol=0, atol=1e-9)
    assert_close(kernel.state(), plain.state())
    again = control_loop(one, network, kernel.state(), "fused")  # goes on from what it gave
    again.run(one, 7)
    plain.run(other, 7)
    assert_close(again.state(), plain.state())


def assert_close(one: hebbtorch.State, other: hebbtorch.State) -> None:
    for a, b in zip(one.weights, other.weights, strict=True):
        torch.testing.assert_close(a, b, rtol=0, atol=1e-9)
    for mine, theirs in zip(one.memory, other.memory, strict=True):
        assert sorted(mine) == sorted(theirs)
        for name, item in mine.items():
            torch.testing.assert_close(item, theirs[name], rtol=0, atol=1e-9)


def network_of(name: str) -> tuple[hebbtorch.HebbianMLP, hebbtorch.State]:
    kind = hebbtorch.HebbianRNN if name == "recurrent" else hebbtorch.HebbianMLP
    sizes = [worlds().n_readings, 3, 2]
    return begun(kind(sizes, population=(N,), dtype=F64, **PLASTIC[name]))


@pytest.mark.parametrize("name", ["neuron-centric", "recurrent"])
def test_plastic_networks(name: str) -> None:
    assert_loops_agree(*network_of(name))


def test_averages_rarer_updates_bounds_and_who_learns() -> None:
    network, state = network_of("attractor")
    assert_loops_agree(network, state.freeze(~MASK).drop("A"))
    sim = worlds()
    loop = fused.pack(sim, network, state, plastic=MASK)
    loop.run(sim, 5)
    for old, new in zip(state.weights, loop.state().weights, strict=True):
        assert torch.equal(old[1], new[1])
        assert not torch.equal(old[0], new[0])


def test_static_recurrent_networks() -> None:
    sizes = [worlds().n_readings, 3, 2]
    static = hebbtorch.StaticRNN(
        sizes, gain=3.0, bias=True, input_activation="tanh", population=(N,), dtype=F64
    )
    assert_loops_agree(*begun(static))


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"rule": "oja"}, "rule oja"),
        ({"activation": "identity"}, "activations other than tanh"),
        ({"trace_decay": 0.5}, "eligibility traces"),
        ({"normalize": torch.tanh}, "a bound of one's own"),
    ],
)
def test_what_the_kernel_does_not_know_goes_through_torch_and_is_said_once(
    options: dict[str, Any], reason: str, caplog: pytest.LogCaptureFixture
) -> None:
    sim = worlds()
    network = hebbtorch.HebbianMLP([sim.n_readings, 2], population=(N,), dtype=F64, **options)
    state = network.initial_state()
    assert fused.why_not(network, state) == reason
    for _ in range(2):
        assert isinstance(control_loop(sim, network, state), TorchLoop)
    assert caplog.text.count(reason) <= 1
    with pytest.raises(ValueError, match=f"got fused for HebbianMLP: {reason}"):
        control_loop(sim, network, state, "fused")
    with pytest.raises(ValueError, match=f"expected a network that the kernel knows, got {reason}"):
        fused.pack(sim, network, state)


@torch.no_grad()
def test_both_loops_fill_a_monitor_alike() -> None:
    network, state = network_of("neuron-centric")
    one, other = worlds(), worlds()
    with hebbtorch.Monitor(network, every=7) as plain:
        TorchLoop(other, network, state).run(other, 20)
    fast = hebbtorch.Monitor(network, every=7)
    kernel = fused.pack(one, network, state)
    for steps in (1, 5, 14):
        kernel.run(one, steps, fast)
    assert fast.life.steps.tolist() == plain.life.steps.tolist() == [1, 8, 15]
    assert fast.summary() == pytest.approx(plain.summary(), abs=1e-9)
    for mine, theirs in zip(fast.life.weights, plain.life.weights, strict=True):
        torch.testing.assert_close(mine, theirs, rtol=0, atol=1e-9)
