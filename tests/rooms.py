"""Points on the surfaces of made-up rooms whose plan is known, for tests of single stages.

A scanner sees surfaces from the front only, and so do these: each wall face is a rectangle of points of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import laspy
import numpy as np
from numpy.typing import NDArray

from asbuilt import Evidence, evidence_from_points, find_storeys
from asbuilt.plan import FloorPlan
from asbuilt.profiles import StoreyVoxels, storey_voxels

Array = NDArray[np.float64]
Ring = Sequence[tuple[float, float]]

SPACING = 0.015
NOISE = 0.002


def rectangle(corner: Sequence[float], a: Sequence[float], b: Sequence[float], spacing: float = SPACING) -> Array:
    """Points (n, 3) in rows, `spacing` (m) apart, on the rectangle that spans `a` and `b` from a corner."""
    corner, a, b = (np.asarray(v, dtype=np.float64) for v in (corner, a, b))
    s, t = (np.arange(spacing / 2, length, spacing) / length for length in (np.linalg.norm(a), np.linalg.norm(b)))
    s, t = (grid.ravel()[:, None] for grid in np.meshgrid(s, t))
    return corner + s * a + t * b


def wall(start: Sequence[float], end: Sequence[float], low: float = 0.0, high: float = 2.6) -> Array:
    """Points of an upright face from `start` to `end` (x, y), between two heights."""
    return rectangle((*start, low), (end[0] - start[0], end[1] - start[1], 0), (0, 0, high - low))


def level(x0: float, y0: float, x1: float, y1: float, z: float) -> Array:
    """Points of a horizontal rectangle."""
    return rectangle((x0, y0, z), (x1 - x0, 0, 0), (0, y1 - y0, 0))


def box_room(x0: float, y0: float, x1: float, y1: float, low: float = 0.0, high: float = 2.6) -> Array:
    """The inside of an empty rectangular room: four walls, floor and ceiling."""
    ring = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return np.concatenate([walls(ring, low, high), level(x0, y0, x1, y1, low), level(x0, y0, x1, y1, high)])


def walls(ring: Ring, low: float = 0.0, high: float = 2.6) -> Array:
    """The upright faces along a closed ring of corners."""
    return np.concatenate([wall(a, b, low, high) for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)])


def without(points: Array, low: Sequence[float], high: Sequence[float]) -> Array:
    """Points outside of an axis-parallel box: an opening, or what a box hides."""
    return points[~((points > low) & (points < high)).all(axis=1)]


def box(x0: float, y0: float, x1: float, y1: float, high: float, low: float = 0.0) -> Array:
    """The outside of a cupboard, a column, a table: four sides and its top."""
    ring = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return np.concatenate([walls(ring, low, high), level(x0, y0, x1, y1, high)])


def noisy(points: Array, sigma: float = NOISE, seed: int = 1) -> Array:
    """The points with normal noise on every coordinate, m."""
    return points + np.random.default_rng(seed).normal(0, sigma, points.shape)


def turned(points: Array, degrees: float, shift: Sequence[float] = (0.0, 0.0, 0.0)) -> Array:
    """The points turned about z and then moved."""
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    moved: Array = points @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]) + shift
    return moved


def write_las(path: Path, points: Array, source: int = 0) -> Path:
    """The points as LAS 1.4 to a tenth of a millimetre, all of one scan; gives the path."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, 0.0001), np.floor(np.nanmin(points, axis=0))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = points.T
    cloud.point_source_id = np.full(len(points), source, dtype=np.uint16)
    cloud.write(path)
    return path


def evidence(*parts: Array, sigma: float = NOISE, seed: int = 1) -> Evidence:
    """The evidence of what was seen, with noise."""
    return evidence_from_points(noisy(np.concatenate(parts), sigma, seed))


def voxels_of(*parts: Array) -> StoreyVoxels:
    """The voxels of the one storey that is seen, with noise."""
    cloud = evidence(*parts)
    (storey,) = find_storeys(cloud)
    return storey_voxels(cloud, storey, None)


def segments(plan: FloorPlan, storey: int = 0) -> Array:
    """The wall faces (n, 4) of a storey."""
    return np.array([(*face.start, *face.end) for face in plan.storeys[storey].wall_faces]).reshape(-1, 4)


def lying_on(found: Array, start: Sequence[float], end: Sequence[float], within: float) -> Array:
    """Which part of the straight line between two points the segments (n, 4) cover that lie `within` (m) of it.

    Returns (k, 2): from and to, m from `start`, sorted.
    """
    start, end = np.asarray(start), np.asarray(end)
    length = float(np.hypot(*(end - start)))
    along = (end - start) / length
    relative = found.reshape(-1, 2, 2) - start
    near = (np.abs(relative @ np.array([-along[1], along[0]])) <= within).all(axis=1)
    place = np.sort((relative @ along)[near], axis=1)
    place = place[(place[:, 1] > 0.02) & (place[:, 0] < length - 0.02)]
    return place[np.argsort(place[:, 0])]
