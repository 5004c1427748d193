import dataclasses
import math

import imageio_ffmpeg
import numpy as np
import pytest
import torch
from PIL import Image

from experiments.analysis.comparison import film_beside
from experiments.analysis.film import FilmOptions, draw_gait, film_run
from experiments.analysis.recorder import record
from experiments.analysis.trajectory import lidar_rays
from experiments.analysis.unseen import reassess
from experiments.config import EvolveConfig
from experiments.rollout import controller
from experiments.runs.archive import Archive
from experiments.runs.champions import Champions
from physics import Apparatus, Simulator
from physics.scene.clock import steps_in
from physics.scene.sensors import Sensor

CONFIG = EvolveConfig(shape="biped-4x3", sensors="high", duration=1.0)
TWO = dataclasses.replace(CONFIG, runs=2)


def genome(seed=0, config=CONFIG):
    n_genes = controller.build(config, 1).n_genes
    return torch.randn(n_genes, generator=torch.Generator().manual_seed(seed))


@pytest.fixture
def run(tmp_path):
    """The folder of a run of two champions."""
    folder = tmp_path / "run"
    folder.mkdir()
    genomes = torch.stack([genome(0), genome(1)])
    Champions(TWO, genomes, torch.tensor([2.0, 3.0])).save(folder)
    return folder


# --- the recorded life --------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [0, 3])
@pytest.mark.parametrize("damage", ["none", "half"])
def test_recorded_life_is_the_one_of_the_reassessment(seed, damage):
    config = dataclasses.replace(CONFIG, damage=damage, noise=0.05, init="uniform")
    recording = record(config, genome(), seed=seed, start=0.0, seconds=1.0)
    speed = reassess(config, genome()[None], [seed]).item()
    assert recording.speed == pytest.approx(speed, abs=5e-6)  # the centre is a float32 mean
    assert recording.terrain.name == f"hilly-3-30-{seed}"
    assert len(recording.times) == steps_in(1.0)


def test_film_begins_and_ends_when_asked_to():
    times = record(CONFIG, genome(), start=0.4, seconds=0.3).times
    assert times[0] == pytest.approx(0.4)
    assert times[-1] == pytest.approx(0.7, abs=1 / 60)
    assert np.diff(times) == pytest.approx(1 / 60)
    last = record(CONFIG, genome(), seconds=0.25).times  # by default as late as a short life lets
    assert last[0] == pytest.approx(0.75)
    assert last[-1] == pytest.approx(1.0, abs=1 / 60)


def test_rays_are_as_long_as_the_lidar_reads():
    angle, reach = 0.4, 10.0
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    corners = 0.9 * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]]) @ turn.T + (20, 8)
    other = np.zeros((4, 3))
    poses = np.stack([other, np.column_stack([corners, np.zeros(4)])])
    apparatus = Apparatus(
        ((Sensor("area"),), (Sensor("touch"), Sensor("lidar", angles=(-30, 0), range=reach)))
    )
    rays, hits = lidar_rays(poses, np.array([0.9, 0.8, 0.5, 1.0]), apparatus)
    assert hits.tolist() == [True, False]
    for ray, reading, own in zip(rays, (0.5, 1.0), (-math.pi / 6, 0.0), strict=True):
        direction = [math.cos(angle + own), math.sin(angle + own)]
        assert ray[0] == pytest.approx([20, 8])
        assert ray[1] - ray[0] == pytest.approx(np.multiply(direction, reading * reach))


def test_without_lidar_there_are_no_rays():
    apparatus = Apparatus(((Sensor("area"),),))
    assert lidar_rays(np.zeros((1, 4, 3)), np.array([0.5]), apparatus) is None


# --- files --------------------------------------------------------------------------------------


def test_a_run_is_filmed(run, tmp_path):
    files = film_run(run, run=1, out=tmp_path / "new" / "films", seconds=0.5)
    assert [path.name for path in files] == ["gait.png", "gait.gif", "gait.mp4"]
    assert all(path.parent == tmp_path / "new" / "films" for path in files)
    with Image.open(files[0]) as strip, Image.open(files[1]) as gif:
        assert strip.width == 1800
        assert gif.n_frames == 11  # 0.5 s at 20 pictures per second
    assert imageio_ffmpeg.count_frames_and_secs(str(files[2]))[0] == 16  # at 30


