"""What a campaign tells before it runs, and the options that it refuses."""

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from experiments.campaign import cost, plan
from experiments.campaign.grid import Condition, Grid
from experiments.campaign.root import CampaignRoot, ConditionStatus
from experiments.campaign.study import Study
from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from tests.experiments.campaign.small import BOTH, HEBBIAN, MLP, SCALE, WORM, run, snapshot
from tests.experiments.held import COMMAND


def test_dry_run_tells_and_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(BOTH, out=tmp_path / "root", dry_run=True) == 0
    assert list(tmp_path.iterdir()) == []
    _, hebbian, mlp, total = capsys.readouterr().out.splitlines()
    assert hebbian.split()[:4] == [HEBBIAN, "2", "2", "32"]  # runs, generations, evaluations
    assert hebbian.endswith("to do ")
    assert mlp.split()[0] == MLP
    assert total.split()[:3] == ["2", "conditions", "64"]


def test_dry_run_tells_what_is_done(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    root = CampaignRoot(tmp_path / "root")
    scale = replace(SCALE, generations=3)
    hebbian, mlp = BOTH.conditions(scale)
    with root.declare(scale, {BOTH: (hebbian, mlp)}):
        with Session.open(hebbian.config, root.condition(HEBBIAN)) as session:
            session.step()
            session.step()
        assert root.status(hebbian).generation == 2
        with Session.open(mlp.config, root.condition(MLP)) as session:
            for _ in range(3):
                session.step()
            assert not root.status(mlp).finished
            session.finish()
    before = snapshot(root.path)
    assert run(BOTH, out=root.path, scale=scale, dry_run=True) == 0
    assert snapshot(root.path) == before
    _, first, second, _ = capsys.readouterr().out.splitlines()
    assert "goes on at generation 3" in first
    assert second.split()[-1] == "done"


def test_estimates_go_by_what_is_left() -> None:
    conditions = [Condition(name, replace(WORM, generations=4, duration=0.5)) for name in "abc"]
    statuses = {
        "a": ConditionStatus(),
        "b": ConditionStatus(3),
        "c": ConditionStatus(4, finished=True),
    }
    whole, rest, none = plan.estimate(conditions, statuses)
    steps = 0  # of an episode, as the simulator counts them
    t = 0.0
    while t < 0.5:
        t += 1 / 60
        steps += 1
    assert whole.evaluations == 40 * 4
    assert whole.robot_steps == 40 * 4 * steps
    assert whole.seconds > 0
    assert math.isclose(rest.seconds, whole.seconds / 4)
    assert none.seconds == 0


def test_time_left_goes_by_the_time_taken() -> None:
    worm = replace(WORM, generations=10)  # 2 voxels
    box = replace(worm, shape="box-2x2")  # 4 voxels
    assert cost.seconds_left([(worm, 0, 0.0)]) is None
    # 5 of 10 generations in 30 s; left: as much again, and 10 generations of twice the size
    assert cost.seconds_left([(worm, 5, 30.0), (box, 0, 0.0)]) == pytest.approx(30 + 120)
    assert cost.seconds_left([(worm, 10, 30.0)]) == 0
    unpacked = (box, 10, 0.0)  # in an unknown time
    assert cost.seconds_left([unpacked, (worm, 0, 0.0)]) is None
    assert cost.seconds_left([unpacked, (worm, 5, 30.0)]) == pytest.approx(30)


def test_expected_disk_is_about_what_a_run_takes(tmp_path: Path) -> None:
    study = Study("large", "?", (Grid(EvolveConfig(shape="worm-7x1", sensors="high")),))
    scale = replace(SCALE, generations=8, duration=0.1)
    assert run(study, out=tmp_path / "root", scale=scale) == 0
    (condition,) = study.conditions(scale)
    folder = tmp_path / "root" / "conditions" / condition.name
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    assert 0.7 < cost.disk_bytes(condition.config) / size < 1.4


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scale": replace(SCALE, runs=0)}, "runs: expected an integer >= 1, got 0"),
        ({"scale": replace(SCALE, duration=math.nan)}, "duration: expected a finite number"),
        ({"device": "tpu"}, "device: expected"),
        ({"gpus": 0.5}, "gpus: expected a share >= 0, and none without --cluster, got 0.5"),
        ({"gpus": -1.0, "cluster": "ray"}, "gpus: expected a share >= 0"),
    ],
)
def test_wrong_options_are_refused(tmp_path: Path, options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        run(BOTH, out=tmp_path / "root", **options)
    assert list(tmp_path.iterdir()) == []


def test_campaigns_without_a_proper_study_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="study: expected the name of one or several"):
        run(out=tmp_path / "root")
    with pytest.raises(ValueError, match="study: expected another name than 'conditions'"):
        run(Study("conditions", "?", BOTH.grids), out=tmp_path / "root")
    assert list(tmp_path.iterdir()) == []


def test_help_tells_what_can_be_studied() -> None:
    shown = subprocess.run([*COMMAND, "campaign", "--help"], capture_output=True, text=True)
    assert shown.returncode == 0
    for word in ("STUDY", "--out", "--seed", "--runs", "--dry-run", "--cluster", "--grid"):
        assert word in shown.stdout


def test_a_script_is_the_command(tmp_path: Path) -> None:
    script = [sys.executable, "-m", "experiments.studies.true_learning"]
    arguments = ["--quick", "--dry-run", "--threads", "1", "--out", str(tmp_path / "root")]
    shown = subprocess.run([*script, *arguments], capture_output=True, text=True, check=True)
    names = [line.split()[0] for line in shown.stdout.splitlines()[1:3]]
    assert names == ["biped-4x3-high-hebbian", "worm-7x1-high-hebbian"]
    wrong = subprocess.run([*script, "--quick"], capture_output=True, text=True)
    assert wrong.returncode == 2
    assert "--out" in wrong.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("interval", [1, 4, 12])
def test_an_estimate_does_not_follow_a_stall_of_the_machine(
    interval: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = [0.0]

    class Episode:
        """Takes 1 ms per step of the simulator, but 5 s for its second stretch."""

        stretches = -1  # the first call is the warm-up

        def run(self, steps: int) -> None:
            self.stretches += 1
            clock[0] += 5.0 if self.stretches == 2 else 1e-3 * steps * interval

    monkeypatch.setattr(cost, "start_episode", lambda *_, **__: Episode())
    monkeypatch.setattr(cost.time, "perf_counter", lambda: clock[0])
    monkeypatch.setattr(cost, "_SECONDS", 5.3)  # that and ten stretches more
    config = replace(WORM, runs=2, population=4, control_interval=interval)
    assert cost.seconds_per_robot_step(config) == pytest.approx(1e-3 / 8)
