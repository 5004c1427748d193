"""The network's part of the kernel, compiled for the features that a network has.

A group's network is one row of items, each a vector with a lane per individual:

    header | sizes | activations of all neurons | their means | biases | windows | synapses

Means and windows exist only with averages, biases only with biases. `header` holds what is named
by LAYERS ... SIZES below. The synapses stand layer by layer, (out, in): a plastic one has five
items, w and eta times A, B, C, D, and with fixed weights two more, fixed and alpha; a static one
has w alone. A window is a ring of the activations of all neurons in the last steps.
"""

from functools import lru_cache

from experiments.rollout.fused.features import Features
from physics.backend import Kernel, Program, ti
from physics.engine import actuation, kernels
from physics.engine.lane_math import limited, magnitude, tanh
from physics.engine.memory import layout as lay

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


def synapse_items(plastic: bool, features: Features) -> int:
    """Items per synapse."""
    if not plastic:
        return 1
    return 7 if features.fixed else 5


@ti.func
def _integer(brain: ti.template(), item):
    """An integer kept in the row; it is the same in every lane."""
    return ti.cast(brain[item][0], ti.i32)


@ti.func
def _weighted_sum(brain: ti.template(), row, stride, pre, n_in, F: ti.template(), T: ti.template()):
    """The input of one neuron, its bias excepted."""
    total = T.vec(0.0)
    for i in range(n_in):
        if ti.static(F.fixed):
            synapse = brain.at[row + stride * i]
            acting = synapse[FIXED] + synapse[ALPHA] * synapse[W]
            total += acting * brain[pre + i]
        else:
            total += brain[row + stride * i] * brain[pre + i]
    return total


@ti.func
def _update_row(
    brain: ti.template(),
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
        synapse = brain.at[row + items * i]
        x = brain[pre + i]
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
def _divide(brain: ti.template(), row, count, divisor, F: ti.template(), T: ti.template()):
    """Divides so many weights from a place on."""
    items = ti.static(synapse_items(True, F))
    for i in range(count):
        synapse = brain.at[row + items * i]
        synapse[W] = synapse[W] / divisor


@ti.func
def _stretch_row(brain: ti.template(), row, n_in, alive, F: ti.template(), T: ti.template()):
    """Maps the incoming weights of one neuron onto [-1, 1], in the lanes that learn."""
    items = ti.static(synapse_items(True, F))
    low, high = brain[row], brain[row]
    for i in range(1, n_in):
        w = brain[row + items * i]
        low = ti.min(low, w)
        high = ti.max(high, w)
    span = high - low
    zero, one = T.vec(0.0), T.vec(1.0)
    for i in range(n_in):
        synapse = brain.at[row + items * i]
        w = synapse[W]
        spread = (w - low) / ti.select(span > zero, span, one) * T.f(2.0) - one
        synapse[W] = ti.select((span > zero) & alive, spread, w)


@ti.func
def _mean(brain: ti.template(), window, neurons, k, step, average, T: ti.template()):
    """The mean of neuron k over the last steps, the present one in its place of the ring."""
    lived = ti.min(step, average)
    total = T.vec(0.0)
    for back in range(lived):
        total += brain[window + ((step - lived + 1 + back) % average) * neurons + k]
    return total / ti.cast(lived, T.f)


@lru_cache
def kernel(features: Features, program: Program) -> Kernel:
    """The closed loop for networks with these features."""
    F = features

    @ti.func
    def think(S: ti.template(), brain: ti.template(), m: ti.template(), T: ti.template()):
        """Readings -> network -> actuation of the next step, and one plastic update (Eq. 1, 3).

        A row of weights is updated as soon as its neuron is known: no other neuron of this step
        reads that row again, so all layers still act under the weights of before the update.
        """
        layers = _integer(brain, LAYERS)
        stride = _integer(brain, STRIDE)
        plastic = _integer(brain, PLASTIC)
        normalize = _integer(brain, NORMALIZE)
        readings = _integer(brain, READINGS)
        alive = S[m.header + lay.H_ALIVE] > T.f(0.0)
        if ti.static(F.mask):
            alive = alive & (brain[LEARNS] > T.f(0.0))
        keep, clip = T.vec(1.0), T.vec(0.0)
        if ti.static(F.decay):
            keep = brain[KEEP]
        if ti.static(F.clip):
            clip = brain[CLIP]
        neurons = 0
        for layer in range(layers + 1):
            neurons += _integer(brain, SIZES + layer)
        first = SIZES + layers + 1
        pre = first
        row = pre + neurons
        n_in = _integer(brain, SIZES)
        mean_shift, bias, window, step, average = 0, 0, 0, 0, 1
        if ti.static(F.average):
            mean_shift = neurons
            row += neurons
        if ti.static(F.bias):
            bias = row
            row += neurons - n_in
        if ti.static(F.average or F.every):
            step = _integer(brain, STEP) + 1
            brain[STEP] = brain[STEP] + T.vec(1.0)
        if ti.static(F.every):  # noqa: SIM102
            if step % _integer(brain, EVERY) != 0:
                plastic = 0
        if ti.static(F.average):
            average = _integer(brain, AVERAGE)
            window = row
            row += average * neurons
        for i in range(readings):
            value = S[m.reading_block + i]
            if ti.static(F.input_tanh):
                value = tanh(value, T)
            if ti.static(F.constant_last_input):  # noqa: SIM102
                if i == readings - 1:
                    value = T.vec(1.0)
            brain[pre + i] = value
        if ti.static(F.average):
            for i in range(n_in):
                brain[window + (step % average) * neurons + i] = brain[pre + i]
                brain[pre + mean_shift + i] = _mean(brain, window, neurons, i, step, average, T)
        for layer in range(layers):
            n_out = _integer(brain, SIZES + layer + 1)
            post = pre + n_in
            begin = row
            greatest = T.vec(0.0)
            for j in range(n_out):
                total = _weighted_sum(brain, row, stride, pre, n_in, F, T)
                if ti.static(F.bias):
                    total += brain[bias + j]
                y = tanh(total, T)
                brain[post + j] = y
                if ti.static(F.average):
                    k = post - first + j
                    brain[window + (step % average) * neurons + k] = y
                    y = _mean(brain, window, neurons, k, step, average, T)
                    brain[post + mean_shift + j] = y
                if plastic != 0:
                    squares, row_max = _update_row(
                        brain, row, pre + mean_shift, n_in, y, alive, keep, clip, F, T
                    )
                    if ti.static(F.maximum):
                        greatest = ti.max(greatest, row_max)
                    if normalize == L2:
                        norm = ti.select((squares > T.f(0.0)) & alive, ti.sqrt(squares), T.vec(1.0))
                        _divide(brain, row, n_in, norm, F, T)
                    if normalize == MINMAX:
                        _stretch_row(brain, row, n_in, alive, F, T)
                row += stride * n_in
            if ti.static(F.maximum):  # noqa: SIM102
                if plastic != 0:
                    divisor = ti.select((greatest > T.f(0.0)) & alive, greatest, T.vec(1.0))
                    _divide(brain, begin, n_in * n_out, divisor, F, T)
            if ti.static(F.bias):
                bias += n_out
            pre = post
            n_in = n_out
        for v in range(m.voxels):
            actuation.receive(S, m, v, brain[pre + v], T)
        if ti.static(F.recurrent):
            hidden = _integer(brain, SIZES + 1)
            for j in range(hidden):
                brain[first + readings + j] = brain[first + readings + hidden + j]

    return kernels.closed_loop(program, think)
