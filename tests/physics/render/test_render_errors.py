"""What is wrong with a picture or film is told by name."""

import numpy as np
import pytest
from PIL import Image

from physics.render import palette
from physics.render.draw import (
    beside,
    draw_film,
    draw_frame,
    draw_overlay,
    draw_strip,
    stack,
)
from physics.render.frame import Frame
from physics.render.movie import write_gif, write_mp4, write_png, write_still
from tests.physics.render.robots import plain, voxels

POSES = voxels([[20.0, 6.5]])


PICTURE = Image.new("RGB", (64, 64))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Frame(POSES[0]), r"poses: expected .* \(V, 4, 3\), got \(4, 3\)"),
        (lambda: Frame(POSES[:0]), r"poses: expected .* \(V, 4, 3\), got \(0, 4, 3\)"),
        (lambda: Frame(np.where(POSES == 0, np.nan, POSES)), "poses: expected finite"),
        (lambda: Frame(POSES, actuation=[0, 0]), r"actuation: expected .* \(1\), got \(2,\)"),
        (lambda: Frame(POSES, rays=np.zeros((3, 2))), r"rays: .*\(K, 2, 2\), got \(3, 2\)"),
        (lambda: draw_strip([]), "frames: expected at least one"),
        (lambda: draw_overlay([]), "frames: expected at least one"),
        (lambda: list(draw_film([])), "frames: expected at least one"),
        (lambda: draw_frame(Frame(POSES), width=10), "width: expected at least 64"),
        (lambda: stack({}), "pictures: expected one width, got no picture"),
        (lambda: beside([], 2), "images: expected at least one"),
        (lambda: Frame(POSES, hits=[True]), r"hits: expected .* \(0\), got \(1,\)"),
        (lambda: Frame(POSES, broken=[0, 1]), r"broken: expected .* \(1\), got \(2,\)"),
        (lambda: write_still("a.jpg", plain(64, 64, palette.SKY)), '".png" or ".svg" or ".pdf"'),
        (lambda: write_png("a.jpg", PICTURE), 'path: expected a name ending in ".png"'),
        (lambda: write_png("nowhere/a.png", PICTURE), 'existing folder, got "nowhere"'),
        (lambda: write_gif("a.gif", [], 20), "images: expected at least one"),
        (lambda: write_gif("a.gif", [PICTURE], 60), r"fps: expected .* \(0, 50\] .*, got 60"),
        (lambda: write_mp4("a.mp4", [], 20), "images: expected at least one"),
        (lambda: write_mp4("a.mp4", [PICTURE], 0), "fps: expected a positive"),
        (lambda: write_mp4("a.mp4", [Image.new("RGB", (63, 64))], 9), "even width and height"),
    ],
)
def test_errors_name_what_was_expected(call, message):
    with pytest.raises(ValueError, match=message):
        call()
