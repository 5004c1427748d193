"""Trajectories: recorded once, kept in a file, and read by whatever shows or checks them."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors import safe_open

from experiments.analysis import trajectory_file
from experiments.analysis.recorder import Recorder, record
from experiments.analysis.trajectory import Trajectory
from experiments.config import EvolveConfig
from experiments.rollout import controller
from experiments.runs.champions import Champions
from physics import Morphology, Simulator, Terrain
from tests.experiments.commands import hebbtorch

EVOGYM = Morphology.from_evogym(np.array([[1, 3]]))


@pytest.fixture(scope="module")
def run(tiny: EvolveConfig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run with one champion."""
    folder = tmp_path_factory.mktemp("trajectory")
    n_genes = controller.build(tiny, 1).n_genes
    genomes = torch.randn(1, n_genes, generator=torch.Generator().manual_seed(0))
    Champions(tiny, genomes, torch.tensor([1.0])).save(folder)
    return folder


@pytest.fixture(scope="module")
def file(run: Path) -> Path:
    """A whole episode of the champion, recorded by the command."""
    path = run / "walk.safetensors"
    with pytest.MonkeyPatch.context() as patch:
        assert hebbtorch(f"record {run} --out {path} --weights-every 0.1 --seed 3", patch) == 0
    return path


def same(one: Trajectory, other: Trajectory) -> bool:
    """Whether all numbers of two trajectories are the same."""
    for field in dataclasses.fields(Trajectory):
        ours, theirs = getattr(one, field.name), getattr(other, field.name)
        if isinstance(ours, np.ndarray):
            if ours.dtype != theirs.dtype or not np.array_equal(ours, theirs):
                return False
        elif isinstance(ours, tuple) and not (
            len(ours) == len(theirs) and all(map(np.array_equal, ours, theirs))
        ):
            return False
    shapes = (one.morphology.description(), one.apparatus, one.config, one.seconds, one.title)
    return shapes == (
        other.morphology.description(),
        other.apparatus,
        other.config,
        other.seconds,
        other.title,
    ) and np.array_equal(one.terrain.xs, other.terrain.xs)


def test_a_file_holds_all_of_a_trajectory(file: Path, run: Path) -> None:
    champions = Champions.load(run)
    course = record(champions.config, champions.genomes[0], seed=3, start=0.0, weights_every=0.1)
    read = trajectory_file.load(file)
    assert same(course, read)
    assert read.is_complete
    assert len(read.weights) == 2
    assert read.activations[0].shape == read.readings.shape
    speeds = np.diff(read.centers[:, 0]) / np.diff(read.times)
    assert read.rewards[1:] == pytest.approx(speeds, abs=1e-3)


def test_the_file_is_as_documented(file: Path) -> None:
    """Another reader of safetensors finds names, shapes and format number."""
    with safe_open(file, framework="np") as content:
        about = json.loads(json.loads(content.metadata()["hebbtorch"])["config"])
        shapes = {name: content.get_tensor(name).shape for name in content.keys()}  # noqa: SIM118
    assert (about["format"], about["kind"], about["terrain"]) == (1, "trajectory", "hilly-3-30-3")
    assert shapes["poses"] == (31, 2, 4, 3)
    assert shapes["rewards"] == shapes["times"] == (31,)
    assert shapes["weights"][1] == sum(a * b for a, b in about["layers"])


def test_a_loop_of_ones_own_is_recorded(tmp_path: Path) -> None:
    """One world of several with different robots, at every other step."""
    shapes = [EVOGYM, Morphology.from_name("worm-3x1")]
    sim = Simulator(shapes, Terrain.from_name("flat"), 2, sensors="high", threads=1)
    recorder = Recorder(sim, world=0)
    for step in range(1, 9):
        sim.step(torch.full((2, 3), step / 10))
        if step % 2 == 0:
            recorder.add(reward=float(step))
    course = recorder.finish()
    assert course.poses.shape == (4, 2, 4, 3)
    assert np.array_equal(course.poses[-1], sim.mass_poses()[0, :2].numpy())
    assert course.rewards.tolist() == [2, 4, 6, 8]
    assert course.actuation[:, 1] == pytest.approx([0.2, 0.4, 0.6, 0.8])
    assert not course.is_complete
    trajectory_file.save(course, tmp_path / "own.safetensors")
    assert same(trajectory_file.load(tmp_path / "own.safetensors"), course)


def test_readers_of_a_file(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert hebbtorch(f"render {file} --gif no --width 160 --fps 10 --out {out}", monkeypatch) == 0
    assert {path.name for path in out.iterdir()} == {"gait.png", "gait.mp4"}
    assert hebbtorch(f"figures {file} --out {out}", monkeypatch) == 0
    assert (out / "walk.png").is_file()
    assert hebbtorch(f"report {file} --out {tmp_path / 'page.html'}", monkeypatch) == 0
    assert "outlines" in (tmp_path / "page.html").read_text(encoding="utf-8")
    capsys.readouterr()
    assert hebbtorch(f"validate --trajectory {file}", monkeypatch) == 0
    assert "1 pass" in capsys.readouterr().out


def test_validate_sees_other_motion(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    course = trajectory_file.load(file)
    path = file.with_name("moved.safetensors")
    moved = course.poses.copy()
    moved[10, ..., 0] += 0.01
    trajectory_file.save(dataclasses.replace(course, poses=moved), path)
    assert hebbtorch(f"validate --trajectory {path}", monkeypatch) == 1


def test_damaged_and_foreign_files_are_refused(file: Path, run: Path, tmp_path: Path) -> None:
    content = bytearray(file.read_bytes())
    content[-100] ^= 1
    damaged = tmp_path / "damaged.safetensors"
    damaged.write_bytes(content)
    for path in (damaged, run / "champion.safetensors", tmp_path / "missing.safetensors"):
        with pytest.raises(ValueError, match="expected a .* that `hebbtorch record` wrote"):
            trajectory_file.load(path)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--out walk.npz", "out: expected a name ending in .safetensors"),
        ("--out w.safetensors --every 0", "every: expected an integer >= 1, got 0"),
        ("--out w.safetensors --start 5", "start: expected a time within the episode"),
        ("--out w.safetensors --run 3", "run: expected 0 to 0"),
    ],
)
def test_mistakes_are_told(
    options: str,
    words: str,
    run: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert hebbtorch(f"record {run} {options}", monkeypatch) == 2
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("settings", "words"),
    [({"world": 2}, "world: expected 0 to 1, got 2"), ({}, "sim: expected worlds with ground")],
)
def test_recorders_want_a_world_with_ground(settings: dict[str, Any], words: str) -> None:
    sim = Simulator("worm-2x1", None, 2, sensors="low", threads=1)
    with pytest.raises(ValueError, match=words):
        Recorder(sim, **settings)
