"""Whole lives inside the simulator's kernel, for the networks of hebbtorch.

The loop of ``episode`` crosses from torch to the simulator and back at every control step.
Here the network runs in the kernel instead, lane by lane with the physics, and its weights and
rules stay in the cache for many steps. The result is that of the torch loop but for rounding:
sums run over the inputs in order, and eta is multiplied into the rules beforehand.

A group's network is one row of items, each a vector with a lane per individual:

    layers, flags | sizes | activations of all neurons | synapses, layer by layer, (out, in)

A plastic synapse has five items, w and eta times A, B, C, D; a static one has w alone.
"""

from dataclasses import dataclass
from functools import lru_cache

import torch
from torch import Tensor

import hebbtorch
from physics import Simulator
from physics.backend import Kernel, Program, ti, unpacked
from physics.engine import actuation, kernels
from physics.engine.lane_math import tanh
from physics.engine.memory import layout as lay

__all__ = ["Brain", "pack"]

_LAYERS, _STRIDE, _PLASTIC, _NORMALIZE, _SIZES = range(5)
_L2, _MINMAX = 1, 2
_NORMALIZATIONS = {None: 0, "l2": _L2, "minmax": _MINMAX}
_PLASTIC_ITEMS = 5
_W, _A, _B, _C, _D = range(_PLASTIC_ITEMS)


@ti.func
def _integer(brain: ti.template(), item):
    """An integer kept in the row; it is the same in every lane."""
    return ti.cast(brain[item][0], ti.i32)


@ti.func
def _think(S: ti.template(), brain: ti.template(), m: ti.template(), T: ti.template()):
    """Readings -> network -> actuation of the next step, and one plastic update (Eq. 1, 3).

    A row of weights is updated as soon as its neuron is known: no other neuron of this step
    reads that row again, so all layers still act under the weights of before the update.
    """
    layers = _integer(brain, _LAYERS)
    stride = _integer(brain, _STRIDE)
    plastic = _integer(brain, _PLASTIC)
    normalize = _integer(brain, _NORMALIZE)
    alive = S[m.header + lay.H_ALIVE] > T.f(0.0)
    neurons = 0
    for layer in range(layers + 1):
        neurons += _integer(brain, _SIZES + layer)
    pre = _SIZES + layers + 1
    row = pre + neurons
    n_in = _integer(brain, _SIZES)
    for i in range(n_in):
        brain[pre + i] = S[m.reading_block + i]
    for layer in range(layers):
        n_out = _integer(brain, _SIZES + layer + 1)
        post = pre + n_in
        for j in range(n_out):
            y = tanh(_weighted_sum(brain, row, stride, pre, n_in, T), T)
            brain[post + j] = y
            if plastic != 0:
                squares = _update_row(brain, row, pre, n_in, y, alive, T)
                if normalize == _L2:
                    _scale_row(brain, row, n_in, squares, T)
                if normalize == _MINMAX:
                    _stretch_row(brain, row, n_in, T)
            row += stride * n_in
        pre = post
        n_in = n_out
    for v in range(m.voxels):
        actuation.receive(S, m, v, brain[pre + v], T)


@ti.func
def _weighted_sum(brain: ti.template(), row, stride, pre, n_in, T: ti.template()):
    """The input of one neuron."""
    total = T.vec(0.0)
    for i in range(n_in):
        total += brain[row + stride * i] * brain[pre + i]
    return total


@ti.func
def _update_row(brain: ti.template(), row, pre, n_in, y, alive, T: ti.template()):
    """Changes the incoming weights of one neuron; returns the sum of their squares."""
    squares = T.vec(0.0)
    for i in range(n_in):
        synapse = brain.at[row + _PLASTIC_ITEMS * i]
        x = brain[pre + i]
        # Eq. (3), factored as y (A x + C) + (B x + D)
        change = y * (synapse[_A] * x + synapse[_C]) + (synapse[_B] * x + synapse[_D])
        w = synapse[_W]
        w = ti.select(alive, w + change, w)  # Eq. (1); worlds that are over learn no more
        synapse[_W] = w
        squares += w * w
    return squares


@ti.func
def _scale_row(brain: ti.template(), row, n_in, squares, T: ti.template()):
    """Divides the incoming weights of one neuron by their Euclidean norm (Sec. IV-C)."""
    norm = ti.select(squares > T.f(0.0), ti.sqrt(squares), T.vec(1.0))
    for i in range(n_in):
        synapse = brain.at[row + _PLASTIC_ITEMS * i]
        synapse[_W] = synapse[_W] / norm


@ti.func
def _stretch_row(brain: ti.template(), row, n_in, T: ti.template()):
    """Maps the incoming weights of one neuron onto [-1, 1]."""
    low, high = brain[row], brain[row]
    for i in range(1, n_in):
        w = brain[row + _PLASTIC_ITEMS * i]
        low = ti.min(low, w)
        high = ti.max(high, w)
    span = high - low
    zero, one = T.vec(0.0), T.vec(1.0)
    for i in range(n_in):
        synapse = brain.at[row + _PLASTIC_ITEMS * i]
        w = synapse[_W]
        spread = (w - low) / ti.select(span > zero, span, one) * T.f(2.0) - one
        synapse[_W] = ti.select(span > zero, spread, w)


