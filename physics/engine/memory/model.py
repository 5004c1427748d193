"""What stays fixed while a batch of worlds is simulated, made into tables for the kernels."""

import dataclasses
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from physics.engine.memory import layout as lay
from physics.engine.memory.layout import Layout
from physics.engine.memory.settings import Engine
from physics.engine.memory.tables import (
    AREA,
    F_RAY_ROW,
    F_RAYS,
    I_WELD_ROW,
    I_WELDS,
    PAIR_ROW,
    RAY,
    READING_ROW,
    SIZES,
    TOUCH,
    VELOCITY_X,
    VELOCITY_Y,
)
from physics.scene import clock, damage, material
from physics.scene.conditions import Conditions
from physics.scene.morphology import Morphology
from physics.scene.sensors import Apparatus

_LAST = 2**31 - 1  # no group comes after
_FIRST_STEPS = 500  # of which a table tells the length of sensor windows step by step
_KINDS = {
    "area": (AREA,),
    "touch": (TOUCH,),
    "velocity": (VELOCITY_X, VELOCITY_Y),
    "lidar": (RAY,),
}


@dataclass(frozen=True)
class Model:
    """A robot in a batch of worlds: what the kernels read and never write.

    Attributes:
        layout: where the state lies.
        numbers: table of F_*, shape (.,), float64.
        integers: table of I_*, shape (.,), int32.
    """

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
        [[sizes[name] for name in SIZES], *rows, *windows], dtype=np.int32, casting="unsafe"
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
    return Model(layout, numbers, integers)


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
        row = tables[robot][: len(SIZES)].copy()
        if k + 1 < len(groups):
            row[SIZES.index("next_group")] = ends[k]
            row[SIZES.index("next_sizes")] = starts[-1] + k * len(SIZES)
        rows.append(row)
    tables[0][: len(SIZES)] = rows[0]
    integers = np.concatenate([*tables, *rows[1:]], dtype=np.int32)
    return dataclasses.replace(
        first, integers=integers, numbers=np.concatenate([each.numbers for each in models])
    )


def _moved(model: Model, integers: int, numbers: int) -> np.ndarray:
    """The integers of a model whose tables begin at these places."""
    moved = model.integers.copy()
    for name in ("weld_table", "reading_table", "interval_table", "pair_table"):
        moved[SIZES.index(name)] += integers
    for name in ("noise_table", "own_numbers"):
        moved[SIZES.index(name)] += numbers
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
