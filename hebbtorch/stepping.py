"""What all networks here have in common: they are called step by step."""

from __future__ import annotations

from typing import TYPE_CHECKING

from torch import Tensor, nn

from hebbtorch.state import State


class Stepping(nn.Module):
    """A module that makes one step with each call: ``y, state = net(x, state)``."""

    if TYPE_CHECKING:  # a call is typed as forward is

        def __call__(  # noqa: D102
            self,
            x: Tensor,
            state: State | None = None,
            plastic: bool | Tensor = True,
            *,
            modulation: Tensor | None = None,
        ) -> tuple[Tensor, State]: ...
