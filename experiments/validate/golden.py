"""Controllers on recorded inputs, without a robot."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import Tensor

from experiments.validate import networks
from experiments.validate.case import (
    Case,
    Check,
    Outcome,
    Panel,
    Picture,
    Setting,
    Skip,
    Tolerance,
    worst,
)
from experiments.validate.recordings import Recordings

__all__ = ["cases"]

_ERROR = Tolerance("at most", 1e-12)
_FILE = "hebbian_golden"
_SHOWN = 3  # outputs in a picture


def cases(recordings: Recordings) -> list[Case | Skip]:
    """One for every network of ``hebbian_golden.json`` and every table ``closedloop_*``."""
    found: list[Case | Skip] = [
        _golden_case(name, content)
        for name, content in recordings.document(_FILE).items()
        if isinstance(content, dict) and "coefs" in content
    ] or [Skip(_FILE, f"no networks in {_FILE}.json")]
    found += [
        _closed_loop_case(recordings, match[0], match[1])
        for match in recordings.names(r"closedloop_.+_(hlp|mlp)")
    ]
    return found


# --- hebbian_golden.json ------------------------------------------------------------------------


def _golden_case(name: str, content: dict[str, Any]) -> Case | Skip:
    case = f"{_FILE} {name}"
    sharing, golden = _read_golden(name, content)
    if sharing is None:
        return Skip(case, f"{len(golden.coefficients)} coefficients, of an unknown sharing")
    return Case(case, partial(_replay_golden, case, sharing, golden))


@dataclass(frozen=True)
class _Golden:
    """A recorded network without robot.

    Attributes:
        sizes: neurons per layer.
        eta: The learning rate.
        coefficients: The coefficients of the rules, that is the genome.
        inputs, outputs: (T, in) and (T, out).
        weights: Number of steps made -> the weights after them, (synapses,).
    """

    sizes: list[int]
    eta: float
    coefficients: np.ndarray
    inputs: np.ndarray
    outputs: np.ndarray
    weights: dict[int, np.ndarray]


def _read_golden(name: str, content: dict[str, Any]) -> tuple[str | None, _Golden]:
    """The sharing, None if unknown, and the network."""
    try:
        golden = _Golden(
            [int(size) for size in content["sizes"]],
            float(content["eta"]),
            np.array(content["coefs"], np.float64),
            np.array(content["inputs"], np.float64),
            np.array(content["outputs"], np.float64),
            {
                int(after.removeprefix("after_")): np.array(values, np.float64)
                for after, values in content["weights"].items()
            },
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(
            f"{_FILE}.json: expected sizes, eta, coefs, inputs, outputs and weights, all numbers, "
            f"in {name}, got {type(error).__name__}: {error}"
        ) from error
    sizes, steps = golden.sizes, len(golden.inputs)
    synapses = sum(n_in * n_out for n_in, n_out in pairwise(sizes))
    expected: dict[str, tuple[int, ...]] = {
        "inputs": (steps, sizes[0]),
        "outputs": (steps, sizes[-1]),
    }
    shapes = {"inputs": golden.inputs.shape, "outputs": golden.outputs.shape}
    for after, weights in golden.weights.items():
        expected[f"weights after_{after}"] = (synapses,) if 1 <= after <= steps else (0,)
        shapes[f"weights after_{after}"] = weights.shape
    if expected != shapes:
        raise ValueError(f"{_FILE}.json: expected shapes {expected} in {name}, got {shapes}")
    sharings = {4 * synapses: "full", 4 * sum(sizes[1:]): "presynaptic"}
    return sharings.get(len(golden.coefficients)), golden


def _replay_golden(name: str, sharing: str, golden: _Golden, setting: Setting) -> Outcome:
    genomes = torch.from_numpy(golden.coefficients)[None]
    network = networks.RecordedHebbian(genomes, golden.sizes, sharing, golden.eta)
    outputs, states = _run(network, torch.from_numpy(golden.inputs))
    flat = [torch.cat([w[0].mT.flatten() for w in state.weights]).numpy() for state in states]
    errors = [flat[after - 1] - weights for after, weights in golden.weights.items()]
    return Outcome(
        tuple(
            Check(name, f"greatest error of {what}", 0.0, worst(error), _ERROR)
            for what, error in (
                ("an output", outputs - golden.outputs),
                ("a weight", np.concatenate([np.zeros(1), *errors])),
            )
        )
    )


# --- closedloop_* -------------------------------------------------------------------------------


def _closed_loop_case(recordings: Recordings, name: str, kind: str) -> Case | Skip:
    generation = name.replace("closedloop", "gen0", 1)
    if not recordings.has(generation):
        return Skip(name, f"no table {generation}")
    table = recordings.table(name)
    inputs, outputs = (
        [column for column in table.columns if re.fullmatch(pattern, column)]
        for pattern in ("in_.+", r"out\d+")
    )
    if not (inputs and outputs):
        raise ValueError(f"{table.path.name}: expected columns in_... and out0, ..., got none")
    sizes = [len(inputs), len(inputs), len(outputs)]
    rows = len(recordings.table(generation))
    genomes = recordings.genomes(generation, rows, networks.n_genes(kind, sizes))
    if genomes is None:
        return Skip(name, f"no file {generation}_genomes.f64.gz")
    recorded = table.numbers(inputs), table.numbers(outputs)
    return Case(name, partial(_replay_closed_loop, name, kind, sizes, genomes[:1], *recorded))


def _replay_closed_loop(
    name: str,
    kind: str,
    sizes: list[int],
    genomes: np.ndarray,
    inputs: np.ndarray,
    recorded: np.ndarray,
    setting: Setting,
) -> Outcome:
    network = networks.build(kind, torch.from_numpy(genomes), sizes)
    outputs, _ = _run(network, torch.from_numpy(inputs))
    row = Check(name, "greatest error of an output", 0.0, worst(outputs - recorded), _ERROR)
    panel = Panel(
        "controller on recorded inputs",
        "time [s]",
        "output",
        "lines",
        recorded[:, :_SHOWN],
        outputs[:, :_SHOWN],
        np.arange(1, len(outputs) + 1) / 60,
    )
    return Outcome((row,), (Picture(name, (panel,)),))


@torch.no_grad()
def _run(
    network: networks.RecordedHebbian | networks.RecordedStatic, inputs: Tensor
) -> tuple[np.ndarray, list[Any]]:
    """Outputs (T, out) of one network to inputs (T, in), and its state after each step."""
    state = network.initial_state()
    outputs, states = [], []
    for x in inputs:
        y, state = network(x[None], state)
        outputs.append(y[0])
        states.append(state)
    return torch.stack(outputs).numpy(), states
