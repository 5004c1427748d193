"""One instant of a robot, and the windows that follow it over many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from physics.render.canvas import Camera
from physics.render.palette import area_level
from physics.scene.material import CORNER_SIGNS, SQUARE_HALF, VOXEL_SIDE, crossed_diagonals
from physics.scene.terrain import Terrain

_GROUND_DEPTH = 0.25  # share of a picture's height that lies under the robot's ground
_LEAST_ASPECT, _MOST_ASPECT = 1.5, 2.5  # width / height of a picture
_MIN_WIDTH = 64  # of a picture [pixels]
_SMOOTHING = 0.4  # of the camera's path, standard deviation [s]


def square_corners(poses: np.ndarray) -> np.ndarray:
    """Corners (..., 4, 2) [m] of rigid squares with poses (..., 3): x, y [m], angle [rad].

    The corners are in the order NW, NE, SE, SW of the square itself.
    """
    local = SQUARE_HALF * np.array(CORNER_SIGNS, dtype=np.float64)
    cos, sin = np.cos(poses[..., 2, None]), np.sin(poses[..., 2, None])
    x = poses[..., 0, None] + cos * local[:, 0] - sin * local[:, 1]
    y = poses[..., 1, None] + sin * local[:, 0] + cos * local[:, 1]
    return np.stack([x, y], axis=-1)


def voxel_outlines(poses: np.ndarray) -> np.ndarray:
    """Outer corners (V, 4, 2) [m], NW NE SE SW, of voxels with square poses (V, 4, 3)."""
    return np.diagonal(square_corners(poses), axis1=1, axis2=2).transpose(0, 2, 1)


@dataclass(frozen=True, eq=False)
class Frame:
    """One instant of one robot.

    Attributes:
        poses: (V, 4, 3) x, y [m] and angle [rad] of the squares NW, NE, SE, SW of each voxel.
        time: time of the instant [s].
        actuation: (V,) in [-1, 1], +1 contracts. Voxels are coloured by it if it is given, and
            by their area ratio if not.
        rays: (K, 2, 2) start and end [m] of the lidar's rays, or None.
        hits: (K,) bool, whether each ray ends on something, or None.
        broken: (V,) bool, voxels that no longer work, or None.

    Raises:
        ValueError: an array has another shape, or holds a number that is not finite.
    """

    poses: np.ndarray
    time: float = 0.0
    actuation: np.ndarray | None = None
    rays: np.ndarray | None = None
    hits: np.ndarray | None = None
    broken: np.ndarray | None = None

    def __post_init__(self) -> None:
        poses = _checked("poses", self.poses, ("V", 4, 3))
        checked = {"poses": poses}
        if self.actuation is not None:
            checked["actuation"] = _checked("actuation", self.actuation, (len(poses),))
        if self.rays is not None:
            checked["rays"] = _checked("rays", self.rays, ("K", 2, 2))
        if self.hits is not None:
            n_rays = len(checked.get("rays", ()))
            checked["hits"] = _checked("hits", self.hits, (n_rays,)) != 0
        if self.broken is not None:
            checked["broken"] = _checked("broken", self.broken, (len(poses),)) != 0
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def outlines(self) -> np.ndarray:
        """(V, 4, 2) outer corners of the voxels [m], NW NE SE SW."""
        return voxel_outlines(self.poses)

    @property
    def levels(self) -> np.ndarray:
        """(V,) what voxels are coloured by, from -1 (contracted) to +1 (expanded)."""
        if self.actuation is not None:
            return -self.actuation
        areas = np.abs(crossed_diagonals(*self.outlines.T)) / 2
        return area_level(areas / VOXEL_SIDE**2)

    @property
    def n_broken(self) -> int:
        """Number of voxels that no longer work."""
        return 0 if self.broken is None else int(self.broken.sum())

    @property
    def bounds(self) -> np.ndarray:
        """(2, 2) lower left and upper right corner [m] of the box around the robot."""
        points = square_corners(self.poses).reshape(-1, 2)
        return np.stack([points.min(axis=0), points.max(axis=0)])


def follow(
    frames: Sequence[Frame],
    terrain: Terrain | None,
    width: int,
    *,
    room: float = 2.4,
    smooth: bool = True,
) -> list[Camera]:
    """One camera per frame, of the same scale and size, that keeps the robot in view.

    Args:
        frames: the frames, in order of time.
        terrain: the ground, or None.
        width: width of the picture [pixels]; its height follows from the robot's.
        room: least width of the view, in widths of the robot.
        smooth: whether the camera glides rather than mirror every shake of the robot.

    Raises:
        ValueError: there is no frame, or the width is too small.
    """
    check_view(frames, width)
    bounds = np.stack([frame.bounds for frame in frames])  # (T, 2, 2)
    span = (bounds[:, 1] - bounds[:, 0]).max(axis=0)
    view_height = (1 + 0.2 * (room - 1)) * span[1] / (1 - _GROUND_DEPTH)
    view_width = max(room * span[0], _LEAST_ASPECT * view_height)
    view_height = max(view_height, view_width / _MOST_ASPECT)
    view = np.array([view_width, view_height])

    anchors = np.array([_anchor(box, terrain) for box in bounds])  # on the ground, under the robot
    if smooth and len(frames) > 1:
        spacing = (frames[-1].time - frames[0].time) / (len(frames) - 1)
        sigma = _SMOOTHING / max(spacing, 1e-3)
        anchors = gaussian_filter1d(anchors, sigma, axis=0, mode="nearest")
    centers = anchors + np.array([0.0, (0.5 - _GROUND_DEPTH) * view_height])
    margin = 0.02 * view
    centers = np.clip(centers, bounds[:, 1] + margin - view / 2, bounds[:, 0] - margin + view / 2)

    scale = width / view_width
    size = (width, 2 * round(view_height * scale / 2))  # video codecs want even sizes
    return [Camera((float(x), float(y)), float(scale), size) for x, y in centers]


def check_view(frames: Sequence[Frame], width: int) -> None:
    """Raise ValueError unless there is something to draw, on a picture wide enough."""
    if not frames:
        raise ValueError("frames: expected at least one frame, got none")
    if width < _MIN_WIDTH:
        raise ValueError(f"width: expected at least {_MIN_WIDTH} pixels, got {width}")


def _anchor(box: np.ndarray, terrain: Terrain | None) -> tuple[float, float]:
    """Middle of the robot's box (2, 2), and the median height of the ground under it [m]."""
    middle = float(box[:, 0].mean())
    if terrain is None:
        return middle, float(box[0, 1])
    return middle, float(np.median(terrain.height(np.linspace(box[0, 0], box[1, 0], 16))))


def _checked(name: str, value: object, shape: tuple[int | str, ...]) -> np.ndarray:
    """The value as float64; a letter in the shape stands for any length of at least 1."""
    array = np.asarray(value, dtype=np.float64)
    fits = array.ndim == len(shape) and all(
        got == wanted if isinstance(wanted, int) else got > 0
        for wanted, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        wanted = ", ".join(map(str, shape))
        raise ValueError(f"{name}: expected an array of shape ({wanted}), got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: expected finite numbers, got NaN or infinity")
    return array
