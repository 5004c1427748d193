"""Where runs may lie, how long they may become, and what of a damaged file is noticed."""

from __future__ import annotations

import csv
import os
from dataclasses import replace
from pathlib import Path

import pytest
import safetensors.torch
import torch

from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from experiments.runs.archive import Archive
from experiments.runs.champions import Champions
from experiments.runs.config_file import read_config
from experiments.runs.folder import Checkpoint, RunStore, read_checkpoint

SMALL = EvolveConfig(population=4, generations=2)
START = Checkpoint(0, {"genomes": torch.zeros(4, 3)})


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


FILES = {"config.json", "checkpoint.pt", "history.csv", "lock"}


def test_a_link_to_an_empty_folder_stays_one(tmp_path: Path) -> None:
    real, link = tmp_path / "real", tmp_path / "link"
    real.mkdir()
    link.symlink_to(real)
    RunStore.create(link, SMALL, START).close()
    assert link.is_symlink()
    assert names(real) == FILES


def test_the_working_directory_stays_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = tmp_path.stat().st_ino
    store = RunStore.create(Path("."), SMALL, START)
    assert tmp_path.stat().st_ino == before
    assert names(tmp_path) == FILES
    with store:
        monkeypatch.chdir("/")
        store.save(Checkpoint(1, {}))
    RunStore.resume(tmp_path)[0].close()


