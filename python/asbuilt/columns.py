"""Columns that stand free in a room, square or round (not in the paper).

Ground cells filled over most of the height, with room all around them, are clusters of their own: walls hang together.
A rectangle and a circle are fitted to the voxels of each cluster, and the better one is a column if it does what
columns do: it reaches from floor to ceiling wherever it was seen, nothing was seen within it, and no wall, beam or
lintel runs on from it. Pilasters hang together with their walls, and stay wall faces.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np

from asbuilt import _core
from asbuilt.faces import Face, segments_of
from asbuilt.grid import BoolArray, FloatArray, IntArray
from asbuilt.indices import squeezed
from asbuilt.neighbours import near_each
from asbuilt.plan import Column
from asbuilt.profiles import StoreyVoxels

_SIZE = (0.15, 1.2)
"""Sides and diameters of columns, m."""
_TALL = ((0.45, 1), (0.75, 1), (0.75, 3))
"""Cells filled over this share of the usual height may belong to a column, and belong together over gaps of so many
cells: to take a column whole, without what stands by it, or from sides that do not meet."""
_MIN_CELLS = 4
"""Clusters of fewer voxels than this many tall cells hold are smaller than any column."""
_NEAR = 0.03
"""Voxels this near to an outline are on it, m."""
_MAX_RMS = 0.01
"""Voxels of a column lie this near to its outline, m: foliage, people and piles do not."""
_UPPER = (0.45, 0.1)
"""A column is seen from and to this far below the ceiling, m; furniture does not reach there."""
_AROUND = (0.07, 0.2)
"""This far from a column's outline there is air, m."""
_RUNS_ON = (0.05, 0.35)
"""What is filled in this share of the directions is a wall or a beam; in fewer it is nothing, in more a capital."""
_SECTORS = 24
"""Directions in which it is looked around a column."""


@dataclass(frozen=True)
class Shape:
    """A rectangle about its centre (2,), or a circle (`depth` = `width`), m from the storey's origin."""

    centre: FloatArray
    width: float
    depth: float
    angle: float
    round: bool

    def local(self, xy: FloatArray) -> FloatArray:
        """Points (n, 2) in the frame of its centre and sides."""
        return _turned(xy - self.centre, self.angle)

    def outside(self, xy: FloatArray) -> FloatArray:
        """Distance (n,) of points from the outline, m; below 0 within."""
        local = self.local(xy)
        if self.round:
            return np.asarray(np.hypot(*local.T) - self.width / 2)
        beyond = np.abs(local) - np.array([self.width, self.depth]) / 2
        distance: FloatArray = np.where(beyond.max(axis=1) > 0, np.hypot(*np.maximum(beyond, 0).T), beyond.max(axis=1))
        return distance

    def outline(self, step: float) -> FloatArray:
        """Points (n, 2) along the outline, `step` m apart."""
        if self.round:
            turns = np.arange(0, 2 * np.pi, step / (self.width / 2))
            return self.centre + self.width / 2 * np.column_stack([np.cos(turns), np.sin(turns)])
        x, y = (np.arange(step / 2, side, step) - side / 2 for side in (self.width, self.depth))
        sides = [np.column_stack([x, np.full(len(x), end)]) for end in (-self.depth / 2, self.depth / 2)]
        sides += [np.column_stack([np.full(len(y), end), y]) for end in (-self.width / 2, self.width / 2)]
        return self.centre + _turned(np.concatenate(sides), -self.angle)


def find_columns(voxels: StoreyVoxels, storey: int) -> tuple[Column, ...]:
    """The free-standing columns of a storey, in the input's frame, from left to right; empty where none stands."""
    fits = (
        fit_shape(voxels.xy.take(members, axis=0), voxels.covariance.take(members, axis=0))
        for members in find_clusters(voxels)
    )
    shapes = [shape for shape in fits if shape is not None]
    if not shapes:
        return ()
    columns = [_as_column(shape, _about(shape, voxels), voxels) for shape in shapes]
    found: list[Column] = []
    for column in sorted((column for column in columns if column is not None), key=lambda c: (-c.voxels, c.centre)):
        if all(math.dist(column.centre, other.centre) > (column.width + other.width) / 2 for other in found):
            found.append(column)
    found.sort(key=lambda column: column.centre)
    return tuple(replace(column, id=f"S{storey}-C{number}") for number, column in enumerate(found, start=1))


