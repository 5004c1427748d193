"""Steep ground: gaits on steps and slopes beside the reference's own floor; passive robots."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import partial

import numpy as np
import torch
from scipy.stats import spearmanr

from experiments.validate.case import Case, Check, Outcome, Setting, Skip, Tolerance
from experiments.validate.motion import STARTS, disturbed, speeds
from experiments.validate.recordings import Recordings, Table
from physics import Morphology, Simulator, Terrain
from physics.scene import clock, material

__all__ = ["cases"]

_DURATION = 30.0  # of a gait [s]
_PASSIVE_STEPS = 601
_LIMIT = 2.0  # times the reference's own floor
_PLAIN = "noccd"  # without continuous detection, as the simulator is; variants are noccd_...
_RISE = 0.1  # of the centre of a passive robot, at most [m]
_GAIN = 2.0  # times the greatest recorded gain of energy


@dataclass(frozen=True)
class _Gaits:
    """Gaits of one shape on one kind of ground.

    Attributes:
        name: The name of the case.
        morphology: The robot's shape.
        frequency, amplitude, phase: (G,) [Hz], (G, V), (G, V).
        terrains: one per gait.
        recorded: speeds [m/s] of the plain run, then of disturbed starts, (R, G).
    """

    name: str
    morphology: Morphology
    frequency: np.ndarray
    amplitude: np.ndarray
    phase: np.ndarray
    terrains: list[Terrain]
    recorded: np.ndarray


def cases(recordings: Recordings) -> list[Case | Skip]:
    """Those of the folders ``slopes`` and ``steep`` in the folder of the recordings."""
    found: list[Case | Skip] = []
    for folder, read in (("slopes", _slopes), ("steep", _steps)):
        if not (recordings.folder / folder).is_dir():
            found.append(Skip(f"gaits on {folder}", f"no folder {folder}"))
            continue
        inner = Recordings(recordings.folder / folder)
        found += [Case(gaits.name, partial(_replay, gaits)) for gaits in read(inner)]
        if inner.has("passive_steps"):
            found.append(Case("passive robots on steps", partial(_passive, inner)))
    return found


def _gaits(
    recordings: Recordings,
    shape: str,
    params: Table,
    terrains: list[str],
    recorded: list[np.ndarray],
    label: str,
) -> _Gaits:
    morphology = recordings.robot(shape, params.path.name.split(".")[0])
    rows = slice(len(terrains))
    voxels = range(morphology.n_voxels)
    by_name = {name: recordings.terrain(name, params.path.name) for name in set(terrains)}
    return _Gaits(
        f"gaits {shape} {label}",
        morphology,
        params.numbers("f")[rows],
        params.numbers([f"amp{v}" for v in voxels])[rows],
        params.numbers([f"phase{v}" for v in voxels])[rows],
        [by_name[name] for name in terrains],
        np.stack(recorded),
    )


def _slopes(recordings: Recordings) -> list[_Gaits]:
    """All gaits of a shape on each of the terrains that the columns name."""
    found = []
    for match in recordings.names("random_gaits_params_(.+)"):
        table = recordings.table(f"random_gaits_clean_{match[1]}")
        ending = f"_{_PLAIN}"
        plain = [column for column in table.columns if column.endswith(ending)]
        for column in plain:
            terrain = column.removeprefix("vel_").removesuffix(ending)
            runs = [column, *(c for c in table.columns if c.startswith(f"{column}_"))]
            speeds_of = [table.numbers(run) for run in runs]
            params = recordings.table(match[0])
            names = [terrain] * len(table)
            found.append(_gaits(recordings, match[1], params, names, speeds_of, terrain))
    return found


def _steps(recordings: Recordings) -> list[_Gaits]:
    """Each gait of a shape on a ground of its own."""
    found = []
    table = recordings.table("steep_gaits")
    rows = list(
        zip(
            table.text("shape"),
            table.numbers("i").astype(int).tolist(),
            table.text("terrain"),
            table.text("mode"),
            table.numbers("vel").tolist(),
            strict=True,
        )
    )
    for match in recordings.names("steep_gaits_params_(.+)"):
        runs: dict[str, dict[int, float]] = {}
        of_gait: dict[int, str] = {}
        for shape, i, terrain, mode, speed in rows:
            if shape == match[1] and mode.startswith(_PLAIN):
                runs.setdefault(mode, {})[i] = speed
                of_gait[i] = terrain
        params = recordings.table(match[0])
        order = [i for i in params.numbers("i").astype(int).tolist() if i in of_gait]
        kept = params.at("i", order)
        modes = sorted(runs)  # the plain one is the shortest name, so the first
        recorded = [np.array([runs[mode][i] for i in order]) for mode in modes]
        names = [of_gait[i] for i in order]
        found.append(_gaits(recordings, match[1], kept, names, recorded, "steps"))
    return found


def _replay(gaits: _Gaits, setting: Setting) -> Outcome:
    count = len(gaits.terrains)
    sim = setting.simulator(gaits.morphology, gaits.terrains * STARTS, count * STARTS)
    times = torch.from_numpy(clock.times(clock.steps_in(_DURATION))[:-1])
    frequency, amplitude, phase = map(
        torch.from_numpy, (gaits.frequency, gaits.amplitude, gaits.phase)
    )
    angle = 2 * math.pi * frequency[:, None] * times[:, None, None] + phase
    actuations = disturbed(amplitude * torch.sin(angle), 1).to(sim.dtype)
    ours = speeds(sim, actuations).reshape(STARTS, count).mean(axis=0)
    recorded = gaits.recorded.mean(axis=0)
    pairs = list(itertools.combinations(gaits.recorded, 2))
    floor = float(np.mean([np.abs(a - b).mean() for a, b in pairs]))
    alike = float(np.mean([spearmanr(a, b).statistic for a, b in pairs]))
    difference = float(np.abs(ours - recorded).mean())
    return Outcome(
        (
            Check(
                gaits.name,
                f"mean of {STARTS} starts: mean absolute difference [m/s]",
                0.0,
                difference,
                Tolerance("at most", _LIMIT * floor),
                floor,
            ),
            Check(
                gaits.name,
                f"mean of {STARTS} starts: Spearman",
                1.0,
                float(spearmanr(ours, recorded).statistic),
                Tolerance("at least", 1 - _LIMIT * max(1 - alike, 0.05)),
                alike,
            ),
        )
    )


def _passive(recordings: Recordings, setting: Setting) -> Outcome:
    """No robot without actuation is thrown, or gains more than some energy of its springs."""
    table = recordings.table("passive_steps")
    shapes, terrains = table.text("shape"), table.text("terrain")
    recorded = [float(table.numbers(name).max()) for name in ("max_rise", "energy_gain")]
    greatest = np.zeros(2)
    for shape in sorted(set(shapes)):
        names = sorted({t for s, t in zip(shapes, terrains, strict=True) if s == shape})
        replayed = [recordings.terrain(name, table.path.name) for name in names]
        sim = setting.simulator(shape, replayed, len(replayed))
        start, energy = sim.center_of_mass()[:, 1], _energy(sim)
        for _ in range(_PASSIVE_STEPS):
            sim.step(torch.zeros(len(replayed), sim.n_voxels))
            rise = (sim.center_of_mass()[:, 1] - start).max()
            greatest = np.maximum(greatest, [float(rise), float((_energy(sim) - energy).max())])
    case = "passive robots on steps"
    return Outcome(
        (
            Check(
                case,
                "greatest rise of a centre [m]",
                recorded[0],
                greatest[0],
                Tolerance("at most", _RISE),
            ),
            Check(
                case,
                "greatest gain of kinetic and potential energy [J]",
                recorded[1],
                greatest[1],
                Tolerance("at most", _GAIN * recorded[1]),
            ),
        )
    )


def _energy(sim: Simulator) -> torch.Tensor:
    """Kinetic and potential energy of all squares [J], (N,)."""
    y, velocities = sim.mass_poses()[..., 1].double(), sim.mass_velocities().double()
    linear = velocities[..., :2].square().sum(-1) * material.SQUARE_MASS / 2
    turning = velocities[..., 2].square() * material.SQUARE_INERTIA / 2
    return (linear + turning + material.SQUARE_MASS * 9.8 * y).sum((1, 2))
