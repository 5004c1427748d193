"""Pictures and films as files: what was drawn, at the right speed, whole or not at all."""

import subprocess
import sys
import weakref
from xml.etree import ElementTree

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image, ImageSequence

from physics.render import palette
from physics.render.draw import (
    draw_film,
    draw_frame,
)
from physics.render.frame import Frame
from physics.render.movie import write_gif, write_mp4, write_png, write_still
from tests.physics.render.robots import FLAT, duo, travel


def test_png_is_what_was_drawn(tmp_path):
    image = draw_frame(travel(1)[0], FLAT, width=200).image()
    write_png(tmp_path / "a.png", image)
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.png")), np.asarray(image))


@pytest.mark.parametrize("fps", [20.0, 24.0, 30.0])
def test_gif_plays_at_the_right_speed_in_the_right_colors(tmp_path, fps):
    images = list(draw_film(travel(31), FLAT, width=240))
    write_gif(tmp_path / "a.gif", images, fps)
    with Image.open(tmp_path / "a.gif") as gif:
        assert gif.info["loop"] == 0  # for ever
        durations, worst = [], 0.0
        for shown, drawn in zip(ImageSequence.Iterator(gif), images, strict=True):
            durations.append(shown.info["duration"])
            error = np.abs(np.asarray(shown.convert("RGB")).astype(int) - np.asarray(drawn))
            worst = max(worst, float(np.percentile(error, 99)))
    ends = np.cumsum(durations) / 1000
    assert ends == pytest.approx(np.arange(1, 32) / fps, abs=0.0051)  # a GIF counts in 10 ms
    assert worst < 16


def test_gif_keeps_the_colors_of_small_things(tmp_path):
    picture = Image.new("RGB", (200, 200), palette.SKY)
    for level in range(41):
        picture.putpixel((level * 4, 9), palette.SAFE.color(level / 20 - 1))
    write_gif(tmp_path / "a.gif", [picture], 10)
    with Image.open(tmp_path / "a.gif") as gif:
        shown = np.asarray(gif.convert("RGB")).astype(int)
    assert np.abs(shown - np.asarray(picture)).max() < 8


def test_mp4_holds_the_frames(tmp_path):
    images = list(draw_film(travel(12), FLAT, width=240))
    write_mp4(tmp_path / "a.mp4", iter(images), 30)
    assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "a.mp4")) == (12, 12 / 30)
    decode = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(tmp_path / "a.mp4"), "-f", "rawvideo"]
    raw = subprocess.run([*decode, "-pix_fmt", "rgb24", "-"], capture_output=True, check=True)
    shown = np.frombuffer(raw.stdout, np.uint8).reshape(12, -1, 240, 3).astype(int)
    for got, drawn in zip(shown, images, strict=True):
        assert np.abs(got - np.asarray(drawn)).mean() < 4


def test_vectors_hold_the_shapes_and_the_words(tmp_path):
    frame = Frame(duo(), actuation=[1.0, -1.0])
    picture = draw_frame(frame, FLAT, width=300, caption="named <so>")
    write_still(tmp_path / "a.svg", picture)
    drawing = ElementTree.parse(tmp_path / "a.svg").getroot()
    words = [element.text for element in drawing.iter("{http://www.w3.org/2000/svg}text")]
    assert {"t = 0.00 s", "named <so>", "contracts"} <= set(words)
    styles = (tmp_path / "a.svg").read_text()
    for color in (palette.SAFE.contracted, palette.SAFE.expanded):
        assert "#{:02x}{:02x}{:02x}".format(*color) in styles
    write_still(tmp_path / "a.pdf", picture)
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")


def test_a_film_is_drawn_as_it_is_written(tmp_path):
    """However long it is, no more than one picture is kept."""
    alive = []

    def pictures(n):
        for _ in range(n):
            image = Image.new("RGB", (64, 64), palette.SKY)
            alive.append(weakref.ref(image))
            yield image
            del image
            assert sum(each() is not None for each in alive) <= 2

    sample = [Image.new("RGB", (64, 64), palette.SKY)]
    write_mp4(tmp_path / "a.mp4", pictures(50), 30)
    write_gif(tmp_path / "a.gif", pictures(50), 20, sample)
    assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "a.mp4"))[0] == 50


def test_a_kill_leaves_nothing(tmp_path):
    code = f"""
import os, sys
from PIL import Image
from physics.render.movie import write_mp4
def pictures():
    for k in range(100):
        if k == 50:
            os.kill(os.getpid(), 9)
        yield Image.new("RGB", (640, 480), (k, k, k))
write_mp4({str(tmp_path / "a.mp4")!r}, pictures(), 30)
"""
    killed = subprocess.run([sys.executable, "-c", code], capture_output=True)
    assert killed.returncode == -9
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("write", "name"), [(write_gif, "a.gif"), (write_mp4, "a.mp4")])
def test_a_film_that_fails_leaves_the_old_file(tmp_path, write, name):
    def broken():
        yield Image.new("RGB", (64, 64))
        raise RuntimeError("no more frames")

    (tmp_path / name).write_bytes(b"old")
    with pytest.raises(RuntimeError, match="no more frames"):
        write(tmp_path / name, broken(), 20)
    assert (tmp_path / name).read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == [name]
