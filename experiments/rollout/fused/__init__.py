"""Whole episodes inside the simulator's kernel, for the networks of hebbtorch."""

from experiments.rollout.fused.features import why_not
from experiments.rollout.fused.loop import FusedLoop, pack

__all__ = ["FusedLoop", "pack", "why_not"]
