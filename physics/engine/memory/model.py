"""What stays fixed while a batch of worlds is simulated, as tables for the kernels."""

import dataclasses
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from physics import checks
from physics.backend import Features, ti
from physics.engine.memory import layout as lay
from physics.engine.memory.layout import Layout
from physics.scene import clock, damage, material
from physics.scene.conditions import Conditions
from physics.scene.morphology import Morphology
from physics.scene.sensors import Apparatus


@dataclass(frozen=True)
class Engine:
    """Settings of the engine; the defaults are the reference's.

    Attributes:
        friction: coefficient between a square and the ground.
        damping: linear and angular velocity damping [1/s].
        velocity_iterations, position_iterations: The iterations of the sequential-impulse solver in
            each step.
        ropes: whether squares of a voxel are kept from passing through each other.
        self_collision: whether squares of the robot that no joint ties keep out of each other.
        continuous: whether squares that land are stopped where they touch the ground, instead of
            as deep in it as their speed takes them in a step (continuous collision detection). It
            costs a tenth of the speed, and champions' speeds come no nearer to those of the
            reference with its own detection than by default (FIDELITY.md).
    """

    friction: float = material.FRICTION
    damping: float = material.DAMPING
    velocity_iterations: int = material.VELOCITY_ITERATIONS
    position_iterations: int = material.POSITION_ITERATIONS
    ropes: bool = True
    self_collision: bool = True
    continuous: bool = False

    def features(self, morphology: Morphology) -> Features:
        """What the kernels must have to simulate this robot."""
        return Features(self.self_collision and morphology.n_voxels > 1, self.continuous)

    def __post_init__(self) -> None:
        for name in ("friction", "damping"):
            checks.finite(name, getattr(self, name), 0.0)
        for name in ("velocity_iterations", "position_iterations"):
            checks.positive_integer(name, getattr(self, name))


# Places in the table of numbers.
F_GRAVITY, F_DAMPING, F_FRICTION, F_NOISE, F_REACH, F_EXTENT, F_LOWPASS = range(7)
F_SPRINGS = 7  # rows of: anchors x1 y1 x2 y2 [m], rest length, its slopes for a >= 0 and a < 0
FS_X1, FS_Y1, FS_X2, FS_Y2, FS_REST, FS_SHRINK, FS_GROW = range(7)
F_SPRING_ROW = 7
F_RAYS = F_SPRINGS + F_SPRING_ROW * len(material.SPRINGS)  # rows of: cos, sin, range [m]
F_RAY_ROW = 3

# Places in the table of integers: the fields of Sizes, then the rows below.
_SIZES = (
    "voxels",
    "welds",
    "segments",
    "readings",
    "header",
    "weld_block",
    "window",
    "rings",
    "reading_block",
    "contact_list",
    "contact_list_new",
    "rope_list",
    "velocity_iterations",
    "position_iterations",
    "control_interval",
    "delay",
    "delay_block",
    "ropes",
    "damage_mode",
    "weld_table",
    "reading_table",
    "interval_table",
    "interval_steps",
    "interval_row",
    "noise_table",
    "self_contact_block",
    "self_contact_memory",
    "self_contact_bounds",
    "self_contact_list",
    "self_contact_list_old",
    "self_contact_limit",
    "pair_table",
    "voxel_pairs",
    "continuous_block",
    "group_items",
    "own_numbers",  # first of this robot's in the table of numbers
    "next_group",  # first group that does not have this robot
    "next_sizes",  # place of the sizes of that group's robot
)
Sizes = ti.types.struct(**dict.fromkeys(_SIZES, ti.i32))

_LAST = 2**31 - 1  # no group comes after

I_SPRINGS = len(_SIZES)  # rows of: items of body 1 and of body 2 in the voxel block
I_SPRING_ROW = 2
I_ROPES = I_SPRINGS + I_SPRING_ROW * len(material.SPRINGS)
I_ROPE_ROW = 2
I_WELDS = I_ROPES + I_ROPE_ROW * len(material.ROPES)
I_WELD_ROW = 3  # items of body 1 and of body 2; 1 where body 1 lies above body 2, else 0

