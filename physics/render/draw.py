"""Pictures of robots, drawn from plain arrays: single frames, strips and the frames of a film.

The outlines of the voxels are filled with the colour of their level (see ``palette``), with
their rigid squares inside, over the ground and a ruler in metres. No simulator is needed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image

from physics.render import paint, palette
from physics.render.canvas import Camera, Canvas, Pixels, Text, text_width
from physics.render.frame import Frame, check_view, follow
from physics.render.vector import Vectors
from physics.scene.terrain import Terrain

__all__ = [
    "Frame",
    "Picture",
    "beside",
    "draw_film",
    "draw_frame",
    "draw_overlay",
    "draw_strip",
    "stack",
]

_GUTTER = 6  # between the panels of a strip [pixels]
_STRIP_ASPECT = 3.0  # width : height that a strip comes close to
_FADE = 0.6  # share of the sky in the first robot of a journey, if there are many
_OVERLAY_ASPECT = 4.0  # the same, at least, of what is seen of a short journey


@dataclass(frozen=True)
class Picture:
    """A picture that can be had in pixels or as vectors.

    Attributes:
        size: width and height [pixels].
        background: The colour of the background.
        paint: draws it on a canvas of this size.
    """

    size: tuple[int, int]
    background: palette.Color
    paint: Callable[[Canvas], None]

    def image(self) -> Image.Image:
        """It in pixels, RGB."""
        canvas = Pixels(self.size, self.background)
        self.paint(canvas)
        return canvas.finish()

    def vectors(self, suffix: str) -> bytes:
        """The content of a file with this suffix, ".svg" or ".pdf"."""
        canvas = Vectors(self.size, self.background)
        self.paint(canvas)
        return canvas.finish(suffix)

    def on(self, canvas: Canvas, left: int, top: int) -> None:
        """Paint it as a part of another picture."""
        self.paint(canvas.inset(left, top, self.size, self.background))


def draw_frame(
    frame: Frame,
    terrain: Terrain | None = None,
    *,
    camera: Camera | None = None,
    width: int = 960,
    caption: str = "",
    legend: bool = True,
    scale: palette.Scale = palette.SAFE,
) -> Picture:
    """Draw one instant.

    Args:
        frame: The robot at the instant to draw.
        terrain: the ground, or None.
        camera: the window to draw; default: one centred on the robot.
        width: width of the picture [pixels], if no camera is given.
        caption: lines under the time.
        legend: whether to explain the colours.
        scale: The scale of the colours.
    """
    view = camera or follow([frame], terrain, width)[0]

    def draw(canvas: Canvas) -> None:
        paint.world(canvas, view, terrain)
        paint.rays(canvas, view, frame)
        paint.robot(canvas, view, frame, scale)
        paint.ruler(canvas, view)
        size = paint.text_size(view)
        paint.caption(canvas, size, [_moment(frame), *caption.splitlines()])
        if legend:
            beside = text_width(_moment(frame), size) + paint.legend_width(0.85 * size) + 2 * size
            # Above the ruler where there is no room beside the time.
            middle = 1.2 * size if beside < view.size[0] else view.size[1] - 2.6 * size
            paint.legend(canvas, 0.85 * size, middle, scale)

    return Picture(view.size, palette.SKY, draw)


def draw_film(
    frames: Sequence[Frame],
    terrain: Terrain | None = None,
    *,
    width: int = 960,
    caption: str = "",
    scale: palette.Scale = palette.SAFE,
    legend: bool = True,
) -> Iterator[Image.Image]:
    """Draw the frames one by one, with a camera that follows the robot; see `draw_frame`."""
    for frame, camera in zip(frames, follow(frames, terrain, width), strict=True):
        picture = draw_frame(
            frame, terrain, camera=camera, caption=caption, legend=legend, scale=scale
        )
        yield picture.image()


def draw_strip(
    frames: Sequence[Frame],
    terrain: Terrain | None = None,
    *,
    width: int = 1800,
    scale: palette.Scale = palette.SAFE,
) -> Picture:
    """Draw instants side by side, in reading order, all at the same scale."""
    shape = follow(frames, terrain, 1000, room=1.3, smooth=False)[0].size
    columns = _strip_columns(len(frames), shape[0] / shape[1])
    panel = (width - (columns - 1) * _GUTTER) // columns
    cameras = follow(frames, terrain, panel, room=1.3, smooth=False)
    panels = [
        draw_frame(frame, terrain, camera=camera, legend=False, scale=scale)
        for frame, camera in zip(frames, cameras, strict=True)
    ]
    across, down = (length + _GUTTER for length in panels[0].size)
    rows = math.ceil(len(frames) / columns)

    def draw(canvas: Canvas) -> None:
        for i, each in enumerate(panels):
            each.on(canvas, i % columns * across, i // columns * down)

    return Picture((width, rows * down - _GUTTER), palette.PAGE, draw)


def draw_overlay(
    frames: Sequence[Frame],
    terrain: Terrain | None = None,
    *,
    width: int = 1800,
    scale: palette.Scale = palette.SAFE,
) -> Picture:
    """Draw instants of a journey in one picture, over a common ground, the earlier the paler."""
    check_view(frames, width)
    camera = _wide_camera(frames, terrain, width)
    size = paint.text_size(camera)
    tops = [(frame.bounds[:, 0].mean(), frame.bounds[1, 1]) for frame in frames]
    places = camera.to_pixels(np.array(tops)).tolist()

    def draw(canvas: Canvas) -> None:
        paint.world(canvas, camera, terrain)
        for i, frame in enumerate(frames):
            paint.robot(canvas, camera, frame, scale, fade=_FADE * (1 - (i + 1) / len(frames)))
        for i, (frame, (x, y)) in enumerate(zip(frames, places, strict=True)):
            label = f"{frame.time:.1f} s"
            room = 1.2 * text_width(label, size)
            if all(abs(x - later) > room for later, _ in places[i + 1 :]):
                place = (x, y - 0.5 * size)
                canvas.text(Text(place, label, size, palette.INK, "mb", backed=True))
        paint.ruler(canvas, camera)

    return Picture(camera.size, palette.SKY, draw)


def stack(pictures: Mapping[str, Picture], scale: palette.Scale = palette.SAFE) -> Picture:
    """One page with pictures of the same width one above the other, each under its title, and
    the scale of colours.

    Raises:
        ValueError: there is no picture, or their widths differ.
    """
    widths = {picture.size[0] for picture in pictures.values()}
    if len(widths) != 1:
        raise ValueError(f"pictures: expected one width, got {sorted(widths) or 'no picture'}")
    (width,) = widths
    band = round(width / 45)  # height of a title
    height = sum(picture.size[1] + band for picture in pictures.values())

    def draw(canvas: Canvas) -> None:
        top = 0
        for title, picture in pictures.items():
            place = (band * 0.3, top + band * 0.5)
            canvas.text(Text(place, title, band * 0.6, palette.INK, "lm"))
            picture.on(canvas, 0, top + band)
            top += band + picture.size[1]
        paint.legend(canvas, 0.6 * band, 0.5 * band, scale)

    return Picture((width, height), palette.PAGE, draw)


def beside(images: Sequence[Image.Image], columns: int) -> Image.Image:
    """One picture of several of the same width, in rows of so many; the lower ones end with paper.

    Raises:
        ValueError: there is none.
    """
    if not images:
        raise ValueError("images: expected at least one, got none")
    width = max(image.width for image in images)
    height = max(image.height for image in images)
    columns = min(columns, len(images))
    rows = math.ceil(len(images) / columns)
    page = Image.new("RGB", (columns * width, rows * height), palette.PAGE)
    for i, image in enumerate(images):
        page.paste(image, (i % columns * width, i // columns * height))
    return page


def _moment(frame: Frame) -> str:
    """The time, and what is broken by then."""
    damage = f", damage: {frame.n_broken} of {len(frame.poses)} voxels broken"
    return f"t = {frame.time:.2f} s" + (damage if frame.n_broken else "")


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
