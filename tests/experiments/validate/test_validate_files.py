"""Files that cannot be replayed: one line that names file and column, exit code 2."""

import csv
import gzip
import json
import shutil
from pathlib import Path

import pytest

from experiments.validate import validation
from experiments.validate.recordings import Recordings, Table
from tests.experiments.commands import hebbtorch

OWN = validation.OWN_COPY


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The whole of the recorded runs, as plain files to be broken."""
    for path in sorted(OWN.rglob("*")):
        target = tmp_path / path.relative_to(OWN)
        if path.is_dir():
            target.mkdir(exist_ok=True)
        elif path.name.endswith(".csv.gz"):
            target.with_suffix("").write_bytes(gzip.decompress(path.read_bytes()))
        else:
            shutil.copy(path, target)
    return tmp_path


def change(path: Path, column: str, line: int, text: str | None) -> None:
    """Puts a text into a cell (line 1 is the header), or drops the cell."""
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    place = rows[0].index(column)
    if text is None:
        del rows[line - 1][place]
    else:
        rows[line - 1][place] = text
    with path.open("w", newline="") as file:
        csv.writer(file).writerows(rows)


def message(folder: Path) -> str:
    """What is wrong with the folder."""
    with pytest.raises(ValueError) as error:
        validation._collect(Recordings(folder))
    text = str(error.value)
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("table", "column"),
    [
        ("single_voxel_step", "actuation"),
        ("two_voxel_step", "a1"),
        ("four_voxel_step", "v1_1_SE_x"),
        ("single_voxel_drop", "area_ratio"),
        ("passive_worm", "v3_0_y"),
        ("sensors_biped-4x3_high", "v3_0_lidar_1"),
        ("sensors_poses_biped-4x3", "v0_2_SW_omega"),
        ("random_gaits_params_worm-7x1", "phase6"),
        ("random_gaits_clean_biped-4x3", "vel_hilly_noccd"),
        ("gen0_biped-4x3_high_hlp", "velocity"),
        ("closedloop_biped-4x3_high_mlp", "out9"),
    ],
)
def test_a_cell_that_is_no_number(folder: Path, table: str, column: str) -> None:
    change(folder / f"{table}.csv", column, 9, "many")
    assert message(folder) == (
        f"{table}.csv: expected a number in column {column}, got 'many' in line 9"
    )


@pytest.mark.parametrize("text", ["NaN", "inf", ""])
def test_a_cell_that_is_not_finite(folder: Path, text: str) -> None:
    change(folder / "passive_biped.csv", "v0_0_y", 30, text)
    assert message(folder) == (
        f"passive_biped.csv: expected a number in column v0_0_y, got {text!r} in line 30"
    )


@pytest.mark.parametrize(
    ("table", "column"),
    [
        ("two_voxel_step", "v1_0_SE_y"),
        ("passive_worm", "v3_0_area_ratio"),
        ("random_gaits_params_biped-4x3", "amp9"),
        ("random_gaits_clean_worm-7x1", "i"),
        ("gen0_biped-4x3_high_mlp", "terrain"),
        ("sensors_poses_biped-4x3", "t"),
    ],
)
def test_a_missing_column(folder: Path, table: str, column: str) -> None:
    change(folder / f"{table}.csv", column, 1, "other")
    assert message(folder) == f"{table}.csv: expected a column {column}, got none"


def test_a_row_that_is_cut_short(folder: Path) -> None:
    change(folder / "passive_worm.csv", "v0_0_x", 40, None)
    assert message(folder) == "passive_worm.csv: expected 29 columns, got 28 in line 40"


def test_another_step_of_time(folder: Path) -> None:
    change(folder / "single_voxel_drop.csv", "t", 3, "0.05")
    assert message(folder) == (
        "single_voxel_drop.csv: expected steps of 1/60 s in column t, got 0.05 instead of "
        "0.0166667 in line 3"
    )


def test_gaits_that_do_not_belong_together(folder: Path) -> None:
    change(folder / "random_gaits_clean_worm-7x1.csv", "i", 5, "77")
    assert "random_gaits_clean_worm-7x1.csv: expected the gaits of random" in message(folder)


def test_an_unknown_ground(folder: Path) -> None:
    change(folder / "gen0_biped-4x3_high_hlp.csv", "terrain", 2, "moon-1")
    text = message(folder)
    assert text.startswith("gen0_biped-4x3_high_hlp.csv: column terrain: terrain: expected one of")
    assert "'moon-1'" in text


def test_an_unknown_shape(folder: Path) -> None:
    for kind in ("params", "clean"):
        (folder / f"random_gaits_{kind}_worm-7x1.csv").rename(
            folder / f"random_gaits_{kind}_snail-7x1.csv"
        )
    text = message(folder)
    assert text.startswith("random_gaits_params_snail-7x1.csv: shape:")


def test_genomes_of_the_wrong_number(folder: Path) -> None:
    path = folder / "gen0_biped-4x3_high_mlp_genomes.f64.gz"
    path.write_bytes(gzip.compress(gzip.decompress(path.read_bytes())[:-8]))
    assert (
        message(folder) == f"{path.name}: expected 40 x 1170 numbers of 8 bytes, got 374392 bytes"
    )


@pytest.mark.parametrize("name", ["gen0_biped-4x3_high_hlp_genomes.f64.gz", "passive_x.csv.gz"])
def test_a_broken_archive(folder: Path, name: str) -> None:
    (folder / name).write_bytes(b"no archive")
    assert message(folder).startswith(f"{name}: expected a ")


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("terrains.json", "{", "terrains.json: expected JSON, got"),
        ("terrains.json", "[1]", "terrains.json: expected an object, got list"),
        ("terrains.json", '{"flat": {"xs": [0, 1]}}', "terrains.json: expected xs and ys of flat"),
        ("hebbian_golden.json", '{"a": {"coefs": [1]}}', "hebbian_golden.json: expected sizes"),
        ("gen0_biped-4x3_high_hlp.json", '{"duration": "long"}', "gen0_biped-4x3_high_hlp.json: "),
    ],
)
def test_a_broken_document(folder: Path, name: str, content: str, expected: str) -> None:
    (folder / name).write_text(content)
    assert message(folder).startswith(expected)


def test_a_golden_network_of_other_shapes(folder: Path) -> None:
    content = json.loads((folder / "hebbian_golden.json").read_text())
    content["full_5-5-3"]["weights"]["after_50"].pop()
    (folder / "hebbian_golden.json").write_text(json.dumps(content))
    text = message(folder)
    assert "expected shapes" in text
    assert "'weights after_50': (39,)" in text


def test_a_table_without_rows(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,x\n")
    with pytest.raises(ValueError, match=r"a\.csv: expected a header and rows, got 1 line"):
        Table(tmp_path / "a.csv")


@pytest.mark.parametrize("present", [False, True])
def test_a_folder_without_recordings(
    present: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder, out = tmp_path / "records", tmp_path / "pictures"
    if present:
        folder.mkdir()
    assert hebbtorch(f"validate --reference {folder} --out {out}", monkeypatch) == 2
    error = capsys.readouterr().err
    assert error.startswith("hebbtorch: reference: expected ")
    assert error.count("\n") == 1
    assert str(folder) in error
    assert not out.exists()


@pytest.mark.parametrize("option", ["json", "out"])
def test_a_result_that_cannot_be_written_is_said_at_once(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "place"
    if option == "json":
        place.mkdir()
    else:
        place.write_text("")
    with pytest.raises(ValueError, match=f"^{option}: expected a f"):
        validation.validate(**{option: place})
    assert capsys.readouterr().out == ""
