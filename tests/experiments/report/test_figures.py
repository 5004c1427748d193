"""Figures from folders of finished runs: what goes into the tables, and that pictures are there."""

import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from experiments import cli
from experiments.config import EvolveConfig
from experiments.io import style
from experiments.report.figures import FIGURES
from experiments.report.finished_runs import find_runs, gather, per_run
from tests.experiments.finished_runs import (
    write_csv,
    write_evaluation,
    write_freezing,
    write_recording,
    write_run,
)
from tests.experiments.report.drawing import draw

SMALL = EvolveConfig(generations=4, population=8)
MLP = replace(SMALL, controller="mlp")


def test_effectiveness_compares_the_controllers_of_each_body(root: Path, out: Path) -> None:
    write_run(root, SMALL, [8.0, 9.0, 7.0])
    write_run(root, MLP, [1.0, 2.0, 3.0])
    write_run(root, replace(SMALL, shape="worm-7x1"), [4.0])
    write_run(root, replace(SMALL, damage="half"), [100.0])  # belongs to another figure
    write_run(root, replace(SMALL, sharing="single"), [100.0])
    biped, worm = draw("effectiveness", root, out)
    assert (biped["where"], biped["first"], biped["second"]) == ("biped-4x3 low", "Hebbian", "MLP")
    assert (float(biped["median_first"]), float(biped["median_second"])) == (8.0, 2.0)
    assert float(biped["a12"]) == 1.0
    assert float(biped["p"]) == pytest.approx(0.1)
    assert biped["verdict"] == "open: too few runs"
    assert (worm["where"], worm["median_first"], worm["second"]) == ("worm-7x1 low", "4.0", "")
    table = (out / "effectiveness.md").read_text(encoding="utf-8")
    assert "| biped-4x3 low | Hebbian | 3 | 8 | 7 | 9 | MLP | 3 | 2 | 1 | 3 | 1 | 0.1 |" in table
    before = {path: path.read_bytes() for path in out.iterdir()}
    draw("effectiveness", root, out)  # same runs, same files
    assert {path: path.read_bytes() for path in out.iterdir()} == before


def test_evolution_shows_the_median_of_runs(root: Path, out: Path) -> None:
    write_run(root, SMALL, [4.0, 8.0, 6.0])
    rows = draw("evolution", root, out)
    assert [float(row["generation"]) for row in rows] == [1, 2, 3, 4]
    assert [float(row["median"]) for row in rows] == [1.5, 3.0, 4.5, 6.0]
    assert float(rows[-1]["deviation"]) == 2.0


def test_generalization_tests_runs_and_tells_the_pooled_p(root: Path, out: Path) -> None:
    ours = write_run(root, SMALL, [8.0, 9.0, 7.0])
    theirs = write_run(root, MLP, [1.0, 2.0, 3.0])
    write_evaluation(ours, SMALL, [[8, 4, 6], [5, 5.5, 7], [9, 8, float("nan")]])
    write_evaluation(theirs, MLP, [[1, 1.5, 2], [0.5, 2.5, 3], [0, 3.5, 2.2]])
    (row,) = draw("generalization", root, out)
    # Medians of the runs are 6, 5.5 and 8, where the failed episode is the worst.
    assert float(row["median_first"]) == 6
    assert float(row["median_second"]) == 2.2
    assert float(row["p"]) == pytest.approx(0.1)
    assert float(row["p_pooled"]) < 0.01
    assert int(row["n_first"]) == 3


def test_a_reassessment_on_more_terrains_counts(root: Path, out: Path) -> None:
    folders = [write_run(root, each, [9.0, 9.0]) for each in (SMALL, MLP)]
    for folder, config in zip(folders, (SMALL, MLP), strict=True):
        write_evaluation(folder, config, [[1.0, 1.0], [1.0, 1.0]])
        usual = folder / "evaluation-hilly-3-30-none.csv"
        usual.rename(folder / "evaluation-hilly-3-30-none-40-seed0.csv")
        write_evaluation(folder, config, [[5.0], [5.0]])
    (row,) = draw("generalization", root, out)
    assert (float(row["median_first"]), float(row["median_second"])) == (1.0, 1.0)


def test_damage_is_a_figure_of_its_own(root: Path, out: Path) -> None:
    broken = replace(SMALL, damage="half")
    folder = write_run(root, broken, [3.0, 4.0])
    write_evaluation(folder, broken, [[1.0, 2.0, 3.0], [2.0, 3.0, 4.0]])
    (row,) = draw("damage", root, out)
    assert float(row["median_first"]) == 2.5
    assert len(draw("damage_evolution", root, out)) == 4
    for name in ("effectiveness", "evolution", "generalization"):
        assert FIGURES[name](find_runs([root]), out) == []


