"""Tables of numbers as CSV files, written whole or not at all."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from experiments.io.atomic import write_atomically

__all__ = ["write_csv"]


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
