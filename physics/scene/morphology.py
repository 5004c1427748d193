"""The shape of a robot: which cells of a grid hold a voxel, and where voxels are welded.

Voxels are numbered row by row from the bottom row, left to right, skipping empty cells.
Square ``c`` (0 NW, 1 NE, 2 SE, 3 SW) of voxel ``v`` is body ``4 v + c``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from physics.scene import material
from physics.scene.material import NE, NW, SE, SW, Material

__all__ = ["Morphology"]


@dataclass(frozen=True, eq=False)
class Morphology:
    """A robot's shape. Build it with :meth:`from_name`, :meth:`from_grid` or :meth:`of`.

    Attributes:
        grid: where there is a voxel, shape (height, width), bool, top row first, read-only,
            without empty outer rows or columns.
        name: its name, for logs and messages.
        materials: what each voxel is made of, V of them, in voxel order.
    """

    grid: np.ndarray
    name: str
    materials: tuple[Material, ...] = ()

    def __post_init__(self) -> None:
        if not self.materials:
            object.__setattr__(self, "materials", (material.ACTUATED,) * int(self.grid.sum()))

    @classmethod
    def from_name(cls, name: str) -> Morphology:
        """A shape of the catalogue.

        ============  ====================================================================
        box-WxH       full rectangle, W voxels wide and H high
        worm-WxH      the same (the paper's worm is worm-7x1)
        biped-WxH     box without the middle columns, from W/4 to before 3W/4, in its lower
                      rows (the paper's is biped-4x3)
        tripod-WxH    box with legs of one column: 0, W/2 and W-1
        comb-WxH      box with a leg at every other column, from the left
        T-WxH         the top row and the middle column
        ball-D        the cells of a DxD box whose centre is, rounded to whole cells, at most
                      D/2 from the middle
        ============  ====================================================================

        Divisions are of integers. Legs take the lower half of the rows, H/2 of them: one row of
        3, two of 4. The middle column of T is two columns if W is even.

        Raises:
            ValueError: if the name is unknown, or its sizes leave nothing to tell legs apart.
        """
        match = _NAME.fullmatch(name) if isinstance(name, str) else None
        if match is None or match["family"] not in _FAMILIES:
            raise ValueError(
                f"shape: expected one of {', '.join(_FORMS)} with integer sizes, "
                f'such as "biped-4x3", got {name!r}'
            )
        family = match["family"]
        has_voxel, least_width, least_height = _FAMILIES[family]
        width = int(match["width"])
        height = int(match["height"]) if match["height"] else width
        if (match["height"] is None) != (family == "ball"):
            form = "ball-D" if family == "ball" else f"{family}-WxH"
            raise ValueError(f"shape: expected {form}, got {name!r}")
        if width < least_width or height < least_height:
            raise ValueError(
                f"shape: {family} needs at least {least_width}x{least_height} voxels, got {name!r}"
            )
        rows = range(height - 1, -1, -1)
        grid = [[has_voxel(x, y, width, height) for x in range(width)] for y in rows]
        return cls.from_grid(grid, name)

    @classmethod
    def from_grid(cls, grid: Any, name: str | None = None) -> Morphology:
        """A shape drawn as a table.

        Args:
            grid: 2-D, 0/1 or bool, top row first; empty outer rows and columns are cut off.
            name: its name; "custom-WxH" if not given.

        Raises:
            ValueError: if the table is not 2-D, not of 0 and 1, empty, or holds voxels that are
                not joined side to side.
        """
        hint = "an array of 0 (empty) and 1 (voxel) only; Morphology.from_evogym reads its codes"
        table = _table(grid, (0, 1), hint).astype(bool)
        if not table.any():
            raise ValueError("shape: expected at least one voxel (a 1), got an empty array")
        rows, columns = np.nonzero(table.any(1))[0], np.nonzero(table.any(0))[0]
        table = table[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1].copy()
        table.setflags(write=False)
        shape = cls(table, name or f"custom-{table.shape[1]}x{table.shape[0]}")
        shape._check_connected()
        return shape

    @classmethod
    def from_evogym(cls, body: Any, name: str | None = None) -> Morphology:
        """A body of EvoGym, with voxels of several materials.

        Args:
            body: 2-D array of EvoGym's codes, top row first: 0 empty, 1 stiff, 2 soft, 3 and 4 soft
                and actuated. EvoGym's actuators change the length of a voxel along one axis, 3
                the horizontal and 4 the vertical; here both change its area. Stiff voxels have
                springs of 30 Hz, critically damped, and like soft ones do not obey the actuation,
                which still has a number for every voxel.
            name: its name; "custom-WxH" if not given.

        Raises:
            ValueError: it holds other codes, or its voxels are no shape (see `from_grid`).
        """
        codes = _table(body, (0, *_EVOGYM), "a 2-D array of EvoGym's codes 0 to 4")
        shape = cls.from_grid(codes > 0, name)
        inside = codes[np.ix_(codes.any(1), codes.any(0))][::-1]
        kinds = tuple(_EVOGYM[int(code)] for code in inside[inside > 0])
        return cls(shape.grid, shape.name, kinds)

    def description(self) -> dict[str, Any]:
        """Grid, name and materials, ready for JSON; `from_description` reads it."""
        return {
            "name": self.name,
            "grid": self.grid.astype(int).tolist(),
            "materials": [asdict(each) for each in self.materials],
        }

    @classmethod
    def from_description(cls, description: Mapping[str, Any]) -> Morphology:
        """The shape that `description` describes.

        Raises:
            ValueError: its voxels are no shape.
            KeyError, TypeError: it is no such description.
        """
        shape = cls.from_grid(description["grid"], description["name"])
        materials = tuple(Material(**each) for each in description["materials"])
        return cls(shape.grid, shape.name, materials)

    @classmethod
    def of(cls, spec: Any) -> Morphology:
        """The shape that a name, a 2-D 0/1 array or a Morphology stands for."""
        if isinstance(spec, Morphology):
            return spec
        return cls.from_name(spec) if isinstance(spec, str) else cls.from_grid(spec)

    @property
    def width(self) -> int:
        """Cells across."""
        return self.grid.shape[1]

    @property
    def height(self) -> int:
        """Cells upwards."""
        return self.grid.shape[0]

    @cached_property
    def cells(self) -> tuple[tuple[int, int], ...]:
        """Cell (gx, gy) of each voxel, gy = 0 at the bottom, in voxel order."""
        return tuple((int(x), int(y)) for y, x in np.argwhere(self.grid[::-1]))

    @property
    def is_uniform(self) -> bool:
        """Whether all voxels are of the usual material, with an actuator."""
        return set(self.materials) == {material.ACTUATED}

    @property
    def n_voxels(self) -> int:
        """Number of voxels, V."""
        return len(self.cells)

    @cached_property
    def voxel_names(self) -> tuple[str, ...]:
        """One name per voxel, "v<gx>_<gy>", in voxel order."""
        return tuple(f"v{x}_{y}" for x, y in self.cells)

    @cached_property
    def welds(self) -> tuple[tuple[int, int], ...]:
        """Pairs of bodies welded together, in solving order (voxel by voxel: left, then below).

        The anchor of a weld is the centre of its first body.
        """
        index = {cell: voxel for voxel, cell in enumerate(self.cells)}
        pairs = []
        for voxel, (x, y) in enumerate(self.cells):
            neighbours = (
                (index.get((x - 1, y)), ((NW, NE), (SW, SE))),
                (index.get((x, y - 1)), ((SW, NW), (SE, NE))),
            )
            for neighbour, squares in neighbours:
                if neighbour is not None:
                    pairs += [(4 * voxel + own, 4 * neighbour + its) for own, its in squares]
        return tuple(pairs)

    def _check_connected(self) -> None:
        """Raise unless every voxel can be reached from the first one, side to side."""
        unseen = set(self.cells)
        frontier = [self.cells[0]]
        unseen.discard(self.cells[0])
        while frontier:
            x, y = frontier.pop()
            for cell in ((x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)):
                if cell in unseen:
                    unseen.discard(cell)
                    frontier.append(cell)
        if unseen:
            raise ValueError(
                f"shape: expected voxels joined side to side, got {self.name} with "
                f"{len(unseen)} voxel(s) cut off from cell {self.cells[0]}, e.g. {min(unseen)}"
            )


def _table(grid: Any, allowed: Iterable[int], wanted: str) -> np.ndarray:
    """The array, if it is 2-D and of these numbers."""
    try:
        table = np.asarray(grid)
    except ValueError:
        raise ValueError("shape: expected rows of equal length in a 2-D array") from None
    if table.ndim != 2:
        raise ValueError(
            f"shape: expected a 2-D 0/1 array, top row first, got {table.ndim} dimension(s)"
        )
    if table.dtype.kind not in "biuf" or not np.isin(table, tuple(allowed)).all():
        raise ValueError(f"shape: expected {wanted}")
    return table


_EVOGYM = {
    1: material.STIFF,
    2: material.PASSIVE,
    3: material.ACTUATED,
    4: material.ACTUATED,
}  # materials of EvoGym's codes

_NAME = re.compile(
    r"(?P<family>[A-Za-z]+)-(?P<width>[1-9][0-9]{0,2})(x(?P<height>[1-9][0-9]{0,2}))?"
)


def _is_middle(x: int, width: int) -> bool:
    return abs(2 * x - (width - 1)) < 2


def _is_in_ball(x: int, y: int, diameter: int) -> bool:
    distance = math.hypot(2 * x + 1 - diameter, 2 * y + 1 - diameter) / 2
    return math.floor(distance + 0.5) <= diameter // 2


# Whether cell (x, y from the bottom) of a (width, height) box holds a voxel; least sizes.
_FAMILIES: dict[str, tuple[Callable[[int, int, int, int], bool], int, int]] = {
    "box": (lambda x, y, w, h: True, 1, 1),
    "worm": (lambda x, y, w, h: True, 1, 1),
    "biped": (lambda x, y, w, h: y >= h // 2 or not w // 4 <= x < 3 * w // 4, 3, 2),
    "tripod": (lambda x, y, w, h: y >= h // 2 or x in (0, w // 2, w - 1), 5, 2),
    "comb": (lambda x, y, w, h: y >= h // 2 or x % 2 == 0, 3, 2),
    "T": (lambda x, y, w, h: y == h - 1 or _is_middle(x, w), 3, 2),
    "ball": (lambda x, y, w, h: _is_in_ball(x, y, w), 1, 1),
}
_FORMS = [f"{family}-D" if family == "ball" else f"{family}-WxH" for family in _FAMILIES]