# A row of voxels that may collide: numbers of both; bit 4 i + j is set where square i of the first
# is welded to square j of the second.
PAIR_ROW = 3

# A reading row: kind, voxel block, slots of its ring (0: no average), ring, interval number, ray.
RE_KIND, RE_VOXEL, RE_SLOTS, RE_RING, RE_INTERVAL, RE_RAY = range(6)
READING_ROW = 6
_FIRST_STEPS = 500  # of which a table tells the length of sensor windows step by step
AREA, TOUCH, VELOCITY_X, VELOCITY_Y, RAY = range(5)
_KINDS = {
    "area": (AREA,),
    "touch": (TOUCH,),
    "velocity": (VELOCITY_X, VELOCITY_Y),
    "lidar": (RAY,),
}


@ti.func
def load_sizes(integers: ti.template(), first):
    """The sizes of a robot's model, which stand from ``first`` on."""
    return Sizes(*[integers[first + k] for k in ti.static(range(len(_SIZES)))])


@ti.func
def sizes_of_group(sizes: ti.template(), integers: ti.template(), group):
    """Turns to the robot of a group, from that of a group before it."""
    while group >= sizes.next_group:
        sizes = load_sizes(integers, sizes.next_sizes)


class Tables:
    """The model in a kernel, where it is called m: a size by its name, such as `m.voxels`.

    It exists while a kernel is compiled only, and leaves no trace in it.

    Attributes:
        integers: the table of I_*, an argument of the kernel.
        numbers: the table of F_*, likewise.
        stages: mask of the stages of `engine.step` that are taken.
    """

    _data_oriented = True  # lets Taichi pass it on as it is

    def __init__(self, sizes: Any, integers: Any, numbers: Any, stages: Any = -1) -> None:
        """What a kernel was given.

        Args:
            sizes: what `load_sizes` found.
            integers: the table of I_*.
            numbers: the table of F_*.
            stages: see the attribute; all by default, which the compiler knows.
        """
        self._sizes = sizes
        self.stages = stages
        self.integers = integers
        self.numbers = numbers

    def __getattr__(self, name: str) -> Any:
        return getattr(self._sizes, name)


@dataclass(frozen=True)
class Model:
    """A robot in a batch of worlds: what the kernels read and never write.

    Attributes:
        morphology, apparatus, engine: what it was built from.
        layout: where the state lies.
        numbers: table of F_*, shape (.,), float64.
        integers: table of I_*, shape (.,), int32.
    """

    morphology: Morphology
    apparatus: Apparatus
    engine: Engine
    layout: Layout
    numbers: np.ndarray
    integers: np.ndarray


