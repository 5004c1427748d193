"""Picture files: PNG, GIF and MP4, written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from PIL import Image

__all__ = ["write_gif", "write_mp4", "write_png"]

_GIF_TICK = 100  # a GIF counts time in 1/100 s ...
_GIF_MAX_FPS = 50  # ... and viewers slow down frames of 1/100 s
_GIF_COLORS = 192  # few enough to compress well, enough for smooth edges
_PALETTE_SAMPLES = 12  # frames from which the shared palette is taken


def write_png(path: str | Path, image: Image.Image) -> None:
    """Write a picture as PNG.

    Raises:
        ValueError: the path does not end in ".png" or its folder does not exist.
    """
    with _whole_file(path, ".png") as part:
        image.save(part, optimize=True)


def write_gif(path: str | Path, images: Iterable[Image.Image], fps: float) -> None:
    """Write pictures as an animated GIF that loops, all with the same palette.

    Args:
        path: the file, "....gif".
        images: the frames, of one size.
        fps: frames per second, at most 50. Durations are whole 1/100 s that add up to the
            right time.

    Raises:
        ValueError: a wrong path (as in :func:`write_png`), no frame, or a rate out of range.
    """
    if not 0 < fps <= _GIF_MAX_FPS:
        raise ValueError(f"fps: expected a number in (0, {_GIF_MAX_FPS}] for a GIF, got {fps}")
    frames = _at_least_one(images)
    ends = [round(_GIF_TICK * i / fps) for i in range(len(frames) + 1)]
    durations = [(1000 // _GIF_TICK) * (b - a) for a, b in pairwise(ends)]
    shared = _shared_palette(frames)
    first, *others = (frame.quantize(palette=shared, dither=Image.Dither.NONE) for frame in frames)
    with _whole_file(path, ".gif") as part:
        first.save(part, save_all=True, append_images=others, duration=durations, loop=0)


def write_mp4(path: str | Path, images: Iterable[Image.Image], fps: float) -> None:
    """Write pictures as an MP4 (H.264) that common players and browsers show.

    Args:
        path: the file, "....mp4".
        images: the frames, of one size with an even width and height; drawn one at a time.
        fps: frames per second.

    Raises:
        ValueError: a wrong path (as in :func:`write_png`), no frame, a rate that is not
            positive, or an odd width or height.
    """
    if not fps > 0:
        raise ValueError(f"fps: expected a positive number, got {fps}")
    frames = iter(images)
    first = next(frames, None)
    if first is None:
        raise ValueError("images: expected at least one frame, got none")
    if first.width % 2 or first.height % 2:
        raise ValueError(f"images: expected an even width and height, got {first.size}")
    with _whole_file(path, ".mp4") as part:
        writer = imageio_ffmpeg.write_frames(
            str(part),
            first.size,
            fps=fps,
            codec="libx264",
            macro_block_size=2,
            ffmpeg_log_level="error",
            output_params=["-crf", "20", "-preset", "medium", "-movflags", "+faststart"],
        )
        writer.send(None)
        try:
            writer.send(np.asarray(first))
            for image in frames:
                writer.send(np.asarray(image))
        finally:
            writer.close()


def _shared_palette(frames: Sequence[Image.Image]) -> Image.Image:
    """A palette for all frames, from a sample of them.

    Colours count by the root of their area: else a large background would take most of the
    palette for its shades, and small things would lose their colour.
    """
    step = max(1, len(frames) // _PALETTE_SAMPLES)
    pixels = np.concatenate([np.asarray(frame).reshape(-1, 3) for frame in frames[::step]])
    packed = pixels.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], dtype=np.uint32)
    colors, counts = np.unique(packed, return_counts=True)
    weighted = np.repeat(colors, np.ceil(np.sqrt(counts)).astype(int))
    channels = np.stack([weighted >> 16, weighted >> 8 & 255, weighted & 255], axis=-1)
    sample = Image.fromarray(channels.astype(np.uint8)[None])
    return sample.quantize(_GIF_COLORS, method=Image.Quantize.MEDIANCUT, kmeans=1)


def _at_least_one(images: Iterable[Image.Image]) -> list[Image.Image]:
    frames = list(images)
    if not frames:
        raise ValueError("images: expected at least one frame, got none")
    return frames


@contextmanager
def _whole_file(path: str | Path, suffix: str) -> Iterator[Path]:
    """A path to write to; the file takes its real name when it is complete."""
    path = Path(path)
    if path.suffix != suffix:
        raise ValueError(f'path: expected a name ending in "{suffix}", got "{path.name}"')
    if not path.parent.is_dir():
        raise ValueError(f'path: expected an existing folder, got "{path.parent}"; create it')
    part = path.with_name(f".{path.stem}.{os.getpid()}{suffix}")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
