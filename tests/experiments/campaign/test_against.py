"""A campaign against another: identical, moved, or no difference shown."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.campaign import against
from experiments.campaign.grid import Condition, Grid, Scale
from experiments.campaign.launch import run_campaign
from experiments.campaign.options import CampaignOptions
from experiments.campaign.study import Study
from experiments.config import EvolveConfig
from experiments.report.bundle import pack
from tests.experiments.finished_runs import write_run

SMALL = EvolveConfig(generations=4, population=8, runs=10)
SCALE = Scale(runs=10, generations=4, population=8)
SPEEDS = np.linspace(1.0, 1.9, 10)


def test_what_moved_is_told_condition_by_condition(tmp_path: Path) -> None:
    new, old = tmp_path / "new", tmp_path / "old"
    speeds = {
        "same": (SPEEDS, SPEEDS),
        "slower": (SPEEDS - 1, SPEEDS),
        "near": (SPEEDS + 0.01, SPEEDS),
        "new": (SPEEDS, None),
    }
    conditions, folders = [], {}
    for k, (name, (now, before)) in enumerate(speeds.items()):
        config = replace(SMALL, sigma=0.1 * (k + 1))
        conditions.append(Condition(name, config))
        folders[name] = write_run(new, config, now.tolist(), name)
        if before is not None:
            write_run(old, replace(config, threads=2), before.tolist(), name)
    found = against.compare(conditions, folders, against.read(old, SCALE))
    assert {each.name: each.verdict for each in found} == {
        "same": "identical",
        "slower": "slower",
        "near": "no difference shown",
        "new": "not there before",
    }
    assert [each.name for each in found if each.moved] == ["slower"]
    slower = next(each for each in found if each.name == "slower")
    assert slower.shift is not None
    assert slower.shift.value == pytest.approx(-1)


def test_another_scale_or_nothing_to_compare_with_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="against: expected the folder"):
        against.read(tmp_path / "nowhere", SCALE)
    with pytest.raises(ValueError, match="against: expected finished runs"):
        against.read(tmp_path, SCALE)
    write_run(tmp_path, SMALL, [1.0])
    with pytest.raises(ValueError, match="against: expected a campaign with generations 5"):
        against.read(tmp_path, replace(SCALE, generations=5))


def test_a_campaign_again_is_identical(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    study = Study("own", "which?", (Grid(EvolveConfig(shape="worm-2x1")),))
    options = CampaignOptions(
        out=tmp_path / "one",
        scale=Scale(runs=2, generations=1, population=8, duration=0.5),
        threads=1,
    )
    assert run_campaign([study], options) == 0
    pack(tmp_path / "one", tmp_path / "bundle")
    again = replace(options, out=tmp_path / "two", against=tmp_path / "bundle")
    assert run_campaign([study], again) == 0
    assert "0 of 1 conditions moved, 1 are identical" in capsys.readouterr().out
