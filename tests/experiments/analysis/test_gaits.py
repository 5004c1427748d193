"""Gaits of champions: seen at every engine step, whatever the control interval."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest

from experiments.analysis import gaits, registry
from experiments.config import EvolveConfig
from experiments.rollout.episode import start_episode
from experiments.rollout.scenarios import Scenarios
from physics import DT
from tests.experiments.champions import PLASTIC, STATIC, random_champions, run_folder


@pytest.mark.parametrize(
    ("config", "rows", "step", "commands"),
    [
        (PLASTIC, 30, DT, 30),
        (replace(STATIC, control_interval=4), 30, DT, 8),
        (replace(PLASTIC, control_interval=4, control_delay=2), 30, DT, 8),
        (replace(PLASTIC, control_interval=4, actuation_cutoff=3.0), 8, 4 * DT, 8),
    ],
)
def test_bodies_end_as_their_episodes_do(
    config: EvolveConfig, rows: int, step: float, commands: int
) -> None:
    genomes = random_champions(config).genomes
    scenarios = Scenarios.unseen(config.terrain, [1, 2], 0)
    motion = gaits.watch(config, genomes, scenarios)
    episode = start_episode(config, genomes, scenarios)
    outcome = episode.finish()
    assert motion.areas.shape == (rows, 2, 3)
    assert motion.step == step
    assert (motion.areas[-1] == episode.sim.area_ratios().numpy()).all()
    assert motion.actuation.shape == (commands, 2, 3)
    assert motion.speed.tolist() == outcome.speed.tolist()
    assert motion.areas.std(axis=0).min() > 0  # they move


def test_robots_at_rest_have_no_gait(tmp_path: Path) -> None:
    """What is left of their motion is rounding, which may well repeat itself."""
    config = replace(STATIC, sensors="low", duration=20.0)
    champions = random_champions(config)
    champions.genomes[:] = 50.0  # all voxels contract for ever
    folder = run_folder(tmp_path, config)
    champions.save(folder)
    with registry.gaits_watched(folder).open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["run"], row["terrain"]) for row in rows] == [
        (str(run), str(terrain)) for run in range(2) for terrain in range(4)
    ]
    assert {row["gait_frequency"] for row in rows} == {"nan"}
    assert {row["vibration"] for row in rows} == {"nan"}
    assert all(abs(float(row["speed"])) < 0.1 for row in rows)
