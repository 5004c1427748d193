"""Figures that go beyond the paper's: take-off, aggregates, controls, other settings."""

from dataclasses import replace
from pathlib import Path

import pytest

from experiments.analysis import recovery
from experiments.config import EvolveConfig
from experiments.report.figures import FIGURES
from experiments.report.finished_runs import find_runs
from tests.experiments.finished_runs import (
    read_csv,
    write_csv,
    write_generalization,
    write_paired,
    write_run,
)
from tests.experiments.report.drawing import draw

SMALL = EvolveConfig(generations=4, population=8)
MLP = replace(SMALL, controller="mlp")


def test_when_a_gait_is_found(root: Path, out: Path) -> None:
    write_run(root, SMALL, [4.0, 2.0, 0.5])  # above 1 m/s in generations 2 and 3, and never
    write_run(root, MLP, [0.5, 0.5, 0.5])
    ours, theirs = draw("takeoff", root, out)
    assert (ours["controller"], ours["n"], ours["took_off"]) == ("Hebbian", "3", "2")
    assert float(ours["median_generation"]) == 3
    assert theirs["median_generation"] == theirs["p"] == "nan"
    assert 0.05 < float(ours["p"]) == float(ours["p_holm"]) < 0.2


def test_aggregates_over_apparatuses(root: Path, out: Path) -> None:
    for sensors, ours, theirs in (("low", 8.0, 2.0), ("high", 4.0, 4.0)):
        write_run(root, replace(SMALL, sensors=sensors), [ours] * 4)
        write_run(root, replace(MLP, sensors=sensors), [theirs] * 4)
    hebbian, mlp = draw("profiles", root, out)
    assert (hebbian["controller"], hebbian["apparatuses"], hebbian["n"]) == (
        "Hebbian",
        "low, high",
        "8",
    )
    assert (float(hebbian["iqm"]), float(mlp["iqm"])) == (6.0, 3.0)
    assert float(hebbian["a12"]) == 0.75  # always faster at one, even at the other
    assert mlp["a12"] == ""


def test_controls_are_compared_with_the_plastic_network(root: Path, out: Path) -> None:
    write_run(root, SMALL, [5.0, 6.0, 7.0])
    write_run(root, MLP, [1.0])
    assert FIGURES["controls"](find_runs([root]), out) == []
    write_run(root, replace(MLP, gain=30.0, bias=True), [4.0])
    write_run(root, replace(MLP, controller="rnn", gain=30.0), [3.0])
    write_run(root, replace(SMALL, control_interval=12), [2.0])
    write_run(root, replace(SMALL, control_interval=4), [2.5])  # without a static one beside it
    write_run(root, replace(SMALL, normalize="l2"), [9.0])  # no control
    rows = draw("controls", root, out)
    assert [row["first"] for row in rows] == [
        "MLP",
        "MLP, gain 30, biases",
        "RNN, gain 30",
    ]
    assert {row["second"] for row in rows} == {"Hebbian"}
    assert [float(row["shift"]) for row in rows] == [1.0 - 6.0, 4.0 - 6.0, 3.0 - 6.0]
    intervals = draw("control_interval", root, out)
    assert [(row["first"], float(row["median_first"])) for row in intervals] == [
        ("every 4 steps", 2.5),
        ("every 12 steps", 2.0),
    ]


def test_controls_that_act_rarely_are_compared_with_the_plastic_network_that_does(
    root: Path, out: Path
) -> None:
    for config, fitness in ((SMALL, 5.0), (MLP, 1.0)):
        write_run(root, config, [fitness])
        write_run(root, replace(config, control_interval=12), [fitness + 1])
    files = FIGURES["controls"](find_runs([root]), out)
    assert {path.stem for path in files} == {"controls-12"}
    (row,) = read_csv(out / "controls-12.csv")
    assert (row["first"], row["second"]) == ("MLP, every 12 steps", "Hebbian, every 12 steps")
    assert (float(row["median_first"]), float(row["median_second"])) == (2.0, 6.0)


def test_settings_unlike_the_evolution(root: Path, out: Path) -> None:
    for config, unseen in ((SMALL, [3.0, 4.0, 5.0]), (MLP, [1.0, 2.0, 3.0])):
        write_generalization(write_run(root, config, unseen), [9.0] * 3, unseen)
    rows = draw("settings", root, out)
    assert [row["where"] for row in rows] == [
        "biped-4x3 low training",
        "biped-4x3 low unseen",
    ]
    assert (float(rows[1]["median_first"]), float(rows[1]["median_second"])) == (4.0, 2.0)


