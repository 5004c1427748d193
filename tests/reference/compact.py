"""Writes this folder's files from the full recordings: python -m tests.reference.compact DIR."""

from __future__ import annotations

import csv
import gzip
import json
import sys
from pathlib import Path

import numpy as np

from tests.reference import FOLDER

KINDS = {"DistanceJoint": "spring", "RopeJoint": "rope", "WeldJoint": "weld"}
SENSOR_STEPS = 300


def table(path: Path) -> tuple[list[str], np.ndarray]:
    """Column names and numbers of a CSV file, plain or gzipped."""
    opener = gzip.open if path.suffix == ".gz" else open
    with opener(path, "rt") as file:
        rows = list(csv.reader(file))
    return rows[0], np.array(rows[1:], dtype=np.float64)


def squares(names: list[str], values: np.ndarray) -> np.ndarray:
    """State x, y, angle, vx, vy, omega of the squares, shape (rows, V, 4, 6)."""
    first = next(i for i, name in enumerate(names) if name.endswith("_NW_x"))
    count = 4 * sum(name.endswith("_NW_x") for name in names)
    return values[:, first : first + 6 * count].reshape(len(values), -1, 4, 6)


def column(names: list[str], values: np.ndarray, *endings: str) -> np.ndarray:
    """The columns with these names or endings, shape (rows, number of them)."""
    return values[:, [i for i, name in enumerate(names) if name.endswith(endings)]]


def save(name: str, **arrays: np.ndarray) -> None:
    np.savez_compressed(FOLDER / f"{name}.npz", **arrays)


def terrains(source: Path) -> None:
    profiles = json.loads((source / "terrains.json").read_text())
    arrays = {name: np.array([p["xs"], p["ys"]]) for name, p in profiles.items()}
    save("terrains", **arrays)


def joint_orders(source: Path) -> None:
    orders = {}
    for shape in ("box-1x1", "box-2x1", "box-2x2", "worm-7x1", "biped-4x3"):
        joints = json.loads((source / f"joint_order_{shape}.json").read_text())
        orders[shape] = [
            [
                KINDS[joint["type"]],
                joint["body1"],
                joint["body2"],
                *(round(value, 12) for value in joint["localAnchor1"] + joint["localAnchor2"]),
                round(joint["distance"], 12) if "distance" in joint else None,
            ]
            for joint in joints["joints_in_solver_order"]
        ]
    rows = {s: "[\n" + ",\n".join(map(json.dumps, o)) + "\n]" for s, o in orders.items()}
    text = ",\n".join(f'"{shape}": {body}' for shape, body in rows.items())
    (FOLDER / "joint_orders.json").write_text("{\n" + text + "\n}\n")


def free_flight(source: Path) -> None:
    for name, dtype in (("single", np.float64), ("two", np.float64), ("four", np.float32)):
        names, values = table(source / f"{name}_voxel_step.csv")
        state = squares(names, values)
        first = next(i for i, column_name in enumerate(names) if column_name.endswith("_NW_x"))
        actuation = values[:, 1:first]
        areas = column(names, values, "area_ratio", *(f"area{v}" for v in range(4)))
        save(
            f"{name}_voxel_step",
            actuation=actuation,
            state=state.astype(dtype),
            area_ratio=areas.astype(np.float32),
        )


def drop(source: Path) -> None:
    names, values = table(source / "single_voxel_drop.csv")
    touch = column(names, values, "NW_touch", "NE_touch", "SE_touch", "SW_touch")
    save(
        "single_voxel_drop",
        state=squares(names, values),
        touching=touch.astype(bool)[:, None, :],
        false_events=column(names, values, "toi_events")[:, 0].astype(np.int16),
    )


def passive(source: Path) -> None:
    for shape in ("worm", "biped"):
        names, values = table(source / f"passive_{shape}.csv")
        per_voxel = values[:, 1 : names.index("com_x")].reshape(len(values), -1, 4)
        save(
            f"passive_{shape}",
            centers=per_voxel[:, :, :2].astype(np.float32),
            area_ratio=per_voxel[:, :, 2].astype(np.float32),
            touching=per_voxel[:, :, 3].astype(bool),
        )


def sensors(source: Path) -> None:
    names, values = table(source / "sensors_poses_biped-4x3.csv.gz")
    rows = slice(1, 1 + SENSOR_STEPS)  # row 0 is the start, before any step
    readings = {}
    for apparatus in ("high", "medium", "low"):
        header, numbers = table(source / f"sensors_biped-4x3_{apparatus}.csv")
        readings[apparatus] = dict(zip(header[1:], numbers[:SENSOR_STEPS, 1:].T, strict=True))
    for apparatus in ("medium", "low"):  # their columns repeat those of high
        for name, numbers in readings[apparatus].items():
            assert np.array_equal(numbers, readings["high"][name])
    save(
        "sensors_biped",
        state=squares(names, values)[rows],
        touching=column(names, values, "_gtouch")[rows].reshape(-1, 10, 4).astype(bool),
        readings=np.array(list(readings["high"].values())).T,
        **{f"names_{a}": np.array(list(readings[a])) for a in readings},
    )


def random_gaits(source: Path) -> None:
    for shape in ("worm-7x1", "biped-4x3"):
        _, values = table(source / f"random_gaits_params_{shape}.csv")
        names, speeds = table(source / f"random_gaits_clean_{shape}.csv")
        parameters = values[:, 2:].reshape(len(values), 2, -1)
        columns = ("veto", "veto_dx", "noccd", "noself")
        save(
            f"random_gaits_{shape.split('-')[0]}",
            frequency=values[:, 1],
            amplitude=parameters[:, 0],
            phase=parameters[:, 1],
            **{
                ground: speeds[:, [names.index(f"vel_{ground}_{c}") for c in columns]]
                for ground in ("flat", "hilly")
            },
        )


if __name__ == "__main__":
    for write in (terrains, joint_orders, free_flight, drop, passive, sensors, random_gaits):
        write(Path(sys.argv[1]))
