"""The network's part of the kernel, compiled for the features that a network has.

A group's network is one row of items, each a vector with a lane per individual:

    header | sizes | activations of all neurons | their means | biases | windows | synapses

Means and windows exist only with averages, biases only with biases. `header` holds what is named
by LAYERS ... SIZES below. The synapses stand layer by layer, (out, in): a plastic one has five
items, w and eta times A, B, C, D, and with fixed weights two more, fixed and alpha; a static one
has w alone. A window is a ring of the activations of all neurons in the last steps.
"""

from dataclasses import asdict
from functools import lru_cache
from typing import Any

from experiments.rollout.fused.features import Features
from physics.backend import Kernel, Program, ti
from physics.engine import closed_loop, limited, magnitude, receive, tanh
from physics.engine import layout as lay

# Sizes and switches, the same in every lane; KEEP is 1 - decay; LEARNS is 1 in the lanes of
# those who learn; READINGS are the inputs that come from the body.
(
    LAYERS,
    STRIDE,
    PLASTIC,
    NORMALIZE,
    READINGS,
    STEP,
    AVERAGE,
    EVERY,
    KEEP,
    CLIP,
    LEARNS,
    SIZES,
) = range(12)
L2, MINMAX, MAX = 1, 2, 3
W, A, B, C, D, FIXED, ALPHA = range(7)


class _Flags:
    """`Features` as a kernel takes them: quadrants would take a dataclass apart."""

    _data_oriented = True

    def __init__(self, features: Features) -> None:
        self.__dict__.update(asdict(features))


def synapse_items(plastic: bool, features: Features) -> int:
    """Items per synapse."""
    if not plastic:
        return 1
    return 7 if features.fixed else 5


@ti.func
def _integer(net: ti.template(), item):
    """An integer kept in the row; it is the same in every lane."""
    return ti.cast(net[item][0], ti.i32)


@ti.func
def _weighted_sum(net: ti.template(), row, stride, pre, n_in, F: ti.template(), T: ti.template()):
    """The input of one neuron, its bias excepted."""
    total = T.vec(0.0)
    for i in range(n_in):
        if ti.static(F.fixed):
            synapse = net.at[row + stride * i]
            acting = synapse[FIXED] + synapse[ALPHA] * synapse[W]
            total += acting * net[pre + i]
        else:
            total += net[row + stride * i] * net[pre + i]
    return total


@ti.func
def _update_row(
    net: ti.template(),
    row,
    pre,
    n_in,
    y,
    alive,
    keep,
    clip,
    F: ti.template(),
    T: ti.template(),
):
    """Changes the incoming weights of one neuron; returns the sum of their squares, the greatest.

    ``alive`` are the lanes that learn: those of worlds that are not over.
    """
    squares = T.vec(0.0)
    greatest = T.vec(0.0)
    items = ti.static(synapse_items(True, F))
    for i in range(n_in):
        synapse = net.at[row + items * i]
        x = net[pre + i]
        # Eq. (3), factored as y (A x + C) + (B x + D)
        change = y * (synapse[A] * x + synapse[C]) + (synapse[B] * x + synapse[D])
        w = synapse[W]
        updated = w + change  # Eq. (1)
        if ti.static(F.decay):
            updated = keep * w + change
        if ti.static(F.clip):
            updated = limited(updated, clip, T)
        w = ti.select(alive, updated, w)
        synapse[W] = w
        squares += w * w
        if ti.static(F.maximum):
            greatest = ti.max(greatest, magnitude(w, T))
    return squares, greatest


@ti.func
def _divide(net: ti.template(), row, count, divisor, F: ti.template(), T: ti.template()):
    """Divides so many weights from a place on."""
    items = ti.static(synapse_items(True, F))
    for i in range(count):
        synapse = net.at[row + items * i]
        synapse[W] = synapse[W] / divisor


@ti.func
def _stretch_row(net: ti.template(), row, n_in, alive, F: ti.template(), T: ti.template()):
    """Maps the incoming weights of one neuron onto [-1, 1], in the lanes that learn."""
    items = ti.static(synapse_items(True, F))
    low, high = net[row], net[row]
    for i in range(1, n_in):
        w = net[row + items * i]
        low = ti.min(low, w)
        high = ti.max(high, w)
    span = high - low
    zero, one = T.vec(0.0), T.vec(1.0)
    for i in range(n_in):
        synapse = net.at[row + items * i]
        w = synapse[W]
        spread = (w - low) / ti.select(span > zero, span, one) * T.f(2.0) - one
        synapse[W] = ti.select((span > zero) & alive, spread, w)


