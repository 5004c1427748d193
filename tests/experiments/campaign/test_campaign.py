"""Whole campaigns: what they leave, what they refuse, and that going on changes no result."""

import csv
import json
import os
import re
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.custom_scalar import layout_pb2

from experiments.campaign.grid import Grid, Scale
from experiments.campaign.root import CampaignRoot
from experiments.campaign.study import Study
from experiments.evolution.evolve import Session
from experiments.report.bundle import pack, unpack
from experiments.runs.champions import Champions
from tests.experiments.campaign.small import BOTH, HEBBIAN, MLP, SCALE, WORM, run, snapshot
from tests.experiments.held import held, lines


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


def test_a_packed_campaign_is_added_to(
    finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = tmp_path / "root"
    alone = Study("alone", "?", (Grid(replace(WORM, controller="mlp")),))
    assert run(alone, out=tmp_path / "first") == 0
    pack(tmp_path / "first", tmp_path / "packed")
    unpack(tmp_path / "packed", root)  # without checkpoints
    before = snapshot(root / "conditions" / MLP)
    capsys.readouterr()
    assert run(alone, out=root) == 0
    nothing = capsys.readouterr().out
    assert "1 conditions, 0 of them to do" in nothing
    assert "tensorboard" not in nothing  # there is nothing to watch
    assert run(BOTH, out=root) == 0
    told = capsys.readouterr().out
    assert "2 conditions, 1 of them to do" in told
    assert told.count(f"tensorboard --logdir {root / 'overview'}") == 2
    assert snapshot(root / "conditions" / MLP) == before
    assert_same_results(root, finished, HEBBIAN)


def test_champions_of_a_shorter_run_end_no_longer_one(finished: Path, tmp_path: Path) -> None:
    root = CampaignRoot(tmp_path / "root")
    shutil.copytree(finished, root.path)
    folder = root.condition(MLP)
    with Session.resume(folder, generations=SCALE.generations + 1) as session:
        session.step()  # and a kill before the new champions are kept
    (condition,) = (
        each for each in BOTH.conditions(replace(SCALE, generations=3)) if each.name == MLP
    )
    status = root.status(condition)
    assert (status.generation, status.finished) == (3, False)


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


def test_only_one_process_works_in_a_folder(finished: Path) -> None:
    with (
        CampaignRoot(finished).declare(SCALE, {BOTH: BOTH.conditions(SCALE)}),
        pytest.raises(ValueError, match="another process is working in"),
    ):
        run(BOTH, out=finished)
