"""Whole campaigns: what they leave, what they refuse, and that going on changes no result."""

import csv
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.custom_scalar import layout_pb2

from experiments.campaign import cost, plan
from experiments.campaign.grid import Condition, Grid, Scale
from experiments.campaign.launch import run_campaign
from experiments.campaign.options import CampaignOptions
from experiments.campaign.root import CampaignRoot, ConditionStatus
from experiments.campaign.study import Study
from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from experiments.runs.champions import Champions
from tests.experiments.held import COMMAND, held, lines

SCALE = Scale(runs=2, generations=2, population=8, duration=0.5, seed=3)
WORM = EvolveConfig(shape="worm-2x1")
BOTH = Study("both", "which?", (Grid(WORM, {"controller": ("hebbian", "mlp")}),))
HEBBIAN, MLP = "worm-2x1-low-hebbian", "worm-2x1-low-mlp"


def run(*studies: Study, out: Path, scale: Scale = SCALE, **options: object) -> int:
    return run_campaign(studies, CampaignOptions(out=out, scale=scale, threads=1, **options))


def results(root: Path, name: str) -> tuple[list[list[str]], Champions]:
    """History without the seconds, and champions."""
    folder = root / "conditions" / name
    with (folder / "history.csv").open(newline="") as file:
        return [row[:-1] for row in csv.reader(file)], Champions.load(folder)


def assert_same_results(root: Path, expected: Path, name: str) -> None:
    (ours, champions), (theirs, others) = results(root, name), results(expected, name)
    assert ours == theirs
    assert champions.config == others.config
    assert torch.equal(champions.genomes, others.genomes)
    assert torch.equal(champions.fitness, others.fitness)


def snapshot(folder: Path) -> dict[str, tuple[int, int]]:
    """Which files there are, and whether they were written anew."""
    found = {}
    for path in folder.rglob("*"):
        status = path.stat()
        found[str(path.relative_to(folder))] = (status.st_ino, status.st_mtime_ns)
    return found


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("campaign") / "root"
    assert run(BOTH, out=root) == 0
    return root


def test_a_campaign_leaves_ordinary_runs_and_its_declaration(finished: Path) -> None:
    rows, champions = results(finished, HEBBIAN)
    assert [row[:2] for row in rows[1:]] == [["0", "1"], ["1", "1"], ["0", "2"], ["1", "2"]]
    assert champions.config == replace(
        WORM, runs=2, generations=2, population=8, duration=0.5, seed=3, threads=1
    )
    content = json.loads((finished / "campaign.json").read_text())
    assert Scale(**content["scale"]) == SCALE
    assert content["studies"] == {"both": {"question": "which?", "conditions": [HEBBIAN, MLP]}}
    assert {path.name for path in finished.iterdir()} == {
        "campaign.json", "conditions", "lock", "overview"
    }  # fmt: skip


def test_tensorboard_shows_the_median_within_its_quartiles(finished: Path) -> None:
    rows, _ = results(finished, HEBBIAN)
    best = [float(row[2]) for row in rows if row[1] == "2"]  # of both runs in generation 2
    together = EventAccumulator(str(finished / "overview" / HEBBIAN)).Reload()
    for tag, share in (
        ("quartiles/fitness/best/q25", 0.25),
        ("fitness/best", 0.5),
        ("quartiles/fitness/best/q75", 0.75),
    ):
        _, last = together.Scalars(tag)
        assert last.value == pytest.approx(min(best) + share * (max(best) - min(best)), rel=1e-5)
    (event,) = together.Tensors("custom_scalars__config__")
    layout = layout_pb2.Layout.FromString(event.tensor_proto.string_val[0])
    (charts,) = layout.category
    series = [chart.margin.series[0] for chart in charts.chart]
    shown = {tag for each in series for tag in (each.value, each.lower, each.upper)}
    assert shown <= set(together.Tags()["scalars"])
    assert series[0].lower == "quartiles/fitness/best/q25"


def test_tensorboard_shows_one_run_per_condition(finished: Path) -> None:
    overview = finished / "overview"
    found = {path.parent.relative_to(overview) for path in overview.rglob("events.out.*")}
    assert found == {Path(HEBBIAN), Path(MLP)}
    static = EventAccumulator(str(overview / MLP)).Reload().Tags()["scalars"]
    assert {"validation/hilly-3-30", "validation/damage", "body/touch"} <= set(static)
    assert not [tag for tag in static if tag.startswith(("plasticity", "rules"))]
    (life,) = (finished / "conditions" / MLP).glob("run-*/life")  # of the best champion
    assert "life/speed" in EventAccumulator(str(life)).Reload().Tags()["scalars"]


