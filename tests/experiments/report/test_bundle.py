"""A campaign in few files: the same runs, and nothing damaged unnoticed."""

import zipfile
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from experiments.config import EvolveConfig
from experiments.report import bundle
from experiments.report.bundle import is_bundle, pack, unpack
from experiments.runs.champions import Champions
from tests.experiments.commands import hebbtorch
from tests.experiments.finished_runs import read_csv, write_evaluation, write_run

SMALL = EvolveConfig(generations=4, population=8)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "root"
    folder = write_run(root / "conditions", SMALL, [4.0, 0.5], "ours")
    write_evaluation(folder, SMALL, [[3.0, 5.0, 4.0], [0.1, 0.2, 0.3]])
    write_run(root / "conditions", replace(SMALL, controller="mlp", seed=3), [1.0], "theirs")
    (folder / "checkpoint.pt").write_bytes(b"large")
    (root / "campaign.json").write_text("{}")
    return root


def content(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_what_was_packed_comes_back(root: Path, tmp_path: Path) -> None:
    files = pack(root, tmp_path / "bundle")
    assert [path.name for path in files] == [
        "champions.safetensors",
        "tables.zip",
        "runs.csv",
        "SHA256SUMS",
    ]
    unpack(tmp_path / "bundle", tmp_path / "back")
    before, after = content(root), content(tmp_path / "back")
    champions = [name for name in before if name.endswith("champion.safetensors")]
    for name in champions:
        ours, theirs = (Champions.load((home / name).parent) for home in (root, tmp_path / "back"))
        assert ours.config == theirs.config
        assert torch.equal(ours.genomes, theirs.genomes)
        assert torch.equal(ours.fitness, theirs.fitness)
    missing = {"conditions/ours/checkpoint.pt"}
    assert after.keys() == before.keys() - missing
    assert all(after[name] == before[name] for name in after.keys() - set(champions))


def test_tables_are_rounded_if_asked(root: Path, tmp_path: Path) -> None:
    folder = root / "conditions" / "ours"
    lines = (
        "run,speed,name\n0,-0.123456789,a 1.23456789\n1,1.23456789e-07,1.2.34567\n12345678,nan,\n"
    )
    (folder / "gaits.csv").write_text(lines)
    exact = pack(root, tmp_path / "exact")
    files = pack(root, tmp_path / "rounded", digits=3)
    unpack(tmp_path / "rounded", tmp_path / "back")
    rounded = (tmp_path / "back" / "conditions" / "ours" / "gaits.csv").read_text()
    assert rounded == (
        "run,speed,name\n0,-0.123,a 1.23456789\n1,1.23e-07,1.2.34567\n12345678,nan,\n"
    )
    for ours, theirs in zip(exact, files, strict=True):
        assert (ours.read_bytes() == theirs.read_bytes()) == (
            ours.name in ("champions.safetensors", "runs.csv")
        )
    with pytest.raises(ValueError, match=r"^digits: expected an integer >= 1"):
        pack(root, tmp_path / "new", digits=0)
    assert not (tmp_path / "new").exists()


def test_rows_of_runs(root: Path, tmp_path: Path) -> None:
    pack(root, tmp_path / "bundle")
    rows = read_csv(tmp_path / "bundle" / "runs.csv")
    assert rows[0] == {
        "condition": "ours",
        "run": "0",
        "seed": "0",
        "speed": "4.0",
        "unseen": "4.0",
        "takeoff_generation": "2",
    }
    assert [row["takeoff_generation"] for row in rows] == ["2", "nan", "nan"]
    assert (rows[2]["condition"], rows[2]["seed"], rows[2]["unseen"]) == ("theirs", "3", "nan")


def test_the_same_runs_give_the_same_bytes(root: Path, tmp_path: Path) -> None:
    pack(root, tmp_path / "one")
    (root / "conditions" / "ours" / "history.csv").touch()
    pack(root, tmp_path / "two")
    pack(root, tmp_path / "two")  # in place
    assert content(tmp_path / "one") == content(tmp_path / "two")


def test_damage_is_noticed_and_nothing_overwritten(root: Path, tmp_path: Path) -> None:
    bundle = tmp_path / "bundle"
    pack(root, bundle)
    assert is_bundle(bundle)
    with zipfile.ZipFile(bundle / "tables.zip", "a") as archive:
        archive.writestr("ours/history.csv.txt", "more")
    with pytest.raises(ValueError, match=r"bundle: .*tables\.zip.*checksum"):
        unpack(bundle, tmp_path / "back")
    assert not (tmp_path / "back").exists()
    pack(root, bundle)
    with pytest.raises(ValueError, match="out: expected a new or empty folder"):
        unpack(bundle, root)
    with pytest.raises(ValueError, match="out: expected a new or empty folder"):
        pack(root, root)
    with pytest.raises(ValueError, match="bundle: expected a packed campaign"):
        unpack(root, tmp_path / "back")
    with pytest.raises(ValueError, match="root: expected finished runs"):
        pack(tmp_path / "nothing", tmp_path / "out")


def test_the_commands_pack_draw_and_unpack(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bundle, back = tmp_path / "bundle", tmp_path / "back"
    assert hebbtorch(f"pack {root} --out {bundle}", monkeypatch) == 0
    drawn = content(bundle / "figures")
    assert {"REPORT.md", "effectiveness.png", "effectiveness.csv"} <= drawn.keys()
    assert {name.split(".")[-1] for name in drawn if name != "REPORT.md"} == {"png", "csv"}
    assert hebbtorch(f"figures {bundle}", monkeypatch) == 0  # again, from the bundle alone
    again = content(bundle / "figures")
    assert all(again[name] == drawn[name] for name in drawn)
    assert hebbtorch(f"unpack {bundle} --out {back}", monkeypatch) == 0
    assert Champions.load(back / "conditions" / "ours").fitness.tolist() == [4.0, 0.5]


@pytest.mark.parametrize("name", ["../x.csv", "/tmp/x.csv", "a/../../x.csv", ""])
def test_names_that_lead_out_of_a_bundle_are_refused(name: str) -> None:
    with pytest.raises(ValueError, match="bundle: expected names within it"):
        bundle._plain(name)
