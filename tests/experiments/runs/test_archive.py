"""The best of every 25th generation: which they are, and that stopping changes nothing."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from experiments.runs import archive as archives
from experiments.runs.archive import Archive

CONFIG = EvolveConfig(runs=2)


def test_the_first_and_every_25th_generation_are_kept() -> None:
    assert [g for g in range(1, 101) if Archive.keeps(g)] == [1, 25, 50, 75, 100]


def test_the_fittest_of_each_run_is_kept_and_read_back(tmp_path: Path) -> None:
    genomes = torch.arange(2 * 3 * 4.0).reshape(2, 3, 4)
    fitness = torch.tensor([[0.1, torch.nan, 0.3], [2.0, 1.0, torch.nan]])
    archive = Archive.empty(CONFIG, 4).with_generation(1, genomes, fitness)
    archive = archive.with_generation(25, -genomes, fitness.flip(1))
    archive.save(tmp_path)
    found = Archive.load(tmp_path)
    assert found is not None
    assert found.config == CONFIG
    assert found.generations.tolist() == [1, 25]
    assert torch.equal(found.genomes[0], torch.stack([genomes[0, 2], genomes[1, 0]]))
    assert torch.equal(found.genomes[1], -torch.stack([genomes[0, 0], genomes[1, 2]]))
    assert found.fitness.tolist() == torch.tensor([[0.3, 2.0], [0.3, 2.0]]).double().tolist()
    assert found.until(24).generations.tolist() == [1]


def test_a_population_that_failed_is_kept_as_failed() -> None:
    fitness = torch.full((2, 3), torch.nan)
    archive = Archive.empty(CONFIG, 4).with_generation(1, torch.zeros(2, 3, 4), fitness)
    assert archive.fitness.isnan().all()


def test_a_damaged_archive_is_told(tmp_path: Path) -> None:
    assert Archive.load(tmp_path) is None
    (tmp_path / "archive.safetensors").write_bytes(b"no archive")
    with pytest.raises(ValueError, match=r"archive\.safetensors.*remove it"):
        Archive.load(tmp_path)


def run_to(session: Session, generation: int) -> None:
    with session:
        while session.generation < generation:
            session.step()


def test_an_evolution_that_was_stopped_keeps_the_same(
    tiny: EvolveConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(archives, "ARCHIVE_INTERVAL", 2)
    config = replace(tiny, generations=4)
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    run_to(Session.create(config, whole), 4)
    expected = Archive.load(whole)
    assert expected is not None
    assert expected.generations.tolist() == [1, 2, 4]
    assert len(torch.unique(expected.fitness)) == 3

    run_to(Session.create(config, stopped), 1)
    shutil.copytree(stopped, tmp_path / "before")
    run_to(Session.resume(stopped), 3)
    # As a kill between the archive and the checkpoint leaves it: the archive runs ahead.
    shutil.copy(stopped / "archive.safetensors", tmp_path / "before")
    run_to(Session.resume(tmp_path / "before"), 4)
    run_to(Session.resume(stopped), 4)
    for folder in (stopped, tmp_path / "before"):
        assert (folder / "archive.safetensors").read_bytes() == (
            whole / "archive.safetensors"
        ).read_bytes()


def test_a_run_from_before_archives_goes_on(
    tiny: EvolveConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(archives, "ARCHIVE_INTERVAL", 2)
    config = replace(tiny, generations=4)
    run_to(Session.create(config, tmp_path / "run"), 3)
    (tmp_path / "run" / "archive.safetensors").unlink()
    run_to(Session.resume(tmp_path / "run"), 4)
    found = Archive.load(tmp_path / "run")
    assert found is not None
    assert found.generations.tolist() == [4]
