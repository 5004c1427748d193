"""TensorBoard event files, read back with TensorBoard's own reader."""

import io
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.backend.event_processing.plugin_event_accumulator import (
    EventAccumulator as DataServer,
)
from tensorboard.plugins.custom_scalar.layout_pb2 import Layout
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData

from experiments.config import EvolveConfig
from experiments.runs.history import HistoryRow
from experiments.runs.tensorboard import EventFile, Tracker


def read(folder: Path) -> EventAccumulator:
    return EventAccumulator(str(folder), {"histograms": 0, "images": 0}).Reload()


def scalars(folder: Path, tag: str) -> list[tuple[int, float]]:
    return [(event.step, event.value) for event in read(folder).Scalars(tag)]


def log(tracker: Tracker, generation: int, *bests: float, **values: float) -> None:
    """A generation of populations of two, the second of which makes half the best."""
    rows = [
        HistoryRow(k, generation, best, 0.75 * best, 0, 0, 2, 0) for k, best in enumerate(bests)
    ]
    populations = np.array([[best, best / 2] for best in bests])
    tracker.log(rows, [dict(values)] * len(bests), populations)


def test_numbers_options_and_provenance_of_a_run(tmp_path: Path) -> None:
    with Tracker(tmp_path, EvolveConfig(sigma=0.125), 1) as tracker:
        log(tracker, 1, 0.5, time=2.0)
        log(tracker, 2, 0.75, time=3.0)
        log(tracker, 3, 0.25, time=3.0)
    assert scalars(tmp_path, "fitness/best") == [(1, 0.5), (2, 0.75), (3, 0.25)]
    assert scalars(tmp_path, "fitness/best_so_far") == [(1, 0.5), (2, 0.75), (3, 0.75)]
    assert scalars(tmp_path, "time") == [(1, 2.0), (2, 3.0), (3, 3.0)]
    events = read(tmp_path)
    assert [each.step for each in events.Histograms("fitness/population")] == [1, 2, 3]
    histogram = events.Histograms("fitness/population")[0].histogram_value
    assert (histogram.min, histogram.max, histogram.num) == (0.25, 0.5, 2)
    (text,) = events.Tensors("config/text_summary")
    assert "| sigma | 0.125 |" in text.tensor_proto.string_val[0].decode()
    (text,) = events.Tensors("provenance/text_summary")
    for word in ("command", "commit", "hebbtorch", "torch", "processor"):
        assert f"| {word} | " in text.tensor_proto.string_val[0].decode()


def test_resume_replaces_what_ran_ahead(tmp_path: Path) -> None:
    with Tracker(tmp_path, EvolveConfig(), 1) as tracker:
        for generation in (1, 2, 3):
            log(tracker, generation, 1.0 * generation)
    history = [HistoryRow(0, k, 1.0 * k, 0, 0, 0, 0, 0) for k in (1, 2)]
    with Tracker(tmp_path, EvolveConfig(), 3, history=history) as tracker:
        log(tracker, 3, 1.5)
        log(tracker, 4, 10.0)
    assert scalars(tmp_path, "fitness/best") == [(1, 1.0), (2, 2.0), (3, 1.5), (4, 10.0)]
    assert scalars(tmp_path, "fitness/best_so_far") == [(1, 1.0), (2, 2.0), (3, 2.0), (4, 10.0)]
    # Where it went on is told, too.
    assert [each.step for each in read(tmp_path).Tensors("provenance/text_summary")] == [0, 2]


def test_a_run_killed_in_its_first_generation_shows_its_options_once(tmp_path: Path) -> None:
    for _ in range(2):
        with Tracker(tmp_path, EvolveConfig(), 1) as tracker:
            log(tracker, 1, 0.5)
    shown = DataServer(str(tmp_path)).Reload()  # the reader of TensorBoard's pages
    assert len(shown.Tensors("config/text_summary")) == 1
    assert scalars(tmp_path, "fitness/best") == [(1, 0.5)]


