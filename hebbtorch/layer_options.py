"""The options that all layers of a network have in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypedDict

import torch

from hebbtorch.functional.activation import Activation
from hebbtorch.functional.bounds import Bound


class LayerOptions(TypedDict, total=False):
    """Arguments of `HebbianLinear` that a network hands to each of its layers."""

    eta: float | str
    normalize: str | Bound | None
    terms: str
    exchange_bc: bool
    average: int
    every: int
    decay: float
    clip: float | None
    trace_decay: float
    activation: str | Activation
    bias: bool
    fixed: bool
    population: Sequence[int]
    dtype: torch.dtype | None
    device: torch.device | str | None
