"""TensorBoard event files, read back with TensorBoard's own reader."""

import io
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from experiments.config import EvolveConfig
from experiments.runs.tensorboard import Tracker


def read(folder: Path) -> EventAccumulator:
    return EventAccumulator(str(folder)).Reload()


def scalars(folder: Path, tag: str) -> list[tuple[int, float]]:
    return [(event.step, event.value) for event in read(folder).Scalars(tag)]


def test_numbers_and_options_of_a_run(tmp_path: Path) -> None:
    with Tracker(tmp_path, EvolveConfig(sigma=0.125), 1) as tracker:
        tracker.log(1, [{"fitness/best": 0.5, "time/generation": 2.0}])
        tracker.log(2, [{"fitness/best": 0.75, "time/generation": 3.0}])
    assert scalars(tmp_path, "fitness/best") == [(1, 0.5), (2, 0.75)]
    assert scalars(tmp_path, "time/generation") == [(1, 2.0), (2, 3.0)]
    (text,) = read(tmp_path).Tensors("config/text_summary")
    assert "| sigma | 0.125 |" in text.tensor_proto.string_val[0].decode()


def test_resume_replaces_what_ran_ahead(tmp_path: Path) -> None:
    with Tracker(tmp_path, EvolveConfig(), 1) as tracker:
        for generation in (1, 2, 3):
            tracker.log(generation, [{"fitness/best": 1.0 * generation}])
    with Tracker(tmp_path, EvolveConfig(), 3) as tracker:
        for generation in (3, 4):
            tracker.log(generation, [{"fitness/best": 10.0 * generation}])
    assert scalars(tmp_path, "fitness/best") == [(1, 1.0), (2, 2.0), (3, 30.0), (4, 40.0)]


def test_several_runs_have_a_folder_each_and_their_quartiles(tmp_path: Path) -> None:
    with Tracker(tmp_path, EvolveConfig(runs=5), 1) as tracker:
        tracker.log(1, [{"fitness/best": best} for best in (5.0, 1.0, 4.0, 2.0, 3.0)])
    assert scalars(tmp_path / "run-2", "fitness/best") == [(1, 4.0)]
    for name, value in (("q25", 2.0), ("median", 3.0), ("q75", 4.0)):
        assert scalars(tmp_path / "over-runs" / name, "fitness/best") == [(1, value)]


def test_pictures_arrive_as_they_are(tmp_path: Path) -> None:
    frames = [Image.new("RGB", (30, 20), (80 * i, 0, 0)) for i in range(3)]
    strip, film, video = (tmp_path / f"gait.{suffix}" for suffix in ("png", "gif", "mp4"))
    frames[0].save(strip)
    frames[0].save(film, save_all=True, append_images=frames[1:])
    video.write_bytes(b"for other viewers")
    with Tracker(tmp_path / "run", EvolveConfig(), 1) as tracker:
        tracker.show(0, 7, [strip, film, video])
    events = read(tmp_path / "run")
    assert sorted(events.Tags()["images"]) == ["champion/gait.gif", "champion/gait.png"]
    (event,) = events.Images("champion/gait.gif")
    assert (event.step, event.width, event.height) == (7, 30, 20)
    with Image.open(io.BytesIO(event.encoded_image_string)) as image:
        assert image.n_frames == 3


def test_weights_of_a_life_by_second(tmp_path: Path) -> None:
    weights = {1.0: np.array([-1.0, 0.5, 0.5]), 15.0: np.array([-20.0, 30.0, 0.0])}
    with Tracker(tmp_path, EvolveConfig(runs=2), 1) as tracker:
        for second, values in weights.items():
            tracker.show_weights(1, second, values, {"A": second / 20, "D": None})
    everything = EventAccumulator(str(tmp_path / "run-1"), {"histograms": 0}).Reload()
    events = everything.Histograms("champion/weights_by_second")
    for event, (second, values) in zip(events, weights.items(), strict=True):
        assert event.step == second
        histogram = event.histogram_value
        assert (histogram.min, histogram.max, histogram.num) == (values.min(), values.max(), 3)
    shares = scalars(tmp_path / "run-1", "champion/share_of_A_by_second")
    assert shares == [(1, pytest.approx(0.05)), (15, 0.75)]
    assert "champion/share_of_D_by_second" not in read(tmp_path / "run-1").Tags()["scalars"]
    assert not read(tmp_path / "run-0").Tags()["histograms"]


def test_flushed_numbers_outlive_a_kill(tmp_path: Path) -> None:
    code = f"""
import os, pathlib
from experiments.config import EvolveConfig
from experiments.runs.tensorboard import Tracker
tracker = Tracker(pathlib.Path({str(tmp_path)!r}), EvolveConfig(), 1)
for generation in range(1, 31):
    tracker.log(generation, [{{"fitness/best": 0.5}}])
tracker.flush()
os._exit(9)
"""
    assert subprocess.run([sys.executable, "-c", code]).returncode == 9
    assert [step for step, _ in scalars(tmp_path, "fitness/best")] == list(range(1, 31))


@pytest.mark.parametrize("runs", [1, 3])
def test_a_dict_per_run_is_expected(tmp_path: Path, runs: int) -> None:
    with Tracker(tmp_path, EvolveConfig(runs=runs), 1) as tracker, pytest.raises(ValueError):
        tracker.log(1, [{"fitness/best": 0.0}] * 2)
