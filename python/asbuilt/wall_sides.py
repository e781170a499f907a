"""Both sides of each wall, unrolled: what stands on the wall's plane, and what stands behind it (not in the paper).

A side is all of one line's faces that look the same way, or all chords of one curve, laid out straight. Its picture
has a column for each step along the side and a row for each step of height. A voxel on the plane is wall; one in the
body of the wall, behind the plane and before the plane of the other side, can only be seen through an opening: a
reveal, a frame, a pane, a leaf, the back of a niche.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from asbuilt.curves import in_turn
from asbuilt.directed import Directed
from asbuilt.elevations import Elevations, ceiling_heights, smooth_rows
from asbuilt.faces import Face, segments_of
from asbuilt.grid import BoolArray, FloatArray, IntArray
from asbuilt.neighbours import near_each
from asbuilt.profiles import StoreyVoxels

PLANE = 0.022
"""Voxels whose mean lies this near are on the plane, m."""
DEPTH = 0.5
"""How far behind the plane is looked, m: as far as the frames of windows in thick walls stand."""
REACH = 0.8
"""And how far for the leaf of a door: house doors stand at the outer side of thick walls, m."""
_BEFORE = 0.15
"""And how far before it, m."""
_MARGIN = 3.2
"""A side goes on beyond its last face by this much: the widest door may stand in the corner of a room, m."""
_WIDEST = 4.0
"""Faces of one line further apart than this are two sides, m."""
_ACROSS = 1.2
"""The other side of a wall goes on this far beyond its faces, across an opening, m."""
_BLANK = 6
"""Columns after each side that stay empty, so that a look around a cell never leaves its side."""
_ABOUT = 5.0
"""Only what lies this near along a side counts for the depth of its wall, m."""
_SLOT = 0.02
"""Depths behind a plane are counted in steps of this, m."""
_BACK = (20, 0.004)
"""So many voxels at one depth behind filled cells are the other side of the wall; in all, and for each such cell."""
_PARTITION = 0.2
"""Walls that are thinner than this, m, stand between rooms..."""
_ALONG = 0.2
"""...and show their other side along this share of their length."""
_SAME_CIRCLE = 0.25
"""Arcs whose centres and radii differ less are of one round wall, m."""
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
        first, last = np.searchsorted(self.side, [side, side + 1])
        piece = first + max(int(np.searchsorted(self.base[first:last], place, side="right")) - 1, 0)
        start, end = self.segments[piece, :2], self.segments[piece, 2:]
        along = (end - start) / max(float(np.hypot(*(end - start))), 1e-12)
        return start + (place - self.base[piece]) * along, along

    def row(self, z: FloatArray | float) -> IntArray:
        """The row of a height above the floor, m."""
        rows: IntArray = np.clip(np.round((z - LOWEST) / self.step), 0, self.wall.shape[1] - 1).astype(np.int64)
        return rows

    def hits(self, side: int, low: float, high: float) -> IntArray:
        """Rows of the voxels near a side between two places along it (m)."""
        of_side = slice(*np.searchsorted(self.number, [side, side + 1]))
        between = (self.place[of_side] > low) & (self.place[of_side] < high)
        rows: IntArray = np.flatnonzero(between) + of_side.start
        return rows


def unroll_sides(faces: list[Face], elevations: Elevations, voxels: StoreyVoxels) -> WallSides:
    """Lay out the sides on which faces stand; those of free-standing partitions are left out."""
    step = elevations.step
    chains = _chain(faces, elevations)
    pieces = [piece for chain in chains for piece in chain]
    segments = np.array([[*piece.start, *piece.end] for piece in pieces]).reshape(-1, 4)
    length = np.array([piece.length for piece in pieces])
    side = np.repeat(np.arange(len(chains)), [len(chain) for chain in chains])
    ends = np.cumsum(length)
    base = ends - length
    base = base - base[np.searchsorted(side, side)]
    counts = np.ceil([sum(piece.length for piece in chain) / step for chain in chains]).astype(np.int64) + _BLANK
    first = np.concatenate([[0], np.cumsum(counts)])
    total = int(first[-1])

    covered = np.zeros(total, dtype=np.bool_)
    for i, piece in enumerate(pieces):
        low, high = (first[side[i]] + round(place / step) for place in (base[i], base[i] + piece.length))
        covered[low:high] |= piece.stands

    # A point and a direction for the middle of each column.
    piece_first = first[side] + np.round(base / step).astype(np.int64)
    on = np.clip(np.searchsorted(piece_first, np.arange(total), side="right") - 1, 0, None)
    along = (segments[:, 2:] - segments[:, :2]) / np.maximum(length, 1e-12)[:, None]
    towards = np.column_stack([-along[:, 1], along[:, 0]])
    at = (np.arange(total) - first[side[on]] + 0.5) * step - base[on]
    middle = segments[on, :2] + at[:, None] * along[on]
    few = slice(None, None, 8)  # a ceiling does not change from column to column
    ceiling = ceiling_heights(middle[few], along[on[few]], towards[on[few]], voxels)
    ceiling = np.repeat(np.where(np.isfinite(ceiling), ceiling, voxels.height), 8)[:total]

    # Further behind the plane than before it.
    shift = (REACH - _BEFORE) / 2
    of_piece, voxel, place, offset = voxels.strips(segments - shift * np.tile(towards, 2), REACH - shift, 0.0)
    z, depth = voxels.z[voxel], shift - offset
    place = place + base[of_piece]
    number = side[of_piece]
    column = first[number] + np.clip((place / step).astype(np.int64), 0, counts[number] - _BLANK - 1)
    floor = _floors(column, z, depth, first, total, step)
    twin = _twins(faces, segments, middle, on)

    row = np.round((z - LOWEST) / step).astype(np.int64)
    rows = int(np.round((voxels.height + 0.1 - LOWEST) / step)) + 2
    cell = column * rows + np.clip(row, 0, rows - 1)

    def picture(chosen: BoolArray) -> BoolArray:
        cells = np.zeros(total * rows, dtype=np.bool_)
        cells[cell[chosen]] = True
        return cells.reshape(total, rows)

    wall = close_cells(picture((np.abs(depth) < PLANE) & (z > floor[column] + 0.08)), 4, 3)
    # What lies behind a filled stretch of the plane was seen from the other side.
    solid = ~_grown(~wall, 7, 7)
    hidden = solid.ravel()[cell] & (depth > PLANE) & (depth < DEPTH)
    back = _back(column[hidden], depth[hidden], solid.sum(axis=1), first, step)
    twin = np.where(np.isfinite(twin), twin, back)
    body = picture((depth > PLANE) & (depth < np.minimum(twin[column] - PLANE, DEPTH - 0.05))) & ~wall
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


@dataclass(frozen=True)
class _Piece(Directed):
    """A straight piece of a side: a face, or what lies between two faces or beyond the last."""

    start: FloatArray
    end: FloatArray
    stands: bool = True


def _chain(faces: list[Face], elevations: Elevations) -> list[list[_Piece]]:
    """The pieces of each side, one after the other."""
    straight: dict[tuple[int, bool], list[Face]] = {}
    curves: dict[int, list[Face]] = {}
    for face in faces:
        if face.curve is not None:
            curves.setdefault(face.curve, []).append(face)
        elif not elevations.partition[face.line]:
            facing = float(face.along @ elevations.along(face.line)) > 0
            straight.setdefault((face.line, facing), []).append(face)
    chains: list[list[_Piece]] = []
    for group in straight.values():
        along = group[0].along
        for run in _runs(sorted(group, key=lambda face: float(face.start @ along))):
            before = _Piece(run[0].start - _MARGIN * along, run[0].start, False)
            after = _Piece(run[-1].end, run[-1].end + _MARGIN * along, False)
            chains.append([before, *_bridged(run, None), after])
    for circle, arc in arcs_of(list(curves.values())):
        chains += [_bridged(run, circle) for run in _runs(arc)]
    return chains


def _runs(faces: list[Face]) -> list[list[Face]]:
    """Faces that follow one another, parted where the gap is too wide to be an opening."""
    runs = [[faces[0]]]
    for last, face in pairwise(faces):
        if float(np.hypot(*(face.start - last.end))) > _WIDEST:
            runs.append([])
        runs[-1].append(face)
    return runs


def _bridged(run: list[Face], circle: FloatArray | None) -> list[_Piece]:
    """The faces of a run as pieces, with pieces across the gaps between them, along the circle where there is one."""
    pieces = [_Piece(run[0].start, run[0].end)]
    for face in run[1:]:
        gap = _Piece(pieces[-1].end, face.start, False)
        if gap.length > 1e-6:
            corners = [gap.start, gap.end]
            if circle is not None:
                corners[1:1] = list(along_circle(gap.start, gap.end, circle))
            pieces += [_Piece(a, b, False) for a, b in pairwise(corners)]
        pieces.append(_Piece(face.start, face.end))
    return pieces


def along_circle(start: FloatArray, end: FloatArray, circle: FloatArray) -> FloatArray:
    """Points (n, 2) between two points on a circle (centre and radius, m), some 0.3 m from one to the next."""
    relative = np.array([start, end]) - circle[:2]
    angle = np.unwrap(np.arctan2(relative[:, 1], relative[:, 0]))
    turns = np.linspace(angle[0], angle[-1], int(np.hypot(*(end - start)) / 0.3) + 2)[1:-1]
    points: FloatArray = circle[:2] + abs(circle[2]) * np.column_stack([np.cos(turns), np.sin(turns)])
    return points


def arcs_of(curves: list[list[Face]]) -> list[tuple[FloatArray, list[Face]]]:
    """Circles (centre x, y and radius, m) and the chords on each: doors part a round wall into several curves.

    Seen from inside the radius counts positive, from outside negative.
    """
    circles: list[tuple[FloatArray, list[Face]]] = []
    for chords in curves:
        tips = np.array([chords[0].start, *(chord.end for chord in chords)])
        terms = np.column_stack([2 * (tips - tips[0]), np.ones(len(tips))])
        solution = np.linalg.lstsq(terms, ((tips - tips[0]) ** 2).sum(axis=1), rcond=None)[0]
        centre = tips[0] + solution[:2]
        inside = float((centre - tips[0]) @ chords[0].normal) > 0
        circle = np.array([*centre, np.hypot(*(tips[0] - centre)) * (1 if inside else -1)])
        same = next((arc for other, arc in circles if np.abs(other - circle).max() < _SAME_CIRCLE), None)
        if same is None:
            circles.append((circle, list(chords)))
        else:
            same += chords
    return [(circle, in_turn(arc, circle[:2])) for circle, arc in circles]


def _floors(column: IntArray, z: FloatArray, depth: FloatArray, first: IntArray, total: int, step: float) -> FloatArray:
    """Height of the floor before each column, m: the well filled level nearest to 0; 0 where none is."""
    # Lower levels are most often the ceiling of the storey below; over a sunken floor a threshold is at 0.
    lowest, step_up = -0.05, 0.05
    before = (depth < -0.04) & (z > lowest - step_up / 2) & (z < 0.7)
    rows = round((0.7 - lowest) / step_up) + 1
    row = np.round((z[before] - lowest) / step_up).astype(np.int64)
    filled = np.bincount(column[before] * rows + row, minlength=total * rows).reshape(total, rows)
    wide = 2 * round(0.6 / step) + 1
    dense = smooth_rows(filled.astype(np.float64), first, wide)
    best = dense.max(axis=1, initial=0)
    levels = np.arange(rows) * step_up + lowest
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
    bounds = np.searchsorted(piece, np.arange(len(segments) + 1))  # columns come piece after piece
    # Columns that are left blank after a piece are some further away.
    for face, near in zip(faces, near_each(segments_of(faces), segments, DEPTH + 2 * _ACROSS), strict=True):
        about = np.array(near, dtype=np.int64)
        relative = np.array([face.start, face.end])[:, None] - start[about]
        place = (relative * along[about]).sum(axis=2)
        depth = -(relative * normal[about]).sum(axis=2)
        beside = (place.max(axis=0) > -_ACROSS) & (place.min(axis=0) < length[about] + _ACROSS)
        opposite = along[about] @ face.along < -0.97
        opposite &= beside & (depth.min(axis=0) > 0.03) & (depth.min(axis=0) < DEPTH)
        if not opposite.any():
            continue
        column = np.concatenate([np.arange(bounds[i], bounds[i + 1]) for i in about[opposite]])
        to_column = middle[column] - face.start
        at = to_column @ face.along
        behind = -(to_column @ face.normal)
        near = (at > -_ACROSS) & (at < face.length + _ACROSS) & (behind > 0.03) & (behind < DEPTH)
        column = column[near]
        twin[column] = np.minimum(twin[column], behind[near])
    return twin


def _back(column: IntArray, depth: FloatArray, filled: IntArray, first: IntArray, step: float) -> FloatArray:
    """The least depth (c,), m, at which many of the voxels (h,) behind the filled cells about each column lie."""
    slots = int(np.ceil(DEPTH / _SLOT)) + 1
    total = len(filled)
    counts = np.bincount(column * slots + (depth / _SLOT).astype(np.int64), minlength=total * slots)
    counts = counts.reshape(total, slots)
    about = 2 * round(_ABOUT / step) + 1
    shown = [counts, counts > 0, filled[:, None], filled[:, None] > 0]
    sums = about * smooth_rows(np.hstack(shown).astype(np.float64), first, about)
    dense, wide, cells, columns = np.split(sums, [slots, 2 * slots, 2 * slots + 1], axis=1)
    # More than in the slot before: what strays behind the plane grows less with the distance.
    many = dense >= np.maximum(_BACK[0], _BACK[1] * cells)
    many &= dense > 1.5 * np.pad(dense, ((0, 0), (1, 0)))[:, :-1]
    # The other side of a partition is seen from its own room, not in one place alone as what a mirror shows.
    thin = round(_PARTITION / _SLOT)
    many[:, :thin] &= (wide > _ALONG * columns)[:, :thin]
    many[:, :2] = False
    depths: FloatArray = np.where(many.any(axis=1), many.argmax(axis=1) * _SLOT, DEPTH)
    return depths


def close_cells(cells: BoolArray, across: int, up: int) -> BoolArray:
    """Fill gaps of less than so many cells of a picture of sides (c, k); its borders stay as they are."""
    padded = np.pad(cells, ((across, across), (up, up)))
    return ~_grown(~_grown(padded, across, up), across, up, 1)[across:-across, up:-up]


def _grown(cells: BoolArray, across: int, up: int, other: int = 0) -> BoolArray:
    """Cells with those about them, in a window of so many; `other` takes the window's other middle where it is even."""
    for size in (across, up):
        before = size // 2 - other * (1 - size % 2)
        cells = np.pad(cells, ((before, size - 1 - before), (0, 0)))
        reach = 1
        while reach < size:
            step = min(reach, size - reach)
            cells = cells[:-step] | cells[step:]
            reach += step
        cells = cells.T
    return cells
