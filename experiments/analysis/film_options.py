"""How films and stills look, as options of the command line; imports nothing slow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["FilmOptions"]


@dataclass(frozen=True)
class FilmOptions:
    """How films and stills look."""

    fps: float = 30.0
    """Pictures per second of the MP4, at most 60."""

    width: int = 1280
    """Width of the MP4 [pixels], even."""

    gif: Literal["auto", "yes", "no"] = "auto"
    """Whether to write a GIF too; "auto": of films up to 20 s."""

    color: Literal["actuation", "area"] = "actuation"
    """What voxels are coloured by."""

    palette: Literal["safe", "paper"] = "safe"
    """Orange and blue, which every kind of colour vision tells apart, or the paper's colours."""

    stills: tuple[Literal["png", "svg", "pdf"], ...] = ("png",)
    """Formats of the page of stills."""

    def validate(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: one is out of range.
        """
        if not 0 < self.fps <= 60:
            raise ValueError(f"fps: expected a number in (0, 60], got {self.fps}")
        if self.width < 64 or self.width % 2:
            raise ValueError(f"width: expected an even number >= 64, got {self.width}")
