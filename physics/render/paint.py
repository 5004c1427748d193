"""Paints the parts of a picture on a canvas: ground, robot, ruler, captions, scale of colours."""

from __future__ import annotations

import math

import numpy as np

from physics.render import palette
from physics.render.canvas import Camera, Canvas, Text, text_width
from physics.render.frame import Frame, square_corners
from physics.scene.terrain import Terrain

__all__ = [
    "caption",
    "legend",
    "legend_width",
    "line_width",
    "rays",
    "robot",
    "ruler",
    "text_size",
    "world",
]

_TICK_STEPS = (1, 2, 5, 10, 20, 50, 100, 200, 500)  # between labels of the ruler [m]
_EDGE, _THIN_EDGE = 0.08, 0.035  # of voxels and of their squares [m]
_HATCH = np.array([0.3, 0.65, 1.0, 1.35, 1.7])  # where lines of the hatch cross a voxel's sides
_CELLS = 9  # of the scale of colours
_HIT = 0.22  # half the diagonal of the mark where a ray ends on something [m]


def world(canvas: Canvas, camera: Camera, terrain: Terrain | None) -> None:
    """Paint a line every few metres, and the ground."""
    (left, right), (bottom, top) = camera.x_range, camera.y_range
    for x in _ticks(camera)[0]:
        canvas.line(camera.to_pixels(np.array([[x, bottom], [x, top]])), palette.GRID, 1.0)
    if terrain is None:
        return
    xs = np.concatenate(
        ([left - 1], terrain.xs[(terrain.xs > left - 1) & (terrain.xs < right + 1)], [right + 1])
    )
    surface = np.stack([xs, terrain.height(xs)], axis=-1)
    base = min(bottom, float(surface[:, 1].min())) - 1
    ground = np.concatenate([surface, [[right + 1, base], [left - 1, base]]])
    canvas.polygon(camera.to_pixels(ground), palette.GROUND)
    canvas.line(camera.to_pixels(surface), palette.GROUND_LINE, line_width(camera, 0.09))


def robot(
    canvas: Canvas, camera: Camera, frame: Frame, scale: palette.Scale, fade: float = 0.0
) -> None:
    """Paint the voxels by their level, with their squares; broken ones are hatched.

    Args:
        canvas: The canvas to paint on.
        camera: The window of the world that is seen.
        frame: The robot at the instant to draw.
        scale: The scale of the colours.
        fade: share of the sky's colour in all colours, for an earlier instant.
    """

    def faded(color: palette.Color) -> palette.Color:
        return palette.mix(color, palette.SKY, fade)

    outlines = camera.to_pixels(frame.outlines)
    squares = camera.to_pixels(square_corners(frame.poses))
    inner_outlines = _shrunk(outlines, line_width(camera, _EDGE))
    inner_squares = _shrunk(squares, line_width(camera, _THIN_EDGE))
    for v, level in enumerate(frame.levels.tolist()):
        fill = scale.color(level)
        canvas.polygon(outlines[v], faded(palette.mix(fill, palette.SHADE, 0.7)))
        canvas.polygon(inner_outlines[v], faded(fill))
        edge = faded(palette.mix(fill, palette.SHADE, 0.3))
        shade = faded(palette.mix(fill, palette.SHADE, 0.1))
        for square, inner in zip(squares[v], inner_squares[v], strict=True):
            canvas.polygon(square, edge)
            canvas.polygon(inner, shade)
        if frame.broken is not None and frame.broken[v]:
            _hatch(canvas, inner_outlines[v], faded(palette.HATCH), line_width(camera, 0.13))


def rays(canvas: Canvas, camera: Camera, frame: Frame) -> None:
    """Paint what the lidars see: their rays, with a mark where one ends on something."""
    if frame.rays is None:
        return
    hits = np.zeros(len(frame.rays), dtype=bool) if frame.hits is None else frame.hits
    corners = _HIT * np.array([[0, 1], [1, 0], [0, -1], [-1, 0]])
    for ray, hit in zip(frame.rays, hits.tolist(), strict=True):
        canvas.line(camera.to_pixels(ray), palette.RAY, line_width(camera, 0.04))
        if hit:
            canvas.polygon(camera.to_pixels(ray[1] + corners), palette.HIT)