@lru_cache
def _kernel(program: Program) -> Kernel:
    return kernels.closed_loop(program, _think)


@dataclass(frozen=True)
class Brain:
    """The networks of a batch of worlds, packed for the kernel.

    Attributes:
        items: (groups, items, lanes), their memory in the order of kernels; the weights in it
            change as the worlds live.
        network: where it came from.
        shapes: of the state's weights, (*lead, out, in) per layer.
    """

    items: Tensor
    network: hebbtorch.HebbianMLP | hebbtorch.StaticMLP
    shapes: tuple[torch.Size, ...]

    def run(self, sim: Simulator, steps: int) -> None:
        """Lets the worlds of ``sim`` live for some control steps."""
        sim.run_closed_loop(_kernel, self.items, steps)

    def freeze(self) -> None:
        """Ends learning: from now on the weights stay as they are."""
        self.items[:, _PLASTIC] = 0.0

    def activations(self) -> tuple[Tensor, ...]:
        """Of all neurons in the last step, the inputs first: per layer (worlds, neurons)."""
        sizes = self.network.sizes
        first = _SIZES + len(sizes)
        neurons = self.items[:, first : first + sum(sizes)].clone().movedim(-1, 1).flatten(0, 1)
        n_worlds = self.shapes[0][:-2].numel()
        return neurons[:n_worlds].split(list(sizes), 1)

    def state(self) -> hebbtorch.State:
        """The weights as they are now."""
        stride = _stride(self.network)
        first = _SIZES + len(self.network.sizes) + sum(self.network.sizes)
        worlds = self.items.movedim(-1, 1).flatten(0, 1)  # (places, items)
        weights = []
        for shape in self.shapes:
            count = shape[-2] * shape[-1]
            lead = shape[:-2].numel()
            rows = worlds[:lead, first : first + stride * count : stride]
            weights.append(rows.reshape(shape).clone())
            first += stride * count
        return hebbtorch.State(tuple(weights))


def pack(
    sim: Simulator,
    network: hebbtorch.HebbianMLP | hebbtorch.StaticMLP,
    state: hebbtorch.State,
    *,
    plastic: bool = True,
) -> Brain:
    """Networks and their weights in the kernel's order.

    Args:
        sim: N worlds.
        network: of N individuals (the dimensions of its population and of the state's batch
            together), in the order of the worlds.
        state: their weights.
        plastic: False freezes the weights.

    Raises:
        ValueError: the networks do not fit the worlds.
    """
    _check_fit(sim, network, state)
    layers = list(network.layers) if isinstance(network, hebbtorch.HebbianMLP) else []
    normalize = _NORMALIZATIONS[layers[0].normalize if layers else None]
    header = [len(network.sizes) - 1, _stride(network), bool(layers) and plastic, normalize]
    header += network.sizes
    rows = [
        torch.tensor(header, dtype=sim.dtype, device=sim.device).expand(sim.n_worlds, -1),
        torch.zeros(sim.n_worlds, sum(network.sizes), dtype=sim.dtype, device=sim.device),
    ]
    for index, weights in enumerate(state.weights):
        parts = [weights]
        if layers:
            layer = layers[index]
            parts += [layer.learning_rate() * c for c in layer.coefficients()]
        synapses = torch.stack([part.detach().expand(weights.shape) for part in parts], -1)
        rows.append(synapses.reshape(sim.n_worlds, -1).to(sim.device, sim.dtype))
    worlds = torch.cat(rows, 1)
    groups = -(-sim.n_worlds // sim.lanes)
    items = worlds.new_zeros(groups * sim.lanes, worlds.shape[1])
    items[: sim.n_worlds] = worlds
    items = unpacked(items.unflatten(0, (groups, sim.lanes)).movedim(1, -1), sim.lanes)
    return Brain(items, network, tuple(weights.shape for weights in state.weights))


def _stride(network: hebbtorch.HebbianMLP | hebbtorch.StaticMLP) -> int:
    """Items per synapse."""
    return _PLASTIC_ITEMS if isinstance(network, hebbtorch.HebbianMLP) else 1


def _check_fit(
    sim: Simulator,
    network: hebbtorch.HebbianMLP | hebbtorch.StaticMLP,
    state: hebbtorch.State,
) -> None:
    ends = (network.sizes[0], network.sizes[-1])
    if ends != (sim.n_readings, sim.n_voxels):
        raise ValueError(
            f"network: expected {sim.n_readings} inputs and {sim.n_voxels} outputs for these "
            f"readings and voxels, got {ends[0]} and {ends[1]}"
        )
    individuals = state.weights[0].shape[:-2].numel()
    if individuals != sim.n_worlds:
        raise ValueError(
            f"network: expected {sim.n_worlds} individuals, one per world, got {individuals}"
        )
