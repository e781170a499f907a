"""Points of what the example house does not have, made for pictures: a flat, a hall with columns, a flight of stairs.

They are those of a scan without clutter: each surface is seen from its front, evenly, with 2 mm of noise
(tests/rooms.py makes them for the tests, too).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import asbuilt
from asbuilt.profiles import StoreyVoxels, storey_voxels

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from rooms import SPACING, box_room, level, noisy, rectangle, wall, walls, without

Array = NDArray[np.float64]
HEIGHT, HEAD = 2.8, 2.05


def flat() -> asbuilt.Evidence:
    """Three rooms with doors between them; cupboards hide part of two walls and a corner."""
    corners = ((0.0, 0.0, 5.0, 4.0), (5.15, 0.0, 8.75, 4.0), (0.0, 4.15, 8.75, 5.75))
    points = np.vstack([box_room(*room, 0.0, HEIGHT) for room in corners])
    for (x0, x1), (y0, y1) in (((3.6, 4.5), (4.0, 4.15)), ((5.5, 6.4), (4.0, 4.15)), ((5.0, 5.15), (1.6, 2.5))):
        along_x = y0 == 4.0
        low, high = ((x0, 3.9, 0.001), (x1, 4.25, HEAD)) if along_x else ((4.9, y0, 0.001), (5.25, y1, HEAD))
        jambs = [((x, y0), (x, y1)) for x in (x0, x1)] if along_x else [((x0, y), (x1, y)) for y in (y0, y1)]
        points = without(points, low, high)
        points = np.vstack([points, *(level(x0, y0, x1, y1, z) for z in (0, HEAD))])
        points = np.vstack([points, *(wall(*jamb, 0.0, HEAD) for jamb in jambs)])
    for (x0, y0), (x1, y1) in (((0.0, 0.0), (0.6, 1.8)), ((6.9, 3.4), (8.75, 4.0))):
        points = without(points, (x0 - 0.05, y0 - 0.05, -1.0), (x1, y1 + 0.05, 2.2))
        x, y = (x1, y1) if y0 == 0 else (x0, y0)  # the sides that look into the room
        sides = (wall((x0, y), (x1, y), 0.0, 2.2), wall((x, y0), (x, y1), 0.0, 2.2))
        points = np.vstack([points, level(x0, y0, x1, y1, 2.2), *sides])
    return asbuilt.evidence_from_points(noisy(points, seed=2) + 0.02)


def hall() -> StoreyVoxels:
    """Two columns, of which the square one is seen from two sides, and a cupboard as large as a column."""
    radius = 0.22
    turn = np.arange(0, 2 * np.pi, SPACING / radius)
    turns, z = (part.ravel() for part in np.meshgrid(turn, np.arange(0, HEIGHT, SPACING)))
    round_one = np.column_stack([3.2 + radius * np.cos(turns), 1.4 + radius * np.sin(turns), z])
    square = np.vstack([wall((1.0, 1.0), end, 0.0, HEIGHT) for end in ((1.5, 1.0), (1.0, 1.4))])
    cupboard = walls(((4.4, 0.8), (4.9, 0.8), (4.9, 1.3), (4.4, 1.3)), 0.0, 2.1)
    points = box_room(0, 0, 6.0, 2.6, 0.0, HEIGHT)
    for x, y, side in ((1.25, 1.2, 0.25), (3.2, 1.4, radius), (4.65, 1.05, 0.25)):
        points = without(points, (x - side, y - side, -1.0), (x + side, y + side, 0.01))
    return _voxels(np.vstack([points, round_one, square, cupboard]))


def staircase() -> StoreyVoxels:
    """A flight of fifteen steps under a hole in the ceiling; the treads above a scanner's eyes were not seen."""
    steps = []
    for i in range(15):
        x, z = 1.0 + 0.27 * i, 0.178 * (i + 1)
        steps.append(rectangle((x, 0.8, z - 0.178), (0, 1.1, 0), (0, 0, 0.178)))
        if z < 1.7:
            steps.append(rectangle((x, 0.8, z), (0.27, 0, 0), (0, 1.1, 0)))
    room = without(box_room(0, 0, 6.0, 2.6, 0.0, HEIGHT), (1.0, 0.8, HEIGHT - 0.1), (5.05, 1.9, HEIGHT + 0.1))
    return _voxels(np.vstack([room, *steps]))


def _voxels(points: Array) -> StoreyVoxels:
    cloud = asbuilt.evidence_from_points(np.add(noisy(points, seed=0), (0.3, 0.2, 0.02)))
    return storey_voxels(cloud, asbuilt.find_storeys(cloud)[0], None)
