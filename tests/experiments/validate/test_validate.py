"""The verdicts: recorded runs pass, wrong models and tampered recordings fail."""

import csv
import gzip
import json
import math
import shutil
from pathlib import Path

import pytest

from experiments.validate import (
    batches,
    falls,
    flight,
    gaits,
    golden,
    sensors,
    steep,
    steps,
    terrains,
    validate,
    validation,
)
from experiments.validate.case import Case, Check, Skip, Tolerance
from experiments.validate.recordings import Recordings
from physics import Engine, Terrain
from tests.experiments.commands import hebbtorch
from tests.experiments.validate.validations import OWN, own_rows, rows_of

SMALL = ("single_voxel_step", "four_voxel_step", "random_gaits_params_worm-7x1")
SMALL += ("random_gaits_clean_worm-7x1",)


@pytest.fixture(autouse=True)
def _smaller_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    """The case that every validation runs, short."""
    monkeypatch.setattr(batches, "_COMPANIES", ((9, 3, 1), (9, 3, 2)))


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A folder with a few of the recorded runs."""
    folder = tmp_path / "small"
    folder.mkdir()
    for name in (*(f"{stem}.csv.gz" for stem in SMALL), "terrains.json"):
        shutil.copy(OWN / name, folder)
    return folder


# --- verdicts -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tolerance", "ours", "passes"),
    [
        (Tolerance("at most", 0.1), 0.1, True),
        (Tolerance("at most", 0.1), 0.11, False),
        (Tolerance("at least", 0.9), 0.9, True),
        (Tolerance("at least", 0.9), 0.89, False),
        (Tolerance("within", 0.5), 5.5, True),
        (Tolerance("within", 0.5), 4.4, False),
        (Tolerance("within", 0.5), 5.6, False),
        *((Tolerance(kind, 9.0), math.nan, False) for kind in ("at most", "at least", "within")),
    ],
)
def test_a_tolerance(tolerance: Tolerance, ours: float, passes: bool) -> None:
    assert Check("case", "measure", 5.0, ours, tolerance).passes is passes


@pytest.mark.slow
def test_recorded_runs_pass_and_are_reported(
    small: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, pictures = tmp_path / "new" / "table.json", tmp_path / "pictures"
    assert validate(small, file, pictures) == 0
    shown = capsys.readouterr().out
    content = json.loads(file.read_text())
    assert content["format"] == 1
    assert content["passed"] is True
    assert content["device"] == "cpu"
    by_measure = {(row["case"], row["measure"]): row for row in content["cases"]}
    row = by_measure["gaits worm-7x1 hilly f32", "one start, noccd: Spearman"]
    assert row["tolerance"] == ">= 0.975"
    assert row["reference"] == 1.0
    assert 0.975 <= row["ours"] < 1.0
    assert row["its_own_shift"] == pytest.approx(0.996, abs=5e-4)  # known of the recording
    assert row["verdict"] == "pass"
    assert f"{row['ours']:.4g}" in shown
    (self_agreement,) = (
        y for y in content["self_agreement"] if y["case"] == "gaits worm-7x1 flat f64"
    )
    assert self_agreement["mean_speed"] == pytest.approx(0.127, abs=5e-4)
    assert self_agreement["no_continuous_detection"]["spearman"] == pytest.approx(0.977, abs=5e-4)
    assert self_agreement["shifted_start"]["bias"] == pytest.approx(-0.003, abs=5e-4)
    assert by_measure["hebbian_golden", "no networks in hebbian_golden.json"] == {
        "case": "hebbian_golden",
        "measure": "no networks in hebbian_golden.json",
        "verdict": "skipped",
    }
    assert {path.name for path in pictures.glob("*.png")} == {
        "single_voxel_step.png",
        "four_voxel_step.png",
        "gaits_worm-7x1_f32.png",
        "gaits_worm-7x1_f32_continuous.png",
        "gaits_worm-7x1_f64.png",
    }


@pytest.mark.parametrize(
    ("engine", "seen_in"),
    [
        (Engine(friction=1.0), {"gaits worm-7x1 flat f32", "gaits worm-7x1 hilly f64"}),
        (Engine(velocity_iterations=4), {"single_voxel_step f32", "gaits worm-7x1 flat f64"}),
        (Engine(ropes=False), {"four_voxel_step f64"}),
    ],
    ids=["friction", "iterations", "ropes"],
)
def test_a_wrong_model_fails(small: Path, engine: Engine, seen_in: set[str]) -> None:
    recordings = Recordings(small)
    rows = rows_of([*steps.cases(recordings), *gaits.cases(recordings)], engine)
    failed = {row.case for row in rows if not row.passes}
    assert seen_in <= failed


def test_a_failing_case_is_exit_code_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(OWN / "four_voxel_step.csv.gz", tmp_path)
    assert validate(tmp_path, engine=Engine(ropes=False)) == 1
    assert "5 FAIL" in capsys.readouterr().out


def test_the_own_copy_holds_every_kind_of_case() -> None:
    found = validation._collect(Recordings(OWN))
    assert not [case for case in found if isinstance(case, Skip)]
    kinds = {case.name.split(" ")[0].split("_")[0] for case in found if isinstance(case, Case)}
    assert kinds >= {"terrains", "hebbian", "closedloop", "single", "two", "four", "passive"}
    assert kinds >= {"sensors", "gaits", "gen0", "rest", "free", "batches", "champions"}
    assert {"gaits worm-7x1 uphill-5", "gaits biped-4x3 steps"} <= {
        case.name for case in found if isinstance(case, Case)
    }
    assert sum(path.stat().st_size for path in OWN.iterdir()) < 4e6


def test_the_quick_cases_of_the_own_copy_pass() -> None:
    recordings = Recordings(OWN)
    modules = (terrains, golden, steps, falls, sensors)
    rows = rows_of([case for module in modules for case in module.cases(recordings)])
    rows += rows_of([*falls.own_cases(), *flight.cases(recordings)])
    assert [row for row in rows if not row.passes] == []


def test_gaits_on_slopes_pass_and_fail_without_friction() -> None:
    cases = [case for case in steep.cases(Recordings(OWN)) if "uphill" in case_name(case)]
    assert [row.passes for row in rows_of(cases)] == [True, True]
    assert not all(row.passes for row in rows_of(cases, Engine(friction=0.5)))


def case_name(case: Case | Skip) -> str:
    return case.name if isinstance(case, Case) else case.case


def test_another_profile_than_recorded_is_named(tmp_path: Path) -> None:
    terrain = Terrain.from_name("hilly-3-30-4")
    points = {"xs": terrain.xs[:-1].tolist(), "ys": terrain.ys[:-1].tolist()}
    (tmp_path / "terrains.json").write_text(json.dumps({"hilly-3-30-4": points}))
    (row,) = rows_of(terrains.cases(Recordings(tmp_path)))
    assert (row.case, row.measure) == ("hilly-3-30-4", "no such profile: points")
    assert row.ours == row.reference + 1
    assert not row.passes


def test_a_rule_without_its_columns_is_skipped(small: Path) -> None:
    with gzip.open(small / "random_gaits_clean_worm-7x1.csv.gz", "rt", newline="") as file:
        rows = list(csv.reader(file))
    keep = [i for i, column in enumerate(rows[0]) if "flat_noccd" not in column]
    (small / "random_gaits_clean_worm-7x1.csv.gz").unlink()
    with (small / "random_gaits_clean_worm-7x1.csv").open("w", newline="") as file:
        csv.writer(file).writerows([[row[i] for i in keep] for row in rows])
    first, *others = gaits.cases(Recordings(small))
    assert first == Skip("gaits worm-7x1 flat", "one start, noccd: no column vel_flat_noccd")
    assert all(isinstance(case, Case) for case in others)


def test_tampered_readings_and_outputs_fail(tmp_path: Path) -> None:
    for name in ("sensors.json", "terrains.json", "sensors_poses_biped-4x3.csv.gz"):
        shutil.copy(OWN / name, tmp_path)
    rows = own_rows("sensors_biped-4x3_medium")
    rows[77][5] = str(float(rows[77][5]) + 1e-6)
    with (tmp_path / "sensors_biped-4x3_medium.csv").open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    content = json.loads((OWN / "hebbian_golden.json").read_text())
    content["output_5-5-3"]["weights"]["after_10"][3] += 1e-9
    content["full_5-5-3"]["outputs"][20][1] += 1e-9
    (tmp_path / "hebbian_golden.json").write_text(json.dumps(content))
    recordings = Recordings(tmp_path)
    rows_given = rows_of([*golden.cases(recordings), *sensors.cases(recordings)])
    assert {(row.case, row.measure) for row in rows_given if not row.passes} == {
        ("hebbian_golden output_5-5-3", "greatest error of a weight"),
        ("hebbian_golden full_5-5-3", "greatest error of an output"),
        ("sensors_biped-4x3_medium", "greatest error of a reading"),
    }


# --- command line -------------------------------------------------------------------------------


def test_the_command_passes_its_verdict_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = own_rows("single_voxel_step")
    column = rows[0].index("v0_0_NE_x")
    rows[100][column] = str(float(rows[100][column]) + 0.001)
    with (tmp_path / "single_voxel_step.csv").open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    assert hebbtorch(f"validate --reference {tmp_path} --seed 3", monkeypatch) == 1
    assert "2 FAIL" in capsys.readouterr().out
