"""What an earlier version left goes on, is evaluated, frozen, filmed and drawn as before."""

import csv
import shutil
from pathlib import Path

import pytest
import torch

from experiments.campaign.grid import Scale
from experiments.campaign.launch import run_campaign
from experiments.campaign.options import CampaignOptions
from experiments.campaign.study import read_study
from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from experiments.evolution.launch import resume
from experiments.report.finished_runs import gather
from experiments.runs.champions import Champions
from tests.experiments.commands import hebbtorch

RECORDED = Path(__file__).parents[2] / "recorded" / "runs"
CONFIG = EvolveConfig(
    shape="worm-2x1", duration=0.5, population=4, generations=4, runs=2, threads=1, seed=5,
    init="uniform", damage="half",
)  # fmt: skip


def fitness(folder: Path) -> list[list[str]]:
    """All columns of history.csv but the seconds, as written."""
    with (folder / "history.csv").open(newline="") as file:
        return [row[:-1] for row in csv.reader(file)]


@pytest.fixture
def stopped(tmp_path: Path) -> Path:
    return Path(shutil.copytree(RECORDED / "stopped", tmp_path / "stopped"))


def test_options_are_read_as_they_were_meant() -> None:
    assert Champions.load(RECORDED / "finished").config == CONFIG
    assert CONFIG.normalize is None


def assert_as_recorded(folder: Path) -> None:
    """Seeds, terrains, noise, damage and selection are the same; contacts with the ground were
    changed on purpose since, which moves speeds by less than a thousandth over half a second."""
    (header, *ours), (expected_header, *expected) = (
        fitness(each) for each in (folder, RECORDED / "finished")
    )
    assert header == expected_header
    numbers = [[float(value) for value in row] for row in ours]
    assert numbers == [pytest.approx([float(value) for value in row], abs=1e-3) for row in expected]


def test_a_stopped_run_goes_on(stopped: Path) -> None:
    with Session.resume(stopped) as session:
        while not session.evolved:
            session.step()
        champions = session.finish()
    assert_as_recorded(stopped)
    before = Champions.load(RECORDED / "finished")
    assert torch.equal(champions.genomes, before.genomes)  # the same parents, the same mutations
    torch.testing.assert_close(champions.fitness, before.fitness, rtol=0, atol=1e-3)


def test_the_same_seed_gives_the_same_history(tmp_path: Path) -> None:
    with Session.create(CONFIG, tmp_path / "run") as session:
        while not session.evolved:
            session.step()
    assert_as_recorded(tmp_path / "run")


def test_the_command_resumes_it(stopped: Path) -> None:
    resume(stopped)
    assert (stopped / "gait.gif").is_file()


def test_a_finished_run_is_assessed_and_filmed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = Path(shutil.copytree(RECORDED / "finished", tmp_path / "finished"))
    for command in (
        "evaluate {} --terrains 2",
        "freeze {} --terrains 1",
        "render {} --seconds 0.3",
        "figures {} --out {}/figures",
    ):
        assert hebbtorch(command.replace("{}", str(folder)), monkeypatch) == 0
    for name in ("evaluation-hilly-3-30-half-2-seed0.csv", "freeze-1-seed0.csv", "gait.mp4"):
        assert (folder / name).is_file(), name


def test_a_campaign_goes_on_where_it_was(tmp_path: Path) -> None:
    root = Path(shutil.copytree(RECORDED / "campaign", tmp_path / "campaign"))
    done = root / "conditions" / "worm-2x1-low-hebbian-terrain-hilly-1-10"
    before = (done / "checkpoint.pt").read_bytes()
    grid = shutil.copy(RECORDED / "grid.toml", tmp_path)
    scale = Scale(runs=2, generations=2, population=4, duration=0.5)
    study = read_study(Path(grid))
    assert run_campaign([study], CampaignOptions(out=root, scale=scale, threads=1)) == 0
    assert (done / "checkpoint.pt").read_bytes() == before
    assert sorted(path.name for path in done.parent.iterdir()) == [
        "worm-2x1-low-hebbian-terrain-hilly-1-10",
        "worm-2x1-low-mlp-terrain-hilly-1-10",
    ]
    found = gather(list(done.parent.iterdir()))
    assert len(found) == 2
    assert all(each.variant == {"terrain": "hilly-1-10"} for each in found)
