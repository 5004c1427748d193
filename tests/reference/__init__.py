"""Runs recorded from the reference simulator; README.md says what each file holds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

FOLDER = Path(__file__).parent


def load(name: str) -> dict[str, np.ndarray]:
    """The arrays of a recorded run, by name."""
    with np.load(FOLDER / f"{name}.npz") as arrays:
        return dict(arrays)


def joint_order(shape: str) -> list[list[Any]]:
    """Joints in recorded solving order: kind, bodies 1 and 2, anchors 1 and 2, rest length."""
    return json.loads((FOLDER / "joint_orders.json").read_text())[shape]
