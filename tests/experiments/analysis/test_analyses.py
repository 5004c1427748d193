"""Analyses of a run's folder: one file each, written once."""

import csv
import json
from pathlib import Path

import pytest

from experiments.analysis import registry, unseen
from tests.experiments.champions import PLASTIC, STATIC, random_champions, run_folder

FILES = {
    "unseen_terrains": "evaluation-hilly-3-30-none.csv",
    "frozen": "freeze.csv",
    "recorded": "recording.json",
    "pruned": "pruned.csv",
    "matrix": "matrix.csv",
    "endured": "endurance.csv",
    "recovered": "recovery.csv",
    "random_genomes": "random_genomes.json",
    "paired_speeds": "paired.csv",
    "generalized": "generalization.csv",
    "settled": "settling.csv",
    "gaits_watched": "gaits.csv",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run_folder(tmp_path_factory.mktemp("analyses"))


def test_all_of_them_are_tried_here() -> None:
    assert sorted(FILES) == registry.__all__


@pytest.mark.parametrize(("name", "file"), FILES.items())
def test_an_analysis_writes_its_file_once(name: str, file: str, folder: Path) -> None:
    written = getattr(registry, name)(folder)
    assert written == folder / file
    if written.suffix == ".csv":
        rows = csv.DictReader(written.read_text().splitlines())
        speeds = [float(row[k]) for row in rows for k in row if k.startswith("speed")]
        assert max(speeds) > min(speeds)
    else:
        n = PLASTIC.population if name == "random_genomes" else PLASTIC.runs
        runs = json.loads(written.read_text())["runs"]
        assert [run["run"] for run in runs] == list(range(n))
    assert not list(folder.glob("*.tmp"))
    written.write_text("left alone")
    assert getattr(registry, name)(folder) == written
    assert written.read_text() == "left alone"


def test_unseen_terrains_are_ten_and_reported_alike(tmp_path: Path) -> None:
    folder = run_folder(tmp_path)
    written = registry.unseen_terrains(folder).read_bytes()
    other = tmp_path / "other.csv"
    unseen.evaluate_run(folder, 10, None, None, 0, other)
    assert other.read_bytes() == written
    speeds = unseen.reassess(PLASTIC, random_champions().genomes, range(10))
    rows = list(csv.reader(written.decode().splitlines()))
    assert rows[0] == ["run", "terrain", "damage", "speed"]
    assert [float(row[3]) for row in rows[1:]] == speeds.flatten().tolist()
    assert [row[1] for row in rows[1:11]] == [f"hilly-3-30-{k}" for k in range(10)]


@pytest.mark.parametrize("name", ["frozen", "recorded", "random_genomes", "pruned", "settled"])
def test_what_asks_for_plasticity_refuses_a_static_network(name: str, tmp_path: Path) -> None:
    folder = run_folder(tmp_path, STATIC)
    with pytest.raises(ValueError, match="run: expected plastic champions, got the mlp"):
        getattr(registry, name)(folder)
    assert [path.name for path in folder.iterdir()] == ["champion.safetensors"]


@pytest.mark.parametrize("name", FILES)
def test_a_folder_without_champions_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="run: expected the folder of a finished run"):
        getattr(registry, name)(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_static_networks_have_unseen_terrains_and_a_matrix(tmp_path: Path) -> None:
    folder = run_folder(tmp_path, STATIC)
    assert registry.unseen_terrains(folder).exists()
    assert registry.matrix(folder).exists()
