"""The folder of a campaign, ROOT: what was declared in it, and how far each condition is.

- campaign.json: scale, studies and their conditions, versions of this program that worked here.
- conditions/NAME/: of each condition an ordinary folder of a run, see `experiments.runs.folder`.
- overview/NAME/: of each condition a TensorBoard run with the median over its runs.
- STUDY/: figures and tables of a study.
- lock: held by the process that works here.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, fields
from importlib.metadata import version
from pathlib import Path
from typing import IO, Any

from experiments.campaign.grid import MACHINE_OPTIONS, Condition, Scale
from experiments.campaign.study import Study
from experiments.config import EvolveConfig
from experiments.io.atomic import write_atomically
from experiments.io.formats import require_format
from experiments.io.locks import LOCK, lock_folder
from experiments.runs.champions import Champions
from experiments.runs.config_file import read_config
from experiments.runs.folder import read_checkpoint
from experiments.runs.names import CAMPAIGN, CHECKPOINT, CONDITIONS

__all__ = ["CampaignRoot", "ConditionStatus", "Members"]

Members = Mapping[Study, Sequence[Condition]]
"""Studies with their conditions."""

_OVERVIEW = "overview"
_OWN_NAMES = {"", CONDITIONS, _OVERVIEW, CAMPAIGN, LOCK, "ray"}  # that no study may have
_FORMAT = 1  # of campaign.json
_OF_AN_INSTANT = {LOCK, f"{CAMPAIGN}.tmp"}  # what a kill may leave before campaign.json is there


@dataclass(frozen=True)
class ConditionStatus:
    """How far a condition is.

    Attributes:
        generation: How many generations are done.
        finished: whether the champions are there.
        seconds: wall time so far [s]; 0 if that is not known.
    """

    generation: int = 0
    finished: bool = False
    seconds: float = 0.0


class CampaignRoot:
    """The folder of a campaign. Reading from it changes nothing; `declare` creates it.

    Attributes:
        path: The campaign's folder, ROOT.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def condition(self, name: str) -> Path:
        """The run's folder of a condition."""
        return self.path / CONDITIONS / name

    @property
    def overviews(self) -> Path:
        """The folder that TensorBoard shows the whole campaign from."""
        return self.path / _OVERVIEW

    def overview(self, name: str) -> Path:
        """The folder of a condition's TensorBoard run with the median over its runs."""
        return self.overviews / name

    def study(self, name: str) -> Path:
        """The folder of a study's figures and tables."""
        return self.path / name

    def check(self, scale: Scale, studies: Members) -> dict[str, ConditionStatus]:
        """See that a campaign can begin or go on here; nothing is written.

        Args:
            scale: The scale of the campaign.
            studies: The studies to add or to go on with, with their conditions.

        Returns:
            How far each of their conditions is, by name.

        Raises:
            ValueError: the folder is not a campaign's, has another scale, or holds something else
                in place of a condition.
        """
        self._check_names(studies)
        declared = self._read()
        if declared:
            self._check_scale(declared["scale"], scale)
        conditions = {each.name: each for members in studies.values() for each in members}
        return {name: self.status(each) for name, each in conditions.items()}

    def status(self, condition: Condition) -> ConditionStatus:
        """How far a condition is; one that comes unpacked, without a checkpoint, is finished.

        Raises:
            ValueError: its folder belongs to another condition, or is damaged.
        """
        folder = self.condition(condition.name)
        if not folder.exists():
            return ConditionStatus()
        config = read_config(folder)
        _require_same(folder, config, condition.config)
        has_champions = _has_champions(folder, config.generations)
        if has_champions and not (folder / CHECKPOINT).exists():
            return ConditionStatus(config.generations, finished=True)
        checkpoint = read_checkpoint(folder, config)
        finished = checkpoint.generation == config.generations and has_champions
        return ConditionStatus(checkpoint.generation, finished, checkpoint.history.seconds)

    def declare(self, scale: Scale, studies: Members) -> IO[str]:
        """Create the folder if need be, and record the studies.

        Args:
            scale: The scale of the campaign.
            studies: The studies to add to those declared before, with their conditions.

        Returns:
            A lock: while it is open, no other process can work here.

        Raises:
            ValueError: as `check`; or another process works here, or the folder cannot be written.
        """
        self.check(scale, studies)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            with ExitStack() as undo:
                lock = undo.enter_context(lock_folder(self.path))
                self._record(scale, studies)
                undo.pop_all()
        except OSError as error:
            raise ValueError(
                f"out: cannot write {str(self.path)!r} ({error.strerror}); choose another --out"
            ) from error
        return lock

    def _record(self, scale: Scale, studies: Members) -> None:
        before = self._read()
        content = _declaration(before, scale, studies)
        if content != before:
            text = json.dumps(content, indent=2) + "\n"
            write_atomically(self.path / CAMPAIGN, text.encode())
        (self.path / CONDITIONS).mkdir(exist_ok=True)

    def _check_names(self, studies: Iterable[Study]) -> None:
        for study in studies:
            if study.name in _OWN_NAMES or study.name.startswith("."):
                raise ValueError(
                    f"study: expected another name than {study.name!r}, which a campaign uses "
                    "itself; rename the file"
                )

    def _read(self) -> dict[str, Any]:
        """What campaign.json says; nothing where a campaign could begin."""
        path = self.path / CAMPAIGN
        if path.is_file():
            try:
                content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8-sig"))
                require_format(content["format"], _FORMAT)
                Scale(**content["scale"]).validate()
                if not isinstance(content["studies"], dict):
                    raise ValueError("studies: expected an object")
            except (OSError, KeyError, TypeError, ValueError, RecursionError) as error:
                raise ValueError(f"out: cannot use {str(path)!r}: {error}") from error
            return content
        if self.path.is_dir():
            if found := sorted({each.name for each in self.path.iterdir()} - _OF_AN_INSTANT):
                raise ValueError(
                    f"out: expected a new folder or a campaign's, got {str(self.path)!r} with "
                    f"{found[0]!r} and without {CAMPAIGN}; choose another --out"
                )
        elif self.path.exists():
            raise ValueError(f"out: expected a folder, got the file {str(self.path)!r}")
        return {}

    def _check_scale(self, declared: Mapping[str, Any], scale: Scale) -> None:
        for name, value in asdict(scale).items():
            if declared[name] != value:
                raise ValueError(
                    f"{name}: expected {declared[name]}, the scale of the campaign in "
                    f"{str(self.path)!r}, got {value}; give --{name} {declared[name]}, or "
                    "another --out"
                )


