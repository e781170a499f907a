"""The leaf of each door: whether it stands open, where it hangs and to which side it opens (not in the paper).

A leaf is an upright rectangle about as wide as its door, or half as wide where there are two, that begins at a jamb.
A wall that stands against the jamb begins there too, but goes on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from asbuilt.grid import FloatArray
from asbuilt.profiles import StoreyVoxels

Side = Literal["start", "end"]
Turn = Literal["left", "right"]

_HEIGHTS = (0.3, 1.8)
"""Heights at which a leaf is looked for, m over the door's own floor."""
_WIDEST = 1.35
"""Leaves are no wider, m."""
_LEAST = 0.58
"""Nor narrower, but for a door of one leaf, m."""
_TURNS = np.arange(12.0, 169.0, 2.0)
"""Angles by which an open leaf is turned out of the opening, degrees."""
_ASKEW = 3
"""A wall beyond a leaf's edge may be turned by so many steps, of 2 degrees."""
_CELL, _ROW = 0.1, 0.15
"""Cells of a leaf along and up, m."""
_THICK = 0.04
"""Half the thickness of a leaf, with what its voxels stray, m."""
_HANGINGS: tuple[tuple[Side, Turn], ...] = (("start", "left"), ("start", "right"), ("end", "left"), ("end", "right"))
_FILLED = 0.7
"""Share of an open leaf's cells that are filled at least."""
_BEYOND = 0.3
"""And of the cells beyond its edge at most: a wall goes on."""


@dataclass(frozen=True)
class Leaf:
    """An open leaf: where it hangs, and to which side of its opening it stands."""

    hinge: Side
    swing: Turn


def find_leaves(lines: FloatArray, thickness: FloatArray, sill: FloatArray, voxels: StoreyVoxels) -> list[Leaf | None]:
    """The open leaf of each door, or None.

    Parameters
    ----------
    lines : (n, 4) of the doors from jamb to jamb, m from the storey's origin.
    thickness : (n,) of their walls, m: a leaf hangs at either face, or between.
    sill : (n,) height of their floors above the storey's, m.
    """
    if len(lines) == 0:
        return []
    # One layer of voxels in three shows a leaf as well.
    heights = (_HEIGHTS[0] - 0.3, _HEIGHTS[1] + 0.5)
    of_line, voxel, along, offset = voxels.strips(lines, _WIDEST + 0.6, _WIDEST + 0.5, heights)
    z = voxels.z[voxel]
    level = np.floor(z / voxels.voxel) % 3 == 0
    of_line, along, offset, z = of_line[level], along[level], offset[level], z[level]
    first = np.searchsorted(of_line, np.arange(len(lines) + 1))
    found = []
    for i, (x1, y1, x2, y2) in enumerate(lines.tolist()):
        near = slice(first[i], first[i + 1])
        high = z[near] - sill[i]
        inside = (high > _HEIGHTS[0]) & (high < _HEIGHTS[1])
        points = np.column_stack([along[near], offset[near], high])[inside]
        found.append(_leaf(points, float(np.hypot(x2 - x1, y2 - y1)), float(thickness[i])))
    return found


def _leaf(points: FloatArray, width: float, thickness: float) -> Leaf | None:
    """The best filled of the leaves that a door of this width can have; `points` (n, 3): along, offset, height."""
    best, most = None, _FILLED
    for hinge, swing in _HANGINGS:
        x = points[:, 0] if hinge == "start" else width - points[:, 0]
        for shift in (0.0, thickness / 2):
            y = (points[:, 1] if swing == "left" else -points[:, 1]) - shift
            fan = _fan(x, y, points[:, 2])
            # A wall a little askew to the ray leaves it at the far end only.
            around = np.concatenate([fan[-_ASKEW:], fan, fan[:_ASKEW]])
            wide = np.max([around[turns : turns + len(fan)] for turns in range(2 * _ASKEW + 1)], axis=0)
            for radius in (width, width / 2):
                if radius > _WIDEST or (radius < width and radius < _LEAST):
                    continue
                leaf = slice(1, round(radius / _CELL) - 1)
                beyond = slice(round(radius / _CELL) + 1, round(radius / _CELL) + 4)
                filled = np.where(wide[:, beyond].mean(axis=1) < _BEYOND, fan[:, leaf].mean(axis=1), 0.0)
                filled[fan[:, leaf].min(axis=1) < _FILLED / 2] = 0.0
                if filled.max() > most:
                    best, most = Leaf(hinge, swing), float(filled.max())
    return best


def _fan(x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
    """Share of the heights (turns, distances) that are filled along rays from the origin, 0..1."""
    distance = np.hypot(x, y)
    columns = round((_WIDEST + 0.5) / _CELL)
    rows = round((_HEIGHTS[1] - _HEIGHTS[0]) / _ROW)
    near = (y > 0) & (distance > _CELL / 2) & (distance < columns * _CELL)
    step = _TURNS[1] - _TURNS[0]
    turns = round(180 / step)
    turn = np.minimum(np.degrees(np.arctan2(y[near], x[near])) / step, turns - 1).astype(np.int64)
    column = (distance[near] / _CELL).astype(np.int64)
    row = np.clip(((z[near] - _HEIGHTS[0]) / _ROW).astype(np.int64), 0, rows - 1)
    # A leaf is as thick near its hinge, where that is more turns.
    reach = (np.degrees(_THICK / ((column + 0.5) * _CELL)) / step).astype(np.int64)
    each = np.repeat(np.arange(len(turn)), 2 * reach + 1)
    ends = np.cumsum(2 * reach + 1)
    spread = np.arange(len(each)) - (ends - 2 * reach - 1)[each] - reach[each] + turn[each]
    each, spread = each[(spread >= 0) & (spread < turns)], spread[(spread >= 0) & (spread < turns)]
    filled = np.zeros((turns, columns, rows), dtype=np.bool_)
    filled[spread, column[each], row[each]] = True
    first = round(_TURNS[0] / step)
    fan: FloatArray = np.count_nonzero(filled[first : first + len(_TURNS)], axis=2) / rows
    return fan