def _about(shape: Shape, voxels: StoreyVoxels) -> IntArray:
    """Indices of the voxels within some metre of a shape."""
    reach = max(shape.width, shape.depth) / 2 + 0.7
    return voxels.in_box(shape.centre - reach, shape.centre + reach)


def drop_sides(faces: list[Face], columns: tuple[Column, ...], voxels: StoreyVoxels) -> list[Face]:
    """The faces that are no sides of columns."""
    centres = np.array([column.centre for column in columns]).reshape(-1, 2) - voxels.origin
    sides = set()
    for column, centre, near in zip(columns, centres, near_each(centres, segments_of(faces), _SIZE[1]), strict=True):
        shape = Shape(centre, column.width, column.depth, column.rotation, column.shape == "round")
        for i in near:
            tips = (faces[i].start, faces[i].end)
            if shape.outside(np.array([tips[0], (tips[0] + tips[1]) / 2, tips[1]])).max() <= 0.12:
                sides.add(i)
    return [face for i, face in enumerate(faces) if i not in sides]


def find_clusters(voxels: StoreyVoxels) -> list[IntArray]:
    """Indices of the voxels of each cluster of tall cells that is no larger than a column and has room around it."""
    standing = (voxels.z > 0.3) & (voxels.z < voxels.height - 0.15)
    if not standing.any():
        return []
    first = voxels.first
    filled = np.add.reduceat(standing, first[:-1], dtype=np.int64)
    usual = float(np.percentile(filled[filled > 0.3 * filled.max()], 75))
    margin = max(gap for _, gap in _TALL)
    cells = squeezed(voxels.index[first[:-1]], 2 * margin + 1) + margin
    shape = tuple(cells.max(axis=0) + margin + 1)
    clusters: dict[tuple[int, ...], IntArray] = {}
    for tall, gap in _TALL:
        image = np.zeros(shape, dtype=np.bool_)
        image[tuple(cells[filled > tall * usual].T)] = True
        image = _widened(image)
        near = np.flatnonzero(image[tuple(cells.T)] & (filled > 0))
        for _ in range(gap - 1):
            image = _widened(image)
        label = _core.patches_of(image)[tuple(cells[near].T)]
        near = near[np.argsort(label, kind="stable")]
        bounds = np.flatnonzero(np.diff(np.sort(label))) + 1
        sizes = [ends.reduceat(cells[near], np.append(0, bounds)) for ends in (np.maximum, np.minimum)]
        # A square stands across its diagonal.
        fitting = np.max((sizes[0] - sizes[1] - 1) * voxels.voxel, axis=1) <= 1.42 * _SIZE[1]
        for part in itertools.compress(np.split(near, bounds), fitting.tolist()):
            if filled[part].sum() > _MIN_CELLS * usual:
                members = np.concatenate([np.arange(first[i], first[i + 1]) for i in part])
                clusters[tuple(part.tolist())] = members[standing[members]]
    return list(clusters.values())


def _widened(image: BoolArray) -> BoolArray:
    """An image with every cell spread over its eight neighbours."""
    once = image.copy()
    once[1:] |= image[:-1]
    once[:-1] |= image[1:]
    twice = once.copy()
    twice[:, 1:] |= once[:, :-1]
    twice[:, :-1] |= once[:, 1:]
    return twice


def fit_shape(xy: FloatArray, covariance: FloatArray) -> Shape | None:
    """The rectangle or the circle that voxels (n, 2) with covariances (n, 3) lie on; None where neither fits."""
    middle = xy.mean(axis=0)  # a small turn about a far origin is a large shift
    xy = xy - middle
    angle, box = _nearest_box(xy)
    size = box[1] - box[0]
    if size.min() < _SIZE[0] / 3 or size.max() > _SIZE[1]:
        return None
    best = None
    for shape in (_fit_circle(xy, covariance), _fit_rectangle(xy, covariance, angle, box)):
        if shape is None or min(shape.width, shape.depth) < _SIZE[0] or max(shape.width, shape.depth) > _SIZE[1]:
            continue
        off = np.abs(shape.outside(xy))
        misfit = float(np.mean(np.minimum(off, 2 * _NEAR) ** 2))
        if (off < _NEAR).mean() > 0.75 and (best is None or misfit < best[0]):
            best = misfit, shape
    return None if best is None else replace(best[1], centre=best[1].centre + middle)


