"""Pictures are checked at pixels whose place in the world, and so whose colour, is known."""

import subprocess
import sys
import weakref
from xml.etree import ElementTree

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image, ImageSequence

from physics.render import palette
from physics.render.canvas import Camera
from physics.render.draw import (
    Picture,
    beside,
    draw_film,
    draw_frame,
    draw_overlay,
    draw_strip,
    stack,
)
from physics.render.frame import Frame, follow
from physics.render.movie import write_gif, write_mp4, write_png, write_still
from physics.scene.material import crossed_diagonals
from physics.scene.terrain import Terrain

FLAT = Terrain.from_profile([0, 10, 1990, 2000], [100, 5, 5, 100])


def voxels(centers, gap=0.0, angle=0.0):
    """Square poses (V, 4, 3) of voxels whose squares are moved outward by ``gap`` along x and y
    and which are turned as a whole by ``angle`` about their centres."""
    offsets = (0.9 + gap) * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]], dtype=float)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    positions = np.asarray(centers)[:, None] + offsets @ turn.T
    return np.concatenate([positions, np.full((*positions.shape[:2], 1), angle)], axis=-1)


def duo(x=20.0, y=6.5):
    """Two voxels side by side, the left one centred at x, y."""
    return voxels([[x, y], [x + 3, y]])


def pixel(image, camera, point):
    x, y = camera.to_pixels(np.array(point)).round().astype(int)
    return image.getpixel((int(x), int(y)))


def travel(n=20, speed=4.0, jump=0.0, rate=20.0):
    times = np.arange(n) / rate
    heights = 6.5 + jump * np.abs(np.sin(9 * times))
    return [
        Frame(duo(14 + speed * t, height), float(t))
        for t, height in zip(times, heights, strict=True)
    ]


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


# --- colours ------------------------------------------------------------------------------------


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


def plain(width, height, color):
    return Picture((width, height), color, lambda canvas: None)


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


# --- files --------------------------------------------------------------------------------------


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


# --- errors -------------------------------------------------------------------------------------

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