@pytest.mark.parametrize(("name", "damage"), [("recovery", "half"), ("unforeseen", "none")])
def test_what_damage_leaves(name: str, damage: str, root: Path, out: Path) -> None:
    after = {"hebbian": [2.0, 3.0, 4.0], "mlp": [1.0, 0.5, 0.0]}
    for controller, speeds in after.items():
        config = replace(SMALL, controller=controller, damage=damage)
        folder = write_run(root, config, [8.0, 8.0, 8.0])
        undamaged = [4.0, 5.0, 0.5]  # the last does not walk
        rows = [
            (run, f"hilly-3-30-{k}", 6.0 + k, speed + k, whole + k)
            for run, (speed, whole) in enumerate(zip(speeds, undamaged, strict=True))
            for k in (-0.25, 0.0, 0.25)
        ]
        write_csv(folder / "recovery.csv", recovery.COLUMNS, rows)
    (row,) = draw(name, root, out)
    assert (float(row["median_first"]), float(row["median_second"])) == (3.0, 0.5)
    assert (row["first"], row["second"]) == ("Hebbian", "MLP")
    assert (float(row["before_first"]), float(row["undamaged_second"])) == (6.0, 4.0)
    assert row["walking_first"] == "2"
    assert float(row["share_first"]) == pytest.approx((2 / 4 + 3 / 5) / 2)
    assert float(row["share_second"]) == pytest.approx((1 / 4 + 0.5 / 5) / 2)
    other = {"recovery": "unforeseen", "unforeseen": "recovery"}[name]
    assert FIGURES[other](find_runs([root]), out) == []


def test_what_becomes_innate(root: Path, out: Path) -> None:
    folder = write_run(root, SMALL, [3.0, 5.0, 4.0])
    write_paired(folder, plastic=[3.0, 5.0, 4.0], frozen=[2.0, 2.0, 1.0], generation=4)
    rows = draw("innateness", root, out)
    assert [
        (row["controller"], float(row["generation"]), float(row["median"])) for row in rows
    ] == [
        ("still learning", 4, 4.0),
        ("frozen at 20 s", 4, 2.0),
    ]


def test_further_rules_are_compared_with_the_papers(root: Path, out: Path) -> None:
    write_run(root, SMALL, [5.0, 6.0, 7.0])
    write_run(root, replace(SMALL, eta="evolved"), [5.0])
    for name in ("neuron_rules", "attractors"):
        assert FIGURES[name](find_runs([root]), out) == []
    write_run(root, replace(SMALL, sharing="neuron", eta="evolved"), [4.0])
    write_run(root, replace(SMALL, normalize="max", average=10, every=4), [3.0])
    assert [row["first"] for row in draw("neuron_rules", root, out)] == [
        "neuron-centric, η evolved",
        "η evolved",
    ]
    (row,) = draw("attractors", root, out)
    assert float(row["median_first"]) == 3.0


def test_gaits_are_told_by_their_frequency(root: Path, out: Path) -> None:
    folder = write_run(root, SMALL, [5.0, 6.0, 7.0])
    measures = "gait_period,gait_frequency,gait_regularity,vibration,saturated,alternating"
    lines = [f"run,terrain,speed,{measures}"]
    for run, frequencies in enumerate(((2.0, 4.0), (8.0, 8.0), ("nan", "nan"))):
        for terrain, frequency in enumerate(frequencies):
            lines.append(f"{run},{terrain},{run + terrain},nan,{frequency},0.9,0.{run + 1},1.0,0.5")
    (folder / "gaits.csv").write_text("\n".join(lines) + "\n")
    write_run(root, MLP, [1.0])  # not watched
    (row,) = draw("gaits", root, out)
    assert (row["controller"], row["n"], row["periodic"]) == ("Hebbian", "3", "2")
    assert float(row["frequency"]) == 5.5  # of 3 and 8 Hz
    assert float(row["vibration"]) == 0.2
    assert float(row["speed"]) == 1.5
    assert (float(row["saturated"]), float(row["alternating"])) == (1.0, 0.5)