def test_several_runs_have_a_folder_each_and_an_overview(tmp_path: Path) -> None:
    with Tracker(tmp_path, EvolveConfig(runs=5), 1) as tracker:
        log(tracker, 1, 5.0, 1.0, 4.0, 2.0, 3.0)
        tracker.log_more(1, [{"validation/flat": value} for value in (None, 1.0, 2.0, 3.0, None)])
    assert scalars(tmp_path / "run-2", "fitness/best") == [(1, 4.0)]
    overview = tmp_path / "over-runs"
    assert not list(overview.glob("*/"))  # one TensorBoard run
    for tag, value in (
        ("fitness/best", 3.0),
        ("quartiles/fitness/best/q25", 2.0),
        ("quartiles/fitness/best/q75", 4.0),
        ("validation/flat", 2.0),
        ("quartiles/validation/flat/q75", 2.5),
    ):
        assert scalars(overview, tag) == [(1, value)]
    assert "validation/flat" not in read(tmp_path / "run-0").Tags()["scalars"]


def test_an_overview_can_lie_elsewhere_and_has_bands(tmp_path: Path) -> None:
    overview = tmp_path / "overview" / "worm"
    tags = ["validation/flat"]
    with Tracker(tmp_path / "run", EvolveConfig(), 1, overview=overview, validated=tags) as tracker:
        log(tracker, 1, 5.0)
    assert scalars(overview, "fitness/best") == [(1, 5.0)]
    assert not (tmp_path / "run" / "over-runs").exists()
    (event,) = read(overview).Tensors("custom_scalars__config__")
    layout = Layout.FromString(event.tensor_proto.string_val[0])
    charts = {chart.title: chart.margin.series[0] for chart in layout.category[0].chart}
    series = charts["fitness/best"]
    assert (series.value, series.lower, series.upper) == (
        "fitness/best", "quartiles/fitness/best/q25", "quartiles/fitness/best/q75"
    )  # fmt: skip
    assert "validation/flat" in charts
    shown = read(overview).Tags()["scalars"]
    assert {series.value, series.lower, series.upper} <= set(shown)


def test_an_overview_that_is_missing_gets_the_generations_before(tmp_path: Path) -> None:
    history = [HistoryRow(run, k, 1.0 * k + run, 0, 0, 0, 0, 0) for k in (1, 2) for run in (0, 1)]
    with Tracker(
        tmp_path / "run", EvolveConfig(runs=2), 3, history=history, overview=tmp_path / "new"
    ) as tracker:
        log(tracker, 3, 3.0, 4.0)
    assert scalars(tmp_path / "new", "fitness/best") == [(1, 1.5), (2, 2.5), (3, 3.5)]


def test_hparams_are_in_the_same_file(tmp_path: Path) -> None:
    config = EvolveConfig(runs=2, seed=5, terrain="flat")
    with Tracker(tmp_path, config, 1, validated=["validation/flat"]) as tracker:
        log(tracker, 1, 0.5, 0.75)
        tracker.end()
    for folder, seed in ((tmp_path / "run-1", 6), (tmp_path / "over-runs", 5)):
        content = read(folder).summary_metadata
        found = {
            tag: HParamsPluginData.FromString(content[tag].plugin_data.content)
            for tag in content
            if tag.startswith("_hparams_/")
        }
        begin = found["_hparams_/session_start_info"].session_start_info.hparams
        assert begin["seed"].number_value == seed
        assert begin["terrain"].string_value == "flat"
        metrics = found["_hparams_/experiment"].experiment.metric_infos
        assert {"fitness/best", "validation/flat"} <= {each.name.tag for each in metrics}
        assert "_hparams_/session_end_info" in found
        assert {path.name[:6] for path in folder.iterdir()} == {"events"}  # no sub-runs


