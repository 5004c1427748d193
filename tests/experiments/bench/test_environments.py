"""The throughput curve of environments."""

import json
from pathlib import Path

from experiments.bench import environments


def test_the_curve_is_measured_and_written(tmp_path: Path) -> None:
    out = tmp_path / "curve.json"
    rows = environments.main(["--most", "4", "--seconds", "0.02", "--out", str(out)])
    assert [row["environments"] for row in rows] == [1, 4]
    assert all(0 < r["least"] <= r["steps_per_second"] <= r["greatest"] for r in rows)
    content = json.loads(out.read_text())
    assert content["format"] == 1
    assert content["rows"] == rows
