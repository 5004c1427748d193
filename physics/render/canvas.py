"""A picture of a piece of the world: metres in, antialiased pixels out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from physics.render.palette import Color

_SUPERSAMPLING = 3  # shapes are drawn this many times larger, then averaged


@dataclass(frozen=True)
class Camera:
    """The window through which the world is seen.

    Attributes:
        center: x, y of the middle of the picture [m].
        scale: size of a metre [pixels].
        size: width, height of the picture [pixels].
    """

    center: tuple[float, float]
    scale: float
    size: tuple[int, int]

    @property
    def x_range(self) -> tuple[float, float]:
        """Left and right end of the view [m]."""
        half = self.size[0] / (2 * self.scale)
        return self.center[0] - half, self.center[0] + half

    @property
    def y_range(self) -> tuple[float, float]:
        """Lower and upper end of the view [m]."""
        half = self.size[1] / (2 * self.scale)
        return self.center[1] - half, self.center[1] + half

    def to_pixels(self, points: np.ndarray) -> np.ndarray:
        """Pixel coordinates (..., 2), y down, of world points (..., 2) [m]."""
        offset = np.asarray(points, dtype=np.float64) - self.center
        return offset * (self.scale, -self.scale) + np.array(self.size) / 2


@dataclass(frozen=True)
class _Text:
    position: tuple[float, float]
    text: str
    size: float
    color: Color
    anchor: str


@cache
def _font(size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


def text_width(text: str, size: float) -> float:
    """Width of a text on one line [pixels]."""
    return float(_font(size).getlength(text))


class Canvas:
    """Draws shapes given in metres or pixels. Text is set last, on the finished picture: glyphs
    rendered at their own size are crisper than averaged ones."""

    def __init__(self, camera: Camera, background: Color) -> None:
        self.camera = camera
        width, height = camera.size
        size = (width * _SUPERSAMPLING, height * _SUPERSAMPLING)
        self._image = Image.new("RGB", size, background)
        self._draw = ImageDraw.Draw(self._image)
        self._texts: list[_Text] = []

    def polygon(self, points: np.ndarray, fill: Color) -> None:
        """Fill the polygon with corners ``points`` (K, 2) [m]."""
        self._draw.polygon(self._fine(self.camera.to_pixels(points)), fill=fill)

    def line(self, points: np.ndarray, color: Color, width: float, closed: bool = False) -> None:
        """Draw a line through ``points`` (K, 2) [m], ``width`` pixels wide."""
        points = np.asarray(points, dtype=np.float64)
        if closed:  # going on to the second point joins the last corner too
            points = np.concatenate([points, points[:2]])
        self._line(self.camera.to_pixels(points), color, width)

    def pixel_line(self, points: np.ndarray, color: Color, width: float) -> None:
        """Draw a line through ``points`` (K, 2) [pixels], ``width`` pixels wide."""
        self._line(np.asarray(points, dtype=np.float64), color, width)

    def pixel_box(self, box: tuple[float, float, float, float], fill: Color) -> None:
        """Fill the box (left, top, right, bottom) [pixels]."""
        left, top, right, bottom = (round(edge * _SUPERSAMPLING) for edge in box)
        self._draw.rectangle((left, top, right - 1, bottom - 1), fill=fill)

    def text(
        self, position: tuple[float, float], text: str, size: float, color: Color, anchor: str
    ) -> None:
        """Write ``text`` at a position [pixels]; ``anchor`` as in Pillow, such as "lt"."""
        self._texts.append(_Text(position, text, size, color, anchor))

    def finish(self) -> Image.Image:
        """The picture, RGB, of the camera's size."""
        image = self._image.reduce(_SUPERSAMPLING)
        draw = ImageDraw.Draw(image)
        for item in self._texts:
            draw.text(
                item.position, item.text, item.color, font=_font(item.size), anchor=item.anchor
            )
        return image

    def _line(self, pixels: np.ndarray, color: Color, width: float) -> None:
        self._draw.line(
            self._fine(pixels),
            fill=color,
            width=max(1, round(width * _SUPERSAMPLING)),
            joint="curve",
        )

    @staticmethod
    def _fine(pixels: np.ndarray) -> list[tuple[float, float]]:
        return [(x * _SUPERSAMPLING, y * _SUPERSAMPLING) for x, y in pixels.tolist()]
