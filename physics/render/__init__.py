"""Pictures and films of robots, drawn without a simulator."""

from physics.render.frame import Frame, voxel_outlines

__all__ = ["Frame", "voxel_outlines"]
