"""Robots at known places, to draw."""

import numpy as np

from physics.render.draw import (
    Picture,
)
from physics.render.frame import Frame
from physics.scene.terrain import Terrain

FLAT = Terrain.from_profile([0, 10, 1990, 2000], [100, 5, 5, 100])


def voxels(centers, gap=0.0, angle=0.0):
    """Square poses (V, 4, 3) of voxels whose squares are moved outward by ``gap`` along x and y
    and which are turned as a whole by ``angle`` about their centres."""
    offsets = (0.9 + gap) * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]], dtype=float)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    positions = np.asarray(centers)[:, None] + offsets @ turn.T
    return np.concatenate([positions, np.full((*positions.shape[:2], 1), angle)], axis=-1)


def duo(x=20.0, y=6.5):
    """Two voxels side by side, the left one centred at x, y."""
    return voxels([[x, y], [x + 3, y]])


def pixel(image, camera, point):
    x, y = camera.to_pixels(np.array(point)).round().astype(int)
    return image.getpixel((int(x), int(y)))


def travel(n=20, speed=4.0, jump=0.0, rate=20.0):
    times = np.arange(n) / rate
    heights = 6.5 + jump * np.abs(np.sin(9 * times))
    return [
        Frame(duo(14 + speed * t, height), float(t))
        for t, height in zip(times, heights, strict=True)
    ]


def plain(width, height, color):
    return Picture((width, height), color, lambda canvas: None)
