"""Whole evolutions: what they leave, and that going on is the same as never having stopped."""

import csv
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from experiments.evolution.launch import evolve, resume
from experiments.evolution.progress import ProgressDisplay
from experiments.runs.champions import Champions
from experiments.runs.folder import Checkpoint, RunStore
from tests.experiments.held import held, interrupt


def history(folder: Path) -> list[list[str]]:
    """All columns but the seconds, as written."""
    with (folder / "history.csv").open(newline="") as file:
        return [row[:-1] for row in csv.reader(file)]


def logged(folder: Path, tag: str = "fitness/best") -> list[tuple[int, float]]:
    return [(e.step, e.value) for e in EventAccumulator(str(folder)).Reload().Scalars(tag)]


def amounts(folder: Path) -> dict[str, int]:
    """Tag -> how many values of it TensorBoard shows, of every kind."""
    events = EventAccumulator(str(folder), dict.fromkeys(("images", "tensors"), 0)).Reload()
    tags = events.Tags()
    kinds = {
        "scalars": events.Scalars,
        "images": events.Images,
        "histograms": events.Histograms,
        "tensors": events.Tensors,
    }
    return {tag: len(read(tag)) for kind, read in kinds.items() for tag in tags[kind]}


def assert_same_outcome(folder: Path, expected: Path) -> None:
    assert history(folder) == history(expected)
    ours, theirs = Champions.load(folder), Champions.load(expected)
    assert ours.config == theirs.config
    assert torch.equal(ours.genomes, theirs.genomes)
    assert torch.equal(ours.fitness, theirs.fitness)


