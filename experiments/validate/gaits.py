"""Random open-loop gaits: speeds against those recorded."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import torch
from scipy.stats import spearmanr

from experiments.validate.case import (
    Case,
    Check,
    Outcome,
    Panel,
    Picture,
    SelfAgreement,
    Setting,
    Skip,
    Tolerance,
)
from experiments.validate.motion import DTYPES, STARTS, disturbed, speeds
from experiments.validate.recordings import Recordings, Table
from physics import Morphology, Terrain
from physics.scene import clock

__all__ = ["agreement", "cases"]

# How a speed was recorded: plain; from a start shifted by 1e-6 m; without continuous collision
# detection; without self-collision.
MODES = ("veto", "veto_dx", "noccd", "noself")
_COLUMN = re.compile(rf"vel_(.+?)_({'|'.join(sorted(MODES, key=len, reverse=True))})")
_DURATION = 30.0  # [s]
_HILLS = 20  # gait i of the terrain "hilly" walks on hilly-3-30-(i mod 20)
_REGULAR = 0.97  # least correlation of the reference with itself in a regular motion
_MEASURES = ("Spearman", "mean absolute difference [m/s]", "mean speed [m/s]")

Agreement = tuple[float, float, float]


def agreement(ours: np.ndarray, recorded: np.ndarray) -> Agreement:
    """Spearman's correlation, mean absolute difference and bias of speeds."""
    difference = ours - recorded
    correlation = float(spearmanr(ours, recorded).statistic)
    return correlation, float(np.abs(difference).mean()), float(difference.mean())


@dataclass(frozen=True)
class _Rule:
    """Which recorded speeds ours are compared with, and how well they must agree.

    Attributes:
        measured: what is compared, for the table.
        modes: the recorded speeds are their mean.
        starts: our speeds are the mean of so many.
        spearman, mae, bias: The tolerances of the rank correlation, mean absolute error and bias.
    """

    measured: str
    modes: tuple[str, ...]
    starts: int
    spearman: float
    mae: float
    bias: float

    @property
    def tolerances(self) -> tuple[Tolerance, Tolerance, Tolerance]:
        return (
            Tolerance("at least", self.spearman),
            Tolerance("at most", self.mae),
            Tolerance("within", self.bias),
        )


_REGULAR_RULES = (_Rule("one start, noccd", ("noccd",), 1, 0.975, 0.02, 0.015),)
_CONTINUOUS_RULES = (
    _Rule("one start, continuous detection, veto", ("veto",), 1, 0.97, 0.02, 0.01),
)
_CHAOTIC_RULES = (
    _Rule(f"mean of {STARTS} starts", MODES, STARTS, 0.88, 0.11, 0.03),
    _Rule("one start, veto", ("veto",), 1, 0.75, 0.17, 0.06),
)


@dataclass(frozen=True)
class _Gaits:
    """The recorded gaits of a shape.

    Attributes:
        morphology: The robot's shape.
        duration: The duration of an episode [s].
        frequency: The frequency of each gait [Hz], (G,).
        amplitude, phase: Of each gait the amplitude and phase of every voxel, (G, V).
        terrains: For every terrain that the columns name, one Terrain per gait.
        recorded: speeds [m/s] by terrain and mode, (G,).
        rules: what ours are held against.
        continuous: whether ours have continuous collision detection.
    """

    morphology: Morphology
    duration: float
    frequency: np.ndarray
    amplitude: np.ndarray
    phase: np.ndarray
    terrains: Mapping[str, list[Terrain]]
    recorded: Mapping[str, Mapping[str, np.ndarray]]

    rules: tuple[_Rule, ...]
    continuous: bool = False


def cases(recordings: Recordings) -> list[Case | Skip]:
    """One per number type for every table ``random_gaits_params_<shape>``."""
    found: list[Case | Skip] = []
    for match in recordings.names(r"random_gaits_params_(.+)"):
        shape, results = match[1], f"random_gaits_clean_{match[1]}"
        if not recordings.has(results):
            found.append(Skip(f"gaits {shape}", f"no table {results}"))
            continue
        gaits = _read(recordings, shape, recordings.table(match[0]), recordings.table(results))
        for terrain, modes in gaits.recorded.items():
            found += [
                Skip(f"gaits {shape} {terrain}", f"{rule.measured}: no column {column}")
                for rule in gaits.rules
                if (column := _missing(rule, modes, terrain))
            ]
        found += [
            Case(f"gaits {shape} {label}", partial(_replay, gaits, label)) for label in DTYPES
        ]
        if gaits.rules == _REGULAR_RULES:  # those of chaotic motions cannot tell
            continuous = replace(gaits, rules=_CONTINUOUS_RULES, continuous=True)
            found.append(Case(f"gaits {shape} continuous", partial(_replay, continuous, "f32")))
    return found


def _rules(
    morphology: Morphology, recorded: Mapping[str, Mapping[str, np.ndarray]]
) -> tuple[_Rule, ...]:
    """The worm's motions are regular, the biped's chaotic; of another shape, the agreement
    of the reference with itself says."""
    family = morphology.name.split("-")[0]
    if family in ("worm", "biped"):
        regular = family == "worm"
    else:
        regular = all(
            {"veto", "veto_dx"} <= modes.keys()
            and agreement(modes["veto_dx"], modes["veto"])[0] >= _REGULAR
            for modes in recorded.values()
        )
    return _REGULAR_RULES if regular else _CHAOTIC_RULES


