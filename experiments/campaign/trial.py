"""A condition as a trial of Ray Tune; needs Ray."""

from __future__ import annotations

import math
import os
import time
from pathlib import Path
from typing import Any

import torch
from ray import tune

from experiments.analysis.presentation import log_champion
from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from experiments.runs.history import HistoryRow
from experiments.runs.names import CAMPAIGN

__all__ = ["ROOT_VARIABLE", "ConditionTrial"]

ROOT_VARIABLE = "HEBBTORCH_CAMPAIGN_ROOT"
"""Of the environment of a node: where it has the campaign's folder, if in another place than the
node where the campaign was started."""
_STEP = 10.0  # least time between reports to Ray [s]


class ConditionTrial(tune.Trainable):
    """The evolution of one condition, all its seeds, in its ordinary folder.

    The run's own checkpoint, replaced after every generation, is all that counts: a worker goes on
    from it, wherever the one before was lost. Ray keeps none.
    """

    def setup(self, config: dict[str, Any]) -> None:
        """Begin, or go on.

        Args:
            config: under "condition" the "root" of the campaign, in it the "folder" of the run and
                that of its "overview", and its "options" in JSON.

        Raises:
            ValueError: the campaign is not there.
        """
        torch.set_num_threads(1)  # the simulator has threads of its own
        condition = config["condition"]
        root = Path(os.environ.get(ROOT_VARIABLE) or condition["root"])
        if not (root / CAMPAIGN).is_file():
            raise ValueError(
                f"campaign: expected {CAMPAIGN} in {str(root)!r} on this node, got none; mount "
                f"the storage that all nodes share, or tell where it is with {ROOT_VARIABLE}"
            )
        options = EvolveConfig.from_json(condition["options"])
        self._session: Session = Session.open(
            options, root / condition["folder"], overview=root / condition["overview"]
        )

    def step(self) -> dict[str, Any]:
        """Some generations; after the last one, the champions."""
        session, began = self._session, time.monotonic()
        reached: dict[str, float] = {}
        while not session.evolved and time.monotonic() - began < _STEP:
            rows, _ = session.step()
            reached = {"best": _best(rows)}
        if session.evolved:
            log_champion(session.folder, session.finish())
        return {**reached, "generation": session.generation, "done": session.evolved}

    def cleanup(self) -> None:
        """Let other workers go on with the folder."""
        self._session.close()


def _best(rows: list[HistoryRow]) -> float:
    return max((row.best for row in rows if not math.isnan(row.best)), default=math.nan)
