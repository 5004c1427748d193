"""Networks of hebbtorch packed for the simulator's kernel.

The torch loop crosses from torch to the simulator and back at every control step. Here the
network runs in the kernel instead, lane by lane with the physics, and its weights and rules stay
in the cache for many steps. The result is that of the torch loop but for rounding: sums run over
the inputs in order, and eta is multiplied into the rules beforehand.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import torch
from torch import Tensor

import hebbtorch
from experiments.rollout.controller import Controller
from experiments.rollout.fused import kernel as k
from experiments.rollout.fused.features import (
    NORMALIZATIONS,
    Features,
    features_of,
    plastic_layers,
    step_of,
    why_not,
)
from hebbtorch.state import Memory, intervened, memory_of
from physics import Simulator
from physics.backend import unpacked

__all__ = ["FusedLoop", "Share", "pack", "packed_rows"]


@dataclass(frozen=True)
class Layout:
    """Where the parts of a row begin, as the kernel finds them.

    Attributes:
        sizes: Neurons per layer, the inputs first, those of a recurrent network with the context.
        plastic: Whether the synapses are plastic.
        features: The features of the network.
        average: Steps in a window.
    """

    sizes: tuple[int, ...]
    plastic: bool
    features: Features
    average: int

    @property
    def neurons(self) -> int:
        """Of all layers, the inputs included."""
        return sum(self.sizes)

    @property
    def stride(self) -> int:
        """Items per synapse."""
        return k.synapse_items(self.plastic, self.features)

    @property
    def activations(self) -> int:
        """First item of the activations."""
        return k.SIZES + len(self.sizes)

    @property
    def window(self) -> int:
        """First item of the window."""
        means = self.neurons if self.features.average else 0
        biases = self.neurons - self.sizes[0] if self.features.bias else 0
        return self.activations + self.neurons + means + biases

    @property
    def synapses(self) -> int:
        """First item of the synapses."""
        return self.window + (self.average * self.neurons if self.features.average else 0)


@dataclass(frozen=True)
class FusedLoop:
    """The networks of a batch of worlds, packed for the kernel.

    Attributes:
        items: (groups, items, lanes), their memory in the order of kernels; the weights in it
            change as the worlds live.
        network: Where it came from.
        start: The state that it began with.
        layout: Where what stands in a row of items.
        places: Where the worlds lie, counted through all lanes, (N,); None: in order.
    """

    items: Tensor
    network: Controller
    start: hebbtorch.State
    layout: Layout
    places: Tensor | None = None

    def run(self, sim: Simulator, steps: int, monitor: hebbtorch.Monitor | None = None) -> None:
        """Lets the worlds of ``sim`` live for some control steps.

        Args:
            sim: The simulator of the worlds.
            steps: The number of control steps.
            monitor: A monitor of this network; it looks at its steps as it does in a loop through
                torch.
        """
        if monitor is not None:
            while steps > (ahead := monitor.until_sample()):
                self.run(sim, ahead)
                monitor.skip(ahead)
                before = self.state().weights
                self.run(sim, 1)
                monitor.record(self.activations(), before, self.state().weights)
                steps -= ahead + 1
            monitor.skip(steps)
        if steps > 0:
            sim.run_closed_loop(partial(k.kernel, self.layout.features), self.items, steps)

    def freeze(self) -> None:
        """Ends learning: from now on the weights stay as they are."""
        self.items[:, k.PLASTIC] = 0.0

    def activations(self) -> tuple[Tensor, ...]:
        """Of all neurons in the last step, the inputs first: per layer (worlds, neurons)."""
        sizes = self.layout.sizes
        rows = self._rows(self.layout.activations, sum(sizes))
        return rows.split(list(sizes), 1)

    def state(self) -> hebbtorch.State:
        """The state as it is now."""
        stride = self.layout.stride
        first = self.layout.synapses
        weights = []
        for old in self.start.weights:
            count = old.shape[-2] * old.shape[-1]
            rows = self._rows(first, stride * count)[:, ::stride]
            weights.append(rows.reshape(old.shape).clone())
            first += stride * count
        memory = tuple(self._memory(i, m) for i, m in enumerate(self.start.memory))
        return hebbtorch.State(tuple(weights), memory)

    def _rows(self, first: int, count: int) -> Tensor:
        """Some items of each world, (worlds, count)."""
        rows = self.items[:, first : first + count].clone().movedim(-1, 1).flatten(0, 1)
        if self.places is not None:
            return rows[self.places]
        return rows[: self.start.weights[0].shape[:-2].numel()]

    def _memory(self, layer: int, old: Memory) -> Memory:
        """What a layer remembers now."""
        new = dict(old)
        step = int(self._rows(k.STEP, 1)[0])
        if "step" in old:
            new["step"] = torch.full_like(old["step"], step)
        if "hidden" in old:
            hidden = self.activations()[0][:, -self.layout.sizes[1] :]
            new["hidden"] = hidden.reshape(old["hidden"].shape)
        if "pre_window" in old:
            shape = (-1, self.layout.average, self.layout.neurons)
            ring = self._rows(self.layout.window, self.layout.average * self.layout.neurons)
            places = [(step + 1 + back) % self.layout.average for back in range(shape[1])]
            window = ring.reshape(shape)[:, places].split(list(self.layout.sizes), 2)
            new["pre_window"] = window[layer].reshape(old["pre_window"].shape)
            new["post_window"] = window[layer + 1].mT.reshape(old["post_window"].shape)
        return new


def pack(
    sim: Simulator,
    network: Controller,
    state: hebbtorch.State,
    *,
    plastic: bool | Tensor = True,
) -> FusedLoop:
    """Networks and their weights in the kernel's order.

    Args:
        sim: A simulator of N worlds.
        network: The networks of N individuals (the dimensions of the population and of the state's
            batch together), in the order of the worlds.
        state: The networks' state.
        plastic: False freezes the weights; a bool mask of the shape of the individuals says who
            learns.

    Raises:
        ValueError: the networks do not fit the worlds, or have what the kernel does not know.
    """
    worlds, layout = packed_rows(Share.of(sim), network, state, plastic)
    items = worlds.new_zeros(sim.groups * sim.lanes, worlds.shape[1])
    items[torch.from_numpy(sim.places).to(items.device)] = worlds
    items = unpacked(items.unflatten(0, (sim.groups, sim.lanes)).movedim(1, -1), sim.lanes)
    return FusedLoop(items, network, state, layout)


@dataclass(frozen=True)
class Share:
    """Worlds with the same robot.

    Attributes:
        n_worlds: How many.
        n_readings, n_voxels: Of the robot.
        dtype, device: Of the simulation.
    """

    n_worlds: int
    n_readings: int
    n_voxels: int
    dtype: torch.dtype
    device: torch.device

    @classmethod
    def of(cls, sim: Simulator) -> Share:
        """All worlds of a simulator."""
        return cls(sim.n_worlds, sim.n_readings, sim.n_voxels, sim.dtype, sim.device)


def packed_rows(
    share: Share, network: Controller, state: hebbtorch.State, plastic: bool | Tensor = True
) -> tuple[Tensor, Layout]:
    """The rows of networks, (worlds, items), and where what stands in them; as for `pack`."""
    if reason := why_not(network, state):
        raise ValueError(f"loop: expected a network that the kernel knows, got {reason}")
    _check_fit(share, network, state)
    mask = plastic if isinstance(plastic, Tensor) else None
    features = features_of(network, state, mask is not None)
    layers = plastic_layers(network)
    average = layers[0].plasticity.average if layers else 1
    sizes = (state.weights[0].shape[-1], *(w.shape[-2] for w in state.weights))
    layout = Layout(sizes, bool(layers), features, average)
    rows = [
        _header(share, network, state, layout, plastic is not False),
        _activations(share, state, layout),
    ]
    if features.bias:
        rows.append(_biases(share, network, state))
    if features.average:
        rows.append(_windows(share, state, layout))
    rows += [_synapses(share, layers, state, i, features) for i in range(len(state.weights))]
    if features.mask:
        rows[0][:, k.LEARNS] = _learners(state, mask).to(share.device, share.dtype)
    return torch.cat(rows, 1), layout


def _header(
    share: Share, network: Controller, state: hebbtorch.State, layout: Layout, plastic: bool
) -> Tensor:
    """Header and sizes, (N, items)."""
    layers = plastic_layers(network)
    plan = layers[0].plasticity if layers else None
    header = [0.0] * k.SIZES
    header[k.LAYERS] = len(layout.sizes) - 1
    header[k.STRIDE] = layout.stride
    header[k.PLASTIC] = float(bool(layers) and plastic)
    header[k.NORMALIZE] = NORMALIZATIONS.index(layers[0].normalize if layers else None)
    header[k.READINGS] = share.n_readings
    header[k.STEP] = step_of(state)
    header[k.AVERAGE] = layout.average
    header[k.EVERY] = plan.every if plan else 1
    header[k.KEEP] = 1.0 - plan.decay if plan else 1.0
    header[k.CLIP] = plan.clip or 0.0 if plan else 0.0
    header += layout.sizes
    return torch.tensor(header, dtype=share.dtype, device=share.device).repeat(share.n_worlds, 1)


def _activations(share: Share, state: hebbtorch.State, layout: Layout) -> Tensor:
    """Zeros, but for the context of a recurrent network; and place for the means."""
    count = layout.neurons * (2 if layout.features.average else 1)
    activations = torch.zeros(share.n_worlds, count, dtype=share.dtype, device=share.device)
    hidden = memory_of(state, 0).get("hidden")
    if hidden is not None:
        context = hidden.detach().reshape(share.n_worlds, -1)
        activations[:, share.n_readings : share.n_readings + context.shape[1]] = context
    return activations


def _biases(share: Share, network: Controller, state: hebbtorch.State) -> Tensor:
    """Biases of all neurons but the inputs, (N, neurons)."""
    lead = state.weights[0].shape[:-2]
    if isinstance(network, hebbtorch.StaticMLP):
        biases = [network.gain * bias for bias in network.biases]
    else:
        biases = [layer.bias for layer in network.layers if layer.bias is not None]
    rows = [b.detach().expand(*lead, *b.shape[-2:]).reshape(share.n_worlds, -1) for b in biases]
    return torch.cat(rows, 1).to(share.device, share.dtype)


def _windows(share: Share, state: hebbtorch.State, layout: Layout) -> Tensor:
    """The rings of the last activations, (N, average * neurons)."""
    memory = state.memory
    parts = [memory[0]["pre_window"], *(m["post_window"].mT for m in memory)]
    oldest_first = torch.cat([p.detach().flatten(0, -3) for p in parts], -1)
    ring = torch.empty_like(oldest_first)
    step = step_of(state)
    places = [(step + 1 + back) % layout.average for back in range(layout.average)]
    ring[:, places] = oldest_first
    return ring.reshape(share.n_worlds, -1).to(share.device, share.dtype)


def _synapses(
    share: Share,
    layers: list[hebbtorch.HebbianLinear],
    state: hebbtorch.State,
    index: int,
    features: Features,
) -> Tensor:
    """The synapses of one layer, (N, stride * out * in)."""
    weights = state.weights[index]
    parts = [weights]
    if layers:
        layer = layers[index]
        coefficients, eta, _ = intervened(
            memory_of(state, index), layer.named_coefficients(), layer.learning_rate()
        )
        parts += [eta * coefficients[name] for name in "ABCD"]
        if features.fixed and layer.fixed is not None and layer.alpha is not None:
            parts += [layer.fixed, layer.alpha]
    synapses = torch.stack([part.detach().expand(weights.shape) for part in parts], -1)
    return synapses.reshape(share.n_worlds, -1).to(share.device, share.dtype)


def _learners(state: hebbtorch.State, mask: Tensor | None) -> Tensor:
    """Who learns, (N,)."""
    lead = state.weights[0].shape[:-2]
    learns = torch.ones(lead, dtype=torch.bool) if mask is None else mask.cpu()
    if learns.dtype != torch.bool or learns.shape != lead:
        raise ValueError(
            f"plastic: expected a bool mask of shape {tuple(lead)}, got {learns.dtype} of shape "
            f"{tuple(learns.shape)}"
        )
    for memory in state.memory:
        if "frozen" in memory:
            learns = learns & ~memory["frozen"].cpu().reshape(lead)
    return learns.flatten()


def _check_fit(share: Share, network: Controller, state: hebbtorch.State) -> None:
    ends = (network.sizes[0], network.sizes[-1])
    if ends != (share.n_readings, share.n_voxels):
        raise ValueError(
            f"network: expected {share.n_readings} inputs and {share.n_voxels} outputs for these "
            f"readings and voxels, got {ends[0]} and {ends[1]}"
        )
    individuals = state.weights[0].shape[:-2].numel()
    if individuals != share.n_worlds:
        raise ValueError(
            f"network: expected {share.n_worlds} individuals, one per world, got {individuals}"
        )
