"""Pictures are checked at pixels whose place in the world, and so whose colour, is known."""

import numpy as np
import pytest

from physics.render import palette
from physics.render.canvas import Camera
from physics.render.draw import (
    beside,
    draw_frame,
    draw_overlay,
    draw_strip,
    stack,
)
from physics.render.frame import Frame, follow
from physics.scene.terrain import Terrain
from tests.physics.render.robots import FLAT, duo, pixel, plain, voxels

# --- one picture --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("actuation", "color"),
    [(1.0, palette.SAFE.contracted), (0.0, palette.SAFE.rest), (-1.0, palette.SAFE.expanded)],
)
def test_voxels_are_filled_by_color(actuation, color):
    frame = Frame(duo(), actuation=[actuation, 0.0])
    camera = follow([frame], FLAT, 400)[0]
    image = draw_frame(frame, FLAT, camera=camera).image()
    assert pixel(image, camera, (20, 6.5)) == color  # between the squares
    assert pixel(image, camera, (23, 6.5)) == palette.SAFE.rest
    on_a_square = pixel(image, camera, (20 - 0.9, 6.5 + 0.9))
    assert on_a_square == palette.mix(color, palette.SHADE, 0.1)


def test_ground_is_filled_up_to_its_profile():
    hills = Terrain.from_profile([0, 18, 24, 60], [2, 2, 8, 8])
    frame = Frame(voxels([[21.0, 12.0]]))
    camera = Camera((21.0, 6.0), 12.0, (360, 240))
    image = draw_frame(frame, hills, camera=camera, legend=False).image()
    for x, height in [(12.5, 2.0), (21.0, 5.0), (28.5, 8.0)]:
        assert pixel(image, camera, (x, height - 0.5)) == palette.GROUND
        assert pixel(image, camera, (x, height + 0.5)) == palette.SKY


def test_without_terrain_there_is_no_ground():
    image = draw_frame(Frame(voxels([[0.0, 0.0]])), width=300).image()
    assert palette.GROUND not in {color for _, color in image.getcolors(1 << 20)}


def test_rays_run_from_start_to_end():
    ray = np.array([[23.0, 8.0], [31.0, 10.0]])
    frame = Frame(voxels([[20.0, 6.5]]), rays=ray[None])
    camera = Camera((24.0, 8.0), 20.0, (480, 300))
    with_rays = np.asarray(draw_frame(frame, FLAT, camera=camera).image()).astype(int)
    without = np.asarray(draw_frame(Frame(frame.poses), FLAT, camera=camera).image()).astype(int)
    changed = np.argwhere(np.abs(with_rays - without).sum(axis=-1) > 200)[:, ::-1]
    start, end = camera.to_pixels(ray)
    along = (changed - start) @ (end - start) / ((end - start) @ (end - start))
    assert -0.01 < along.min() < 0.02
    assert 0.98 < along.max() < 1.01
    off_line = (changed - start) - along[:, None] * (end - start)
    assert np.abs(off_line).max() < 1.5


def test_ruler_has_a_tick_every_metre_where_the_metres_are():
    camera = Camera((20.0, 8.0), 24.0, (480, 300))
    picture = draw_frame(Frame(voxels([[20.0, 6.5]])), FLAT, camera=camera)
    image = np.asarray(picture.image()).astype(int)
    band = np.flatnonzero((image == palette.RULER).all(axis=-1).mean(axis=1) > 0.5)
    ticks = np.flatnonzero(image[band[0] + 1].sum(axis=-1) > sum(palette.RULER) + 60)
    centers = [group.mean() for group in np.split(ticks, np.flatnonzero(np.diff(ticks) > 1) + 1)]
    metres = [20 + (center + 0.5 - 240) / 24 for center in centers]
    expected = range(round(metres[0]), round(metres[0]) + len(metres))
    assert metres == pytest.approx(list(expected), abs=0.05)
    assert len(metres) >= 19


def test_edges_are_smooth():
    image = draw_frame(Frame(voxels([[20.0, 7.0]], angle=0.3)), FLAT, width=300).image()
    assert len(image.getcolors(1 << 20)) > 100  # a picture without blends has a dozen colours


# --- several instants ---------------------------------------------------------------------------


def test_strip_shows_the_instants_in_reading_order():
    levels = [1.0, 0.0, -1.0, 0.5, -0.5, 0.25]
    poses = duo()
    frames = [Frame(poses, float(t), actuation=[a, a]) for t, a in enumerate(levels)]
    strip = draw_strip(frames, FLAT, width=900).image()
    assert strip.width == 900
    found = []  # top left corner and colour of each panel's robot
    for frame in frames:
        color = palette.SAFE.color(float(frame.levels[0]))
        rows, columns = np.nonzero((np.asarray(strip) == color).all(axis=-1))
        found.append((int(rows.min()), int(columns.min())))
    assert found == sorted(found)
    per_row = sum(row == found[0][0] for row, _ in found)
    assert per_row > 1
    assert len(found) % per_row == 0


def test_overlay_shows_every_instant_in_its_place_the_last_in_full_color():
    frames = [Frame(voxels([[20.0 + 8 * i, 6.5]]), float(i), actuation=[1.0]) for i in range(3)]
    picture = np.asarray(draw_overlay(frames, FLAT, width=900).image()).astype(int)
    full = (picture == palette.SAFE.contracted).all(axis=-1)
    first = (picture == palette.mix(palette.SAFE.contracted, palette.SKY, 0.4)).all(axis=-1)
    columns = [float(np.nonzero(mask)[1].mean()) for mask in (first, full)]
    robots_left, robots_right = 20 - 1.5, 36 + 1.5  # the view ends 2 m further out
    scale = 900 / (robots_right - robots_left + 4)
    assert (columns[1] - columns[0]) / scale == pytest.approx(16, abs=0.1)


def test_stack_keeps_the_pictures_whole():
    red, blue = plain(90, 20, (255, 0, 0)), plain(90, 30, (0, 0, 255))
    page = np.asarray(stack({"one": red, "two": blue}).image())
    assert (page == (255, 0, 0)).all(axis=-1).sum() == 90 * 20
    assert (page[-30:] == (0, 0, 255)).all()


def test_pictures_beside_each_other_fill_rows():
    colors = [(255, 0, 0), (0, 255, 0), (0, 0, 255)]
    page = beside([plain(20, 10, color).image() for color in colors], columns=2)
    assert page.size == (40, 20)
    assert [page.getpixel(at) for at in ((5, 5), (25, 5), (5, 15))] == colors