@pytest.fixture(scope="module")
def finished(tiny: EvolveConfig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("finished") / "run"
    evolve(tiny, folder)
    return folder


def stop_after(generation: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Press Ctrl-C once a generation is done."""
    show = ProgressDisplay.show

    def show_and_stop(self: ProgressDisplay, rows: list, rate: float) -> None:
        show(self, rows, rate)
        if rows[0].generation == generation:
            raise KeyboardInterrupt

    monkeypatch.setattr(ProgressDisplay, "show", show_and_stop)


def test_a_finished_run_is_complete(tiny: EvolveConfig, finished: Path) -> None:
    header, *rows = history(finished)
    assert header == ["run", "generation", "best", "median", "mean", "q75", "evaluations"]
    assert [row[1] for row in rows] == ["1", "2", "3", "4", "5", "6"]
    assert [row[6] for row in rows] == ["8", "16", "24", "32", "40", "48"]
    champions = Champions.load(finished)
    assert champions.config == tiny
    assert champions.fitness.tolist() == [float(rows[-1][2])]  # Algorithm 1 returns the last best
    assert [step for step, _ in logged(finished)] == [1, 2, 3, 4, 5, 6]
    names = {path.name for path in finished.iterdir()}
    assert {"config.json", "checkpoint.pt", "champion.safetensors", "gait.gif"} <= names


def test_stopped_and_resumed_is_the_same(
    tiny: EvolveConfig, finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "run"
    with monkeypatch.context() as patch:
        stop_after(2, patch)
        with pytest.raises(KeyboardInterrupt):
            evolve(tiny, folder)
    assert len(history(folder)) == 1 + 2
    with monkeypatch.context() as patch:
        stop_after(3, patch)
        with pytest.raises(KeyboardInterrupt):
            resume(folder)
    resume(folder)
    assert_same_outcome(folder, finished)
    assert logged(folder) == logged(finished)


def test_what_ran_ahead_of_the_checkpoint_is_done_again(
    tiny: EvolveConfig, finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "run"
    save = RunStore.save

    def save_until_killed(self: RunStore, checkpoint: Checkpoint) -> None:
        if checkpoint.generation > 0:
            # All that the checkpoint will vouch for is in the files already.
            assert logged(folder)[-1][0] == checkpoint.generation
            assert history(folder)[-1][1] == str(checkpoint.generation)
        if checkpoint.generation == 3:
            raise KeyboardInterrupt
        save(self, checkpoint)

    with monkeypatch.context() as patch:
        patch.setattr(RunStore, "save", save_until_killed)
        with pytest.raises(KeyboardInterrupt):
            evolve(tiny, folder)
    resume(folder)
    assert_same_outcome(folder, finished)
    assert logged(folder) == logged(finished)


@pytest.mark.parametrize("options", [{"sharing": "single", "terms": "A"}, {"shape": "worm-1x1"}])
def test_networks_of_one_number_evolve(
    tiny: EvolveConfig, tmp_path: Path, options: dict[str, str]
) -> None:
    config = replace(tiny, generations=1, **options)
    with Session.create(config, tmp_path / "run") as session:
        (row,), _ = session.step()
        assert session.finish().genomes.shape[0] == 1
    assert row.generation == 1


def test_nothing_is_written_into_a_folder_that_is_no_longer_its_own(
    tiny: EvolveConfig, tmp_path: Path
) -> None:
    """Moved while at work; another run, or nothing, is in its place now."""
    folder, moved = tmp_path / "run", tmp_path / "moved"
    for successor in (True, False):
        with Session.create(tiny, folder) as session:
            session.step()
            folder.rename(moved)
            if successor:
                evolve(replace(tiny, seed=77), folder)
            before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
            for act in (session.step, session.finish):
                with pytest.raises(ValueError, match="run: expected .* moved or deleted meanwhile"):
                    act()
        assert {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()} == before
        assert len(before) > 5 if successor else not folder.exists()
        shutil.rmtree(folder, ignore_errors=True)
        shutil.rmtree(moved)


def test_resuming_a_finished_run_changes_nothing_that_counts(
    finished: Path, tmp_path: Path
) -> None:
    before, events, shown = history(finished), logged(finished), amounts(finished)
    (finished / "champion.safetensors").unlink()  # as if killed in the last moment
    resume(finished)
    assert history(finished) == before
    assert logged(finished) == events
    assert amounts(finished) == shown
    assert shown["provenance/text_summary"] == 1
    assert Champions.load(finished).fitness.tolist() == [float(before[-1][2])]


def test_runs_side_by_side_evolve_as_they_would_alone(
    tiny: EvolveConfig, finished: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "runs"
    evolve(replace(tiny, runs=2, seed=tiny.seed - 1), folder)
    rows = [row[1:] for row in history(folder) if row[0] == "1"]
    assert rows == [row[1:] for row in history(finished)[1:]]
    champions, alone = Champions.load(folder), Champions.load(finished)
    assert torch.equal(champions.genomes[1], alone.genomes[0])
    assert logged(folder / "run-1") == logged(finished)


def test_interrupted_killed_and_resumed_is_the_same(tiny: EvolveConfig, tmp_path: Path) -> None:
    expected, folder = tmp_path / "expected", tmp_path / "killed"
    evolve(tiny, expected)

    options = "--shape worm-2x1 --duration 0.5 --population 8 --generations 6 --threads 1 --seed 5"
    with held(f"evolve {options} --out {folder}", folder, 2) as process:
        out, _ = interrupt(process)
        assert f"hebbtorch evolve --resume {folder}" in out
        assert process.returncode == 130
    assert len(history(folder)) == 1 + 2

    with held(f"evolve --resume {folder}", folder, 3) as process:
        out, _ = interrupt(process, signal.SIGTERM)
        assert f"hebbtorch evolve --resume {folder}" in out
        assert process.returncode == 143

    with held(f"evolve --resume {folder}", folder, 5, moment="before") as process:
        process.kill()
        process.communicate()
        assert process.returncode == -signal.SIGKILL
    assert len(history(folder)) == 1 + 5  # the checkpoint is at 4

    resume(folder)
    assert_same_outcome(folder, expected)
    assert logged(folder) == logged(expected)
