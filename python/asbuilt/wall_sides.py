"""Both sides of each wall, unrolled: what stands on the wall's plane, and what stands behind it (not in the paper).

A side is all of one line's faces that look the same way, or all chords of one curve, laid out straight. Its picture
has a column for each step along the side and a row for each step of height. A voxel on the plane is wall; one in the
body of the wall, behind the plane and before the plane of the other side, can only be seen through an opening: a
reveal, a frame, a pane, a leaf, the back of a niche.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asbuilt import _core
from asbuilt.elevations import Elevations, ceiling_heights, smooth_rows
from asbuilt.faces import Face
from asbuilt.grid import FloatArray, IntArray
from asbuilt.profiles import StoreyVoxels

BoolArray = NDArray[np.bool_]

PLANE = 0.022
"""Voxels whose mean lies this near are on the plane, m."""
_DEPTH = 0.35
"""How far before and behind the plane is looked, m; reveals of thicker walls begin at the plane all the same."""
_MARGIN = 1.6
"""A side goes on beyond its last face by this much: a door may stand in the corner of a room, m."""
_WIDEST = 4.0
"""Faces of one line further apart than this are two sides, m."""
_ACROSS = 1.2
"""The other side of a wall goes on this far beyond its faces, across an opening, m."""
_BLANK = 6
"""Columns after each side that stay empty, so that a look around a cell never leaves its side."""
_BACK = (20, 0.004)
"""So many voxels behind the filled cells of a side, at one depth, are the other side of its wall; and for each cell."""
LOWEST = -0.3
"""Height of the lowest row, m: sunken floors."""


@dataclass(frozen=True)
class WallSides:
    """The sides of a storey's walls, unrolled, side after side.

    Attributes
    ----------
    first : (n + 1,) where each side's columns begin; its last ones are blank.
    step : width of a column and height of a row, m; row k is about the height `LOWEST` + k `step`.
    segments : (m, 4) the straight pieces of the sides, m from the storey's origin; the room is on their left.
    side, base : (m,) the side that each piece belongs to, and the place on it where it begins, m.
    covered : (c,) whether a face stands on each column.
    ceiling, floor : (c,) height of the room's ceiling and floor before each column, m.
    twin : (c,) how far behind each column the other side of the wall stands, m.
    wall : (c, k) which cells are filled on the plane, with gaps between scan lines closed.
    body : (c, k) which cells hold a voxel in the body of the wall, and are not filled on the plane.
    number, column, place, depth, z, voxel : (h,) for each voxel near a side: the side, its column, its place along the
        side, how far it lies behind the plane, its height and its row among the storey's voxels; side after side.
    """

    first: IntArray
    step: float
    segments: FloatArray
    side: IntArray
    base: FloatArray
    covered: BoolArray
    ceiling: FloatArray
    floor: FloatArray
    twin: FloatArray
    wall: BoolArray
    body: BoolArray
    number: IntArray
    column: IntArray
    place: FloatArray
    depth: FloatArray
    z: FloatArray
    voxel: IntArray

    def at(self, side: int, place: float) -> tuple[FloatArray, FloatArray]:
        """Point (2,) on a side at a place along it (m), and the unit vector (2,) along the side there."""
        pieces = np.flatnonzero(self.side == side)
        piece = pieces[max(int(np.searchsorted(self.base[pieces], place, side="right")) - 1, 0)]
        start, end = self.segments[piece, :2], self.segments[piece, 2:]
        along = (end - start) / max(float(np.hypot(*(end - start))), 1e-12)
        return start + (place - self.base[piece]) * along, along

    def hits(self, side: int, low: float, high: float) -> IntArray:
        """Rows of the voxels near a side between two places along it (m)."""
        of_side = slice(*np.searchsorted(self.number, [side, side + 1]))
        between = (self.place[of_side] > low) & (self.place[of_side] < high)
        rows: IntArray = np.flatnonzero(between) + of_side.start
        return rows


def unroll_sides(faces: list[Face], elevations: Elevations, voxels: StoreyVoxels) -> WallSides:
    """Lay out the sides on which faces stand; those of free-standing partitions are left out."""
    from scipy import ndimage  # heavy: help and errors do not wait for it

    step = elevations.step
    segments, side, base, stretches = _chain(faces, elevations)
    length = np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
    ends = np.zeros(int(side.max(initial=-1)) + 1)
    np.maximum.at(ends, side, base + length)
    counts = np.ceil(ends / step).astype(np.int64) + _BLANK
    first = np.concatenate([[0], np.cumsum(counts)])
    total = int(first[-1])

    covered = np.zeros(total, dtype=np.bool_)
    for stretch, low, high in stretches:
        covered[first[stretch] + round(low / step) : first[stretch] + round(high / step)] = True

    # A point and a direction for the middle of each column.
    piece_first = first[side] + np.round(base / step).astype(np.int64)
    piece = np.clip(np.searchsorted(piece_first, np.arange(total), side="right") - 1, 0, max(len(segments) - 1, 0))
    along = (segments[:, 2:] - segments[:, :2]) / np.maximum(length, 1e-12)[:, None]
    towards = np.column_stack([-along[:, 1], along[:, 0]])
    at = (np.arange(total) - first[side[piece]] + 0.5) * step - base[piece]
    middle = segments[piece, :2] + at[:, None] * along[piece]
    ceiling = ceiling_heights(middle, along[piece], towards[piece], voxels)
    ceiling = np.where(np.isfinite(ceiling), ceiling, voxels.height)

    of_piece, voxel, place, offset = _core.strips(voxels.xy, segments, _DEPTH, 0.0)
    z, depth = voxels.z[voxel], -offset
    place = place + base[of_piece]
    number = side[of_piece]
    column = first[number] + np.clip((place / step).astype(np.int64), 0, counts[number] - _BLANK - 1)
    floor = _floors(column, z, depth, first, total, step)
    twin = _twins(faces, segments, middle, piece)

    row = np.round((z - LOWEST) / step).astype(np.int64)
    rows = int(np.round((voxels.height + 0.1 - LOWEST) / step)) + 2
    row = np.clip(row, 0, rows - 1)

    def picture(chosen: BoolArray) -> BoolArray:
        cells = np.zeros((total, rows), dtype=np.bool_)
        cells[column[chosen], row[chosen]] = True
        return cells

    wall = close_cells(picture((np.abs(depth) < PLANE) & (z > floor[column] + 0.08)), 4, 3)
    # What lies behind a filled stretch of the plane was seen from the other side.
    solid = ndimage.binary_erosion(wall, np.ones((7, 7)))
    hidden = solid[column, row] & (depth > PLANE)
    cells = np.add.reduceat(solid.sum(axis=1), first[:-1]).astype(np.float64) if total else np.zeros(0)
    back = np.repeat(_back(number[hidden], depth[hidden], cells), counts)
    twin = np.where(np.isfinite(twin), twin, back)
    body = picture((depth > PLANE) & (depth < np.minimum(twin[column] - PLANE, _DEPTH - 0.05))) & ~wall
    return WallSides(
        first,
        step,
        segments,
        side,
        base,
        covered,
        ceiling,
        floor,
        twin,
        wall=wall,
        body=body,
        number=number,
        column=column,
        place=place,
        depth=depth,
        z=z,
        voxel=voxel,
    )


def _chain(
    faces: list[Face], elevations: Elevations
) -> tuple[FloatArray, IntArray, FloatArray, list[tuple[int, float, float]]]:
    """Pieces (m, 4), their sides and where they begin on them, and (side, from, to) of each face, m."""
    groups: dict[tuple[int, int], list[Face]] = {}
    for face in faces:
        if face.curve is not None:
            groups.setdefault((-1, face.curve), []).append(face)
        elif not elevations.partition[face.line]:
            facing = int(float(face.along @ elevations.along(face.line)) > 0)
            groups.setdefault((face.line, facing), []).append(face)
    segments: list[FloatArray] = []
    side: list[int] = []
    base: list[float] = []
    stretches: list[tuple[int, float, float]] = []
    number = -1
    for (line, _), group in groups.items():
        if line >= 0:
            group = sorted(group, key=lambda face: float(face.start @ group[0].along))
        last: Face | None = None
        place = 0.0
        for face in group:
            gap = np.inf if last is None else float(np.hypot(*(face.start - last.end)))
            if last is None or gap > _WIDEST:
                if last is not None and line >= 0:
                    segments[-1][2:] += _MARGIN * last.along
                number, place = number + 1, 0.0
                margin = _MARGIN if line >= 0 else 0.0
                segments.append(np.concatenate([face.start - margin * face.along, face.end]))
                side.append(number)
                base.append(place)
                place += margin
            elif line >= 0:
                segments[-1][2:] = face.end
                place += gap
            else:
                if gap > 1e-6:
                    segments.append(np.concatenate([last.end, face.start]))
                    side.append(number)
                    base.append(place)
                    place += gap
                segments.append(np.concatenate([face.start, face.end]))
                side.append(number)
                base.append(place)
            stretches.append((number, place, place + face.length))
            place += face.length
            last = face
        if last is not None and line >= 0:
            segments[-1][2:] += _MARGIN * last.along
    return np.array(segments).reshape(-1, 4), np.array(side, np.int64), np.array(base), stretches


def _floors(column: IntArray, z: FloatArray, depth: FloatArray, first: IntArray, total: int, step: float) -> FloatArray:
    """Height of the floor before each column, m: the well filled level nearest to 0; 0 where none is."""
    before = (depth < -0.04) & (np.abs(z) < 0.7)
    rows = round(1.4 / 0.05) + 1
    row = np.round((z[before] + 0.7) / 0.05).astype(np.int64)
    filled = np.bincount(column[before] * rows + row, minlength=total * rows).reshape(total, rows)
    wide = 2 * round(0.6 / step) + 1
    dense = smooth_rows(filled.astype(np.float64), first, wide)
    best = dense.max(axis=1, initial=0)
    levels = np.arange(rows) * 0.05 - 0.7
    level = levels[np.where(dense >= 0.5 * best[:, None], np.abs(levels), np.inf).argmin(axis=1)]
    heights: FloatArray = np.where(best > 0.5, level, 0.0)
    return heights


def _twins(faces: list[Face], segments: FloatArray, middle: FloatArray, piece: IntArray) -> FloatArray:
    """Distance of the face behind each column that looks the other way, m; infinite where there is none.

    A face is taken to go on across openings.
    """
    twin = np.full(len(middle), np.inf)
    start, end = segments[:, :2], segments[:, 2:]
    length = np.maximum(np.hypot(*(end - start).T), 1e-12)
    along = (end - start) / length[:, None]
    normal = np.column_stack([-along[:, 1], along[:, 0]])
    for face in faces:
        relative = np.array([face.start, face.end])[:, None] - start
        place = (relative * along).sum(axis=2)
        depth = -(relative * normal).sum(axis=2)
        beside = (place.max(axis=0) > -_ACROSS) & (place.min(axis=0) < length + _ACROSS)
        opposite = (along @ face.along < -0.97) & beside & (depth.min(axis=0) > 0.03) & (depth.min(axis=0) < _DEPTH)
        if not opposite.any():
            continue
        column = np.flatnonzero(opposite[piece])
        to_column = middle[column] - face.start
        at = to_column @ face.along
        behind = -(to_column @ face.normal)
        near = (at > -_ACROSS) & (at < face.length + _ACROSS) & (behind > 0.03) & (behind < _DEPTH)
        column = column[near]
        twin[column] = np.minimum(twin[column], behind[near])
    return twin


def _back(side: IntArray, depth: FloatArray, cells: FloatArray) -> FloatArray:
    """The least depth (n,), m, at which many of the voxels (h,) behind a side's filled `cells` (n,) lie."""
    slots = int(np.ceil(_DEPTH / 0.02)) + 1
    counts = np.bincount(side * slots + (depth / 0.02).astype(np.int64), minlength=len(cells) * slots)
    counts = counts.reshape(len(cells), slots)
    # More than in the slot before: what strays behind the plane grows less with the distance.
    many = (counts >= np.maximum(_BACK[0], _BACK[1] * cells)[:, None]) & (
        counts > 1.5 * np.pad(counts, ((0, 0), (1, 0)))[:, :-1]
    )
    many[:, :2] = False
    depths: FloatArray = np.where(many.any(axis=1), many.argmax(axis=1) * 0.02, _DEPTH)
    return depths


def close_cells(cells: BoolArray, across: int, up: int) -> BoolArray:
    """Fill gaps of less than so many cells of a picture of sides (c, k); its borders stay as they are."""
    from scipy import ndimage  # heavy: help and errors do not wait for it

    closed: BoolArray = ndimage.binary_closing(np.pad(cells, 6), np.ones((across, up)))[6:-6, 6:-6]
    return closed
