"""A campaign from its first condition to its last figure.

A failure loses nothing else: it is told where it happens and again at the end.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from datetime import datetime, timedelta

from experiments.campaign import results
from experiments.campaign.cost import seconds_left
from experiments.campaign.execution import run_condition
from experiments.campaign.grid import Condition
from experiments.campaign.root import CampaignRoot, Members
from experiments.campaign.study import Study
from experiments.io import terminal

__all__ = ["Campaign"]


class Campaign:
    """Studies at work in a folder.

    Attributes:
        root: the folder, declared.
        conditions: all that the studies need, by name.
        failures: what went wrong so far, a line each.
    """

    def __init__(self, root: CampaignRoot, studies: Members) -> None:
        """Take stock of the folder.

        Args:
            root: the folder, declared.
            studies: The studies in the order of their work, with their conditions, whose config has
                the options of the machine.
        """
        self.root = root
        self.conditions = {each.name: each for members in studies.values() for each in members}
        self.failures: list[str] = []
        self._waiting = {
            study: [each.name for each in members] for study, members in studies.items()
        }
        self._statuses = {name: root.status(each) for name, each in self.conditions.items()}

    @property
    def unfinished(self) -> Sequence[Condition]:
        """The conditions that are not finished, in order."""
        return [
            condition
            for name, condition in self.conditions.items()
            if not self._statuses[name].finished
        ]

    @property
    def finished(self) -> Sequence[str]:
        """Names of the conditions that are finished, in order."""
        return [name for name, status in self._statuses.items() if status.finished]

    def run_here(self) -> None:
        """Run the conditions one after another, and report on each study that is complete."""
        self.report_complete()
        for condition in self.unfinished:
            number = list(self.conditions).index(condition.name) + 1
            label = f"[{number}/{len(self.conditions)}]"
            terminal.say(f"{label} {condition.name}")
            terminal.say(f"{label} expected end of the campaign: {self._expected_end()}")
            self._try(condition.name, self._run, condition, label)
            self.look_again(condition)
            self.report_complete()

    def look_again(self, condition: Condition) -> None:
        """Take note of what became of a condition."""
        with suppress(ValueError):  # its failure is told already
            self._statuses[condition.name] = self.root.status(condition)

    def report_complete(self) -> None:
        """Report on every study whose conditions are all finished, once."""
        for study, names in list(self._waiting.items()):
            if all(self._statuses[name].finished for name in names):
                self._report(study)

    def report_rest(self) -> None:
        """Report on the studies that are left, as far as their conditions are finished."""
        for study in list(self._waiting):
            self._report(study)

    def fail(self, what: str, why: str) -> None:
        """Note a failure and tell it."""
        self.failures.append(f"{what}: {why}")
        terminal.LOG.warning("failed: %s", self.failures[-1])

    def _run(self, condition: Condition, label: str) -> None:
        champions = run_condition(
            condition,
            self.root.condition(condition.name),
            self.root.overview(condition.name),
            label,
        )
        speeds = ", ".join(f"{speed:.2f}" for speed in champions.fitness.tolist())
        terminal.say(f"{label} champions: {speeds} m/s")

    def _report(self, study: Study) -> None:
        names = self._waiting.pop(study)
        finished = [name for name in names if self._statuses[name].finished]
        folders = [self.root.condition(name) for name in finished]
        for name, folder in zip(finished, folders, strict=True):
            for analysis in study.analyses:
                terminal.say(f"{study.name}: {analysis} of {name}")
                self._try(f"{analysis} of {name}", results.analyse, analysis, folder)
        if not finished:
            return
        out = self.root.study(study.name)
        for figure in study.figures:
            self._try(f"figure {figure}", results.draw, figure, folders, out)
        if study.figures:
            terminal.say(f"{study.name}: figures and tables in {out}")

    def _try(self, what: str, call: Callable[..., object], *arguments: object) -> None:
        try:
            call(*arguments)
        except Exception as error:  # whatever it is, the other conditions can go on
            if not isinstance(error, ValueError | OSError):
                traceback.print_exc()
            self.fail(what, (str(error) or type(error).__name__).splitlines()[0])

    def _expected_end(self) -> str:
        statuses = self._statuses
        seconds = seconds_left(
            (condition.config, statuses[name].generation, statuses[name].seconds)
            for name, condition in self.conditions.items()
        )
        if seconds is None:
            return "known after the first condition"
        return f"{datetime.now() + timedelta(seconds=seconds):%a %d %b %H:%M}"