def build(
    morphology: Morphology,
    apparatus: Apparatus,
    engine: Engine,
    conditions: Conditions,
    segments: int,
    extent: float,
    damage_mode: str,
    lanes: int,
    room: Layout | None = None,
) -> Model:
    """The model of a robot.

    Args:
        morphology: the robot's shape.
        apparatus: The robot's sensors.
        engine: settings of the solver.
        conditions: gravity, noise and so on.
        segments: terrain segments that the window of a group holds; 0 without ground.
        extent: width of the ground in the window [m].
        damage_mode: one of damage.MODES.
        lanes: worlds per group.
        room: of other robots in the same state, which has to hold this one too.
    """
    reading_rows, rays, intervals, ring_items = _readings(apparatus)
    features = engine.features(morphology)
    pairs = _voxel_pairs(morphology) if features.self_collision else []
    limit = lay.SELF_CONTACTS_PER_VOXEL * morphology.n_voxels
    own = Layout(
        voxels=morphology.n_voxels,
        welds=len(morphology.welds),
        segments=segments,
        ring_items=ring_items,
        readings=apparatus.n_readings,
        self_contacts=lanes * limit if pairs else 0,
        continuous=4 * morphology.n_voxels if features.continuous else 0,
        delay=conditions.control_delay,
    )
    layout = own if room is None else own.union(room)
    springs = [(s.square1 * lay.BODY_ITEMS, s.square2 * lay.BODY_ITEMS) for s in material.SPRINGS]
    ropes = [(a * lay.BODY_ITEMS, b * lay.BODY_ITEMS) for a, b in material.ROPES]
    welds = [_weld_row(morphology, *pair) for pair in morphology.welds]
    reading_table = I_WELDS + I_WELD_ROW * len(welds)
    pair_table = reading_table + READING_ROW * len(reading_rows)
    interval_table = pair_table + PAIR_ROW * len(pairs)
    interval_steps, windows = _windows(intervals)
    sizes = {
        "voxels": own.voxels,
        "welds": own.welds,
        "segments": layout.segments,
        "readings": own.readings,
        "header": layout.header,
        "weld_block": layout.weld_block,
        "window": layout.window,
        "rings": layout.rings,
        "reading_block": layout.reading_block,
        "contact_list": layout.contact_list,
        "contact_list_new": layout.contact_list_new,
        "rope_list": layout.rope_list,
        "velocity_iterations": engine.velocity_iterations,
        "position_iterations": engine.position_iterations,
        "control_interval": conditions.control_interval,
        "delay": layout.delay,
        "delay_block": layout.delay_block,
        "ropes": int(engine.ropes),
        "damage_mode": damage.MODES.index(damage_mode),
        "weld_table": I_WELDS,
        "reading_table": reading_table,
        "interval_table": interval_table,
        "interval_steps": interval_steps,
        "interval_row": windows.shape[1],
        "noise_table": F_RAYS + len(rays),
        "self_contact_block": layout.self_contact_block,
        "self_contact_memory": layout.self_contact_memory,
        "self_contact_bounds": layout.self_contact_bounds,
        "self_contact_list": layout.self_contact_list,
        "self_contact_list_old": layout.self_contact_list_old,
        "self_contact_limit": limit,
        "pair_table": pair_table,
        "voxel_pairs": len(pairs),
        "continuous_block": layout.continuous_block,
        "group_items": layout.items,
        "own_numbers": 0,
        "next_group": _LAST,
        "next_sizes": 0,
    }
    rows = [*springs, *ropes, *welds, *reading_rows, *pairs]
    integers = np.concatenate(
        [[sizes[name] for name in _SIZES], *rows, *windows], dtype=np.int32, casting="unsafe"
    )
    noise = conditions.reading_noise(apparatus)
    numbers = np.array(
        [
            conditions.gravity[0],
            engine.damping,
            conditions.friction[0],
            max(noise, default=0.0),
            reach(apparatus),
            extent,
            conditions.lowpass,
            *_spring_numbers(),
            *rays,
            *noise,
        ],
        dtype=np.float64,
    )
    return Model(morphology, apparatus, engine, layout, numbers, integers)


def joined(models: Sequence[Model], groups: Sequence[tuple[int, int]]) -> Model:
    """The model of a batch in which groups have different robots.

    Args:
        models: of the robots, all with the same layout.
        groups: which robot comes next, by its number, and how many groups have it.
    """
    first, *_ = models
    starts = np.cumsum([0, *(len(each.integers) for each in models)])
    numbers = np.cumsum([0, *(len(each.numbers) for each in models)])
    tables = [
        _moved(model, int(start), int(number))
        for model, start, number in zip(models, starts[:-1], numbers[:-1], strict=True)
    ]
    rows, ends = [], np.cumsum([count for _, count in groups])
    for k, (robot, _) in enumerate(groups):
        row = tables[robot][: len(_SIZES)].copy()
        if k + 1 < len(groups):
            row[_SIZES.index("next_group")] = ends[k]
            row[_SIZES.index("next_sizes")] = starts[-1] + k * len(_SIZES)
        rows.append(row)
    tables[0][: len(_SIZES)] = rows[0]
    integers = np.concatenate([*tables, *rows[1:]], dtype=np.int32)
    return dataclasses.replace(
        first, integers=integers, numbers=np.concatenate([each.numbers for each in models])
    )


