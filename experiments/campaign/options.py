"""What `hebbtorch campaign` is told, besides what to study.

This module imports neither torch nor the simulator, so that the command line can show its help
at once.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import tyro

from experiments.campaign.grid import QUICK, Scale

__all__ = ["CampaignOptions"]


@dataclass(frozen=True)
class CampaignOptions:
    """Where, how much, and on what."""

    out: Path
    """Folder of the campaign, ROOT, new or one to go on with."""

    scale: Annotated[Scale, tyro.conf.arg(name="")] = field(default_factory=Scale)
    """How much of everything."""

    quick: bool = False
    """A tiny scale, to see that everything works."""

    dry_run: bool = False
    """Only tell what would be done, and what it would take; write nothing."""

    against: Path | None = None
    """Folder of another campaign, packed or not: tell whether the speeds of the same conditions
    moved; exit code 1 if any did."""

    device: str = "cpu"
    """Where to compute: cpu, or cuda where PyTorch finds a GPU."""

    threads: int | None = None
    """Threads of a condition; all cores if not given, one on a cluster. No influence on the
    results."""

    cluster: Literal["none", "ray"] = "none"
    """Where conditions run: one after another in this process, or side by side on the Ray
    cluster that is there (a local one is started if none is)."""

    gpus: float = 0.0
    """On a cluster, GPUs of each condition; 0.25 lets four share one."""

    def chosen_scale(self) -> Scale:
        """The scale asked for.

        Raises:
            ValueError: it is wrong, or --quick is joined by another scale.
        """
        if not self.quick:
            self.scale.validate()
            return self.scale
        if self.scale != Scale(seed=self.scale.seed):
            raise ValueError(
                "quick: expected no --runs, --generations, --population or --duration with it, "
                "got some; drop them or --quick"
            )
        quick = Scale(
            QUICK.runs, QUICK.generations, QUICK.population, QUICK.duration, self.scale.seed
        )
        quick.validate()
        return quick
