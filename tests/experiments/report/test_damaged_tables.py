"""Figures of runs whose tables are damaged: one line that names the file, and nothing written."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from experiments.config import EvolveConfig
from experiments.report.gallery import draw_all
from tests.experiments.finished_runs import write_evaluation, write_recording, write_run

pytestmark = pytest.mark.slow

CONFIG = EvolveConfig(generations=3)
TABLES = ("history.csv", "evaluation-hilly-3-30-none.csv", "freeze.csv", "recording.json")


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for name in ("hebbian", "mlp"):
        config = EvolveConfig(generations=3, controller=name)
        folder = write_run(tmp_path / "root", config, [1.0, 2.0], name)
        write_evaluation(folder, config, [[1.0, 1.1], [2.0, 2.1]])
    return tmp_path / "root"


DAMAGES = {
    "empty": b"",
    "only a header": b"run,speed\n",
    "no table": b"\x00\xff\xfe",
    "rows of other lengths": b"run,generation,best\n0,1\n",
    "a damaged number": b"run,generation,best,speed\n0,1,x,y\n0,2,1,1\n",
    "other columns": b"a,b\n1,2\n",
    "other JSON": b'{"runs": 3}',
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("table", TABLES)
def test_a_damaged_table_is_named_and_nothing_is_written(
    root: Path, tmp_path: Path, table: str, damage: str
) -> None:
    path = root / "hebbian" / table
    path.write_bytes(DAMAGES[damage])
    out = tmp_path / "out"
    with pytest.raises(ValueError, match=table):
        draw_all([root], out, 0, all_formats=False)
    assert list(out.iterdir()) == []


@pytest.mark.parametrize("table", ["recording.json", "recording.npz", "random_genomes.json"])
def test_a_recording_of_a_newer_version_is_refused_by_saying_so(
    root: Path, tmp_path: Path, table: str
) -> None:
    folder = root / "hebbian"
    write_recording(folder, 2)
    shutil.copy(folder / "recording.json", folder / "random_genomes.json")
    path = folder / table
    if path.suffix == ".npz":
        with np.load(path) as arrays:
            content = {**arrays, "format": np.array(2)}
        np.savez(path, **content)
    else:
        path.write_text(json.dumps(json.loads(path.read_text()) | {"format": 2}))
    with pytest.raises(ValueError, match=f"{table}.* a newer version of hebbtorch"):
        draw_all([root], tmp_path / "out", 0, all_formats=False)
