"""A condition as a trial of Ray Tune; needs Ray."""

from __future__ import annotations

import json
import math
import time
from pathlib import Path
from typing import Any

import torch
from ray import tune

from experiments.analysis.presentation import log_champion
from experiments.campaign.execution import open_session
from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from experiments.runs.history import Row

__all__ = ["ConditionTrial"]

_STANDING = "standing.json"
_STEP = 10.0  # least time between reports to Ray [s]


class ConditionTrial(tune.Trainable):
    """The evolution of one condition, all its seeds, in its ordinary folder.

    The run's own checkpoint, replaced after every generation, is the truth: a worker goes on from
    it, wherever the one before was lost. Ray's checkpoints only note how far it was.
    """

    def setup(self, config: dict[str, Any]) -> None:
        """Begin, or go on.

        Args:
            config: under "condition" the "folder" of the run and that of its "overview", on
                storage that all workers share, and its "options" in JSON.
        """
        torch.set_num_threads(1)  # the simulator has threads of its own
        condition = config["condition"]
        options = EvolveConfig.from_json(condition["options"])
        self._session: Session = open_session(
            options, Path(condition["folder"]), Path(condition["overview"])
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

    def save_checkpoint(self, checkpoint_dir: str) -> None:
        """Note how far the run's folder is."""
        text = json.dumps({"generation": self._session.generation})
        Path(checkpoint_dir, _STANDING).write_text(text, encoding="utf-8")

    def load_checkpoint(self, checkpoint: str) -> None:  # type: ignore[override]
        """See that the run's folder is at least as far as noted.

        Raises:
            ValueError: it is not, as if the storage were not the same for all workers.
        """
        noted = json.loads(Path(checkpoint, _STANDING).read_text(encoding="utf-8"))["generation"]
        if self._session.generation < noted:
            raise ValueError(
                f"folder: expected generation {noted} or later in {str(self._session.folder)!r}, "
                f"got {self._session.generation}; is it on storage that all nodes share?"
            )

    def cleanup(self) -> None:
        """Let other workers go on with the folder."""
        self._session.close()


def _best(rows: list[Row]) -> float:
    return max((row.best for row in rows if not math.isnan(row.best)), default=math.nan)