def _moved(model: Model, integers: int, numbers: int) -> np.ndarray:
    """The integers of a model whose tables begin at these places."""
    moved = model.integers.copy()
    for name in ("weld_table", "reading_table", "interval_table", "pair_table"):
        moved[_SIZES.index(name)] += integers
    for name in ("noise_table", "own_numbers"):
        moved[_SIZES.index(name)] += numbers
    return moved


def reach(apparatus: Apparatus) -> float:
    """How far from a robot's squares the ground matters: to touch it, or to see it [m]."""
    ranges = [s.range for own in apparatus.sensors for s in own if s.kind == "lidar"]
    return material.SQUARE_SIDE + max(ranges, default=0.0)


def _windows(intervals: list[float]) -> tuple[int, np.ndarray]:
    """Samples in a sensor's window.

    Args:
        intervals: lengths of windows [s].

    Returns:
        Number of first steps, and a row per interval: lengths at each of these steps, then pairs
        of a step and the length from that step on, the last of which fill up the row.
    """
    first_steps = _FIRST_STEPS + math.ceil(max(intervals, default=0.0) / material.DT)
    changes = [np.stack(clock.window_changes(first_steps, each), 1) for each in intervals]
    most = max(map(len, changes), default=0)
    rows = []
    for interval, own in zip(intervals, changes, strict=True):
        filled = np.concatenate([own, own[-1:].repeat(most - len(own), 0)])
        rows.append(np.append(clock.window_lengths(first_steps, interval), filled))
    return first_steps, np.array(rows).reshape(len(intervals), first_steps + 2 * most)


def _spring_numbers() -> list[float]:
    """The rows of F_SPRINGS."""
    numbers: list[float] = []
    for spring in material.SPRINGS:
        for corner in (spring.corner1, spring.corner2):
            signs = (0, 0) if corner is None else material.CORNER_SIGNS[corner]
            numbers += [sign * material.SQUARE_HALF for sign in signs]
        family = material.FAMILIES[spring.family]
        numbers += [family.rest, family.rest - family.contracted, family.expanded - family.rest]
    return numbers


def _weld_row(morphology: Morphology, body1: int, body2: int) -> tuple[int, int, int]:
    """Items of the two bodies, and whether body 1 lies above (1) or right of (0) body 2."""
    (x1, y1), (x2, y2) = morphology.cells[body1 // 4], morphology.cells[body2 // 4]
    return lay.body_offset(body1), lay.body_offset(body2), int((x1, y1) == (x2, y2 + 1))


def _voxel_pairs(morphology: Morphology) -> list[tuple[int, int, int]]:
    """The rows of voxels that may collide: any two, for squares meet where a robot folds."""
    welded: dict[tuple[int, int], int] = {}
    for weld in morphology.welds:
        first, second = sorted(weld)
        pair = (first // 4, second // 4)
        welded[pair] = welded.get(pair, 0) | 1 << 4 * (first % 4) + second % 4
    pairs = itertools.combinations(range(morphology.n_voxels), 2)
    return [(a, b, welded.get((a, b), 0)) for a, b in pairs]


def _readings(
    apparatus: Apparatus,
) -> tuple[list[tuple[int, ...]], list[float], list[float], int]:
    """Reading rows, ray numbers, the intervals they refer to, and items of all rings."""
    rows: list[tuple[int, ...]] = []
    rays: list[float] = []
    intervals: list[float] = []
    ring = 0
    for voxel, own in enumerate(apparatus.sensors):
        for sensor in own:
            slots = number = 0
            if sensor.interval:
                if sensor.interval not in intervals:
                    intervals.append(sensor.interval)
                number = intervals.index(sensor.interval)
                slots = math.ceil(sensor.interval / material.DT) + 2
            kinds = _KINDS[sensor.kind]
            for part in range(sensor.n_readings):
                kind = kinds[part % len(kinds)]
                ray = len(rays) // F_RAY_ROW
                rows.append((kind, voxel * lay.VOXEL_ITEMS, slots, ring, number, ray))
                ring += slots
                if sensor.kind == "lidar":
                    radians = math.radians(sensor.angles[part])
                    rays += [math.cos(radians), math.sin(radians), sensor.range]
    return rows, rays, intervals, ring