def ruler(canvas: Canvas, camera: Camera) -> None:
    """Paint a band at the bottom with a tick every metre and labels."""
    width, height = camera.size
    size = 0.85 * text_size(camera)
    top = height - 1.9 * size
    band = np.array([[0, top], [width, top], [width, height], [0, height]])
    canvas.polygon(band, palette.RULER)
    labelled, others = _ticks(camera)
    for ticks, length in ((others, 0.3), (labelled, 0.5)):
        for x in ticks:
            px = float(camera.to_pixels(np.array([x, 0.0]))[0])
            line = np.array([[px, top], [px, top + length * size]])
            canvas.line(line, palette.RULER_TICK, 1.0)
    for x in labelled:
        px = float(camera.to_pixels(np.array([x, 0.0]))[0])
        if size * 1.5 < px < width - size * 1.5:  # whole labels only
            place = (px, top + 0.65 * size)
            canvas.text(Text(place, f"{x} m", size, palette.RULER_TEXT, "mt"))


def caption(canvas: Canvas, size: float, lines: list[str]) -> None:
    """Write lines at the upper left, the first one larger, on a backing."""
    top = 0.8 * size
    for i, line in enumerate(lines):
        own = size if i == 0 else 0.78 * size
        canvas.text(Text((0.8 * size, top), line, own, palette.INK, "lt", backed=True))
        top += 1.5 * own


def legend(canvas: Canvas, size: float, middle: float, scale: palette.Scale) -> None:
    """Paint the scale of colours at the right, around the height ``middle`` [pixels]."""
    cell, gap = 0.9 * size, 0.4 * size
    right = canvas.size[0] - size - text_width("expands", size)
    left = right - gap - _CELLS * cell
    for place, word, anchor in ((left - gap, "contracts", "rm"), (right, "expands", "lm")):
        text = Text((place, middle), word, size, palette.FAINT_INK, anchor, backed=True)
        canvas.text(text)
    low, high = middle - 0.4 * size, middle + 0.4 * size
    for i, level in enumerate(np.linspace(-1, 1, _CELLS).tolist()):
        x = left + i * cell
        box = np.array([[x, low], [x + cell, low], [x + cell, high], [x, high]])
        canvas.polygon(box, scale.color(level))


def legend_width(size: float) -> float:
    """Width of the scale of colours with its words [pixels], for letters of a size."""
    return text_width("contracts", size) + text_width("expands", size) + (0.9 * _CELLS + 1.8) * size


def text_size(camera: Camera) -> float:
    """Height of the letters that suit a picture [pixels]."""
    return 9.0 + 0.0135 * min(camera.size[0], 2 * camera.size[1])


def line_width(camera: Camera, metres: float) -> float:
    """Width of a line [pixels] that is so wide in the world, within what looks well."""
    return float(np.clip(metres * camera.scale, 1.0, 3.0))


def _shrunk(quads: np.ndarray, border: float) -> np.ndarray:
    """Quadrilaterals (..., 4, 2) without a border [pixels]: drawn over the whole ones, they leave
    an edge, several times faster than lines."""
    centers = quads.mean(axis=-2, keepdims=True)
    sides = np.linalg.norm(quads - np.roll(quads, 1, axis=-2), axis=-1).mean(axis=-1)
    share = np.clip(1.0 - 2.0 * border / np.maximum(sides, 1e-9), 0.0, 1.0)
    shrunk: np.ndarray = centers + share[..., None, None] * (quads - centers)
    return shrunk


def _hatch(canvas: Canvas, outline: np.ndarray, color: palette.Color, width: float) -> None:
    """Paint slanted lines across a voxel with corners (4, 2) NW, NE, SE, SW [pixels]."""
    nw, ne, se, sw = outline
    for total in _HATCH.tolist():  # lines on which the shares of the way right and down add up
        ends = []
        for right in (max(0.0, total - 1.0), min(1.0, total)):
            down = total - right
            upper, lower = nw + right * (ne - nw), sw + right * (se - sw)
            ends.append(upper + down * (lower - upper))
        canvas.line(np.array(ends), color, width)


def _ticks(camera: Camera) -> tuple[list[int], list[int]]:
    """Abscissas in view [m] of the labelled ticks of the ruler, and of the others."""
    left, right = camera.x_range
    spacing = 5 * text_size(camera) / camera.scale  # least distance of two labels [m]
    step = next((s for s in _TICK_STEPS if s >= spacing), _TICK_STEPS[-1])
    minor = 1 if camera.scale >= 6 else step
    ticks = range(math.ceil(left / minor) * minor, math.floor(right) + 1, minor)
    return [x for x in ticks if x % step == 0], [x for x in ticks if x % step]
