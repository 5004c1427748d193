"""Tables of numbers as CSV files, written whole or not at all."""

from __future__ import annotations

import csv
import io
import itertools
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torch import Tensor

from experiments.io.atomic import write_atomically

__all__ = ["labelled", "write_csv"]


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> Path:
    """Replace a file by a table; floats with every digit, "nan" where there is no number.

    Args:
        path: The file to write.
        columns: their names, the first line.
        rows: one value per column each.

    Returns:
        The file.
    """
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    write_atomically(path, table.getvalue().encode())
    return path


def labelled(values: Tensor, *labels: Sequence[Any]) -> Iterator[tuple[Any, ...]]:
    """The rows of a long table: labels of each value along every axis, then the value.

    Args:
        values: Of any shape.
        labels: For each axis of the values as many labels as it is long.
    """
    assert values.shape == tuple(map(len, labels))
    for names, value in zip(itertools.product(*labels), values.flatten().tolist(), strict=True):
        yield *names, value
