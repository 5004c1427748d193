"""Weights and neurons of champions during an episode: the paper's Fig. 7 and 9, and Sec. IV-C."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from experiments.io import style
from experiments.io.formats import require_format
from experiments.io.reading import readable
from experiments.report import tables
from experiments.report.finished_runs import FinishedRuns, gather
from experiments.runs.names import (
    RANDOM_GENOMES,
    RECORDING,
    RECORDING_FORMAT,
    RECORDING_MEASURES,
)

__all__ = ["RecordedEpisode", "activations", "measures", "random_measures", "weight_distributions"]

_PER_RUN = ("weights_", "activations_", "histograms")
_LAYERS = ("hidden", "output")
_BINS = 61  # of the histograms of weights; odd, so that one is centred on zero
_RASTER = 6.0  # [s]
_STEPS = 60  # control steps per second
_COLOR = "#0072B2"
_PANEL = (2.2, 1.6)  # [in]


@dataclass(frozen=True)
class RecordedEpisode:
    """The recorded episode of a condition's best champion among those recorded.

    Attributes:
        condition: where it evolved.
        measures: what recording.json says of it.
        arrays: what recording.npz holds of it, by name, without the axis of the runs.
    """

    condition: FinishedRuns
    measures: dict[str, Any]
    arrays: dict[str, NDArray[Any]]

    @property
    def title(self) -> str:
        """Shape, apparatus and what is special."""
        extra = "" if self.condition.label == "Hebbian" else f", {self.condition.label}"
        return self.condition.where + extra


def weight_distributions(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Fig. 7 and 9: how often which weights occur, at three times of an episode.

    A figure without normalization of the weights, and one for each way to normalize.
    """
    conditions = gather(run_folders)
    figures: tuple[tuple[str, dict[str, str]], ...] = (
        ("weight_distributions", {}),
        ("normalized_weight_distributions", {"normalize": "l2"}),
        ("minmax_weight_distributions", {"normalize": "minmax"}),
    )
    return [file for name, variant in figures for file in _weights(conditions, out, name, variant)]


