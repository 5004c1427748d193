"""Pictures and films of robots, drawn without a simulator."""

from typing import Any

from physics.renamed import moved
from physics.render.frame import Frame, voxel_outlines

__all__ = ["Frame", "voxel_outlines"]


def __getattr__(name: str) -> Any:
    """What version 0.1 had here."""
    return moved(__name__, "physics.render.draw", name)
