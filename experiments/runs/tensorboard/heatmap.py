"""Pictures of matrices, for TensorBoard: orange is negative, blue positive, pale zero."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from physics.render import palette

__all__ = ["heat_map"]

_WIDTH, _HEIGHT = 640, 360  # that a picture comes close to [pixels]
_LARGEST = 24  # side of a square [pixels]
_BAND, _TEXT = 18, 12  # height of the caption and of its letters [pixels]
_SHADES = 255
_FAILED: palette.Color = (120, 120, 120)


def heat_map(
    values: np.ndarray, caption: str = "", *, reach: float | None = None, course: bool = False
) -> Image.Image:
    """Draw a matrix, a rectangle for each number, the first row on top.

    Args:
        values: shape (rows, columns); what is not finite is grey.
        caption: written below, with the reach of the colours.
        reach: the number that has the full colour; by default the largest size there is.
        course: whether the columns are instants; else the rectangles are squares.
    """
    finite = np.where(np.isfinite(values), values, 0.0)
    if reach is None:
        reach = float(np.abs(finite).max(initial=0.0))
    levels = np.clip(finite / reach if reach > 0 else finite, -1, 1)
    shades = [palette.SAFE.color(level) for level in np.linspace(-1, 1, _SHADES).tolist()]
    places = ((levels + 1) / 2 * (_SHADES - 1)).round().astype(int)
    pixels = np.array(shades, dtype=np.uint8)[places]
    pixels[~np.isfinite(values)] = _FAILED
    rows, columns = values.shape
    width, height = max(1, _WIDTH // columns), max(1, _HEIGHT // rows)
    if not course:
        width = height = min(width, height, _LARGEST)
    size = (columns * width, rows * height)
    matrix = Image.fromarray(pixels).resize(size, Image.Resampling.NEAREST)
    words = f"{caption}; full colour: ±{reach:.3g}"
    font = ImageFont.load_default(_TEXT)
    page_width = max(size[0], round(font.getlength(words)) + 4)
    page = Image.new("RGB", (page_width, size[1] + _BAND), palette.PAGE)
    page.paste(matrix, (0, 0))
    ImageDraw.Draw(page).text((2, size[1] + 3), words, palette.INK, font=font)
    return page
