"""Colours that differ for every eye, and marks that show without colour."""

import numpy as np
import pytest

from physics.render import palette
from physics.render.canvas import Camera
from physics.render.draw import (
    draw_frame,
)
from physics.render.frame import Frame, follow
from physics.scene.terrain import Terrain
from tests.physics.render.robots import FLAT, duo, voxels

# Machado, Oliveira and Fernandes (2009), severity 1: what linear RGB turns into.
DEFICIENCIES = {
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}


def lab(color, deficiency=None):
    """CIE L*a*b* (D65) of an sRGB colour as somebody with a deficiency sees it."""
    rgb = np.array(color) / 255
    linear = np.where(rgb > 0.04045, ((rgb + 0.055) / 1.055) ** 2.4, rgb / 12.92)
    if deficiency is not None:
        linear = np.clip(np.array(DEFICIENCIES[deficiency]) @ linear, 0, 1)
    to_xyz = [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
    x, y, z = np.cbrt(np.array(to_xyz) @ linear / [0.95047, 1.0, 1.08883])
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("deficiency", [None, *DEFICIENCIES])
@pytest.mark.parametrize("amplitude", [0.5, 1.0])
def test_colors_differ_for_every_eye(deficiency, amplitude):
    contracted, rest, expanded = (
        lab(palette.SAFE.color(level), deficiency) for level in (-amplitude, 0.0, amplitude)
    )
    for one, other in ((contracted, rest), (rest, expanded), (contracted, expanded)):
        assert np.linalg.norm(one - other) > 23  # ten times what is just noticeable


@pytest.mark.parametrize("scale", palette.SCALES.values())
def test_colors_change_steadily_and_stop_at_the_ends(scale):
    light = [lab(scale.color(level))[0] for level in np.linspace(-1, 1, 21)]
    assert np.all(np.diff(light[:11]) > 0)
    assert np.all(np.diff(light[10:]) < 0)
    assert scale.color(-3.0) == scale.contracted
    assert scale.color(3.0) == scale.expanded


def test_broken_voxels_are_hatched():
    poses = duo()
    camera = follow([Frame(poses)], FLAT, 400)[0]

    def dark(broken):
        frame = Frame(poses, actuation=[0.5, 0.5], broken=broken)
        image = np.asarray(draw_frame(frame, FLAT, camera=camera, legend=False).image())
        x, y = camera.to_pixels(np.array([20.0, 6.5])).astype(int)
        return int((image[y - 15 : y + 15, x - 15 : x + 15].sum(axis=-1) < 150).sum())

    assert dark(None) == dark([False, True]) == 0
    assert dark([True, False]) > 40


def test_a_ray_that_hits_is_marked():
    ray = np.array([[[23.0, 8.0], [31.0, 10.0]]])
    camera = Camera((24.0, 8.0), 20.0, (480, 300))
    for hits, marked in (([True], True), ([False], False), (None, False)):
        frame = Frame(voxels([[20.0, 6.5]]), rays=ray, hits=hits)
        image = draw_frame(frame, FLAT, camera=camera, legend=False).image()
        near = np.asarray(image)[104:117, 373:388].reshape(-1, 3)  # around (31, 10)
        assert (near == palette.HIT).all(axis=-1).any() == marked


def test_a_caption_is_readable_on_the_ground():
    cliff = Terrain.from_profile([0, 19, 21, 60], [30, 30, 2, 2])
    frame = Frame(voxels([[25.0, 4.0]]))
    camera = Camera((25.0, 9.0), 20.0, (480, 300))
    behind = {}
    for caption in ("", "x" * 8):
        image = draw_frame(frame, cliff, camera=camera, caption=caption).image()
        behind[caption] = np.asarray(image)[39:46, 14:50].reshape(-1, 3).max(axis=0)
    assert tuple(behind[""]) == palette.GROUND
    assert (behind["x" * 8] > 230).all()
