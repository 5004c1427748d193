"""`hebbtorch campaign`: checks everything first, then tells or does it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from importlib.util import find_spec

from experiments.campaign import against, plan
from experiments.campaign.grid import Condition, Scale
from experiments.campaign.options import CampaignOptions
from experiments.campaign.root import CampaignRoot
from experiments.campaign.runner import Campaign
from experiments.campaign.study import Study
from experiments.io import terminal

__all__ = ["run_campaign"]


def run_campaign(studies: Sequence[Study], options: CampaignOptions) -> int:
    """Run studies in a folder, or go on with them.

    Args:
        studies: The studies to run, at least one.
        options: where, how much and on what.

    Returns:
        The exit code: 1 if anything failed, or if speeds moved against another campaign.

    Raises:
        ValueError: something is wrong with the studies, the options or the folder; nothing was
            run then.
        KeyboardInterrupt: it was stopped; the same call goes on.
    """
    if not studies:
        raise ValueError("study: expected the name of one or several, or --grid FILE, got none")
    run_conditions = _way(options)
    scale = options.chosen_scale()
    members = {study: _conditions(study, scale, options) for study in studies}
    before = None if options.against is None else against.read(options.against, scale)
    root = CampaignRoot(options.out)
    statuses = root.check(scale, members)
    if options.dry_run:
        conditions = {each.name: each for own in members.values() for each in own}
        plan.show(plan.estimate(list(conditions.values()), statuses))
        return 0
    with root.declare(scale, members):
        work = Campaign(root, members)
        terminal.say(f"{len(work.conditions)} conditions, {len(work.unfinished)} of them to do")
        if work.unfinished:
            terminal.say(f"to watch: tensorboard --logdir {root.overviews}")
        try:
            run_conditions(work)
            work.report_rest()
        except KeyboardInterrupt:
            terminal.say("stopped; go on with the same command")
            raise
    if root.overviews.exists():  # an unpacked campaign has none
        terminal.say(f"curves of all conditions: tensorboard --logdir {root.overviews}")
    terminal.say(f"one page to read or send: hebbtorch report {root.path}")
    code = _conclude(work.failures)
    if options.against is not None and before is not None:
        folders = {name: root.condition(name) for name in work.finished}
        differences = against.compare(list(work.conditions.values()), folders, before)
        against.show(differences, options.against)
        code = max(code, int(any(each.moved for each in differences)))
    return code


def _conditions(study: Study, scale: Scale, options: CampaignOptions) -> list[Condition]:
    """The conditions of a study, validated, with the options of the machine."""
    threads = options.threads
    if threads is None and options.cluster != "none":
        threads = 1  # others work on the same machine
    found = []
    for each in study.conditions(scale):
        config = replace(each.config, device=options.device, threads=threads)
        found.append(Condition(each.name, config))
    found[0].config.validate()  # all have the machine in common, which is still unchecked
    return found


def _way(options: CampaignOptions) -> Callable[[Campaign], None]:
    """How conditions are to be run."""
    if options.gpus < 0 or (options.gpus and options.cluster == "none"):
        raise ValueError(
            f"gpus: expected a share >= 0, and none without --cluster, got {options.gpus}"
        )
    if options.cluster == "none":
        return Campaign.run_here
    if find_spec("ray") is None:
        raise ValueError(
            "cluster: expected Ray to be installed, got none; pip install 'hebbtorch[cluster]'"
        )
    from experiments.campaign.cluster import run_on_ray

    return partial(run_on_ray, gpus=options.gpus)


def _conclude(failures: Sequence[str]) -> int:
    """Tell what failed, and choose the exit code."""
    if not failures:
        return 0
    terminal.say(f"{len(failures)} failed:")
    for failure in failures:
        terminal.say(f"  {failure}")
    terminal.say("the same command tries them again")
    return 1