def test_frozen_weights(root: Path, out: Path) -> None:
    folder = write_run(root, SMALL, [3.0, 4.0, 5.0])
    write_freezing(folder, [[0, 1, 3], [0, 2, 4], [0, 3, 8]])
    rows = draw("true_learning", root, out)
    assert [(float(row["second"]), float(row["median"])) for row in rows] == [
        (0, 0),
        (1, 2),
        (2, 4),
    ]
    assert FIGURES["normalized_freezing"](find_runs([root]), out) == []


def test_variants_are_compared_with_the_full_model(root: Path, out: Path) -> None:
    write_run(root, SMALL, [5.0, 6.0, 7.0])
    write_run(root, replace(SMALL, sensors="high"), [9.0])  # no variant there
    for sharing, speed in (("presynaptic", 3.0), ("single", 0.1), ("grouped", 0.2)):
        write_run(root, replace(SMALL, sharing=sharing), [speed, speed + 1])
    write_run(root, replace(SMALL, sharing="single", init="uniform"), [1.0])  # of neither figure
    rows = draw("rule_sharing", root, out)
    assert [row["first"] for row in rows] == ["single", "sensors", "pre-synaptic"]
    assert {row["second"] for row in rows} == {"Hebbian"}
    assert [float(row["median_first"]) for row in rows] == pytest.approx([0.6, 0.7, 3.5])
    assert FIGURES["initialization"](find_runs([root]), out) == []


def test_each_variant_has_its_figure(root: Path, out: Path) -> None:
    write_run(root, SMALL, [5.0, 6.0, 7.0])
    write_run(root, replace(SMALL, terms="ABD"), [float("nan"), 6.0, float("nan")])
    (row,) = draw("rule_terms", root, out)
    assert row["first"] == "without C"
    assert row["median_first"] == "nan"  # two of three failed
    assert float(row["a12"]) == pytest.approx(1.5 / 9)
    others = {
        "normalization": replace(SMALL, normalize="l2"),
        "learning_rate": replace(SMALL, eta="evolved"),
        "initialization": replace(SMALL, init="uniform"),
    }
    for name, config in others.items():
        assert FIGURES[name](find_runs([root]), out) == []
        write_run(root, config, [5.0])
    labels = [each.label for each in gather(find_runs([root]))]
    assert sorted(labels) == ["Hebbian", "U(-1, 1)", "normalized", "without C", "η evolved"]
    (row,) = draw("learning_rate", root, out)
    assert row["first"] == "η evolved"


def test_recordings(root: Path, out: Path) -> None:
    plain = write_run(root, SMALL, [3.0, 5.0])
    write_recording(plain, 2, growth=4.0, period=1.5)
    normalized = write_run(root, replace(SMALL, normalize="l2"), [4.0])
    write_recording(normalized, 1, gain=1.0)
    rows = draw("weight_distributions", root, out)
    assert [(row["run"], float(row["second"])) for row in rows] == [
        (run, second) for run in "01" for second in (1, 15, 60)
    ]
    assert float(rows[2]["largest"]) == pytest.approx(4 * float(rows[1]["largest"]))
    assert len(list(out.glob("normalized_weight_distributions.*"))) == 4
    shutil.copy(normalized / "recording.json", plain / "random_genomes.json")
    rows = draw("weight_distributions", root, out)
    assert [row["whose"] for row in rows] == ["champion"] * 6 + ["random genome"] * 3
    (plain / "random_genomes.json").unlink()
    rows = draw("activations", root, out)
    assert [row["controller"] for row in rows] == ["Hebbian", "Hebbian", "normalized"]
    assert {row["whose"] for row in rows} == {"champion"}
    assert float(rows[0]["period_gait"]) == pytest.approx(1.5, rel=1e-3)
    assert float(rows[0]["saturated_output"]) > 0.8 > float(rows[2]["saturated_output"])


def test_pruning(root: Path, out: Path) -> None:
    folder = write_run(root, SMALL, [3.0, 5.0, 4.0])
    rows = [
        (run, which, fraction, terrain, (run + 1) * (1 - fraction) + terrain)
        for run in range(3)
        for which in ("largest", "random")
        for fraction in (0.0, 0.5)
        for terrain in (-1, 0, 1)
    ]
    write_csv(folder / "pruned.csv", ["run", "which", "fraction", "terrain", "speed"], rows)
    table = draw("pruning", root, out)
    assert [(row["controller"], float(row["fraction"]), float(row["median"])) for row in table] == [
        (which, fraction, median)
        for which in ("largest", "random")
        for fraction, median in ((0.0, 2.0), (0.5, 1.0))
    ]