def _nearest_box(xy: FloatArray) -> tuple[float, FloatArray]:
    """The box around points (n, 2) whose sides they lie nearest to: its angle, rad, and its ends (low, high) x (x, y)
    in the frame turned by that angle (Zhang et al. 2017).
    """
    few = xy[:: max(len(xy) // 300, 1)]
    angles = np.radians(np.arange(0, 90, 2))
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    off = _core.from_box_sides(np.ascontiguousarray(few), directions, (0.02, 0.98))
    angle = float(angles[np.argmin(np.minimum(off, 0.05).mean(axis=1))])
    return angle, np.percentile(_turned(xy, angle), (2, 98), axis=0)


def _fit_circle(xy: FloatArray, covariance: FloatArray) -> Shape | None:
    """Least squares (Kasa 1976) on the points' own second moments, so that the mean of an arc does not pull inwards."""
    middle = xy.mean(axis=0)
    local = xy - middle
    square = (local**2).sum(axis=1) + covariance[:, 0] + covariance[:, 2]
    near = np.ones(len(xy), dtype=np.bool_)
    for _ in range(4):
        terms = np.column_stack([2 * local[near], np.ones(int(near.sum()))])
        solution = np.linalg.lstsq(terms, square[near], rcond=None)[0]
        radius = float(np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 0.0)))
        near = np.abs(np.hypot(*(local - solution[:2]).T) - radius) < _NEAR
        if near.mean() < 0.5:
            return None
    shape = Shape(middle + solution[:2], 2 * radius, 2 * radius, 0.0, True)
    # A third of the way around, or the radius hangs on the noise.
    return shape if len(_sectors(shape, xy[near])) >= 0.35 * _SECTORS else None


