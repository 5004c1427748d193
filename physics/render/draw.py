"""Pictures of robots, drawn from plain arrays: single frames, strips and the frames of a film.

The outlines of the voxels are filled with the colour of their state (see ``palette``), with
their rigid squares inside, over the ground and a ruler in metres. No simulator is needed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from PIL import Image

from physics.render import palette
from physics.render.canvas import Camera, Canvas, text_width
from physics.render.frame import Frame, check_view, follow, square_corners
from physics.scene.terrain import Terrain

__all__ = ["Frame", "draw_film", "draw_frame", "draw_overlay", "draw_strip", "stack"]

_TICK_STEPS = (1, 2, 5, 10, 20, 50, 100, 200, 500)  # between labels of the ruler [m]
_GUTTER = 6  # between the panels of a strip [pixels]
_STRIP_ASPECT = 3.0  # width : height that a strip comes close to
_FADE = 0.6  # share of the sky in the first robot of a journey, if there are many
_OVERLAY_ASPECT = 4.0  # the same, at least, of what is seen of a short journey


def draw_frame(
    frame: Frame,
    terrain: Terrain | None = None,
    *,
    camera: Camera | None = None,
    width: int = 960,
    caption: str = "",
    legend: bool = True,
) -> Image.Image:
    """Draw one instant.

    Args:
        frame: the robot.
        terrain: the ground, or None.
        camera: the window to draw; default: one centred on the robot.
        width: width of the picture [pixels], if no camera is given.
        caption: text under the time.
        legend: whether to explain the colours.

    Returns:
        An RGB picture.
    """
    camera = camera or follow([frame], terrain, width)[0]
    canvas = Canvas(camera, palette.SKY)
    _draw_world(canvas, terrain)
    for ray in () if frame.rays is None else frame.rays:
        canvas.line(ray, palette.RAY, _line_width(camera, 0.04))
    _draw_robot(canvas, frame)
    _draw_ruler(canvas)
    size, pad = _text_size(camera), _text_size(camera) * 0.8
    canvas.text((pad, pad), f"t = {frame.time:.2f} s", size, palette.INK, "lt")
    canvas.text((pad, pad + 1.4 * size), caption, 0.7 * size, palette.INK, "lt")
    if legend:
        _draw_legend(canvas, 0.85 * size, pad + 0.4 * size)
    return canvas.finish()


def draw_film(
    frames: Sequence[Frame], terrain: Terrain | None = None, *, width: int = 960, caption: str = ""
) -> Iterator[Image.Image]:
    """Draw the frames one by one, with a camera that follows the robot."""
    for frame, camera in zip(frames, follow(frames, terrain, width), strict=True):
        yield draw_frame(frame, terrain, camera=camera, caption=caption)


def draw_strip(
    frames: Sequence[Frame], terrain: Terrain | None = None, *, width: int = 1800
) -> Image.Image:
    """Draw instants side by side, in reading order, all at the same scale."""
    shape = follow(frames, terrain, 1000, room=1.3, smooth=False)[0].size
    columns = _strip_columns(len(frames), shape[0] / shape[1])
    panel = (width - (columns - 1) * _GUTTER) // columns
    cameras = follow(frames, terrain, panel, room=1.3, smooth=False)
    panels = [
        draw_frame(frame, terrain, camera=camera, legend=False)
        for frame, camera in zip(frames, cameras, strict=True)
    ]
    across, down = (length + _GUTTER for length in panels[0].size)
    rows = math.ceil(len(frames) / columns)
    strip = Image.new("RGB", (width, rows * down - _GUTTER), palette.PAPER)
    for i, image in enumerate(panels):
        strip.paste(image, (i % columns * across, i // columns * down))
    return strip


def draw_overlay(
    frames: Sequence[Frame], terrain: Terrain | None = None, *, width: int = 1800
) -> Image.Image:
    """Draw instants of a journey in one picture, over a common ground, the earlier the paler."""
    check_view(frames, width)
    camera = _wide_camera(frames, terrain, width)
    canvas = Canvas(camera, palette.SKY)
    _draw_world(canvas, terrain)
    size = _text_size(camera)
    for i, frame in enumerate(frames):
        _draw_robot(canvas, frame, fade=_FADE * (1 - (i + 1) / len(frames)))
    tops = [(frame.bounds[:, 0].mean(), frame.bounds[1, 1]) for frame in frames]
    places = camera.to_pixels(np.array(tops)).tolist()
    for i, (frame, (x, y)) in enumerate(zip(frames, places, strict=True)):
        label = f"{frame.time:.1f} s"
        room = 1.2 * text_width(label, size)
        if all(abs(x - later) > room for later, _ in places[i + 1 :]):
            canvas.text((x, y - 0.5 * size), label, size, palette.INK, "mb")
    _draw_ruler(canvas)
    return canvas.finish()


def stack(pictures: Mapping[str, Image.Image]) -> Image.Image:
    """One page with pictures of the same width one above the other, each under its title, and
    the scale of colours.

    Raises:
        ValueError: there is no picture, or their widths differ.
    """
    widths = {image.width for image in pictures.values()}
    if len(widths) != 1:
        raise ValueError(f"pictures: expected one width, got {sorted(widths) or 'no picture'}")
    (width,) = widths
    band = round(width / 45)  # height of a title
    height = sum(image.height + band for image in pictures.values())
    page = Canvas(Camera((0.0, 0.0), 1.0, (width, height)), palette.PAPER)
    tops = []
    top = 0
    for title, image in pictures.items():
        page.text((band * 0.3, top + band * 0.5), title, band * 0.6, palette.INK, "lm")
        tops.append(top + band)
        top += band + image.height
    _draw_legend(page, 0.6 * band, 0.5 * band)
    result = page.finish()
    for top, image in zip(tops, pictures.values(), strict=True):
        result.paste(image, (0, top))
    return result


def _draw_world(canvas: Canvas, terrain: Terrain | None) -> None:
    camera = canvas.camera
    (left, right), (bottom, top) = camera.x_range, camera.y_range
    for x in _ticks(camera)[0]:
        canvas.line(np.array([[x, bottom], [x, top]]), palette.GRID, 1.0)
    if terrain is None:
        return
    xs = np.concatenate(
        ([left - 1], terrain.xs[(terrain.xs > left - 1) & (terrain.xs < right + 1)], [right + 1])
    )
    surface = np.stack([xs, terrain.height(xs)], axis=-1)
    base = min(bottom, float(surface[:, 1].min())) - 1
    ground = np.concatenate([surface, [[right + 1, base], [left - 1, base]]])
    canvas.polygon(ground, palette.GROUND)
    canvas.line(surface, palette.GROUND_LINE, _line_width(camera, 0.09))


def _draw_robot(canvas: Canvas, frame: Frame, fade: float = 0.0) -> None:
    """Draw the voxels and their squares, ``fade`` (0 to 1) of the way to the colour of the sky."""

    def faded(color: palette.Color) -> palette.Color:
        return palette.mix(color, palette.SKY, fade)

    camera = canvas.camera
    thin = _line_width(camera, 0.025)
    for outline, squares, level in zip(
        frame.outlines, square_corners(frame.poses), frame.levels.tolist(), strict=True
    ):
        fill = palette.level_color(level)
        shade = palette.mix(fill, palette.SHADE, 0.13)
        canvas.polygon(outline, faded(fill))
        for square in squares:
            canvas.polygon(square, faded(shade))
            canvas.line(square, faded(palette.mix(fill, palette.SHADE, 0.3)), thin, closed=True)
        edge = palette.mix(fill, palette.SHADE, 0.7)
        canvas.line(outline, faded(edge), _line_width(camera, 0.07), closed=True)


def _draw_ruler(canvas: Canvas) -> None:
    """Draw a band at the bottom with a tick every metre and labels."""
    camera = canvas.camera
    width, height = camera.size
    size = 0.85 * _text_size(camera)
    top = height - 1.9 * size
    canvas.pixel_box((0, top, width, height), palette.RULER)
    labelled, others = _ticks(camera)
    for ticks, length in ((others, 0.3), (labelled, 0.5)):
        for x in ticks:
            px = float(camera.to_pixels(np.array([x, 0.0]))[0])
            line = np.array([[px, top], [px, top + length * size]])
            canvas.pixel_line(line, palette.RULER_TICK, 1.0)
    for x in labelled:
        px = float(camera.to_pixels(np.array([x, 0.0]))[0])
        if size * 1.5 < px < width - size * 1.5:  # whole labels only
            canvas.text((px, top + 0.65 * size), f"{x} m", size, palette.RULER_TEXT, "mt")


def _draw_legend(canvas: Canvas, size: float, middle: float) -> None:
    """Draw the scale of colours at the right, around the height ``middle`` [pixels]."""
    cells, cell, gap = 9, 0.9 * size, 0.4 * size
    right = canvas.camera.size[0] - size - text_width("expanded", size)
    left = right - gap - cells * cell
    canvas.text((left - gap, middle), "contracted", size, palette.FAINT_INK, "rm")
    for i, level in enumerate(np.linspace(-1, 1, cells).tolist()):
        x = left + i * cell
        box = (x, middle - 0.4 * size, x + cell, middle + 0.4 * size)
        canvas.pixel_box(box, palette.level_color(level))
    canvas.text((right, middle), "expanded", size, palette.FAINT_INK, "lm")


def _ticks(camera: Camera) -> tuple[list[int], list[int]]:
    """Abscissas in view [m] of the labelled ticks of the ruler, and of the others."""
    left, right = camera.x_range
    spacing = 5 * _text_size(camera) / camera.scale  # least distance of two labels [m]
    step = next((s for s in _TICK_STEPS if s >= spacing), _TICK_STEPS[-1])
    minor = 1 if camera.scale >= 6 else step
    ticks = range(math.ceil(left / minor) * minor, math.floor(right) + 1, minor)
    return [x for x in ticks if x % step == 0], [x for x in ticks if x % step]


def _strip_columns(n: int, panel_aspect: float) -> int:
    """Columns that divide ``n`` panels into whole rows, nearest to the wanted aspect."""
    divisors = [c for c in range(1, n + 1) if n % c == 0]
    return min(divisors, key=lambda c: abs(math.log(c * c / n * panel_aspect / _STRIP_ASPECT)))


def _wide_camera(frames: Sequence[Frame], terrain: Terrain | None, width: int) -> Camera:
    """A window that holds all frames and the ground under them."""
    bounds = np.stack([frame.bounds for frame in frames])
    (left, low), (right, high) = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    if terrain is not None:
        low = min(low, terrain.height(np.linspace(left, right, 200)).min())
    widest = (bounds[:, 1, 0] - bounds[:, 0, 0]).max()
    view_width = max(right - left + 4, 3 * widest, _OVERLAY_ASPECT * (high - low))
    scale = width / view_width
    below, above = width / 30, width / 45  # for the ruler, for the times [pixels]
    height = 2 * math.ceil(((high - low) * scale + below + above) / 2)
    middle = (low + high + (above - below) / scale) / 2
    return Camera(((left + right) / 2, middle), scale, (width, height))


def _text_size(camera: Camera) -> float:
    return 9.0 + 0.0135 * min(camera.size[0], 2 * camera.size[1])


def _line_width(camera: Camera, metres: float) -> float:
    return float(np.clip(metres * camera.scale, 1.0, 3.0))
