"""Every example runs, at a small scale, and does what it says."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

FOLDER = Path(__file__).parents[2] / "examples"

# What libraries of others do is theirs.
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]

QUICK = ["--generations", "2", "--population", "8", "--duration", "1"]


def example(name: str, *needs: str) -> ModuleType:
    """The module of an example, if the libraries that it needs are installed."""
    for each in needs:
        pytest.importorskip(each)
    spec = importlib.util.spec_from_file_location(f"example_{name}", FOLDER / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_ppo_learns_to_walk() -> None:
    """A quarter of the steps: the worm is on its way."""
    ppo = example("ppo_walks", "stable_baselines3")
    assert ppo.main(["--steps", "150000"]) > 0.25


@pytest.mark.parametrize(("name", "library"), [("cma_es", "cma"), ("evotorch_snes", "evotorch")])
def test_other_optimizers_evolve(name: str, library: str) -> None:
    assert -9.0 < example(name, library).main(QUICK) < 30.0


def test_an_archive_of_gaits_is_filled(capsys: pytest.CaptureFixture[str]) -> None:
    archive = example("gait_archive", "ribs").main(QUICK)
    assert 0 < len(archive) <= 16
    assert "of the voxels on the ground" in capsys.readouterr().out


def test_a_controller_drives_bodies_of_any_size() -> None:
    speeds: dict[str, Any] = example("transfer_between_bodies").main(QUICK)
    assert set(speeds) == {"worm-4x1", "worm-7x1", "biped-4x3", "comb-5x2"}


def test_bodies_evolve(capsys: pytest.CaptureFixture[str]) -> None:
    bodies = example("evolve_bodies")
    assert bodies.main(["--generations", "2", "--bodies", "4", "--duration", "1"]) > -10
    assert capsys.readouterr().out.count("generation") == 2