def test_validation_matrix(root: Path, out: Path) -> None:
    folder = write_run(root, SMALL, [3.0, 5.0, 4.0])
    rows = [
        (run, terrain, damage, seed, speed * (run + 1) + seed)
        for run in range(3)
        for terrain, speed in (("flat", 4), ("steppy-1-10", 2))
        for damage in ("none", "half")
        for seed in (-1, 0, 1)
    ]
    write_csv(folder / "matrix.csv", ["run", "terrain", "damage", "seed", "speed"], rows)
    table = draw("validation_matrix", root, out)
    found = {(row["terrain"], row["damage"]): float(row["median"]) for row in table}
    assert found == {
        ("flat", "none"): 8,
        ("flat", "half"): 8,
        ("steppy-1-10", "none"): 4,
        ("steppy-1-10", "half"): 4,
    }


def test_runs_of_a_condition_are_gathered_from_several_folders(root: Path) -> None:
    folders = [
        write_run(root, replace(SMALL, seed=3, device="cpu"), [4.0]),
        write_run(root, replace(SMALL, runs=2, threads=2), [1.0, 2.0]),
        write_run(root, replace(SMALL, seed=1), [2.0]),  # the second run of the one before
    ]
    for folder, speeds in zip(folders, ([[40.0]], [[10.0], [20.0]], [[20.0]]), strict=True):
        write_evaluation(folder, SMALL, speeds)
    (condition,) = gather([*folders, root / "nowhere"])
    assert condition.fitness.tolist() == [1.0, 2.0, 4.0]
    assert [seed for _, _, seed in condition.sources] == [0, 1, 3]
    table = condition.table("evaluation-hilly-3-30-none.csv")
    assert table is not None
    assert per_run(table).tolist() == [10.0, 20.0, 40.0]
    assert condition.curves().tolist() == [[0.25, 0.5, 0.75, 1], [0.5, 1, 1.5, 2], [1, 2, 3, 4]]


def test_runs_of_different_scales_are_refused(root: Path) -> None:
    write_run(root, SMALL, [1.0])
    write_run(root, replace(MLP, generations=5), [1.0])
    with pytest.raises(ValueError, match="one scale, got generations 4 and 5"):
        gather(find_runs([root]))


def command(arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(sys, "argv", ["hebbtorch", "figures", *arguments])
    try:
        cli.main()
    except SystemExit as exit_:
        return int(exit_.code or 0)
    return 0


def test_the_command_draws_what_there_is_and_says_what_is_missing(
    root: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_run(root, SMALL, [8.0, 9.0])
    write_run(root, MLP, [1.0, 2.0])
    assert command([str(root), "--seed", "3"], monkeypatch) == 0
    shown = capsys.readouterr().out
    written = sorted(path.name for path in (root / "figures").iterdir())
    assert written == sorted(
        [f"{name}.{suffix}" for name in ("effectiveness", "evolution", "takeoff", "profiles")
         for suffix in ("png", "pdf", "csv", "md")]
        + ["REPORT.md", "conditions.csv", "conditions.md"]
    )  # fmt: skip
    assert shown.count("wrote ") == len(written)
    assert "not drawn: pruning; `hebbtorch campaign pruning" in shown
    assert "not drawn: activations; `hebbtorch campaign weight_dynamics" in shown


def test_the_command_needs_finished_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for arguments in ([], [str(tmp_path)], [str(tmp_path / "nowhere")]):
        assert command(arguments, monkeypatch) == 2
        assert capsys.readouterr().err.startswith("hebbtorch: root: expected ")
    assert list(tmp_path.iterdir()) == []


def test_many_controllers_look_unlike_each_other() -> None:
    found = style.looks([str(i) for i in range(20)])
    assert len({(look.color, str(look.line)) for look in found.values()}) == 20
    assert len({(look.color, look.hatch) for look in found.values()}) == 20
    assert found["0"] == style.looks(["one"])["one"]


def test_a_palette_keeps_the_colors_of_a_figure(tmp_path: Path) -> None:
    colors = [look.color for look in style.looks([str(i) for i in range(6)]).values()]
    with style.sheet(tmp_path, "colors", (2, 2), columns=2) as drawn:
        drawn.panel(0, 0).imshow(np.arange(256.0).reshape(16, 16), cmap="cividis")
        for i, color in enumerate(colors):
            drawn.panel(0, 1).axhspan(i, i + 0.1, color=color)
    with Image.open(tmp_path / "colors.png") as image:
        found = np.unique(np.asarray(image.convert("RGB")).reshape(-1, 3), axis=0) / 255
    for color in colors:
        assert np.abs(found - to_rgb(color)).max(axis=1).min() < 4 / 255, color
