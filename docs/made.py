"""Points of what the example house does not have, made for pictures: a flat, a hall with columns, a flight of stairs.

They are those of a scan without clutter: each surface is seen from its front, evenly, with 2 mm of noise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import asbuilt
from asbuilt.profiles import StoreyVoxels, storey_voxels

Array = NDArray[np.float64]
SPACING, HEIGHT = 0.015, 2.8


def plane(corner: tuple[float, float, float], a: tuple[float, float, float], b: tuple[float, float, float]) -> Array:
    """Points of the rectangle that two sides span from a corner."""
    s, t = (np.arange(SPACING / 2, length, SPACING) / length for length in (np.linalg.norm(a), np.linalg.norm(b)))
    grid = np.stack(np.meshgrid(s, t), axis=-1).reshape(-1, 2)
    points: Array = np.array(corner) + grid @ np.array([a, b])
    return points


def room(x: float, y: float, hole: tuple[float, float, float, float] | None = None) -> Array:
    """An empty room of x by y m, over part of which the ceiling is open."""
    walls = [((0, 0, 0), (x, 0, 0)), ((x, 0, 0), (0, y, 0)), ((x, y, 0), (-x, 0, 0)), ((0, y, 0), (0, -y, 0))]
    ceiling = plane((0, 0, HEIGHT), (x, 0, 0), (0, y, 0))
    if hole is not None:
        x0, y0, x1, y1 = hole
        ceiling = ceiling[~((ceiling[:, :2] > (x0, y0)) & (ceiling[:, :2] < (x1, y1))).all(axis=1)]
    return np.vstack(
        [*(plane(c, a, (0, 0, HEIGHT)) for c, a in walls), plane((0, 0, 0), (x, 0, 0), (0, y, 0)), ceiling]
    )


def flat() -> asbuilt.Evidence:
    """Three rooms with doors between them; cupboards hide part of two walls and a corner."""
    rooms = [((0.0, 0.0), room(5.0, 4.0)), ((5.15, 0.0), room(3.6, 4.0)), ((0.0, 4.15), room(8.75, 1.6))]
    points = np.vstack([part + np.array([*corner, 0.0]) for corner, part in rooms])
    for (x0, x1), (y0, y1) in (((3.6, 4.5), (4.0, 4.15)), ((5.5, 6.4), (4.0, 4.15)), ((5.0, 5.15), (1.6, 2.5))):
        along_x = y0 == 4.0
        low, high = ((x0, 3.9, 0.001), (x1, 4.25, 2.05)) if along_x else ((4.9, y0, 0.001), (5.25, y1, 2.05))
        points = points[~((points > low) & (points < high)).all(axis=1)]
        a, b = (x1 - x0, 0, 0), (0, y1 - y0, 0)
        points = np.vstack([points, *(plane((x0, y0, z), a, b) for z in (0, 2.05))])
        through, across = (b, a) if along_x else (a, b)
        jambs = (np.array((x0, y0, 0.0)), np.array((x0, y0, 0.0)) + across)
        points = np.vstack([points, *(plane((*jamb[:2], 0), through, (0, 0, 2.05)) for jamb in jambs)])
    for (x0, y0), (x1, y1) in (((0.0, 0.0), (0.6, 1.8)), ((6.9, 3.4), (8.75, 4.0))):
        low, high = (x0 - 0.05, y0 - 0.05, -1.0), (x1, y1 + 0.05, 2.2)
        points = points[~((points > low) & (points < high)).all(axis=1)]
        x, y = (x1, y1) if y0 == 0 else (x0, y0)  # the sides that look into the room
        points = np.vstack(
            [
                points,
                plane((x0, y0, 2.2), (x1 - x0, 0, 0), (0, y1 - y0, 0)),
                plane((x0, y, 0), (x1 - x0, 0, 0), (0, 0, 2.2)),
                plane((x, y0, 0), (0, y1 - y0, 0), (0, 0, 2.2)),
            ]
        )
    return asbuilt.evidence_from_points(points + np.random.default_rng(2).normal(0, 0.002, points.shape) + 0.02)


def hall() -> StoreyVoxels:
    """Two columns, of which the square one is seen from two sides, and a cupboard as large as a column."""
    radius = 0.22
    turn = np.arange(0, 2 * np.pi, SPACING / radius)
    turns, z = (part.ravel() for part in np.meshgrid(turn, np.arange(0, HEIGHT, SPACING)))
    round_one = np.column_stack([3.2 + radius * np.cos(turns), 1.4 + radius * np.sin(turns), z])
    square = np.vstack([plane((1.0, 1.0, 0), side, (0, 0, HEIGHT)) for side in ((0.5, 0, 0), (0, 0.4, 0))])
    corners = ((4.4, 0.8), (4.9, 0.8), (4.9, 1.3), (4.4, 1.3))
    cupboard = np.vstack(
        [
            plane((*a, 0), (b[0] - a[0], b[1] - a[1], 0), (0, 0, 2.1))
            for a, b in zip(corners, corners[1:] + corners[:1], strict=True)
        ]
    )
    points = room(6.0, 2.6)
    low = points[:, 2] < 0.01
    for x, y, side in ((1.25, 1.2, 0.25), (3.2, 1.4, radius), (4.65, 1.05, 0.25)):
        points = points[~(low & (np.abs(points[:, :2] - (x, y)) < side).all(axis=1))]
        low = points[:, 2] < 0.01
    return _voxels(np.vstack([points, round_one, square, cupboard]))


def staircase() -> StoreyVoxels:
    """A flight of fifteen steps; the treads above a scanner's eyes were not seen."""
    steps = []
    for i in range(15):
        x, z = 1.0 + 0.27 * i, 0.178 * (i + 1)
        steps.append(plane((x, 0.8, z - 0.178), (0, 1.1, 0), (0, 0, 0.178)))
        if z < 1.7:
            steps.append(plane((x, 0.8, z), (0.27, 0, 0), (0, 1.1, 0)))
    return _voxels(np.vstack([room(6.0, 2.6, (1.0, 0.8, 5.05, 1.9)), *steps]))


def _voxels(points: Array) -> StoreyVoxels:
    points = points + np.random.default_rng(0).normal(0, 0.002, points.shape) + np.array([0.3, 0.2, 0.02])
    cloud = asbuilt.evidence_from_points(points)
    return storey_voxels(cloud, asbuilt.find_storeys(cloud)[0], None)