@ti.func
def _mean(net: ti.template(), window, neurons, k, step, average, T: ti.template()):
    """The mean of neuron k over the last steps, the present one in its place of the ring."""
    lived = ti.min(step, average)
    total = T.vec(0.0)
    for back in range(lived):
        total += net[window + ((step - lived + 1 + back) % average) * neurons + k]
    return total / ti.cast(lived, T.f)


@lru_cache
def kernel(features: Features, program: Program) -> Kernel:
    """The closed loop for networks with these features."""
    F: Any = _Flags(features)

    @ti.func
    def think(S: ti.template(), net: ti.template(), m: ti.template(), T: ti.template()):
        """Readings -> network -> actuation of the next step, and one plastic update (Eq. 1, 3).

        A row of weights is updated as soon as its neuron is known: no other neuron of this step
        reads that row again, so all layers still act under the weights of before the update.
        """
        layers = _integer(net, LAYERS)
        stride = _integer(net, STRIDE)
        plastic = _integer(net, PLASTIC)
        normalize = _integer(net, NORMALIZE)
        readings = _integer(net, READINGS)
        alive = S[m.header + lay.H_ALIVE] > T.f(0.0)
        if ti.static(F.mask):
            alive = alive & (net[LEARNS] > T.f(0.0))
        keep, clip = T.vec(1.0), T.vec(0.0)
        if ti.static(F.decay):
            keep = net[KEEP]
        if ti.static(F.clip):
            clip = net[CLIP]
        neurons = 0
        for layer in range(layers + 1):
            neurons += _integer(net, SIZES + layer)
        first = SIZES + layers + 1
        pre = first
        row = pre + neurons
        n_in = _integer(net, SIZES)
        mean_shift, bias, window, step, average = 0, 0, 0, 0, 1
        if ti.static(F.average):
            mean_shift = neurons
            row += neurons
        if ti.static(F.bias):
            bias = row
            row += neurons - n_in
        if ti.static(F.average or F.every):
            step = _integer(net, STEP) + 1
            net[STEP] = net[STEP] + T.vec(1.0)
        if ti.static(F.every):  # noqa: SIM102
            if step % _integer(net, EVERY) != 0:
                plastic = 0
        if ti.static(F.average):
            average = _integer(net, AVERAGE)
            window = row
            row += average * neurons
        for i in range(readings):
            value = S[m.reading_block + i]
            if ti.static(F.input_tanh):
                value = tanh(value, T)
            if ti.static(F.constant_last_input):  # noqa: SIM102
                if i == readings - 1:
                    value = T.vec(1.0)
            net[pre + i] = value
        if ti.static(F.average):
            for i in range(n_in):
                net[window + (step % average) * neurons + i] = net[pre + i]
                net[pre + mean_shift + i] = _mean(net, window, neurons, i, step, average, T)
        for layer in range(layers):
            n_out = _integer(net, SIZES + layer + 1)
            post = pre + n_in
            begin = row
            greatest = T.vec(0.0)
            for j in range(n_out):
                total = _weighted_sum(net, row, stride, pre, n_in, F, T)
                if ti.static(F.bias):
                    total += net[bias + j]
                y = tanh(total, T)
                net[post + j] = y
                if ti.static(F.average):
                    k = post - first + j
                    net[window + (step % average) * neurons + k] = y
                    y = _mean(net, window, neurons, k, step, average, T)
                    net[post + mean_shift + j] = y
                if plastic != 0:
                    squares, row_max = _update_row(
                        net, row, pre + mean_shift, n_in, y, alive, keep, clip, F, T
                    )
                    if ti.static(F.maximum):
                        greatest = ti.max(greatest, row_max)
                    if normalize == L2:
                        norm = ti.select((squares > T.f(0.0)) & alive, ti.sqrt(squares), T.vec(1.0))
                        _divide(net, row, n_in, norm, F, T)
                    if normalize == MINMAX:
                        _stretch_row(net, row, n_in, alive, F, T)
                row += stride * n_in
            if ti.static(F.maximum):  # noqa: SIM102
                if plastic != 0:
                    divisor = ti.select((greatest > T.f(0.0)) & alive, greatest, T.vec(1.0))
                    _divide(net, begin, n_in * n_out, divisor, F, T)
            if ti.static(F.bias):
                bias += n_out
            pre = post
            n_in = n_out
        for v in range(m.voxels):
            receive(S, m, v, net[pre + v], T)
        if ti.static(F.recurrent):
            hidden = _integer(net, SIZES + 1)
            for j in range(hidden):
                net[first + readings + j] = net[first + readings + hidden + j]

    return closed_loop(program, think)
