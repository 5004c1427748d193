"""What a robot senses: which sensors each voxel carries, and how the readings are named.

The definitions are the paper's (Sec. III-A): high, medium and low apparatus. For the biped
they give 29, 20 and 8 readings (the paper prints 48 and 36 for the first two, which its own
definition does not give).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from physics.scene.morphology import Morphology

__all__ = ["Apparatus", "Sensor"]

KINDS = ("area", "touch", "velocity", "lidar")  # in the order of a voxel's readings
_INTERVALS = {"touch": 0.25, "velocity": 0.5}  # [s]
LIDAR_ANGLES = (-45.0, 0.0, 45.0)  # [degrees]
NAMES = ("low", "medium", "high")


@dataclass(frozen=True, init=False)
class Sensor:
    """One sensor of a voxel.

    Attributes:
        kind: "area", "touch", "velocity" or "lidar".
        interval: length of the window it averages over [s]; 0 for area and lidar.
        angles: directions of a lidar's rays from the voxel's own angle [degrees], one reading
            each; none for the other kinds.
        range: length of a lidar's rays [m].
    """

    kind: str
    interval: float
    angles: tuple[float, ...]
    range: float

    def __init__(
        self,
        kind: str,
        interval: float | None = None,
        angles: Iterable[float] | None = None,
        range: float = 10.0,
    ) -> None:
        """A sensor; touch averages over 0.25 s, velocity over 0.5 s, and a lidar looks at
        -45, 0 and 45 degrees, unless told otherwise.

        Raises:
            ValueError: if the kind is unknown, or a setting is not one of that kind.
        """
        if kind not in KINDS:
            raise ValueError(f"sensor: expected kind in {', '.join(KINDS)}, got {kind!r}")
        averages, casts = kind in _INTERVALS, kind == "lidar"
        if interval is None:
            interval = _INTERVALS.get(kind, 0.0)
        if angles is None:
            angles = LIDAR_ANGLES if casts else ()
        angles = tuple(map(float, angles))
        if not (interval > 0 if averages else interval == 0):
            wanted = "> 0 s" if averages else "none (it does not average)"
            raise ValueError(f"{kind} sensor: expected interval {wanted}, got {interval!r}")
        if casts != (len(angles) > 0):
            wanted = "at least one angle" if casts else "no angles"
            raise ValueError(f"{kind} sensor: expected {wanted}, got {angles!r}")
        if not range > 0:
            raise ValueError(f"{kind} sensor: expected range > 0 m, got {range!r}")
        for field, value in (
            ("kind", kind),
            ("interval", float(interval)),
            ("angles", angles),
            ("range", float(range)),
        ):
            object.__setattr__(self, field, value)

    @property
    def n_readings(self) -> int:
        """Number of readings it gives."""
        return len(self.suffixes)

    @property
    def suffixes(self) -> tuple[str, ...]:
        """What its readings are called within the voxel."""
        if self.kind == "velocity":
            return ("vel_x", "vel_y")
        if self.kind == "lidar":
            return tuple(f"lidar_{ray}" for ray, _ in enumerate(self.angles))
        return (self.kind,)


@dataclass(frozen=True)
class Apparatus:
    """The sensors of a whole robot.

    Attributes:
        sensors: The sensors of each voxel, in voxel order; at most one of a kind. They are kept in
            the order of readings: area, touch, velocity, lidar.
    """

    sensors: tuple[tuple[Sensor, ...], ...]

    def __post_init__(self) -> None:
        ordered = []
        for voxel, own in enumerate(self.sensors):
            kinds = [sensor.kind for sensor in own]
            if len(set(kinds)) < len(kinds):
                raise ValueError(
                    f"sensors: expected at most one of a kind in a voxel, got {kinds} in {voxel}"
                )
            ordered.append(tuple(sorted(own, key=lambda sensor: KINDS.index(sensor.kind))))
        object.__setattr__(self, "sensors", tuple(ordered))

    @classmethod
    def named(
        cls,
        name: str,
        morphology: Morphology,
        lidar_angles: tuple[float, ...] = LIDAR_ANGLES,
    ) -> Apparatus:
        """An apparatus of the paper.

        high: area everywhere, touch in the bottom row, velocity in the top row, lidar in the
        rightmost column. medium: high without lidar. low: area in the two top rows, or in the
        three central voxels of a robot one voxel high.

        Args:
            name: "low", "medium" or "high".
            morphology: The robot's shape.
            lidar_angles: directions of the rays [degrees].

        Raises:
            ValueError: if the name is unknown.
        """
        if name not in NAMES:
            raise ValueError(f"sensors: expected one of {', '.join(NAMES)}, got {name!r}")
        if name == "low":
            return cls(
                tuple((Sensor("area"),) * _is_central(c, morphology) for c in morphology.cells)
            )
        top, right = morphology.height - 1, morphology.width - 1
        sensors = []
        for x, y in morphology.cells:
            own = [Sensor("area")]
            if y == 0:
                own.append(Sensor("touch"))
            if y == top:
                own.append(Sensor("velocity"))
            if x == right and name == "high":
                own.append(Sensor("lidar", angles=tuple(lidar_angles)))
            sensors.append(tuple(own))
        return cls(tuple(sensors))

    @classmethod
    def of(cls, spec: str | Apparatus | None, morphology: Morphology) -> Apparatus:
        """The apparatus that a name, an Apparatus or None (no sensors) stands for.

        Raises:
            ValueError: if the name is unknown or the Apparatus is for another number of voxels.
        """
        if spec is None:
            return cls(((),) * morphology.n_voxels)
        apparatus = spec if isinstance(spec, Apparatus) else cls.named(spec, morphology)
        if len(apparatus.sensors) != morphology.n_voxels:
            raise ValueError(
                f"sensors: expected one tuple for each of the {morphology.n_voxels} voxels of "
                f"{morphology.name}, got {len(apparatus.sensors)}"
            )
        return apparatus

    @cached_property
    def n_readings(self) -> int:
        """Number of readings, R."""
        return len(self.kinds)

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """The kind of sensor behind each reading, R labels."""
        return tuple(sensor.kind for own in self.sensors for sensor in own for _ in sensor.suffixes)

    def names(self, morphology: Morphology) -> tuple[str, ...]:
        """The name of each reading, such as "v3_0_lidar_1", R of them."""
        return tuple(
            f"{voxel}_{suffix}"
            for voxel, own in zip(morphology.voxel_names, self.sensors, strict=True)
            for sensor in own
            for suffix in sensor.suffixes
        )


def _is_central(cell: tuple[int, int], morphology: Morphology) -> bool:
    """Whether the low apparatus has a sensor in this cell."""
    if morphology.height > 1:
        return cell[1] >= morphology.height - 2
    first = max(0, (morphology.width - 3) // 2)
    return first <= cell[0] < first + 3