def test_champions_of_two_runs_are_filmed_apart_and_repeatably(run):
    def strip(**options):
        (path,) = film_run(run, seconds=0.3, mp4=False, options=FilmOptions(gif="no"), **options)
        return path.read_bytes()

    assert strip() == strip(run=1)  # the fittest
    assert strip() != strip(run=0)
    assert strip() != strip(seed=1)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"run": 2}, "run: expected 0 to 1, .* got 2"),
        ({"seconds": 0.0}, "seconds: expected a number > 0, got 0.0"),
        ({"start": 1.5}, "start: expected a time within the episode of 1.0 s, got 1.5"),
        ({"start": -1.0}, "start: expected a time within the episode"),
    ],
)
def test_wrong_options_are_named_and_nothing_is_written(run, options, message):
    before = sorted(run.iterdir())
    with pytest.raises(ValueError, match=message):
        film_run(run, **options)
    assert sorted(run.iterdir()) == before


def test_a_film_ends_where_the_simulation_fails(monkeypatch):
    monkeypatch.setattr(Simulator, "failed", lambda sim: torch.tensor([sim.time > 0.51]))
    times = record(CONFIG, genome(), start=0.3, seconds=0.5).times
    assert times[-1] == pytest.approx(0.5)
    with pytest.raises(ValueError, match="before the simulation of this robot fails, got 0.6 s"):
        record(CONFIG, genome(), start=0.6, seconds=0.3)


# --- side by side -------------------------------------------------------------------------------


def test_robots_are_filmed_beside_each_other(run, tmp_path):
    archive = Archive.empty(TWO, len(genome()))
    population = torch.stack([genome(k) for k in range(4)]).unflatten(0, (2, 2))
    archive.with_generation(1, population, torch.zeros(2, 2)).save(run)
    others = ["damaged", "frozen", "generation-1"]
    (film,) = film_beside(
        run, others, out=tmp_path / "out", seconds=0.3, options=FilmOptions(gif="no", width=640)
    )
    assert film.name == "beside.mp4"
    frames, _ = imageio_ffmpeg.count_frames_and_secs(str(film))
    assert frames == 10
    reader = imageio_ffmpeg.read_frames(str(film))
    width, height = next(reader)["size"]
    reader.close()
    assert width == 640
    assert height > 300  # two rows of two


@pytest.mark.parametrize("other", ["generation-7", "generation-x", "nowhere"])
def test_what_cannot_be_beside_is_named(run, other):
    before = sorted(run.iterdir())
    with pytest.raises(ValueError, match=f"beside: expected .*{other}"):
        film_beside(run, [other], seconds=0.3)
    assert sorted(run.iterdir()) == before


def test_a_frozen_robot_goes_on_with_the_weights_it_has():
    config = dataclasses.replace(CONFIG, eta=0.5)
    options = {"every": 6, "weights_every": 0.1}
    plastic = record(config, genome(), **options)
    frozen = record(config, genome(), freeze_at=0.5, **options)
    then = int(np.argmax(frozen.weight_times > 0.55))
    for ours, theirs in zip(frozen.weights, plastic.weights, strict=True):
        assert np.array_equal(ours[: then - 1], theirs[: then - 1])
        assert (ours[then:] == ours[then]).all()
        assert not (theirs[then:] == theirs[then]).all()


def test_a_robot_that_stands_gets_one_picture():
    moving = record(dataclasses.replace(CONFIG, eta=0.5), genome(), start=0.5, seconds=0.4)
    still = dataclasses.replace(
        moving,
        poses=np.broadcast_to(moving.poses[:1], moving.poses.shape),
        areas=np.ones_like(moving.areas),
    )
    pages = [draw_gait(course, "run 0") for course in (still, moving)]
    assert pages[0].size[1] < 0.8 * pages[1].size[1]


def test_broken_voxels_are_those_that_no_longer_act():
    config = dataclasses.replace(CONFIG, damage="half", eta=0.5)
    course = record(config, genome(), seed=2)
    assert not course.broken[course.times < 0.5].any()
    broken, late = course.broken[-1], course.times > 0.55
    assert broken.any()
    assert not broken.all()
    assert (course.broken[late] == broken).all()
    assert (course.actuation[late][:, broken] == 0).all()
    assert (course.actuation[late][:, ~broken] != 0).any(axis=0).all()
