"""Whole episodes inside the simulator's kernel, for the networks of hebbtorch."""

from experiments.rollout.fused.brain import Brain, pack
from experiments.rollout.fused.features import why_not

__all__ = ["Brain", "pack", "why_not"]
