"""A run's folder: complete or not there, never overwritten, one writer at a time."""

import json
import os
from pathlib import Path

import pytest
import torch

from experiments.config import EvolveConfig
from experiments.runs.config_file import read_config
from experiments.runs.folder import Checkpoint, RunStore
from experiments.runs.history import History, HistoryRow

CONFIG = EvolveConfig(population=4, seed=3)


def checkpoint(generation: int) -> Checkpoint:
    rows = [
        HistoryRow(0, g, 0.1 * g, 0.0, 0.0, 0.0, 4 * g, 1.0 * g) for g in range(1, generation + 1)
    ]
    strategy = {"genomes": torch.full((4, 3), 1 / 3) * generation, "generation": generation}
    return Checkpoint(generation, strategy, History(rows))


def content(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def make_run(folder: Path, generation: int = 2) -> Path:
    with RunStore.create(folder, CONFIG, checkpoint(0)) as store:
        store.save(checkpoint(generation))
    return folder


def test_a_run_goes_on_where_it_stood(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "deep" / "run")
    store, found = RunStore.resume(folder)
    with store:
        assert store.config == CONFIG
        assert found.generation == 2
        assert torch.equal(found.strategy["genomes"], checkpoint(2).strategy["genomes"])
        assert found.history.rows == checkpoint(2).history.rows
        assert len(store.history_file.read_text().splitlines()) == 1 + 2


def test_a_new_run_can_be_resumed_at_once(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    RunStore.create(folder, CONFIG, checkpoint(0)).close()
    store, found = RunStore.resume(folder)
    store.close()
    assert (found.generation, found.history.rows) == (0, [])


def test_an_empty_folder_is_taken(tmp_path: Path) -> None:
    RunStore.create(tmp_path, CONFIG, checkpoint(0)).close()
    assert read_config(tmp_path) == CONFIG


def test_an_occupied_folder_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("years of work")
    before = content(tmp_path)
    with pytest.raises(ValueError, match="out: .*not empty.*--resume .*another --out"):
        RunStore.create(tmp_path, CONFIG, checkpoint(0))
    assert content(tmp_path) == before


def test_a_file_in_the_way_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "run").write_text("a file")
    for out in (tmp_path / "run", tmp_path / "run" / "below"):
        with pytest.raises(ValueError, match="^out: .*choose another"):
            RunStore.create(out, CONFIG, checkpoint(0))
    assert content(tmp_path) == {"run": b"a file"}


def test_creation_that_fails_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full_disk(fd: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full_disk)
    with pytest.raises(ValueError, match="out: cannot write .*No space left on device"):
        RunStore.create(tmp_path / "run", CONFIG, checkpoint(0))
    assert list(tmp_path.iterdir()) == []


def test_a_save_that_fails_leaves_the_old_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = make_run(tmp_path / "run")
    store, _ = RunStore.resume(folder)
    with store, monkeypatch.context() as patch:

        def die(*paths: object) -> None:
            raise KeyboardInterrupt

        patch.setattr(os, "replace", die)
        with pytest.raises(KeyboardInterrupt):
            store.save(checkpoint(3))
    store, found = RunStore.resume(folder)
    store.close()
    assert found.generation == 2


def truncate(data: bytes) -> bytes:
    return data[: len(data) // 2]


def flip_a_gene(data: bytes) -> bytes:
    gene = torch.tensor(2 / 3, dtype=torch.float32).numpy().tobytes()
    at = data.index(gene)
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]


@pytest.mark.parametrize(
    "damage", [truncate, flip_a_gene, lambda data: b"", lambda data: b"not a checkpoint"]
)
def test_a_damaged_checkpoint_is_reported_and_nothing_changed(tmp_path: Path, damage) -> None:
    folder = make_run(tmp_path / "run")
    path = folder / "checkpoint.pt"
    path.write_bytes(damage(path.read_bytes()))
    before = content(folder)
    with pytest.raises(ValueError, match=r"^resume: cannot read .*checkpoint\.pt") as refusal:
        RunStore.resume(folder)
    assert "\n" not in str(refusal.value)
    assert content(folder) == before


def test_a_missing_checkpoint_is_not_a_new_start(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run")
    (folder / "checkpoint.pt").unlink()
    with pytest.raises(ValueError, match="cannot read"):
        RunStore.resume(folder)


def test_changed_options_are_refused(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run")
    other = EvolveConfig(population=4, seed=3, sigma=0.1)
    (folder / "config.json").write_text(other.to_json())
    with pytest.raises(ValueError, match=r"config\.json .* not the one this run started with"):
        RunStore.resume(folder)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"generations": 8},
            "changed or damaged since they were written",
        ),  # an extension may do so
        ({"digest": None}, "changed or damaged since they were written"),
        ({"format": 3}, "format: expected at most 2, got 3, which a newer version"),
        ({"format": 0}, "format: expected 2, got 0"),
    ],
)
def test_options_changed_on_disk_are_refused(
    tmp_path: Path, change: dict[str, object], message: str
) -> None:
    folder = make_run(tmp_path / "run")
    options = json.loads((folder / "config.json").read_text())
    (folder / "config.json").write_text(json.dumps(options))  # the same in another layout
    assert read_config(folder).generations == options["generations"]
    (folder / "config.json").write_text(json.dumps(options | change))
    with pytest.raises(ValueError, match=message):
        read_config(folder)


def test_a_folder_that_is_no_run_is_refused(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "missing"):
        with pytest.raises(ValueError, match="expected the folder of a run"):
            RunStore.resume(folder)
    assert list(tmp_path.iterdir()) == []


def test_only_one_process_works_on_a_run(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with (
        RunStore.create(folder, CONFIG, checkpoint(0)),
        pytest.raises(ValueError, match="another process is working in"),
    ):
        RunStore.resume(folder)
    store, _ = RunStore.resume(folder)  # free again
    store.close()
