"""The soak: that its trials see what they are for, and count nothing else."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from experiments.io import tensors
from experiments.soak import trials, worlds
from experiments.soak.counts import EpisodeCounts
from experiments.soak.damage import DamageCounts, Original, try_flip
from experiments.soak.energy import energy_per_kg
from experiments.soak.kills import KillCounts, try_kills, undisturbed
from physics import Simulator, Terrain
from physics.scene import material


@pytest.fixture(scope="module")
def original(tiny: EvolveConfig, tmp_path_factory: pytest.TempPathFactory) -> Original:
    folder = tmp_path_factory.mktemp("soak") / "run"
    with Session.create(tiny, folder) as session:
        session.step()
        session.finish()
    return Original(folder)


def test_no_changed_bit_is_read_as_sound(original: Original) -> None:
    counts = DamageCounts()
    for trial in range(300):
        try_flip(5, trial, original, counts)
    assert counts.flips.total() == 300
    assert (counts.silent, counts.errors) == ({}, {})
    assert counts.noticed > 100
    assert counts.repaired > 0


def test_a_missing_digest_would_be_seen(
    original: Original, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tensors, "_digest", lambda *_: "always")
    for name in ("champion.safetensors", "archive.safetensors"):
        (original.folder / name).write_bytes(original.files[name])
    counts = DamageCounts()
    with pytest.raises(ValueError, match="digest"):
        original.__class__(original.folder)
    monkeypatch.setattr(
        tensors, "_checked_config", lambda metadata, _: json.loads(metadata["hebbtorch"])["config"]
    )
    for trial in range(200):
        try_flip(5, trial, original, counts)
    assert counts.silent.total() > 0


def test_energy_is_that_of_mechanics() -> None:
    """A robot in free fall turns potential into kinetic energy; a stretched one has elastic."""
    sim = Simulator("worm-2x1", None, 1, dtype=torch.float64, gravity=0.0)
    poses = sim.mass_poses()
    rest = float(energy_per_kg(sim, 0.0))
    assert rest == pytest.approx(0, abs=1e-9)
    velocities = torch.zeros_like(poses)
    velocities[..., 0], velocities[..., 2] = 3.0, 2.0
    sim.set_poses(poses, velocities)
    spin = 0.5 * material.SQUARE_INERTIA / material.SQUARE_MASS * 2.0**2
    assert float(energy_per_kg(sim, 0.0)) == pytest.approx(0.5 * 3.0**2 + spin)
    raised = poses.clone()
    raised[..., 1] += 2
    sim.set_poses(raised)
    height = float(raised[..., 1].mean())
    assert float(energy_per_kg(sim, 9.8)) == pytest.approx(9.8 * height)
    raised[..., 0] *= 1.1
    sim.set_poses(raised)
    stretched = float(energy_per_kg(sim, 0.0))
    assert stretched > 0.1
    later = []
    for _ in range(60):
        sim.step(torch.zeros(1, 2))
        later.append(float(energy_per_kg(sim, 0.0)))
    assert max(later) < 1.5 * stretched  # steps are no small part of the springs' period
    assert max(later[10:]) < 0.01 * stretched


def test_worlds_hold_and_faults_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    counts = worlds.WorldCounts()
    worlds.try_worlds(0, 6, counts)
    assert (counts.trials, counts.worlds, counts.faults.total()) == (1, 32, 0)
    assert counts.examples == []
    monkeypatch.setattr(Terrain, "height", lambda self, x: 100.0 + 0 * x)
    energy = energy_per_kg
    monkeypatch.setattr(worlds, "energy_per_kg", lambda sim: energy(sim) + 5 * sim.time)
    worlds.try_worlds(0, 6, counts)
    assert counts.faults["below the ground"] == 16
    assert counts.faults["energy rose by more than 1.0 J/kg"] == 16
    (example,) = counts.examples
    assert example.startswith("seed 0, trial 6")


@pytest.mark.long
def test_a_chain_of_kills_ends_as_if_never_killed(tmp_path: Path) -> None:
    expected, counts = undisturbed(tmp_path / "whole"), KillCounts()
    try_kills(3, 0, tmp_path, expected, counts)
    assert counts.chains == 1
    assert counts.kills.total() > 0
    assert (counts.refused, counts.different, counts.leftovers, counts.hung) == ({}, 0, 0, 0)
    try_kills(3, 1, tmp_path, {**expected, "history.csv": b""}, counts)
    assert counts.different == 1


@pytest.mark.long
def test_the_command_writes_its_counts(tmp_path: Path) -> None:
    assert trials.soak(0.001, 7, tmp_path / "counts.json", None) == 0
    content = json.loads((tmp_path / "counts.json").read_text())
    assert content["format"] == 1
    assert content["seed"] == 7
    assert content["kills"]["chains"] == content["worlds"]["trials"] == 1
    assert content["broken"] == []


def test_staggered_episodes_are_as_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """A trial finds nothing; and something where a world's reset touches another."""
    from experiments.soak import episodes

    monkeypatch.setattr(episodes, "_STEPS", 60)
    monkeypatch.setattr(episodes, "_SHAPES", ("worm-3x1", "box-2x2"))
    counts = EpisodeCounts()
    for trial in range(2):
        episodes.try_episodes(3, trial, counts)
    assert counts.faults.total() == 0
    assert counts.resets > 10
    reset = Simulator.reset

    def careless(sim: Simulator, worlds: Any = None, *rest: Any, **options: Any) -> Any:
        if worlds is not None and len(worlds) > 1:
            worlds = worlds | np.roll(worlds, 1)
            options = {}
        return reset(sim, worlds, *rest, **options)

    monkeypatch.setattr(Simulator, "reset", careless)
    episodes.try_episodes(3, 0, counts)
    assert counts.faults["other than alone"] > 0
    assert "trial 0" in counts.examples[0]


@pytest.mark.parametrize(
    ("memory", "grew"), [([400.0, 420.0, 431.0], True), ([400.0, 429.0], False)]
)
def test_memory_that_grows_from_episode_to_episode_is_told(memory: list[float], grew: bool) -> None:
    broken = trials._broken(
        KillCounts(), DamageCounts(), EpisodeCounts(memory=memory), worlds.WorldCounts()
    )
    assert broken == (["memory of episodes grew from 400 to 431 MB"] if grew else [])