def test_finished_conditions_are_left_alone(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = snapshot(finished)
    assert run(BOTH, out=finished) == 0
    assert snapshot(finished) == before
    assert "2 conditions, 0 of them to do" in capsys.readouterr().out


def test_results_do_not_depend_on_other_conditions(finished: Path, tmp_path: Path) -> None:
    alone = Study("alone", "?", (Grid(replace(WORM, controller="mlp")),))
    assert run(alone, out=tmp_path / "root") == 0
    assert_same_results(tmp_path / "root", finished, MLP)


def test_studies_added_later_reuse_conditions(tmp_path: Path) -> None:
    root = tmp_path / "root"
    alone = Study("alone", "?", (Grid(replace(WORM, controller="mlp")),))
    assert run(alone, out=root) == 0
    before = snapshot(root / "conditions" / MLP)
    assert run(BOTH, out=root) == 0
    assert snapshot(root / "conditions" / MLP) == before
    assert (root / "conditions" / HEBBIAN / "champion.safetensors").is_file()
    content = json.loads((root / "campaign.json").read_text())
    assert list(content["studies"]) == ["alone", "both"]


def test_a_killed_campaign_goes_on_exactly(tmp_path: Path) -> None:
    file = tmp_path / "both.toml"
    file.write_text('[base]\nshape = "worm-2x1"\n[axes]\ncontroller = ["hebbian", "mlp"]\n')
    scale = replace(SCALE, generations=3)
    expected, root = tmp_path / "expected", tmp_path / "root"
    assert run(BOTH, out=expected, scale=scale) == 0

    options = "--runs 2 --generations 3 --population 8 --duration 0.5 --seed 3 --threads 1"
    second = root / "conditions" / MLP
    with held(f"campaign --grid {file} --out {root} {options}", second, 2) as process:
        process.kill()
        process.communicate()
        assert process.returncode == -signal.SIGKILL
    first = snapshot(root / "conditions" / HEBBIAN)
    assert len(lines(second)) == 1 + 2 * 2

    assert run(BOTH, out=root, scale=scale) == 0
    assert snapshot(root / "conditions" / HEBBIAN) == first
    for name in (HEBBIAN, MLP):
        assert_same_results(root, expected, name)


def test_a_failure_loses_nothing_else(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], finished: Path
) -> None:
    root = tmp_path / "root"
    (first, _) = BOTH.conditions(SCALE)
    (root / "conditions").mkdir(parents=True)
    declared = json.loads((finished / "campaign.json").read_text())
    (root / "campaign.json").write_text(json.dumps(declared))
    folder = root / "conditions" / HEBBIAN
    with Session.open(replace(first.config, threads=1), folder):  # someone else works there
        assert run(BOTH, out=root) == 1
    assert_same_results(root, finished, MLP)
    told = capsys.readouterr().out
    assert f"1 failed:\n  {HEBBIAN}: run: another process is working in" in told
    assert run(BOTH, out=root) == 0
    assert_same_results(root, finished, HEBBIAN)


def test_analyses_and_figures_follow(finished: Path, tmp_path: Path) -> None:
    root = shutil.copytree(finished, tmp_path / "root")
    study = Study("again", "?", BOTH.grids, ("unseen_terrains",), ("generalization",))
    assert run(study, out=root) == 0
    for name in (HEBBIAN, MLP):
        folder = root / "conditions" / name
        with (folder / "evaluation-hilly-3-30-none.csv").open(newline="") as file:
            assert len(list(csv.DictReader(file))) == 2 * 10  # runs, unseen terrains
    assert (root / "again" / "generalization.png").is_file()
    assert (root / "again" / "generalization.csv").is_file()
    before = snapshot(root / "conditions")
    assert run(study, out=root) == 0
    assert snapshot(root / "conditions") == before


def test_figures_that_fail_are_told(
    finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = shutil.copytree(finished, tmp_path / "root")
    study = Study("broken", "?", BOTH.grids, figures=("no_such_figure",))
    assert run(study, out=root) == 1
    assert "figure no_such_figure:" in capsys.readouterr().out


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


def test_expected_disk_is_about_what_a_run_takes(tmp_path: Path) -> None:
    study = Study("large", "?", (Grid(EvolveConfig(shape="worm-7x1", sensors="high")),))
    scale = replace(SCALE, generations=8, duration=0.1)
    assert run(study, out=tmp_path / "root", scale=scale) == 0
    (condition,) = study.conditions(scale)
    folder = tmp_path / "root" / "conditions" / condition.name
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    assert 0.7 < cost.disk_bytes(condition.config) / size < 1.4


def test_what_is_no_campaign_is_refused(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("dear")
    with pytest.raises(ValueError, match="out: expected a new folder or a campaign's, .*letter"):
        run(BOTH, out=tmp_path)
    with pytest.raises(ValueError, match="out: expected a folder, got the file"):
        run(BOTH, out=tmp_path / "letter.txt")
    root = tmp_path / "root"
    root.mkdir()
    (root / "campaign.json").write_text('{"format": 1}')
    with pytest.raises(ValueError, match="out: cannot use .*campaign.json"):
        run(BOTH, out=root)
    assert [path.name for path in root.iterdir()] == ["campaign.json"]


def test_another_scale_is_refused(finished: Path) -> None:
    before = snapshot(finished)
    message = re.escape(f"runs: expected 2, the scale of the campaign in {str(finished)!r}, got 5")
    with pytest.raises(ValueError, match=f"{message}; give --runs 2, or another --out"):
        run(BOTH, out=finished, scale=replace(SCALE, runs=5))
    assert snapshot(finished) == before


def test_a_condition_of_another_scale_is_refused(finished: Path, tmp_path: Path) -> None:
    root = CampaignRoot(tmp_path / "root")
    with root.declare(replace(SCALE, generations=9), {}):
        pass
    os.symlink(finished / "conditions" / MLP, root.condition(MLP))
    for dry_run in (True, False):
        with pytest.raises(ValueError, match="holds a run with generations 2 in place of 9; move"):
            run(BOTH, out=root.path, scale=replace(SCALE, generations=9), dry_run=dry_run)
    assert not root.condition(HEBBIAN).exists()


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


def test_only_one_process_works_in_a_folder(finished: Path) -> None:
    with (
        CampaignRoot(finished).declare(SCALE, {BOTH: BOTH.conditions(SCALE)}),
        pytest.raises(ValueError, match="another process is working in"),
    ):
        run(BOTH, out=finished)


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
