"""Geometry of one instant of a robot, and the window of the world that follows it."""

import numpy as np
import pytest

from physics.render.frame import Frame, follow
from physics.scene.material import crossed_diagonals
from tests.physics.render.robots import FLAT, duo, travel, voxels

# --- geometry -----------------------------------------------------------------------------------


@pytest.mark.parametrize("gap", [-0.1, 0.0, 0.2])
def test_outline_goes_through_the_outer_corners_whatever_the_rotation(gap):
    frame = Frame(voxels([[20.0, 7.0]], gap, angle=0.7))
    side = 3 + 2 * gap  # closed form: the outer corners are a square of this side
    assert crossed_diagonals(*frame.outlines.T) == pytest.approx([-2 * side**2])  # clockwise
    assert np.linalg.norm(frame.outlines[0] - [20, 7], axis=-1) == pytest.approx(side / np.sqrt(2))


def test_outline_follows_each_squares_own_rotation():
    poses = voxels([[0.0, 0.0]])
    poses[0, 1, 2] = np.pi / 4  # NE square: its own NE corner now points up
    expected = [[-1.5, 1.5], [0.9, 0.9 + 0.6 * np.sqrt(2)], [1.5, -1.5], [-1.5, -1.5]]
    assert Frame(poses).outlines[0] == pytest.approx(np.array(expected))


def test_level_is_the_area_ratio_unless_actuation_is_given():
    poses = np.concatenate([voxels([[0, 0]], gap=-0.1), voxels([[9, 0]], gap=0.1)])
    ratios = np.array([2.8**2 / 9, 3.2**2 / 9])
    assert Frame(poses).levels == pytest.approx((ratios - 1) / 0.225)
    assert Frame(poses, actuation=[-0.5, 1.0]).levels == pytest.approx([0.5, -1.0])  # +1 contracts


# --- camera -------------------------------------------------------------------------------------


@pytest.mark.parametrize("terrain", [None, FLAT])
def test_camera_keeps_a_leaping_robot_in_view_at_one_scale(terrain):
    frames = travel(40, speed=25.0, jump=12.0)
    cameras = follow(frames, terrain, 320)
    assert len({(camera.scale, camera.size) for camera in cameras}) == 1
    for frame, camera in zip(frames, cameras, strict=True):
        corners = camera.to_pixels(frame.bounds)
        assert (corners > 0).all()
        assert (corners < camera.size).all()


def test_camera_glides():
    frames = [Frame(duo(20 + 0.5 * (i % 2)), i / 20) for i in range(40)]  # shaking by 0.5 m
    centers = [camera.center[0] for camera in follow(frames, FLAT, 320)]
    assert np.abs(np.diff(centers)).max() < 0.03
    assert np.ptp([c.center[0] for c in follow(frames, FLAT, 320, smooth=False)]) == 0.5