def test_a_folder_that_cannot_be_replaced_is_filled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a mount point is."""

    def refuse(source: Path, target: Path) -> None:
        raise OSError(16, "Device or resource busy")

    monkeypatch.setattr(os, "rename", refuse)
    RunStore.create(tmp_path, SMALL, START).close()
    assert names(tmp_path) == FILES


def test_a_long_name_has_room(tmp_path: Path) -> None:
    folder = tmp_path / ("r" * 250)
    RunStore.create(folder, SMALL, START).close()
    assert names(folder) == FILES
    assert names(tmp_path) == {folder.name}


@pytest.mark.parametrize("kept", [{"lock"}, {"lock", "checkpoint.pt"}, FILES - {"config.json"}])
def test_a_creation_that_was_killed_is_made_again(tmp_path: Path, kept: set[str]) -> None:
    RunStore.create(tmp_path, SMALL, START).close()
    for name in FILES - kept:
        (tmp_path / name).unlink()
    (tmp_path / "config.json.tmp").write_text("{")
    RunStore.create(tmp_path, SMALL, START).close()
    assert names(tmp_path) == FILES


def test_what_a_kill_left_of_files_is_removed_when_the_run_goes_on(tmp_path: Path) -> None:
    RunStore.create(tmp_path, SMALL, START).close()
    for name in ("config.json.tmp", "checkpoint.pt.tmp", "archive.safetensors.tmp"):
        (tmp_path / name).write_text("half of")
    RunStore.resume(tmp_path)[0].close()
    assert names(tmp_path) == FILES


def test_a_run_that_lost_its_options_is_left_alone(tmp_path: Path) -> None:
    RunStore.create(tmp_path, SMALL, START).close()
    (tmp_path / "config.json").unlink()
    with (tmp_path / "history.csv").open("a") as file:
        file.write("0,1,0.1,0.1,0.1,0.1,4,1.0\n")
    with pytest.raises(ValueError, match="out: expected a new or empty folder"):
        RunStore.create(tmp_path, SMALL, START)


def test_a_relative_folder_is_kept_when_the_process_moves(
    tiny: EvolveConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with Session.create(replace(tiny, generations=2), Path("run")) as session:
        monkeypatch.chdir("/")
        session.step()
        session.step()
        session.finish()
    assert Champions.load(tmp_path / "run").config.generations == 2


def rows(folder: Path) -> list[list[str]]:
    with (folder / "history.csv").open(newline="") as file:
        return [row[:-1] for row in csv.reader(file)]


def run(session: Session) -> None:
    with session:
        while not session.evolved:
            session.step()
        session.finish()


def test_an_extended_run_is_one_started_with_that_length(
    tiny: EvolveConfig, tmp_path: Path
) -> None:
    long, short = tmp_path / "long", tmp_path / "short"
    run(Session.create(replace(tiny, generations=4), long))
    run(Session.create(replace(tiny, generations=2), short))
    run(Session.resume(short, generations=4))
    assert rows(short) == rows(long)
    for name in ("config.json", "champion.safetensors", "archive.safetensors"):
        assert (short / name).read_bytes() == (long / name).read_bytes()
    with pytest.raises(ValueError, match="generations: expected at least the 4 that are done"):
        Session.resume(short, generations=3)


def test_an_extension_that_was_killed_goes_on(tiny: EvolveConfig, tmp_path: Path) -> None:
    """The options say the new length, the checkpoint the old one."""
    run(Session.create(replace(tiny, generations=1), tmp_path / "run"))
    Session.resume(tmp_path / "run", generations=2).close()
    run(Session.resume(tmp_path / "run"))
    assert len(rows(tmp_path / "run")) == 1 + 2


# --- damage ---------------------------------------------------------------------------------------


@pytest.fixture
def champions(tmp_path: Path) -> Path:
    """The smallest champions, and an archive."""
    genomes = torch.tensor([[0.5, -1.25]])
    Champions(SMALL, genomes, torch.tensor([1.5], dtype=torch.float64)).save(tmp_path)
    archive = Archive.empty(SMALL, 2)
    archive.with_generation(1, genomes[None].repeat(1, 4, 1), torch.ones(1, 4)).save(tmp_path)
    return tmp_path


def read_state(folder: Path) -> None:
    """The options and the checkpoint of a run."""
    read_checkpoint(folder, read_config(folder))


@pytest.mark.parametrize(
    ("name", "load"),
    [
        ("champion.safetensors", Champions.load),
        ("archive.safetensors", Archive.load),
        ("checkpoint.pt", read_state),
        ("config.json", read_state),
    ],
)
def test_every_flipped_bit_is_noticed(champions: Path, name: str, load) -> None:
    with RunStore.create(champions / "run", SMALL, START) as store:
        for file in store.folder.iterdir():
            file.rename(champions / file.name)
    path = champions / name
    whole = path.read_bytes()
    for place in range(len(whole)):
        path.write_bytes(
            whole[:place] + bytes([whole[place] ^ 1 << place % 8]) + whole[place + 1 :]
        )
        with pytest.raises(ValueError, match="(run|resume): cannot (read|use)"):
            load(champions)
    for length in range(0, len(whole), 7):
        path.write_bytes(whole[:length])
        with pytest.raises(ValueError, match="(run|resume): cannot (read|use)"):
            load(champions)
    path.write_bytes(whole)
    load(champions)


def test_a_checkpoint_of_before_there_was_a_digest_is_read(tmp_path: Path) -> None:
    """One in the format of now without a digest has lost it."""
    with RunStore.create(tmp_path / "run", SMALL, START) as store:
        path = store.folder / "checkpoint.pt"
    checkpoint = torch.load(path, weights_only=True)
    torch.save({**checkpoint, "format": 1}, path)
    read_state(tmp_path / "run")
    torch.save(checkpoint, path)
    with pytest.raises(ValueError, match="without its digest"):
        read_state(tmp_path / "run")


def test_champions_of_before_there_was_a_digest_are_read_with_a_warning(
    champions: Path, caplog: pytest.LogCaptureFixture
) -> None:
    found = Champions.load(champions)
    assert not caplog.records
    tensors = {"genomes": found.genomes, "fitness": found.fitness}
    old = safetensors.torch.save(tensors, metadata={"config": found.config.to_json()})
    (champions / "champion.safetensors").write_bytes(old)
    assert torch.equal(Champions.load(champions).genomes, found.genomes)
    assert [record.message.split(" ", 1)[1][:30] for record in caplog.records] == [
        "was written before files had a"
    ]


def test_options_of_champions_are_checked(champions: Path) -> None:
    path = champions / "champion.safetensors"
    found = Champions.load(champions)
    replace(found, config=replace(SMALL, population=-3)).save(champions)
    with pytest.raises(ValueError, match="population: expected an integer"):
        Champions.load(champions)
    replace(found, config=replace(SMALL, runs=2)).save(champions)
    with pytest.raises(ValueError, match="expected 2 genomes and as many fitness values"):
        Champions.load(champions)
    assert path.exists()


def test_newer_formats_are_refused_by_saying_so(champions: Path) -> None:
    path = champions / "champion.safetensors"
    content = path.read_bytes()
    path.write_bytes(content.replace(b'\\"format\\": 1', b'\\"format\\": 9'))
    with pytest.raises(ValueError, match="at most 1, got 9, which a newer version of hebbtorch"):
        Champions.load(champions)
    with RunStore.create(champions / "run", SMALL, START) as store:
        checkpoint = torch.load(store.folder / "checkpoint.pt", weights_only=True)
        torch.save({**checkpoint, "format": 3}, store.folder / "checkpoint.pt")
    with pytest.raises(ValueError, match="at most 2, got 3, which a newer version of hebbtorch"):
        RunStore.resume(champions / "run")
