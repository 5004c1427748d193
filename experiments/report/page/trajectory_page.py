"""The page of one recorded trajectory."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from experiments.analysis import trajectory_file
from experiments.report.page.episode_data import episode_data
from experiments.report.page.html import page, section, table

__all__ = ["trajectory_page"]


def trajectory_page(file: Path) -> str:
    """The HTML of its page.

    Args:
        file: that `hebbtorch record` or `trajectory_file.save` wrote.

    Raises:
        ValueError: it cannot be read.
    """
    course = trajectory_file.load(file)
    rows = [
        ("body", course.morphology.name),
        ("terrain", course.terrain.name),
        ("from [s]", float(course.times[0])),
        ("to [s]", float(course.times[-1])),
        ("instants", len(course.times)),
        ("mean velocity [m/s]", course.speed),
        ("mean reward", float(course.rewards.mean())),
    ]
    sections = [
        section("The episode", "<div id='episode'></div>"),
        section("The recording", table(("what", "value"), rows)),
    ]
    if course.config is not None:
        options = dataclasses.asdict(course.config).items()
        sections.append(section("Options", table(("option", "value"), options)))
    data = {"episodes": [episode_data(course, file.stem, inside=True)], "charts": {}}
    return page(f"{file.stem}: {course.title}", sections, data)