def _fit_rectangle(xy: FloatArray, covariance: FloatArray, angle: float, box: FloatArray) -> Shape | None:
    """Least squares on all sides together, starting from a box at an angle (rad) with its ends (2, 2)."""
    sides = box.copy()
    if (np.abs(_turned(xy, angle)[:, None] - sides).min(axis=(1, 2)) < 2 * _NEAR).mean() < 0.6:
        return None
    for _ in range(4):
        local = _turned(xy, angle)
        rows, values, seen = [], [], []
        for side in range(4):
            end, axis = divmod(side, 2)
            other = local[:, 1 - axis]
            # A corner's voxels hold points of both sides.
            inner = (other > sides[0, 1 - axis] + 0.04) & (other < sides[1, 1 - axis] - 0.04)
            on = inner & (np.abs(local[:, axis] - sides[end, axis]) < _NEAR)
            if on.sum() < 10 or np.ptp(other[on]) < 0.5 * (np.ptp(sides[:, 1 - axis]) - 0.08):
                continue
            row = np.zeros((int(on.sum()), 5))
            row[:, side], row[:, 4] = 1.0, -other[on] if axis == 0 else other[on]
            rows.append(row)
            values.append(local[on, axis])
            seen.append(side)
        if len({side % 2 for side in seen}) < 2:
            return None  # no two sides that meet: its depth is not known
        solution = np.linalg.lstsq(np.concatenate(rows), np.concatenate(values), rcond=None)[0]
        angle += float(solution[4])
        for side in range(4):
            sides[side // 2, side % 2] = solution[side] if side in seen else _end(local, covariance, angle, side, sides)
    centre = _turned(sides.mean(axis=0)[None], -angle)[0]
    width, depth = (float(size) for size in sides[1] - sides[0])
    if angle % np.pi >= np.pi / 2:
        width, depth, angle = depth, width, angle - np.pi / 2
    return Shape(centre, width, depth, float(angle % np.pi), False)


def _end(local: FloatArray, covariance: FloatArray, angle: float, side: int, sides: FloatArray) -> float:
    """Where a side that was not seen stands: at the end of those that meet it, m."""
    end, axis = divmod(side, 2)
    sign = 1.0 if end else -1.0
    on = np.abs(local[:, 1 - axis, None] - sides[:, 1 - axis]).min(axis=1) < _NEAR
    if not on.any():
        return float(sides[end, axis])
    place = sign * local[on, axis]
    last = place > np.percentile(place, 98) - 0.03
    cos, sin = (np.cos(angle), np.sin(angle)) if axis == 0 else (-np.sin(angle), np.cos(angle))
    xx, xy, yy = covariance[on][last].T
    spread = np.sqrt(np.maximum(cos**2 * xx + 2 * cos * sin * xy + sin**2 * yy, 0.0))
    # Points spread evenly from m - a to m + a have the variance a^2 / 3.
    return sign * float(np.median(place[last] + np.sqrt(3) * spread))


def _as_column(shape: Shape, near: IntArray, voxels: StoreyVoxels) -> Column | None:
    """The column of a shape, by the voxels (n,) about it; None where it does not stand as a column does."""
    z, out = voxels.z[near], shape.outside(voxels.xy[near])
    ceiling = _ceiling_about(voxels.index[near], z, out, voxels.height)
    upper = (z > ceiling - _UPPER[0]) & (z < ceiling - _UPPER[1])
    standing = (z > 0.15) & (z < ceiling - _UPPER[1])
    level = np.abs(z) < 0.08
    on, within = np.abs(out) < _NEAR, out < -_NEAR - 0.01
    around = (out > _AROUND[0]) & (out < _AROUND[1])
    if not (on & standing).any():
        return None
    # Which share of its heights is filled along each step of the outline.
    places = shape.outline(voxels.voxel)
    step = np.argmin(((voxels.xy[near][on][:, None] - places) ** 2).sum(axis=2), axis=1)
    filled = _filled(step, z[on], len(places), 0.15, ceiling - _UPPER[1], voxels.voxel)
    top = _filled(step, z[on], len(places), ceiling - _UPPER[0], ceiling - _UPPER[1], voxels.voxel)
    seen = filled > 0.2
    rms = float(np.sqrt(np.mean(out[on & standing] ** 2)))
    if seen.mean() < 0.45 or filled[seen].mean() < 0.65 or (top[seen] > 0.4).mean() < 0.6 or rms > _MAX_RMS:
        return None  # hardly seen, or it stops below the ceiling
    if (within & upper).sum() > 0.2 * (on & upper).sum() or _area(
        voxels.xy[near][within & level], voxels
    ) > 0.3 * shape.width * shape.depth:
        return None  # one can look into it, or stand in it
    runs_on = len(_sectors(shape, voxels.xy[near][around & upper], 9)) / _SECTORS
    if _RUNS_ON[0] < runs_on < _RUNS_ON[1] or len(_sectors(shape, voxels.xy[near][around & level])) < 2:
        return None  # part of a wall, or not seen to stand on the floor
    x, y = voxels.origin + shape.centre
    return Column(
        (float(x), float(y)),
        shape.width,
        shape.depth,
        "round" if shape.round else "square",
        shape.angle,
        seen=float(seen.mean()),
        rms=rms,
        voxels=int((on & standing).sum()),
    )


def _ceiling_about(index: IntArray, z: FloatArray, out: FloatArray, height: float) -> float:
    """Height of the ceiling about a shape, m above the floor; the storey's where none was seen.

    It is a high percentile of the highest voxels of the cells around, so that lamps and beams do not count.
    """
    ring = (out > 0.1) & (out < 0.7) & (z > 1.7)
    _, cell = np.unique(index[ring] @ np.array([1 << 20, 1]), return_inverse=True)
    tops = np.zeros(int(cell.max(initial=-1)) + 1)
    np.maximum.at(tops, cell, z[ring])
    return float(np.percentile(tops, 70)) if len(tops) >= 20 else height


def _filled(step: IntArray, z: FloatArray, count: int, low: float, high: float, voxel: float) -> FloatArray:
    """Share of the heights from `low` to `high` (m) that hold a voxel, for each of `count` steps."""
    inside = (z > low) & (z < high)
    slots = int(np.ceil((high - low) / voxel))
    slot = np.unique(step[inside] * slots + ((z[inside] - low) / voxel).astype(np.int64))
    return np.bincount(slot // slots, minlength=count) / slots


def _area(xy: FloatArray, voxels: StoreyVoxels) -> float:
    """Area of the cells that hold points (n, 2), m2."""
    return len(np.unique(np.floor(xy / voxels.voxel), axis=0)) * voxels.voxel**2


def _sectors(shape: Shape, xy: FloatArray, least: int = 1) -> IntArray:
    """The directions from a shape's centre in which there are `least` points (n, 2) or more."""
    turn = np.arctan2(*shape.local(xy).T) / (2 * np.pi) % 1.0
    return np.flatnonzero(np.bincount((turn * _SECTORS).astype(np.int64) % _SECTORS, minlength=_SECTORS) >= least)


def _turned(xy: FloatArray, angle: float) -> FloatArray:
    """Points (n, 2) in a frame turned by an angle, rad."""
    cos, sin = np.cos(angle), np.sin(angle)
    turned: FloatArray = xy @ np.array([[cos, -sin], [sin, cos]])
    return turned
