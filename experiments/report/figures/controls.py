"""Controls: the plastic network beside static ones of other kinds, and fast beside slow control."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from experiments.report.figures import boxes
from experiments.report.figures.performance import box
from experiments.report.figures.variants import FULL
from experiments.report.finished_runs import FinishedRuns, gather

__all__ = ["attractors", "control_interval", "controls", "neuron_rules"]

_OPTIONS = {
    "gain",
    "bias",
    "input_activation",
    "control_interval",
    "exchange_bc",
    "constant_last_input",
}
_CAPTION = (
    "Speed of each run's best individual at the end of evolution [m/s]; medians over runs with "
    "95 % bootstrap intervals. Every controller against the plastic one: how much higher it is "
    "(Hodges and Lehmann), with the shifts that the exact Mann-Whitney test does not reject."
)


def controls(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Static networks with a gain, biases or recurrence, and those of the paper's code, against the
    plastic network: a figure for each control interval."""
    found = [
        each
        for each in gather(run_folders)
        if set(each.variant) <= _OPTIONS and each.config.damage == "none"
    ]
    files = []
    for interval in sorted({each.config.control_interval for each in found if _is_static(each)}):
        alike = [each for each in found if each.config.control_interval == interval]
        name = "controls" if interval == 1 else f"controls-{interval}"
        plastic = next((each.full_label for each in alike if _is_main(each)), FULL)
        files += _figure(alike, out, name, plastic)
    return files


def control_interval(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Plastic networks that act and learn every few steps, against every step."""
    found = [each for each in _plastic(run_folders) if set(each.variant) <= {"control_interval"}]
    return _figure(found, out, "control_interval")


def neuron_rules(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Rules made of genes of neurons against those of synapses, eta fixed and evolved."""
    found = [each for each in _plastic(run_folders) if set(each.variant) <= {"sharing", "eta"}]
    found = [each for each in found if each.config.sharing in ("full", "neuron")]
    if not any(each.config.sharing == "neuron" for each in found):
        return []
    return _figure(found, out, "neuron_rules")


def attractors(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Weights over their greatest, with means of activations and rarer updates, against the paper's
    model."""
    options = {"normalize", "average", "every"}
    found = [each for each in _plastic(run_folders) if set(each.variant) <= options]
    found = [each for each in found if each.config.normalize in (None, "max")]
    return _figure(found, out, "attractors")


def _plastic(run_folders: Sequence[Path]) -> list[FinishedRuns]:
    """Plastic networks that evolved without damage."""
    return [
        each
        for each in gather(run_folders)
        if (each.config.controller, each.config.damage) == ("hebbian", "none")
    ]


def _is_static(condition: FinishedRuns) -> bool:
    return condition.config.controller != "hebbian"


def _is_main(condition: FinishedRuns) -> bool:
    """Whether it is the paper's plastic network, at any control interval."""
    return not _is_static(condition) and set(condition.variant) <= {"control_interval"}


def _figure(
    found: Sequence[FinishedRuns], out: Path, name: str, reference: str = FULL
) -> list[Path]:
    if not any(each.variant or each.config.controller == "rnn" for each in found):
        return []  # nothing but what other figures show
    mixed = any(_is_static(each) for each in found)
    named = [(each.full_label if mixed else each.label, each) for each in found]
    named.sort(key=lambda pair: (pair[0] != reference, _place(pair[1])))
    drawn = [replace(box(each, each.fitness), label=label) for label, each in named]
    return boxes.draw(drawn, out, name, reference, _CAPTION)


def _place(condition: FinishedRuns) -> tuple[Any, ...]:
    """By control interval, kind, gain, biases, and steps of rules."""
    config = condition.config
    return (
        config.control_interval,
        config.controller,
        config.gain,
        config.bias,
        config.average,
        config.every,
        condition.label,
    )