def test_pictures_arrive_as_they_are(tmp_path: Path) -> None:
    frames = [Image.new("RGB", (30, 20), (80 * i, 0, 0)) for i in range(3)]
    frames[0].save(tmp_path / "film.gif", save_all=True, append_images=frames[1:])
    with EventFile(tmp_path / "run") as file:
        file.image("still", frames[1], 7)
        file.picture_file("film", tmp_path / "film.gif", 7)
    events = read(tmp_path / "run")
    (still,), (film,) = events.Images("still"), events.Images("film")
    assert (film.step, film.width, film.height) == (7, 30, 20)
    with Image.open(io.BytesIO(film.encoded_image_string)) as image:
        assert image.n_frames == 3
    with Image.open(io.BytesIO(still.encoded_image_string)) as image:
        assert image.getpixel((0, 0)) == (80, 0, 0)


def test_of_values_that_overflowed_the_finite_ones_are_shown(tmp_path: Path) -> None:
    with EventFile(tmp_path) as file:
        file.histogram("weights", np.array([1.0, -3.0, np.inf, np.nan]), 1)
        file.histogram("weights", np.array([np.inf, np.nan]), 2)
    (histogram,) = read(tmp_path).Histograms("weights")
    value = histogram.histogram_value
    assert (histogram.step, value.min, value.max, value.num) == (1, -3.0, 1.0, 2)
    assert sum(value.bucket) == 2


def test_a_part_that_is_written_anew_replaces_the_old_one(tmp_path: Path) -> None:
    for value in (1.0, 2.0):
        with EventFile(tmp_path, part="freeze") as file:
            file.scalars({"speed": value}, 3)
        with EventFile(tmp_path, part="other") as file:
            file.scalars({"kept": value}, 3)
    assert scalars(tmp_path, "speed") == scalars(tmp_path, "kept") == [(3, 2.0)]


def test_flushed_numbers_outlive_a_kill(tmp_path: Path) -> None:
    code = f"""
import os, pathlib
from experiments.runs.tensorboard import EventFile
file = EventFile(pathlib.Path({str(tmp_path)!r}))
for generation in range(1, 31):
    file.scalars({{"fitness/best": 0.5}}, generation)
file.flush()
os._exit(9)
"""
    assert subprocess.run([sys.executable, "-c", code]).returncode == 9
    assert [step for step, _ in scalars(tmp_path, "fitness/best")] == list(range(1, 31))


@pytest.mark.parametrize("runs", [1, 3])
def test_a_dict_per_run_is_expected(tmp_path: Path, runs: int) -> None:
    with Tracker(tmp_path, EvolveConfig(runs=runs), 1) as tracker, pytest.raises(ValueError):
        log(tracker, 1, 0.0, 0.0)


def event_files(folder: Path) -> list[Path]:
    return sorted(folder.glob("events.out.tfevents.*"))


def test_a_clock_that_was_set_back_hides_nothing(tmp_path: Path) -> None:
    for generation in (1, 2, 3):
        with Tracker(tmp_path, EvolveConfig(), generation) as tracker:
            log(tracker, generation, 1.0 * generation)
        latest = event_files(tmp_path)[-1]
        head, second, tail = re.split(r"\.(\d{10})(?=\.)", latest.name)
        latest.rename(tmp_path / f"{head}.{int(second) + 3600}{tail}")
    assert scalars(tmp_path, "fitness/best") == [(1, 1.0), (2, 2.0), (3, 3.0)]


def test_a_strange_file_beside_the_event_files_is_passed_over(tmp_path: Path) -> None:
    (tmp_path / "events.out.tfevents.bak").write_text("mine")
    (tmp_path / "events.out.tfevents").write_text("mine")
    with Tracker(tmp_path, EvolveConfig(), 1) as tracker:
        log(tracker, 1, 0.5)
    assert (tmp_path / "events.out.tfevents.bak").read_text() == "mine"
