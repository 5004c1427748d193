"""Evolved champions in closed loop: their speeds in the reference simulator, and ours."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import torch
from scipy.stats import spearmanr

import hebbtorch
from experiments.rollout import Episode
from experiments.validate.case import Case, Check, Outcome, Setting, Skip, Tolerance
from experiments.validate.recordings import Recordings
from physics import Morphology, Terrain

__all__ = ["cases"]

_DURATION = 60.0  # [s]
_NETWORKS = {"mlp": hebbtorch.StaticMLP, "hebbian": hebbtorch.HebbianMLP}
_PLAIN, _OTHER = "noccd", "veto"  # modes: as the simulator is by default; with true events
_ALIKE = Tolerance("at least", 0.6)  # the reference's own modes: 0.59 to 0.99
_MEDIAN = Tolerance("within", 2.0)


@dataclass(frozen=True)
class _Champions:
    """Champions of one kind, each on several terrains: episodes (E,).

    Attributes:
        name: The name of the case.
        kind: The kind of the networks.
        morphology: The robot's shape.
        sensors: name of its apparatus.
        genomes: one per episode, (E, G).
        runs: number of each one's champion, (E,).
        terrains: one per episode.
        recorded: speeds [m/s] by mode, (E,).
    """

    name: str
    kind: str
    morphology: Morphology
    sensors: str
    genomes: np.ndarray
    runs: np.ndarray
    terrains: list[Terrain]
    recorded: dict[str, np.ndarray]


def cases(recordings: Recordings) -> list[Case | Skip]:
    """Those of the folder ``champions`` in the folder of the recordings."""
    if not (recordings.folder / "champions").is_dir():
        return [Skip("champions", "no folder champions")]
    inner = Recordings(recordings.folder / "champions")
    found: list[Case | Skip] = []
    for match in inner.names(r"([^_]+)_(low|medium|high)_(hebbian|mlp)_speeds"):
        champions = _read(inner, match[0], match[1], match[2], match[3])
        found.append(Case(champions.name, partial(_replay, champions)))
    return found


def _read(recordings: Recordings, name: str, shape: str, sensors: str, kind: str) -> _Champions:
    table = recordings.table(name)
    runs = table.numbers("run").astype(int)
    terrains, modes = np.array(table.text("terrain")), np.array(table.text("mode"))
    speeds = table.numbers("vel")
    order = [(int(run), str(t)) for run, t in zip(runs, terrains, strict=True)]
    episodes = sorted(set(order))
    recorded = {}
    for mode in (_PLAIN, _OTHER):
        found = {key: v for key, v, m in zip(order, speeds, modes, strict=True) if m == mode}
        recorded[mode] = np.array([found[key] for key in episodes])
    genomes = recordings.matrix(name.replace("_speeds", "_genomes"))
    return _Champions(
        f"champions {shape} {sensors} {kind}",
        kind,
        recordings.robot(shape, name),
        sensors,
        genomes[[run for run, _ in episodes]],
        np.array([run for run, _ in episodes]),
        [recordings.terrain(t, table.path.name) for _, t in episodes],
        recorded,
    )


def _replay(champions: _Champions, setting: Setting) -> Outcome:
    count = len(champions.genomes)
    sim = setting.simulator(
        champions.morphology, champions.terrains, count, sensors=champions.sensors
    )
    sizes = [sim.n_readings, sim.n_readings, sim.n_voxels]
    network = _NETWORKS[champions.kind](sizes, population=(count,))
    network.set_genomes(torch.from_numpy(champions.genomes).float())
    network.to(sim.device)
    ours = Episode(sim, network, _DURATION).finish().speed.cpu().numpy()
    plain, other = champions.recorded[_PLAIN], champions.recorded[_OTHER]
    medians = [_medians(champions.runs, each) for each in (ours, plain, other)]
    difference = float(np.abs(other - plain).mean())
    return Outcome(
        (
            Check(
                champions.name,
                "Spearman of the champions' medians",
                1.0,
                float(spearmanr(medians[0], medians[1]).statistic),
                _ALIKE,
                float(spearmanr(medians[2], medians[1]).statistic),
            ),
            Check(
                champions.name,
                "median speed [m/s]",
                float(np.median(plain)),
                float(np.median(ours)),
                _MEDIAN,
                float(np.median(other)),
            ),
            Check(
                champions.name,
                "mean absolute difference [m/s]",
                0.0,
                float(np.abs(ours - plain).mean()),
                Tolerance("at most", difference),
                difference,
            ),
        )
    )


def _medians(runs: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Of each champion over its terrains."""
    return np.array([np.median(speeds[runs == run]) for run in np.unique(runs)])
