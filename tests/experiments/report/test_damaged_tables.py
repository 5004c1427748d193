"""Figures of runs whose tables are damaged: one line that names the file, and nothing written."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.config import EvolveConfig
from experiments.report.gallery import draw_all
from tests.experiments.finished_runs import write_evaluation, write_run

CONFIG = EvolveConfig(generations=3)
TABLES = ("history.csv", "evaluation-hilly-3-30-none.csv", "freeze.csv", "inner_life.json")


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
        draw_all([root], out, 0, print_quality=False)
    assert list(out.iterdir()) == []
