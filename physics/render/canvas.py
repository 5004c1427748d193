"""What pictures are drawn on: pixels (PNG, films) or vectors (SVG, PDF)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Protocol

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from physics.render.palette import Color

_FINE_WIDTH = 800  # up to this width [pixels] shapes are drawn three times larger, beyond it twice
_BACKING = 0.78  # opacity of what lies behind a caption


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
class Text:
    """Words on a picture.

    Attributes:
        position: The position of the anchor [pixels].
        words: The words, in one line.
        size: height of the font [pixels].
        color: The colour of the letters.
        anchor: as in Pillow: l, m or r, then t, m or b.
        backed: whether a pale box behind them keeps them readable on anything.
    """

    position: tuple[float, float]
    words: str
    size: float
    color: Color
    anchor: str = "lt"
    backed: bool = False


class Canvas(Protocol):
    """A picture in the making. Points are (K, 2) in pixels, y down."""

    size: tuple[int, int]

    def polygon(self, points: np.ndarray, fill: Color) -> None:
        """Fill a polygon."""

    def line(self, points: np.ndarray, color: Color, width: float) -> None:
        """Draw a line of a width [pixels]."""

    def text(self, text: Text) -> None:
        """Write on top of all shapes."""

    def inset(self, left: int, top: int, size: tuple[int, int], background: Color) -> Canvas:
        """A canvas of its own within this one; what leaves it is cut off."""


@cache
def _font(size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


def text_width(words: str, size: float) -> float:
    """Width of a text on one line [pixels]."""
    return float(_font(size).getlength(words))


class Pixels:
    """A canvas of antialiased pixels. Text is set last, on the finished picture: glyphs rendered
    at their own size are crisper than averaged ones."""

    def __init__(self, size: tuple[int, int], background: Color) -> None:
        self.size = size
        self._factor = 3 if size[0] <= _FINE_WIDTH else 2
        fine = (size[0] * self._factor, size[1] * self._factor)
        self._image = Image.new("RGB", fine, background)
        self._draw = ImageDraw.Draw(self._image)
        self._texts: list[Text] = []
        self._insets: list[tuple[tuple[int, int], Pixels]] = []

    def polygon(self, points: np.ndarray, fill: Color) -> None:
        """See `Canvas`."""
        self._draw.polygon((points * self._factor).ravel().tolist(), fill=fill)

    def line(self, points: np.ndarray, color: Color, width: float) -> None:
        """See `Canvas`."""
        fine = max(1, round(width * self._factor))
        joint = "curve" if len(points) > 2 and fine > 2 else None
        self._draw.line((points * self._factor).ravel().tolist(), color, fine, joint)

    def text(self, text: Text) -> None:
        """See `Canvas`."""
        self._texts.append(text)

    def inset(self, left: int, top: int, size: tuple[int, int], background: Color) -> Pixels:
        """See `Canvas`."""
        inset = Pixels(size, background)
        self._insets.append(((left, top), inset))
        return inset

    def finish(self) -> Image.Image:
        """The picture, RGB, of the canvas's size."""
        image = self._image.reduce(self._factor)
        for place, inset in self._insets:
            image.paste(inset.finish(), place)
        draw = ImageDraw.Draw(image)
        for text in self._texts:
            font = _font(text.size)
            if text.backed and text.words:
                box = draw.textbbox(text.position, text.words, font=font, anchor=text.anchor)
                _brighten(image, box, 0.25 * text.size)
            draw.text(text.position, text.words, text.color, font=font, anchor=text.anchor)
        return image


def _brighten(image: Image.Image, box: tuple[float, float, float, float], pad: float) -> None:
    """Fade a part of a picture to white."""
    left, top = (max(0, round(edge - pad)) for edge in box[:2])
    right = min(image.width, round(box[2] + pad))
    bottom = min(image.height, round(box[3] + pad))
    if left < right and top < bottom:
        part = image.crop((left, top, right, bottom))
        white = Image.new("RGB", part.size, (255, 255, 255))
        image.paste(Image.blend(part, white, _BACKING), (left, top))
