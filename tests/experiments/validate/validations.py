"""What tests of the validation share."""

import csv
import gzip
from pathlib import Path

import numpy as np

from experiments.validate import validation
from experiments.validate.case import Case, Check, Setting, Skip
from physics import Engine

OWN = validation.OWN_COPY


def rows_of(cases: list[Case | Skip], engine: Engine | None = None) -> list[Check]:
    """What the cases give; none may be skipped."""
    skipped = [case for case in cases if isinstance(case, Skip)]
    assert cases
    assert not skipped
    setting = Setting(engine or Engine())
    return [row for case in cases if isinstance(case, Case) for row in case.replay(setting).rows]


def write(path: Path, columns: dict[str, np.ndarray | list[str]]) -> None:
    """A table in CSV."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(list(column) for column in columns.values()), strict=True))


def own_rows(name: str) -> list[list[str]]:
    """The rows of one of the package's own tables, header first."""
    with gzip.open(OWN / f"{name}.csv.gz", "rt", newline="") as file:
        return list(csv.reader(file))