def _missing(rule: _Rule, modes: Mapping[str, np.ndarray], terrain: str) -> str:
    """The columns that a rule needs and the table lacks."""
    return ", ".join(f"vel_{terrain}_{mode}" for mode in rule.modes if mode not in modes)


def _read(recordings: Recordings, shape: str, params: Table, results: Table) -> _Gaits:
    name = f"random_gaits_params_{shape}"
    morphology = recordings.robot(shape, name)
    voxels = range(morphology.n_voxels)
    numbers = params.numbers("i")
    if not np.array_equal(numbers, results.numbers("i")):
        raise ValueError(
            f"{results.path.name}: expected the gaits of {params.path.name} in column i, got others"
        )
    recorded: dict[str, dict[str, np.ndarray]] = {}
    for column in results.columns:
        if match := _COLUMN.fullmatch(column):
            recorded.setdefault(match[1], {})[match[2]] = results.numbers(column)
    if not recorded:
        raise ValueError(f"{results.path.name}: expected columns vel_<terrain>_veto, got none")
    return _Gaits(
        morphology,
        recordings.duration(name, _DURATION),
        params.numbers("f"),
        params.numbers([f"amp{v}" for v in voxels]),
        params.numbers([f"phase{v}" for v in voxels]),
        {
            terrain: [
                recordings.terrain(
                    f"hilly-3-30-{int(i) % _HILLS}" if terrain == "hilly" else terrain,
                    f"{results.path.name}: column vel_{terrain}_...",
                )
                for i in numbers
            ]
            for terrain in recorded
        },
        recorded,
        _rules(morphology, recorded),
    )


def _replay(gaits: _Gaits, label: str, setting: Setting) -> Outcome:
    starts = max(rule.starts for rule in gaits.rules)
    ours = _speeds(gaits, label, starts, setting)
    rows, self_agreements, panels = [], [], []
    for terrain, modes in gaits.recorded.items():
        case = f"gaits {gaits.morphology.name} {terrain} {label}"
        own = ours[terrain]
        for rule in gaits.rules:
            if not _missing(rule, modes, terrain):
                rows += _rows(case, rule, own, modes)
                panels.append(_panel(f"{terrain}, {rule.measured}", rule, own, modes))
        if "veto" in modes and not gaits.continuous:
            self_agreements.append(_self_agreement(case, own[0], modes))
    detection = "_continuous" if gaits.continuous else ""
    picture = Picture(f"gaits_{gaits.morphology.name}_{label}{detection}", tuple(panels))
    return Outcome(tuple(rows), (picture,), tuple(self_agreements))


def _speeds(gaits: _Gaits, label: str, starts: int, setting: Setting) -> dict[str, np.ndarray]:
    """Our speeds by terrain, (starts, G), all as worlds of one simulator."""
    terrains = [terrain for group in gaits.terrains.values() for terrain in group]
    sim = setting.simulator(
        gaits.morphology,
        terrains * starts,
        len(terrains) * starts,
        dtype=DTYPES[label],
        engine=replace(setting.engine, continuous=gaits.continuous),
    )
    times = torch.from_numpy(clock.times(clock.steps_in(gaits.duration))[:-1])
    frequency, amplitude, phase = map(
        torch.from_numpy, (gaits.frequency, gaits.amplitude, gaits.phase)
    )
    angle = 2 * math.pi * frequency[:, None] * times[:, None, None] + phase  # (T, G, V)
    waves = (amplitude * torch.sin(angle)).repeat(1, len(gaits.terrains), 1)
    ours = speeds(sim, disturbed(waves, 1, starts).to(sim.dtype)).reshape(
        starts, len(gaits.terrains), -1
    )
    return {name: ours[:, index] for index, name in enumerate(gaits.terrains)}


def _pair(
    rule: _Rule, own: np.ndarray, modes: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """The speeds that a rule compares: ours and the recorded."""
    return own[: rule.starts].mean(axis=0), np.mean([modes[mode] for mode in rule.modes], axis=0)


def _rows(case: str, rule: _Rule, own: np.ndarray, modes: Mapping[str, np.ndarray]) -> list[Check]:
    ours, recorded = _pair(rule, own, modes)
    correlation, difference, _ = agreement(ours, recorded)
    figures = (
        (1.0, correlation),
        (0.0, difference),
        (float(recorded.mean()), float(ours.mean())),
    )
    itself: tuple[float | None, ...] = (None, None, None)
    if {"veto", "veto_dx"} <= modes.keys():
        correlation, difference, _ = agreement(modes["veto_dx"], modes["veto"])
        itself = correlation, difference, float(modes["veto_dx"].mean())
    return [
        Check(case, f"{rule.measured}: {measure}", *figure, tolerance, own_figure)
        for measure, figure, tolerance, own_figure in zip(
            _MEASURES, figures, rule.tolerances, itself, strict=True
        )
    ]


def _self_agreement(case: str, ours: np.ndarray, modes: Mapping[str, np.ndarray]) -> SelfAgreement:
    plain = modes["veto"]
    shifted, no_detection = (
        agreement(modes[mode], plain) if mode in modes else None for mode in ("veto_dx", "noccd")
    )
    return SelfAgreement(case, float(plain.mean()), shifted, no_detection, agreement(ours, plain))


def _panel(title: str, rule: _Rule, own: np.ndarray, modes: Mapping[str, np.ndarray]) -> Panel:
    ours, recorded = _pair(rule, own, modes)
    return Panel(title, "recorded speed [m/s]", "our speed [m/s]", "points", recorded, ours)