def _declaration(before: Mapping[str, Any], scale: Scale, studies: Members) -> dict[str, Any]:
    """The content of campaign.json."""
    declared = {
        study.name: {
            "question": study.question,
            "conditions": [each.name for each in members],
        }
        for study, members in studies.items()
    }
    versions: list[str] = before.get("versions", [])
    here = version("hebbtorch")
    return {
        "format": _FORMAT,
        "versions": versions if here in versions else [*versions, here],
        "scale": asdict(scale),
        "studies": {**before.get("studies", {}), **declared},
    }


def _require_same(folder: Path, found: EvolveConfig, expected: EvolveConfig) -> None:
    """Refuse a folder that holds another condition, or one of another scale."""
    different = [
        f"{each.name} {getattr(found, each.name)} in place of {getattr(expected, each.name)}"
        for each in fields(EvolveConfig)
        if each.name not in MACHINE_OPTIONS
        and getattr(found, each.name) != getattr(expected, each.name)
    ]
    if different:
        raise ValueError(
            f"out: {str(folder)!r} holds a run with {', '.join(different)}; move it away, or "
            "choose another --out"
        )


def _has_champions(folder: Path, generations: int) -> bool:
    """Whether those of so many generations are there."""
    try:
        return Champions.load(folder).config.generations == generations
    except ValueError:
        return False
