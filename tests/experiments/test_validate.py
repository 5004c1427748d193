"""The verdicts: recorded runs pass, wrong models and tampered recordings fail."""

import csv
import gzip
import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from experiments import cli
from experiments.validate import (
    batches,
    command,
    falls,
    flight,
    gaits,
    generation,
    golden,
    motion,
    sensors,
    steps,
    terrains,
    validate,
)
from experiments.validate.case import Case, Row, Setting, Skip, Tolerance
from experiments.validate.recordings import Recordings
from physics import Apparatus, Engine, Morphology, Simulator, Terrain, clock

OWN = command.OWN_COPY
SMALL = ("single_voxel_step", "four_voxel_step", "random_gaits_params_worm-7x1")
SMALL += ("random_gaits_clean_worm-7x1",)


def rows_of(cases: list[Case | Skip], engine: Engine | None = None) -> list[Row]:
    """What the cases give; none may be skipped."""
    skipped = [case for case in cases if isinstance(case, Skip)]
    assert cases
    assert not skipped
    setting = Setting(engine or Engine())
    return [row for case in cases if isinstance(case, Case) for row in case.replay(setting).rows]


def write(path: Path, columns: dict[str, np.ndarray | list[str]]) -> None:
    """A table in CSV."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(list(column) for column in columns.values()), strict=True))


def own_rows(name: str) -> list[list[str]]:
    """The rows of one of the package's own tables, header first."""
    with gzip.open(OWN / f"{name}.csv.gz", "rt", newline="") as file:
        return list(csv.reader(file))


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
    assert Row("case", "measure", 5.0, ours, tolerance).passes is passes


