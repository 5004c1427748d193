"""Picture files: PNG, SVG, PDF, GIF and MP4, written whole or not at all.

Films go picture by picture to ffmpeg, so that their length costs no memory. It writes to a file
without a name, of which nothing is left if this process is killed.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import imageio_ffmpeg
import numpy as np
from PIL import Image

from physics.render.draw import Picture

__all__ = ["write_gif", "write_mp4", "write_png", "write_still"]

_GIF_MAX_FPS = 50  # a GIF counts time in 1/100 s, and viewers slow down frames of 1/100 s
_GIF_COLORS = 192  # few enough to compress well, enough for smooth edges
_PALETTE_SIZE = 256  # entries that a GIF's palette has
_STILLS = (".png", ".svg", ".pdf")


def write_still(path: str | Path, picture: Picture) -> None:
    """Write a picture as PNG, SVG or PDF, by the end of the name.

    Raises:
        ValueError: the path has another suffix or its folder does not exist.
    """
    path = Path(path)
    if path.suffix == ".png":
        write_png(path, picture.image())
        return
    with _whole_file(path, *_STILLS) as file:
        file.write(picture.vectors(path.suffix))


def write_png(path: str | Path, image: Image.Image) -> None:
    """Write a picture as PNG.

    Raises:
        ValueError: the path does not end in ".png" or its folder does not exist.
    """
    with _whole_file(path, ".png") as file:
        image.save(file, "PNG", optimize=True)


def write_gif(
    path: str | Path,
    images: Iterable[Image.Image],
    fps: float,
    samples: Sequence[Image.Image] | None = None,
) -> None:
    """Write pictures as an animated GIF that loops, all with the same palette.

    Args:
        path: the file, "....gif".
        images: the frames, of one size; drawn one at a time if there are samples.
        fps: frames per second, at most 50. Durations are whole 1/100 s that add up to the
            right time.
        samples: pictures that have the colours of all; without them, some of the frames.

    Raises:
        ValueError: a wrong path (as in :func:`write_png`), no frame, or a rate out of range.
    """
    if not 0 < fps <= _GIF_MAX_FPS:
        raise ValueError(f"fps: expected a number in (0, {_GIF_MAX_FPS}] for a GIF, got {fps}")
    if samples is None:
        images = list(images)
        samples = images[:: max(1, len(images) // 12)]
    frames = _begun(images)
    with tempfile.NamedTemporaryFile(suffix=".png") as palette, _whole_file(path, ".gif") as file:
        _palette_image(samples).save(palette, "PNG")
        palette.flush()
        use = "[0:v][1:v]paletteuse=dither=none:diff_mode=rectangle"
        options = ["-i", palette.name, "-lavfi", use, "-f", "gif", "-loop", "0"]
        _encode(frames, fps, options, file)


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
    frames = _begun(images)
    size = frames[0].size
    if size[0] % 2 or size[1] % 2:
        raise ValueError(f"images: expected an even width and height, got {size}")
    codec = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "20", "-preset", "veryfast"]
    options = [*codec, "-movflags", "+faststart", "-f", "mp4"]
    with _whole_file(path, ".mp4") as file:
        _encode(frames, fps, options, file)


def _encode(
    frames: tuple[Image.Image, Iterator[Image.Image]],
    fps: float,
    options: list[str],
    out: IO[bytes],
) -> None:
    """Let ffmpeg encode pictures into an open file."""
    first, others = frames
    width, height = first.size
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:.9g}"]
    target = f"/dev/fd/{out.fileno()}"
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-y", *raw, "-i", "-", *options]
    with (
        tempfile.TemporaryFile() as complaints,
        subprocess.Popen(
            [*command, target], stdin=subprocess.PIPE, stderr=complaints, pass_fds=(out.fileno(),)
        ) as encoder,
    ):
        assert encoder.stdin is not None
        try:
            encoder.stdin.write(first.tobytes())
            for image in others:
                encoder.stdin.write(image.tobytes())
            encoder.stdin.close()
        except BrokenPipeError:
            pass  # it has stopped; its complaint says why
        except BaseException:
            encoder.kill()
            raise
        if encoder.wait():
            complaints.seek(0)
            raise RuntimeError(f"ffmpeg: {complaints.read().decode(errors='replace').strip()}")


def _begun(images: Iterable[Image.Image]) -> tuple[Image.Image, Iterator[Image.Image]]:
    """The first picture, and the rest, not drawn yet."""
    rest = iter(images)
    first = next(rest, None)
    if first is None:
        raise ValueError("images: expected at least one frame, got none")
    return first, rest


def _palette_image(samples: Sequence[Image.Image]) -> Image.Image:
    """A picture whose pixels are the colours of a palette for all samples.

    Colours count by the root of their area: else a large background would take most of the
    palette for its shades, and small things would lose their colour.
    """
    pixels = np.concatenate([np.asarray(sample).reshape(-1, 3) for sample in samples])
    packed = pixels.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], dtype=np.uint32)
    colors, counts = np.unique(packed, return_counts=True)
    weighted = np.repeat(colors, np.ceil(np.sqrt(counts)).astype(int))
    channels = np.stack([weighted >> 16, weighted >> 8 & 255, weighted & 255], axis=-1)
    sample = Image.fromarray(channels.astype(np.uint8)[None])
    shared = sample.quantize(_GIF_COLORS, method=Image.Quantize.MEDIANCUT, kmeans=1)
    entries = np.array(shared.getpalette(), dtype=np.uint8).reshape(-1, 3)
    filled = np.concatenate([entries, entries[:1].repeat(_PALETTE_SIZE - len(entries), 0)])
    return Image.fromarray(filled.reshape(16, 16, 3))


@contextmanager
def _whole_file(path: str | Path, *suffixes: str) -> Iterator[IO[bytes]]:
    """A file to write to, without a name; it takes its place when it is complete."""
    path = Path(path)
    if path.suffix not in suffixes:
        names = " or ".join(f'"{suffix}"' for suffix in suffixes)
        raise ValueError(f'path: expected a name ending in {names}, got "{path.name}"')
    if not path.parent.is_dir():
        raise ValueError(f'path: expected an existing folder, got "{path.parent}"; create it')
    with tempfile.TemporaryFile(dir=path.parent) as file:
        yield file
        file.flush()
        part = path.with_name(f".{path.name}.{os.getpid()}")
        try:
            _give_name(file, part)
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)


def _give_name(file: IO[bytes], path: Path) -> None:
    """Let a file without a name appear in its folder, at once where the system can do it."""
    try:
        os.link(f"/proc/self/fd/{file.fileno()}", path, follow_symlinks=True)
    except OSError:
        file.seek(0)
        with path.open("wb") as copy:
            shutil.copyfileobj(file, copy, 1 << 20)
    path.chmod(0o666 & ~_umask())


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
