"""A run that was begun on another machine: read, looked at and gone on with where a GPU lacks."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from experiments.analysis.unseen import evaluate_run
from experiments.config import EvolveConfig
from experiments.evolution import evolve as module
from experiments.evolution.evolve import Evolution, Session
from experiments.runs.archive import Archive
from experiments.runs.champions import Champions
from experiments.runs.folder import Checkpoint, RunStore
from tests.experiments.commands import hebbtorch
from tests.experiments.evolution.test_evolve import history

pytestmark = pytest.mark.skipif(torch.cuda.is_available(), reason="needs a machine without a GPU")


def run_to_end(session: Session) -> Champions:
    with session:
        while not session.evolved:
            session.step()
        return session.finish()


@pytest.fixture
def on_cpu(tiny: EvolveConfig, tmp_path: Path) -> Path:
    run_to_end(Session.create(tiny, tmp_path / "on-cpu"))
    return tmp_path / "on-cpu"


@pytest.fixture
def begun(tiny: EvolveConfig, tmp_path: Path) -> Path:
    """A run as a machine with a GPU begins it."""
    start = Checkpoint(generation=0, strategy=Evolution(tiny).strategy.state_dict())
    RunStore.create(tmp_path / "begun", replace(tiny, device="cuda", threads=64), start).close()
    return tmp_path / "begun"


def test_it_goes_on_with_the_options_of_this_machine_and_keeps_its_own(
    begun: Path, on_cpu: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    built = []
    monkeypatch.setattr(
        module,
        "Evaluator",
        lambda config, build=module.Evaluator: built.append(config) or build(config),
    )
    champions = run_to_end(Session.resume(begun, machine={"device": "cpu", "threads": 1}))
    assert [(each.device, each.threads) for each in built] == [("cpu", 1)]
    assert (champions.config.device, champions.config.threads) == ("cpu", 1)
    recorded = Champions.load(begun, as_recorded=True).config
    assert (recorded.device, recorded.threads) == ("cuda", 64)
    archive = Archive.load(begun)
    assert archive is not None
    assert archive.config == recorded
    assert history(begun) == history(on_cpu)
    assert torch.equal(Champions.load(begun).genomes, Champions.load(on_cpu).genomes)


def test_without_such_options_it_is_told_how(begun: Path) -> None:
    before = {path: path.read_bytes() for path in begun.iterdir()}
    with pytest.raises(
        ValueError, match=r"^device: .*finds no GPU here.*goes on elsewhere with --d"
    ):
        Session.resume(begun)
    assert {path: path.read_bytes() for path in begun.iterdir()} == before
    run_to_end(Session.resume(begun, machine={"device": "cpu"}))  # and its lock is free


def test_a_campaign_goes_on_with_its_own_options(begun: Path, tiny: EvolveConfig) -> None:
    with Session.open(replace(tiny, threads=1), begun) as session:
        session.step()
        assert session.generation == 1


def test_champions_that_evolved_on_a_gpu_are_evaluated_without_one(on_cpu: Path) -> None:
    champions = Champions.load(on_cpu)
    replace(champions, config=replace(champions.config, device="cuda")).save(on_cpu)
    assert Champions.load(on_cpu).config.device == "cpu"
    assert Champions.load(on_cpu, as_recorded=True).config.device == "cuda"
    evaluate_run(on_cpu, 1, None, None, 0, None)
    assert list(on_cpu.glob("evaluation*.csv"))


def test_options_of_the_machine_beside_resume(
    begun: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert hebbtorch(f"evolve --resume {begun}", monkeypatch) == 2
    assert "--device" in capsys.readouterr().err
    assert hebbtorch(f"evolve --resume {begun} --device cpu --threads 1", monkeypatch) == 0
    assert hebbtorch(f"evolve --resume {begun} --device cpu --noise 0.5", monkeypatch) == 2
    assert "expected no other option than" in capsys.readouterr().err


def test_memory_for_an_evolution_is_not_asked_of_those_who_read_it(tiny: EvolveConfig) -> None:
    huge = replace(tiny, population=10**9, runs=1)
    with pytest.raises(ValueError, match="memory"):
        huge.validate()
    huge.validate(machine=False)
