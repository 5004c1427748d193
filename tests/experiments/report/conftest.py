"""Folders for the runs and the figures of a test."""

from pathlib import Path

import pytest


@pytest.fixture
def out(tmp_path: Path) -> Path:
    (tmp_path / "out").mkdir()
    return tmp_path / "out"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return tmp_path / "runs"
