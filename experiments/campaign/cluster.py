"""Conditions side by side on a Ray cluster: one trial of Ray Tune is one condition, all its seeds.

Every worker writes an ordinary folder of a run into ROOT/conditions, which has to be on storage
that all nodes share; `trial.ROOT_VARIABLE` is for nodes that have it in another place. A condition
ends the same wherever it runs; what began on a cluster can be finished without. This module needs
Ray.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import ray
from ray import tune
from ray._private import ray_constants
from ray.tune.experiment import Trial

from experiments.campaign.grid import Condition
from experiments.campaign.runner import Campaign
from experiments.campaign.trial import ConditionTrial
from experiments.io import terminal

__all__ = ["connect", "run_on_ray"]

_RETRIES = 2  # of a condition whose worker is lost
_FORMAT = "3"  # of what a trial is told, and of how Ray treats it


def run_on_ray(campaign: Campaign, gpus: float) -> None:
    """Run the conditions of a campaign on a Ray cluster, and report on complete studies.

    The cluster is the one that this process is connected to, or that RAY_ADDRESS names; without
    any, one is started on this machine. A condition takes as many cores as it has threads.

    Args:
        campaign: studies at work in a folder.
        gpus: How many GPUs each condition takes; a fraction lets several share one.
    """
    if todo := campaign.unfinished:
        if not ray.is_initialized():
            connect()
        errors = _run_trials(campaign, todo, gpus)
        for condition in todo:
            campaign.look_again(condition)
        for condition in campaign.unfinished:
            stale = f"no trial of it is left; remove {str(_storage(campaign))!r} and try again"
            campaign.fail(condition.name, errors.get(condition.name, stale))
    campaign.report_complete()


def connect() -> None:
    """Connect to the cluster that RAY_ADDRESS names; without any, start one for this machine
    alone, which no other can reach."""
    if os.environ.get("RAY_ADDRESS"):
        ray.init()
        return
    # Ray listens on all interfaces, unless it believes that there can be no second node.
    ray_constants.ENABLE_RAY_CLUSTER = False
    ray.init(address="local", include_dashboard=False)


def _run_trials(campaign: Campaign, todo: Sequence[Condition], gpus: float) -> dict[str, str]:
    """Run the trials, or go on with them; what went wrong, by condition."""
    os.environ.setdefault("TUNE_DISABLE_SIGINT_HANDLER", "1")  # Ctrl-C is an exception as usual
    cpus = todo[0].config.threads
    trainable = tune.with_resources(ConditionTrial, {"cpu": cpus or 1, "gpu": gpus})
    experiment = _storage(campaign) / _experiment(campaign)
    if tune.Tuner.can_restore(str(experiment)):
        tuner = tune.Tuner.restore(str(experiment), trainable, restart_errored=True)
    else:
        tuner = tune.Tuner(
            trainable,
            param_space={
                "condition": tune.grid_search([_options(campaign, each) for each in todo])
            },
            tune_config=tune.TuneConfig(trial_name_creator=_name, trial_dirname_creator=_name),
            run_config=tune.RunConfig(
                name=experiment.name,
                storage_path=str(experiment.parent),
                failure_config=tune.FailureConfig(max_failures=_RETRIES),
                checkpoint_config=tune.CheckpointConfig(checkpoint_at_end=False),
                callbacks=[_Progress(len(campaign.conditions), campaign.finished)],
                verbose=0,
            ),
        )
    grid = tuner.fit()
    results = [grid[i] for i in range(len(grid))]
    return {
        result.config["condition"]["name"]: str(result.error).strip().splitlines()[-1]
        for result in results
        if result.error and result.config
    }


class _Progress(tune.Callback):
    """Tells which conditions are finished.

    Ray keeps it as it was made, for when the campaign goes on: what was finished since then, the
    trials tell.
    """

    def __init__(self, conditions: int, finished: Sequence[str]) -> None:
        self._conditions = conditions
        self._finished = set(finished)

    def on_trial_complete(self, iteration: int, trials: list[Any], trial: Any, **info: Any) -> None:
        """Called by Ray, while the trial's own status is still that of a running one."""
        self._finished |= {_name(each) for each in trials if each.status == Trial.TERMINATED}
        self._finished.add(_name(trial))
        terminal.say(f"[{len(self._finished)}/{self._conditions}] {_name(trial)} finished")


def _storage(campaign: Campaign) -> Path:
    """Where Ray notes down what it did."""
    return campaign.root.path.resolve() / "ray"


def _experiment(campaign: Campaign) -> str:
    """A name for these conditions in this place: it is the same when the campaign goes on."""
    text = "\n".join([_FORMAT, str(_storage(campaign)), *sorted(campaign.conditions)])
    return hashlib.blake2b(text.encode(), digest_size=6).hexdigest()


def _options(campaign: Campaign, condition: Condition) -> dict[str, str]:
    """What a worker has to know."""
    root = campaign.root.path.resolve()
    return {
        "name": condition.name,
        "root": str(root),
        "folder": str(campaign.root.condition(condition.name).resolve().relative_to(root)),
        "overview": str(campaign.root.overview(condition.name).resolve().relative_to(root)),
        "options": condition.config.to_json(),
    }


def _name(trial: Any) -> str:
    """How Ray calls a trial and its folder."""
    name: str = trial.config["condition"]["name"]
    return name
