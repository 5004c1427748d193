"""The command as a process: versions, help, streams that end, and a disk that is full."""

from __future__ import annotations

import errno
import os
import subprocess
from pathlib import Path

import pytest

from experiments.config import EvolveConfig
from experiments.evolution.launch import evolve
from experiments.runs import folder as folders
from tests.experiments.commands import hebbtorch
from tests.experiments.held import COMMAND


def run(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*COMMAND, *arguments], text=True, stderr=subprocess.PIPE, **options)  # type: ignore[call-overload,no-any-return]


def test_the_version_and_the_help_need_no_command() -> None:
    ended = run("--version", stdout=subprocess.PIPE)
    assert (ended.returncode, ended.stdout.split()[0]) == (0, "hebbtorch")
    ended = run(stdout=subprocess.PIPE, env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "usage: hebbtorch" in ended.stdout


SMALL = "evolve --shape worm-2x1 --population 4 --generations 2 --duration 0.2 --threads 1 --out"


def test_a_full_or_lost_terminal_ends_no_run(tmp_path: Path) -> None:
    with Path("/dev/full").open("w") as full:
        ended = run(*SMALL.split(), str(tmp_path / "full"), stdout=full)
    assert (ended.returncode, ended.stderr) == (0, "")
    reading, writing = os.pipe()
    os.close(reading)
    ended = run(*SMALL.split(), str(tmp_path / "lost"), stdout=writing)
    os.close(writing)
    assert (ended.returncode, ended.stderr) == (0, "")
    for name in ("full", "lost"):
        assert (tmp_path / name / "champion.safetensors").is_file()


def test_a_disk_that_gets_full_names_what_to_do(
    tiny: EvolveConfig,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def full(path: Path, content: bytes) -> None:
        if path.name == "checkpoint.pt" and path.parent == tmp_path / "run":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        write(path, content)

    write = folders.write_atomically
    monkeypatch.setattr(folders, "write_atomically", full)
    assert hebbtorch(f"{SMALL} {tmp_path / 'run'}", monkeypatch) == 1
    error = capsys.readouterr().err
    assert error.startswith("hebbtorch: cannot write: No space left on device")
    assert error.endswith(f"go on with: hebbtorch evolve --resume {tmp_path / 'run'}\n")
    monkeypatch.setattr(folders, "write_atomically", write)
    assert hebbtorch(f"evolve --resume {tmp_path / 'run'}", monkeypatch) == 0
    evolve_again = EvolveConfig(
        shape="worm-2x1", population=4, generations=2, duration=0.2, threads=1
    )
    evolve(evolve_again, tmp_path / "again")
    for name in ("champion.safetensors", "archive.safetensors"):
        assert (tmp_path / "run" / name).read_bytes() == (tmp_path / "again" / name).read_bytes()


def test_negative_seeds_are_refused_by_every_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    commands = ("evolve", "evaluate r", "freeze r", "render r", "validate", "bench", "figures r")
    for command in (*commands, f"campaign damage --out {tmp_path / 'root'}"):
        assert hebbtorch(f"{command} --seed -1", monkeypatch) == 2
        assert capsys.readouterr().err == "hebbtorch: seed: expected an integer >= 0, got -1\n"


def test_a_run_is_given_another_length(
    tiny: EvolveConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert hebbtorch(f"{SMALL} {tmp_path / 'run'}", monkeypatch) == 0
    assert hebbtorch(f"evolve --resume {tmp_path / 'run'} --generations 3", monkeypatch) == 0
    assert len((tmp_path / "run" / "history.csv").read_text().splitlines()) == 1 + 3
    assert hebbtorch(f"evolve --resume {tmp_path / 'run'} --sigma 0.1", monkeypatch) == 2
