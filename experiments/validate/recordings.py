"""Reads a folder of recorded runs. A broken file is a ValueError that names file and column."""

from __future__ import annotations

import copy
import csv
import gzip
import json
import math
import re
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from physics import Morphology, Terrain
from physics.scene import clock

__all__ = ["Recordings", "Table"]

_VOXEL = re.compile(r"v(\d+)_(\d+)_")
SQUARES = ("NW", "NE", "SE", "SW")
_POSE = ("x", "y", "angle")
_VELOCITY = ("vx", "vy", "omega")


class Table:
    """A CSV file with a header. Columns become numbers when they are asked for."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with _open(path) as file:
                lines = list(csv.reader(file))
        except (UnicodeDecodeError, EOFError, gzip.BadGzipFile) as error:
            raise ValueError(f"{path.name}: expected a CSV file, got one that is broken") from error
        if len(lines) < 2:
            raise ValueError(f"{path.name}: expected a header and rows, got {len(lines)} line(s)")
        self.columns, *self._rows = lines
        for number, row in enumerate(self._rows, start=2):
            if len(row) != len(self.columns):
                raise ValueError(
                    f"{path.name}: expected {len(self.columns)} columns, got {len(row)} in line "
                    f"{number}"
                )

    def __len__(self) -> int:
        return len(self._rows)

    def __contains__(self, column: str) -> bool:
        return column in self._places

    @cached_property
    def _places(self) -> dict[str, int]:
        return {name: place for place, name in enumerate(self.columns)}

    def at(self, column: str, numbers: Sequence[int]) -> Table:
        """The rows with these integers in a column, in their order."""
        places = {int(number): row for row, number in enumerate(self.numbers(column))}
        chosen = copy.copy(self)
        chosen._rows = [self._rows[places[number]] for number in numbers]
        return chosen

    def text(self, column: str) -> list[str]:
        """A column as it is written."""
        if column not in self._places:
            raise ValueError(f"{self.path.name}: expected a column {column}, got none")
        place = self._places[column]
        return [row[place] for row in self._rows]

    def numbers(self, columns: str | Sequence[str]) -> np.ndarray:
        """One column, (rows,), or several, (rows, columns), float64, all finite."""
        if not isinstance(columns, str):
            return np.stack([self.numbers(column) for column in columns], axis=1)
        cells = self.text(columns)
        try:
            values = np.array(cells, dtype=np.float64)
        except ValueError:
            values = np.array([_number(cell) for cell in cells])
        wrong = np.flatnonzero(~np.isfinite(values))
        if len(wrong):
            row = int(wrong[0])
            raise ValueError(
                f"{self.path.name}: expected a number in column {columns}, got {cells[row]!r} in "
                f"line {row + 2}"
            )
        return values

    def per_voxel(self, single: str, stem: str) -> np.ndarray:
        """A quantity of every voxel, (rows, V): the columns ``stem0``, ``stem1``, ..., or for a
        robot of one voxel the column ``single``."""
        if single in self:
            return self.numbers([single])
        count = self.morphology().n_voxels
        return self.numbers([f"{stem}{voxel}" for voxel in range(count)])

    def morphology(self) -> Morphology:
        """The robot whose voxels the columns ``v{x}_{y}_...`` name."""
        cells = {(int(m[1]), int(m[2])) for name in self.columns if (m := _VOXEL.match(name))}
        if not cells:
            raise ValueError(f"{self.path.name}: expected columns of voxels, v0_0_..., got none")
        width, height = (max(axis) + 1 for axis in zip(*cells, strict=True))
        grid = [[(x, y) in cells for x in range(width)] for y in reversed(range(height))]
        return Morphology.from_grid(np.array(grid))

    def squares(self, morphology: Morphology) -> tuple[np.ndarray, np.ndarray]:
        """Poses and velocities of the squares, (rows, V, 4, 3) each."""
        stems = [f"{voxel}_{square}" for voxel in morphology.voxel_names for square in SQUARES]
        names = [f"{stem}_{item}" for stem in stems for item in (*_POSE, *_VELOCITY)]
        state = self.numbers(names).reshape(len(self), morphology.n_voxels, 4, 6)
        return state[..., :3], state[..., 3:]

    def check_clock(self, first: int) -> None:
        """Checks that column t counts control steps, from this one on."""
        expected = np.concatenate([[0.0], clock.times(len(self) + first)])[first:][: len(self)]
        wrong = np.flatnonzero(np.abs(self.numbers("t") - expected) > 1e-6)
        if len(wrong):
            row = int(wrong[0])
            raise ValueError(
                f"{self.path.name}: expected steps of 1/60 s in column t, got "
                f"{self.text('t')[row]} instead of {expected[row]:.6g} in line {row + 2}"
            )


class Recordings:
    """The recorded runs of a folder. A table X is the file X.csv or X.csv.gz.

    Raises:
        ValueError: there is no such folder.
    """

    def __init__(self, folder: Path) -> None:
        if not folder.is_dir():
            raise ValueError(f"reference: expected a folder of recorded runs, got {folder}")
        self.folder = folder
        paths = sorted(folder.glob("*.csv.gz")) + sorted(folder.glob("*.csv"))
        self._tables = {path.name.removesuffix(".gz").removesuffix(".csv"): path for path in paths}

    def names(self, pattern: str) -> list[re.Match[str]]:
        """Matches of the tables whose whole name fits a pattern, by name."""
        matches = (re.fullmatch(pattern, name) for name in sorted(self._tables))
        return [match for match in matches if match]

    def has(self, name: str) -> bool:
        """Whether there is a table of this name."""
        return name in self._tables

    def table(self, name: str) -> Table:
        """A table by name."""
        return Table(self._tables[name])

    def matrix(self, name: str) -> np.ndarray:
        """The numbers of a CSV file without a header, (rows, columns)."""
        path = self._tables[name]
        try:
            with _open(path) as file:
                return np.loadtxt(file, delimiter=",", ndmin=2)
        except (OSError, EOFError, ValueError) as error:
            raise ValueError(f"{path.name}: expected rows of numbers, got: {error}") from error

    def document(self, name: str) -> dict[str, Any]:
        """The object in the file ``name``.json; empty if there is no such file."""
        path = self.folder / f"{name}.json"
        if not path.exists():
            return {}
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            raise ValueError(f"{path.name}: expected JSON, got: {error}") from error
        if not isinstance(content, dict):
            raise ValueError(f"{path.name}: expected an object, got {type(content).__name__}")
        return content

    @cached_property
    def profiles(self) -> dict[str, Terrain]:
        """The recorded terrains, by name."""
        terrains = {}
        for name, points in self.document("terrains").items():
            try:
                terrains[name] = Terrain.from_profile(points["xs"], points["ys"], name)
            except (KeyError, TypeError, ValueError) as error:
                raise ValueError(f"terrains.json: expected xs and ys of {name}: {error}") from error
        return terrains

    def terrain(self, name: str, where: str) -> Terrain:
        """A terrain that a file named: as it was recorded, else from the catalogue.

        Args:
            name: The name of the terrain.
            where: file and column that named it, for the message.
        """
        if name in self.profiles:
            return self.profiles[name]
        try:
            return Terrain.from_name(name)
        except ValueError as error:
            raise ValueError(f"{where}: {error}") from error

    def robot(self, shape: str, table: str) -> Morphology:
        """The robot whose shape the name of a table holds."""
        try:
            return Morphology.of(shape)
        except ValueError as error:
            raise ValueError(f"{self._tables[table].name}: {error}") from error

    def duration(self, name: str, default: float) -> float:
        """The length of the episodes in a table [s]: "duration" in its JSON file, or a default."""
        value = self.document(name).get("duration", default)
        if not isinstance(value, int | float) or not 0 < value < math.inf:
            raise ValueError(f"{name}.json: expected duration > 0 s, got {value!r}")
        return float(value)

    def genomes(self, name: str, rows: int, genes: int) -> np.ndarray | None:
        """Genomes from the file ``name``_genomes.f64.gz (or .f64), (rows, genes), or None if
        there is no such file: little-endian float64, row by row."""
        for ending in (".f64.gz", ".f64"):
            path = self.folder / f"{name}_genomes{ending}"
            if not path.exists():
                continue
            try:
                content = (
                    gzip.decompress(path.read_bytes()) if ending[-1] == "z" else path.read_bytes()
                )
            except (OSError, EOFError) as error:
                raise ValueError(f"{path.name}: expected a gzip file, got: {error}") from error
            if len(content) != 8 * rows * genes:
                raise ValueError(
                    f"{path.name}: expected {rows} x {genes} numbers of 8 bytes, got "
                    f"{len(content)} bytes"
                )
            return np.frombuffer(content, dtype="<f8").reshape(rows, genes).astype(np.float64)
        return None


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _open(path: Path) -> Any:
    if path.suffix == ".gz":
        return gzip.open(path, "rt", encoding="utf-8", newline="")
    return path.open(encoding="utf-8", newline="")
