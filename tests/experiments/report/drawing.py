"""Figures drawn for a test."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from experiments.report.figures import FIGURES
from experiments.report.finished_runs import find_runs
from tests.experiments.finished_runs import read_csv


def draw(name: str, root: Path, out: Path) -> list[dict[str, str]]:
    """The table of a figure; its pictures are looked at."""
    files = FIGURES[name](find_runs([root]), out)
    by_suffix = {path.suffix: path for path in files if path.stem == name}
    assert set(by_suffix) == {".png", ".pdf", ".csv", ".md"}
    assert by_suffix[".pdf"].read_bytes().startswith(b"%PDF")
    with Image.open(by_suffix[".png"]) as image:
        assert min(image.size) > 200
        assert image.info["dpi"][0] == pytest.approx(200, abs=1)
        pixels = np.asarray(image.convert("L"))
    assert 0.01 < (pixels < 250).mean() < 0.7  # something is drawn, and most is paper
    return read_csv(by_suffix[".csv"])