def activations(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """How often which activations occur, and their course at the episode's end (Sec. IV-C)."""
    conditions = gather(run_folders)
    variants: list[dict[str, str]] = [{}, {"normalize": "l2"}, {"normalize": "minmax"}]
    found = [each for variant in variants for each in _of_variant(conditions, variant)]
    episodes = sorted(_best_episodes(found), key=lambda episode: episode.condition.where)
    if not episodes:
        return []
    with style.sheet(out, "activations", _PANEL, rows=len(episodes), columns=3) as sheet:
        for row, episode in enumerate(episodes):
            for layer, name in enumerate(_LAYERS):
                _draw_activations(sheet.panel(row, layer), episode.arrays["histograms"][layer])
                sheet.panel(row, layer).set_title(f"{episode.title}\n{name} layer")
            _draw_raster(sheet, sheet.panel(row, 2), episode)
    caption = (
        "Shares of the activations of the last seconds of an episode beyond +-0.9 (saturated) and "
        "within +-0.1 (middle), the share of neurons that switch between both ends, and period [s] "
        "and regularity (at most 1) of the neurons and of the gait, and the share of the body's "
        "movement above 4 Hz (vibration); n/a where nothing repeats itself. The figure shows the "
        "best run of each condition."
    )
    return [*sheet.files, *tables.write(_activation_rows(found), out, "activations", caption)]


def random_measures(condition: FinishedRuns) -> list[dict[str, Any]]:
    """As `measures`, of random genomes in place of the champions."""
    files = condition.files(RANDOM_GENOMES)
    folders = dict.fromkeys(path for _, _, path in files)
    return [episode for path in folders for episode in _runs_in(path)]


def measures(condition: FinishedRuns) -> list[dict[str, Any]]:
    """What recording.json says of each run, in order; empty if the condition was not analysed."""
    found = []
    for run, own, path in condition.files(RECORDING_MEASURES):
        with readable(path):
            found.append({**_runs_in(path)[own], "run": run})
    return found


def _runs_in(path: Path) -> list[dict[str, Any]]:
    """What a file of measures says of each run."""
    with readable(path):
        content = json.loads(path.read_text(encoding="utf-8"))
        require_format(content.get("format", RECORDING_FORMAT), RECORDING_FORMAT)
        of_runs = content["runs"]
        if not isinstance(of_runs, list) or not all(isinstance(each, dict) for each in of_runs):
            raise ValueError("runs: expected a list of objects")
    return of_runs


def _weights(
    conditions: Sequence[FinishedRuns], out: Path, name: str, variant: Mapping[str, str]
) -> list[Path]:
    found = _of_variant(conditions, variant)
    episodes = _best_episodes(found)
    if not episodes:
        return []
    n_times = max(len(episode.arrays["times"]) for episode in episodes)
    with style.sheet(out, name, _PANEL, rows=len(episodes), columns=n_times, sharey="all") as sheet:
        for row, episode in enumerate(episodes):
            for k, time in enumerate(episode.arrays["times"]):
                axes = sheet.panel(row, k)
                layers = (episode.arrays[f"weights_{layer}"][k] for layer in range(len(_LAYERS)))
                _draw_weights(axes, np.concatenate([layer.ravel() for layer in layers]))
                axes.set_title(f"{episode.title}, {time:.2g} s")
                if row == len(episodes) - 1:
                    axes.set_xlabel("weight")
            sheet.panel(row).set_ylabel("relative frequency")
    caption = (
        "Median and largest |w|, the share of weights beyond ten medians (diverged), and excess "
        "kurtosis (above 0: a bell with extremes). The figure shows the best run of each condition."
    )
    return [*sheet.files, *tables.write(_weight_rows(found), out, name, caption)]


def _of_variant(
    conditions: Sequence[FinishedRuns], variant: Mapping[str, str]
) -> list[FinishedRuns]:
    return [
        each
        for each in conditions
        if each.variant == variant
        and (each.config.controller, each.config.damage) == ("hebbian", "none")
    ]


def _best_episodes(conditions: Sequence[FinishedRuns]) -> list[RecordedEpisode]:
    episodes = []
    for condition in conditions:
        described = {each["run"]: each for each in measures(condition)}
        recorded = [each for each in condition.files(RECORDING) if each[0] in described]
        if not recorded:
            continue
        speeds = np.nan_to_num(condition.fitness, nan=-np.inf)
        run, own, path = max(recorded, key=lambda each: speeds[each[0]])
        with readable(path), np.load(path) as file:
            if "format" in file:
                require_format(file["format"].item(), RECORDING_FORMAT)
            arrays = {name: file[name][own] for name in file if name.startswith(_PER_RUN)}
            arrays["times"] = file["times"]
        episodes.append(RecordedEpisode(condition, described[run], arrays))
    return episodes


def _draw_weights(axes: Axes, weights: NDArray[Any]) -> None:
    finite = weights[np.isfinite(weights)]
    reach = max(float(np.abs(finite).max(initial=0.0)), 1e-6)
    counts, edges = np.histogram(finite, _BINS, (-reach, reach))
    axes.stairs(counts / len(weights), edges, fill=True, color=_COLOR)
    axes.set(yscale="log", ylim=(0.7 / len(weights), 1))  # a single weight can be seen


def _draw_activations(axes: Axes, counts: NDArray[Any]) -> None:
    edges = np.linspace(-1, 1, len(counts) + 1)
    axes.stairs(counts / max(counts.sum(), 1), edges, fill=True, color=_COLOR)
    axes.set(xlabel="activation", ylabel="relative frequency", xlim=(-1, 1))


def _draw_raster(sheet: style.Sheet, axes: Axes, episode: RecordedEpisode) -> None:
    """Neurons (rows, outputs on top) against time, with the period of the gait marked."""
    layers = [episode.arrays[f"activations_{name}"] for name in _LAYERS]
    shown = np.concatenate(layers, axis=1)[-int(_RASTER * _STEPS) :].T.astype(np.float64)
    seconds = shown.shape[1] / _STEPS
    image = axes.imshow(
        shown, cmap="cividis", vmin=-1, vmax=1, aspect="auto", interpolation="nearest",
        origin="lower", extent=(0, seconds, 0, len(shown)),
    )  # fmt: skip
    axes.axhline(layers[0].shape[1], color="white", lw=0.8)
    gait = episode.measures["gait_period"]
    if gait is not None and gait < seconds:
        for time in np.arange(gait, seconds, gait):
            axes.axvline(time, color="white", lw=0.6, ls=":")
    said = "no gait period" if gait is None else f"gait period {gait:.2f} s"
    axes.set(xlabel="time [s], end of the episode", ylabel="neuron (outputs on top)", title=said)
    sheet.figure.colorbar(image, ax=axes, label="activation")


def _weight_rows(conditions: Sequence[FinishedRuns]) -> list[dict[str, Any]]:
    names = ("second", "median", "largest", "diverged", "kurtosis")
    return [
        _row(condition, whose, episode["run"], {name: at_time[name] for name in names})
        for condition in conditions
        for whose, episode in _observed(condition)
        for at_time in episode["weights"]
    ]


def _activation_rows(conditions: Sequence[FinishedRuns]) -> list[dict[str, Any]]:
    names = ("saturated", "middle", "switching", "period", "regularity")
    rows = []
    for condition in conditions:
        for whose, episode in _observed(condition):
            of_layers = {
                f"{name}_{layer}": episode["layers"][layer][name]
                for layer in _LAYERS
                for name in names
            }
            gait = {f"{name}_gait": episode[f"gait_{name}"] for name in ("period", "regularity")}
            gait["vibration"] = episode.get("vibration")
            rows.append(_row(condition, whose, episode["run"], of_layers | gait))
    return rows


def _observed(condition: FinishedRuns) -> Iterator[tuple[str, dict[str, Any]]]:
    """All that was observed: whose it is, and its measures."""
    for whose, episodes in (
        ("champion", measures(condition)),
        ("random genome", random_measures(condition)),
    ):
        for episode in episodes:
            yield whose, episode


def _row(
    condition: FinishedRuns, whose: str, run: int, values: Mapping[str, Any]
) -> dict[str, Any]:
    known = {name: float("nan") if value is None else value for name, value in values.items()}
    where = {"where": condition.where, "controller": condition.label, "whose": whose, "run": run}
    return where | known
