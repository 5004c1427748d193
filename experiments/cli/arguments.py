"""Kinds of arguments that several commands have, and what commands do first."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

__all__ = ["Root", "Roots", "RunFolder", "RunOrFile", "RunOrRoot", "Studies", "one_thread"]

RunFolder = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
RunOrFile = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|FILE")]
RunOrRoot = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|ROOT|FILE")]
Roots = Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="ROOT|FILE [...]")]
Root = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="ROOT")]
Studies = Annotated[
    tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="[STUDY [STUDY ...]]")
]


def one_thread() -> None:
    """PyTorch's threads wait for each other at every operation, which costs more than these
    small networks gain; the simulator has threads of its own."""
    import torch

    torch.set_num_threads(1)