def test_recorded_runs_pass_and_are_reported(
    small: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, pictures = tmp_path / "new" / "table.json", tmp_path / "pictures"
    assert validate(small, file, pictures) == 0
    shown = capsys.readouterr().out
    content = json.loads(file.read_text())
    assert content["passed"] is True
    by_measure = {(row["case"], row["measure"]): row for row in content["cases"]}
    row = by_measure["gaits worm-7x1 hilly f32", "one start, noccd: Spearman"]
    assert row["tolerance"] == ">= 0.975"
    assert row["reference"] == 1.0
    assert 0.975 <= row["ours"] < 1.0
    assert row["its_own_shift"] == pytest.approx(0.996, abs=5e-4)  # known of the recording
    assert row["verdict"] == "pass"
    assert f"{row['ours']:.4g}" in shown
    (yardstick,) = (y for y in content["yardstick"] if y["case"] == "gaits worm-7x1 flat f64")
    assert yardstick["mean_speed"] == pytest.approx(0.127, abs=5e-4)
    assert yardstick["no_continuous_detection"]["spearman"] == pytest.approx(0.977, abs=5e-4)
    assert yardstick["shifted_start"]["bias"] == pytest.approx(-0.003, abs=5e-4)
    assert by_measure["hebbian_golden", "no networks in hebbian_golden.json"] == {
        "case": "hebbian_golden",
        "measure": "no networks in hebbian_golden.json",
        "verdict": "skipped",
    }
    assert {path.name for path in pictures.iterdir()} == {
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
    found = command._collect(Recordings(OWN))
    assert not [case for case in found if isinstance(case, Skip)]
    kinds = {case.name.split(" ")[0].split("_")[0] for case in found if isinstance(case, Case)}
    assert kinds >= {"terrains", "hebbian", "closedloop", "single", "two", "four", "passive"}
    assert kinds >= {"sensors", "gaits", "gen0", "rest", "free", "batches"}
    assert sum(path.stat().st_size for path in OWN.iterdir()) < 4e6


def test_the_quick_cases_of_the_own_copy_pass() -> None:
    recordings = Recordings(OWN)
    modules = (terrains, golden, steps, falls, sensors)
    rows = rows_of([case for module in modules for case in module.cases(recordings)])
    rows += rows_of([*falls.own_cases(), *flight.cases(recordings)])
    assert [row for row in rows if not row.passes] == []


# --- other robots than the recorded ones --------------------------------------------------------

SHAPE, PROFILE = "T-5x2", {"xs": [0, 10, 500, 900], "ys": [50, 5, 30, 5]}


def recorded_gaits(folder: Path, speeds: np.ndarray | None = None) -> np.ndarray:
    """Writes three gaits of half a second on two grounds, as our simulator walks them, or with
    the speeds given; returns the speeds (terrains, gaits)."""
    voxels = Simulator(SHAPE, None).n_voxels
    numbers = np.arange(3)
    amplitude = 0.5 + 0.1 * np.add.outer(numbers, np.arange(voxels)) % 0.5
    phase = np.add.outer(numbers, 2.0 * np.arange(voxels))
    frequency = 1.0 + 0.2 * numbers
    names = {"hilly": [f"hilly-3-30-{i}" for i in numbers], "bump": ["bump"] * 3}
    if speeds is None:
        times = clock.times(clock.steps_in(0.5))[:-1]
        angle = 2 * np.pi * frequency[:, None] * times[:, None, None] + phase
        rows = []
        for grounds in names.values():
            profile = Terrain.from_profile(PROFILE["xs"], PROFILE["ys"])
            ground = [profile if n == "bump" else Terrain.from_name(n) for n in grounds]
            sim = Simulator(SHAPE, ground, 3, dtype=torch.float64)
            rows.append(motion.speeds(sim, torch.from_numpy(amplitude * np.sin(angle))))
        speeds = np.array(rows)
    params = {"i": numbers, "f": frequency}
    params |= {f"amp{v}": amplitude[:, v] for v in range(voxels)}
    params |= {f"phase{v}": phase[:, v] for v in range(voxels)}
    write(folder / f"random_gaits_params_{SHAPE}.csv", params)
    (folder / f"random_gaits_params_{SHAPE}.json").write_text('{"duration": 0.5}')
    (folder / "terrains.json").write_text(json.dumps({"bump": PROFILE}))
    columns = {
        f"vel_{terrain}_{mode}": speeds[index]
        for index, terrain in enumerate(names)
        for mode in gaits.MODES
    }
    write(folder / f"random_gaits_clean_{SHAPE}.csv", {"i": numbers} | columns)
    return speeds


def test_gaits_of_any_shape_ground_and_duration(tmp_path: Path) -> None:
    recorded_gaits(tmp_path)
    f64 = [case for case in gaits.cases(Recordings(tmp_path)) if "f64" in getattr(case, "name", "")]
    rows = rows_of(f64)
    assert {row.case for row in rows} == {f"gaits {SHAPE} hilly f64", f"gaits {SHAPE} bump f64"}
    for row in rows:  # we are the reference, so it agrees with itself: the stricter rule
        assert row.measure.startswith("one start, noccd: ")
        assert row.ours == pytest.approx(row.reference, abs=1e-15)


def test_a_shape_that_does_not_agree_with_itself_gets_the_rule_for_chaos(tmp_path: Path) -> None:
    speeds = recorded_gaits(tmp_path)
    path = tmp_path / f"random_gaits_clean_{SHAPE}.csv"
    table = {"i": np.arange(3)}
    for index, terrain in enumerate(("hilly", "bump")):
        table |= {f"vel_{terrain}_{mode}": speeds[index] for mode in gaits.MODES}
    table["vel_bump_veto_dx"] = -speeds[1]
    write(path, table)
    (case, _) = gaits.cases(Recordings(tmp_path))
    assert isinstance(case, Case)
    measures = {row.measure.split(":")[0] for row in case.replay(Setting()).rows}
    assert measures == {"mean of 4 starts", "one start, veto"}


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


def test_steps_of_any_shape_plain_or_compressed(tmp_path: Path) -> None:
    sim = Simulator("T-3x3", None, gravity=0.0, dtype=torch.float64)
    actuations = np.sin(np.add.outer(0.1 * np.arange(21), np.arange(sim.n_voxels)))
    track = motion.follow(sim, actuations[:-1])
    columns: dict[str, np.ndarray] = {"t": np.concatenate([[0.0], clock.times(20)])}
    for v, voxel in enumerate(sim.morphology.voxel_names):
        columns |= {f"a{v}": actuations[:, v], f"area{v}": track.areas[:, v]}
        for c, square in enumerate(("NW", "NE", "SE", "SW")):
            for i, item in enumerate(("x", "y", "angle")):
                columns[f"{voxel}_{square}_{item}"] = track.poses[:, v, c, i]
            columns |= {f"{voxel}_{square}_{item}": np.zeros(21) for item in ("vx", "vy", "omega")}
    path = tmp_path / "my_voxel_step.csv"
    write(path, columns)
    plain = rows_of(list(steps.cases(Recordings(tmp_path))))
    (tmp_path / "my_voxel_step.csv.gz").write_bytes(gzip.compress(path.read_bytes()))
    path.unlink()
    assert rows_of(list(steps.cases(Recordings(tmp_path)))) == plain
    for row in plain:
        assert row.ours < (1e-15 if "f64" in row.case else 1e-5)


# --- closed loop --------------------------------------------------------------------------------


def plastic(genome: np.ndarray, sizes: tuple[int, int, int]) -> Callable[[np.ndarray], np.ndarray]:
    """The reference's plastic controller as its record describes it: the last input is a bias,
    B weighs the post- and C the pre-synaptic activation, genes run input by input."""
    n_in, hidden, out = sizes
    first, second = genome[: 4 * n_in * hidden], genome[4 * n_in * hidden :]
    rules = [first.reshape(n_in, hidden, 4), second.reshape(hidden, out, 4)]
    weights = [np.zeros((n_in, hidden)), np.zeros((hidden, out))]

    def act(readings: np.ndarray) -> np.ndarray:
        layers = [np.append(readings[:-1], 1.0)]
        for weight in weights:
            layers.append(np.tanh(layers[-1] @ weight))
        for layer, rule in enumerate(rules):
            pre, post = layers[layer][:, None], layers[layer + 1][None]
            a, b, c, d = np.moveaxis(rule, -1, 0)
            weights[layer] += 0.01 * (a * post * pre + b * post + c * pre + d)
        return layers[-1]

    return act


def static(genome: np.ndarray, sizes: tuple[int, int, int]) -> Callable[[np.ndarray], np.ndarray]:
    """The reference's static controller: biases come first, tanh acts on the inputs too."""
    n_in, hidden, out = sizes
    cut = hidden * (n_in + 1)
    weights = [genome[:cut].reshape(hidden, n_in + 1), genome[cut:].reshape(out, hidden + 1)]

    def act(readings: np.ndarray) -> np.ndarray:
        values = np.tanh(readings)
        for weight in weights:
            values = np.tanh(weight[:, 0] + weight[:, 1:] @ values)
        return values

    return act


@pytest.mark.parametrize(
    ("kind", "brain", "genes"), [("hlp", plastic, 4524), ("mlp", static, 1170)]
)
def test_the_first_generation_is_replayed(
    tmp_path: Path, kind: str, brain: Callable[..., Any], genes: int
) -> None:
    """The record is two lives of 0.6 s (longer ones are chaotic) under the controllers above."""
    name, grounds = f"gen0_biped-4x3_high_{kind}", ["hilly-3-30-1", "flat"]
    genomes = np.random.default_rng(5).uniform(-1, 1, (2, genes))
    speeds = []
    for genome, ground in zip(genomes, grounds, strict=True):
        apparatus = Apparatus.named("high", Morphology.from_name("biped-4x3"), (-30, 0, 30))
        sim = Simulator(
            "biped-4x3",
            Terrain.from_name(ground),
            sensors=apparatus,
            dtype=torch.float64,
            engine=Engine(self_collision=True, continuous=True),  # as the real ones were recorded
        )
        act = brain(genome, (29, 29, 10))
        readings = sim.step(torch.zeros(1, 10))
        start = sim.center_of_mass()[0, 0].item()
        for _ in range(clock.steps_in(0.6) - 1):
            assert readings is not None
            readings = sim.step(torch.from_numpy(act(readings[0].numpy()))[None])
        path = sim.center_of_mass()[0, 0].item() - start
        speeds.append(path / (sim.time - clock.times(1)[0]))
    write(tmp_path / f"{name}.csv", {"terrain": grounds, "velocity": np.array(speeds)})
    (tmp_path / f"{name}_genomes.f64").write_bytes(genomes.astype("<f8").tobytes())
    (tmp_path / f"{name}.json").write_text('{"duration": 0.6}')
    likeness, mean = rows_of(generation.cases(Recordings(tmp_path)))
    assert mean.reference == pytest.approx(np.mean(speeds))
    assert mean.ours == pytest.approx(mean.reference, abs=1e-6)
    assert likeness.ours > 0.1
    assert abs(mean.reference) > 1e-3


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
    command_line = ["hebbtorch", "validate", "--reference", str(tmp_path), "--seed", "3"]
    monkeypatch.setattr("sys.argv", command_line)
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 1
    assert "2 FAIL" in capsys.readouterr().out
