"""The elevation of each wall line: what was seen on its plane, before it and behind it (not in the paper).

An elevation is the drawing of a wall seen from the front. Each line is cut into steps of a voxel; each step keeps
which heights are filled on the plane, and whether floor, ceiling or low things come close on either side. That is what
tells a wall from a cupboard (over which the ceiling goes on), from a door (behind whose plane the floor goes on, or a
leaf stands), and a hidden stretch (where nothing is known) from a gap.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from asbuilt import _core
from asbuilt.grid import BoolArray, FloatArray, IntArray
from asbuilt.profiles import TOP_CELL, StoreyVoxels

MARGIN = 2.0
"""An elevation goes on beyond the ends of its line, m."""
ON_PLANE = 0.03
"""Voxels whose mean lies this near are on the plane, m."""
_DEPTH = 0.35
"""How far before and behind the plane is looked, m."""
_LOW = (0.1, 0.6)
"""Heights at which an opening shows what stands in it and a window does not, m."""
_NEAR = (0.03, 0.13)
"""Floor and ceiling this far before the plane belong to the room that sees it, m."""
_CLOSE = (0.03, 0.08)
"""Where they go on this close behind the plane, no wall can stand; nor can its other face, m."""
_THIN = (0.5, 0.85)
"""In clouds thinner than this, steps are two and four voxels long."""
_LEVEL = 0.08
"""What lies this near to the height of the floor is floor, m."""
_WITHIN = (_LEVEL, 0.1)
"""And so near to those of floor and ceiling, m."""
_BEYOND = (0.15, 0.3)
"""Where it goes on this far behind, what stands there is deep, as cupboards are and panes are not, m."""
_BY_WALL, _COVE = 6, 0.6
"""Of the samples of a ceiling, so many are nearest to the wall; there it may be lower by so much, m."""
_SAMPLES = np.array([(aside, shift) for aside in (0.15, 0.3, 0.45, 0.6, 0.75, 0.9) for shift in (-0.2, 0.0, 0.2)])
"""Where heights of floor and ceiling are sampled, (18, 2: to one side, along), m."""
_UPPER = (0.45, 0.1)
"""The upper zone of a wall: from and to this far below the ceiling, m."""
_CORNICE = (0.2, 0.4)
"""A cornice stands out of its wall by less than the first, and hides it below the ceiling by the second, m."""
_LINTEL = 1.7
"""The lintel before a shut door, which looks alike, goes on for less, m."""
_SPARSE = (9, 0.1, 5)
"""Where of so many cells each way less than a share is filled, gaps of fewer cells than the last are closed."""
_SCANNED = 0.45
"""Where ceilings show over less than such a share of the floors, they were not scanned."""
_ABOUT, _REACHED = 0.5, 0.3
"""What fills this share of the cells so near along the plane, m, reaches as high..."""
_LOWER = (0.7, 2.3)
"""...and the ceiling over it is not lower than the storey's by more than the first, nor than the second, m."""
_TOP = 0.25
"""Its upper half begins so far below the ceiling, m."""


@dataclass(frozen=True)
class Elevations:
    """Steps along lines, line after line.

    Attributes
    ----------
    lines : (n, 4) m from the storey's origin.
    first : (n + 1,) where each line's steps begin.
    step : length of a step, m.
    left : (m,) whether the room that sees the plane is on the left of the line.
    upper, lower, whole : (m,) share of the heights filled on the plane: in the upper zone, from 0.15 to 1.9 m, and
        from 0.15 m to the ceiling.
    top : (m,) share of the heights filled in the upper half of the upper zone; 1 where no ceiling was seen.
    covered : (m,) whether a ceiling was seen over the room that sees the plane.
    front : (m,) 0..2; how much of floor and ceiling reaches the plane from the front.
    ceiling_behind, floor_behind : (m,) 0..1; how much of them goes on just behind the plane.
    ceiling_beyond : (m,) 0..1; how much of the ceiling goes on a cupboard's depth behind it.
    low_behind : (m,) 0..1; whether low things stand just behind the plane, where a wall's body would be.
    partition : (n,) whether a line is a face of a free-standing partition.
    """

    lines: FloatArray
    first: IntArray
    step: float
    left: BoolArray
    upper: FloatArray
    lower: FloatArray
    whole: FloatArray
    top: FloatArray
    covered: BoolArray
    front: FloatArray
    ceiling_behind: FloatArray
    ceiling_beyond: FloatArray
    floor_behind: FloatArray
    low_behind: FloatArray
    partition: BoolArray

    @cached_property
    def _ways(self) -> FloatArray:
        ways: FloatArray = self.lines[:, 2:] - self.lines[:, :2]
        ways /= np.hypot(*ways.T)[:, None]
        return ways

    def along(self, line: int) -> FloatArray:
        """Unit vector (2,) from the start of a line to its end."""
        way: FloatArray = self._ways[line]
        return way

    def position(self, line: int) -> FloatArray:
        """Middle of each step along a line, m from its start."""
        return (np.arange(self.first[line + 1] - self.first[line]) + 0.5) * self.step - MARGIN

    def between(self, line: int, one: FloatArray, other: FloatArray) -> slice:
        """The steps of a line beside a stretch between two points (2,), m from the storey's origin; none beyond it."""
        start, along = self.lines[line, :2], self.along(line)
        ends = sorted(float((point - start) @ along) for point in (one, other))
        first, last = int(self.first[line]), int(self.first[line + 1])
        low, high = (min(max(int((end + MARGIN) / self.step), 0), last - first) for end in ends)
        return slice(first + low, first + high)

    def beside(self, line: int, one: FloatArray, other: FloatArray) -> slice:
        """The steps between two points as `between` tells them, but never none: the nearest one at least."""
        steps = self.between(line, one, other)
        begin = min(steps.start, int(self.first[line + 1]) - 1)
        return slice(begin, max(steps.stop, begin + 1))


def draw_elevations(lines: FloatArray, partition: BoolArray, voxels: StoreyVoxels) -> Elevations:
    """The elevations of lines (n, 4), m from the storey's origin, of which some are partitions' (n,).

    Steps are as long as a voxel, or two or four in a thin cloud, so that most of a well seen wall is filled.
    """
    return _draw(lines, partition, voxels, step_of(voxels))


def step_of(voxels: StoreyVoxels) -> float:
    """Length of a step of elevations, m."""
    return voxels.voxel * float(2 ** sum(voxels.thinness > limit for limit in _THIN))


def _draw(lines: FloatArray, partition: BoolArray, voxels: StoreyVoxels, step: float) -> Elevations:
    length = np.hypot(lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1])
    counts = np.ceil((length + 2 * MARGIN) / step).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(counts)])
    total = int(first[-1])
    line_of = np.repeat(np.arange(len(lines)), counts)
    along = (np.arange(total) - first[line_of] + 0.5) * step - MARGIN
    direction = (lines[:, 2:] - lines[:, :2]) / length[:, None]
    normal = np.column_stack([-direction[:, 1], direction[:, 0]])
    place = lines[line_of, :2] + along[:, None] * direction[line_of]
    ceilings, floors = (
        np.stack([heights(place, direction[line_of], side * normal[line_of], voxels) for side in (1, -1)])
        for heights in (ceiling_heights, floor_heights)
    )

    hits = voxels.hits(lines, _DEPTH, MARGIN, step, first)
    filled = filled_on_plane(hits, first, step)
    heights = instead_of_ceilings(ceilings, filled, first, step, voxels)
    # Where the other face of its wall stands, if the room that sees the plane is on the left, and on the right.
    twins = [twin_distance(hits, sign, height, first, step) for sign, height in zip((1, -1), heights, strict=True)]
    # Close to the plane most of all: on the far side of a thin wall another room begins.
    weights = ((1, _NEAR[1]), (9, _CLOSE[1]))
    around = hits.counts(
        [
            _ranges(total, sign, (_NEAR[0], np.minimum(reach, beyond - 0.015)), level, (-within, within))
            for levels, sign, beyond in zip(zip(floors, ceilings, strict=True), (1, -1), twins[::-1], strict=True)
            for _, reach in weights
            for level, within in zip(levels, _WITHIN, strict=True)
        ]
    )
    # So much of floor and ceiling, on the left and on the right.
    weight = np.repeat([weight for weight, _ in weights], len(_WITHIN)).astype(np.float64)
    faces = [np.sum(weight[:, None] * side, axis=0) for side in (around[:4], around[4:])]
    wide = 2 * round(0.4 / step) + 1
    left = partition[line_of] | (smooth(faces[0], first, wide) >= smooth(faces[1], first, wide))

    front_is = np.where(left, 1.0, -1.0)
    ceiling, twin = np.where(left, heights, heights[::-1])[0], np.where(left, *twins)
    unknown = np.isnan(np.where(left, *ceilings))
    # Levels before and behind: a floor may be higher on one side.
    before, behind = np.where(left, floors, floors[::-1])
    below = filled_below(filled)

    close = (_NEAR[0], np.minimum(_CLOSE[1], twin - 0.015))
    at_floor, at_ceiling = ((-within, within) for within in _WITHIN)
    low = (_NEAR[0] + 0.005, np.minimum(0.3, twin - 0.02))
    whole = share_filled(below, np.full(total, 0.15), ceiling - _UPPER[1], step)
    upper_zone = (-_UPPER[0], -_UPPER[1])
    # Where a cornice stands out, and beyond.
    out, deep = (2 * ON_PLANE, _CORNICE[0]), (_CORNICE[0], _DEPTH)
    looks: list[tuple[FloatArray, Ends, FloatArray | float, Ends, int]] = [
        (front_is, _NEAR, before, at_floor, 1),
        (-front_is, close, behind, at_floor, 1),
        (front_is, _NEAR, ceiling, at_ceiling, 1),
        (-front_is, close, ceiling, at_ceiling, 1),
        (-front_is, _BEYOND, ceiling, at_ceiling, 1),
        (-front_is, low, 0.0, _LOW, 2),
        (front_is, out, ceiling, upper_zone, 3),
        (front_is, out, ceiling - 2 * _CORNICE[1], upper_zone, 3),
        (front_is, deep, ceiling, upper_zone, 3),
    ]
    seen = hits.counts([_ranges(total, side, depth, about, height) for side, depth, about, height, _ in looks])
    floor, floor_behind, over, ceiling_behind, ceiling_beyond, low_behind, hiding, lower_down, farther = (
        smooth((count >= least).astype(np.float64), first, 5) for count, (*_, least) in zip(seen, looks, strict=True)
    )
    front_floor, floor_behind = _as_if_dense(floor, floor_behind, whole)
    front_ceiling, ceiling_behind = _as_if_dense(over, ceiling_behind, whole)
    upper, under = (
        share_filled(below, ceiling - low - _UPPER[0], ceiling - low - _UPPER[1], step) for low in (0.0, _CORNICE[1])
    )
    top = share_filled(below, ceiling - _TOP, ceiling - _UPPER[1], step)
    lower = share_filled(below, np.full(total, 0.15), np.full(total, 1.9), step)
    hiding, lower_down, farther, high, low_part = (
        smooth(share, first, wide) for share in (hiding, lower_down, farther, top, lower)
    )
    at_cornice = ~unknown & _is_cornice(hiding, lower_down, farther, high, low_part)
    at_cornice = _long_runs(at_cornice, first, round(_LINTEL / step))
    return Elevations(
        lines,
        first,
        step,
        left,
        upper=np.where(at_cornice, np.maximum(upper, under), upper),
        lower=lower,
        whole=whole,
        top=np.where(unknown | at_cornice, 1.0, top),
        covered=~unknown,
        front=front_floor + (front_ceiling if front_ceiling.any() else front_floor),
        ceiling_behind=ceiling_behind,
        ceiling_beyond=ceiling_beyond,
        floor_behind=floor_behind,
        low_behind=low_behind,
        partition=partition,
    )


def filled_on_plane(hits: _core.Hits, first: IntArray, step: float) -> BoolArray:
    """Which cells of elevations (m, rows), as wide and high as a `step` (m), hold a voxel on the plane."""
    rows = int(np.floor(max(hits.highest, 0.0) / step)) + 2
    on_plane = _ranges(int(first[-1]), 1, (-ON_PLANE, ON_PLANE), 0.0, (np.nextafter(0.0, -1.0), np.inf))
    return _close_sparse(hits.by_height(on_plane, step, rows) > 0, first)


def instead_of_ceilings(
    ceilings: FloatArray, filled: BoolArray, first: IntArray, step: float, voxels: StoreyVoxels
) -> FloatArray:
    """Heights of ceilings (2, m) over each step, m, with those that were not seen taken to be the storey's.

    Where hardly any were scanned, a ceiling lies as high as what stands on the plane reaches, of which the cells
    `filled` (m, rows) are: rooms of one storey are not of one height.
    """
    height = np.full(len(filled), voxels.height)
    if voxels.roofed < _SCANNED:
        wide = 2 * round(_ABOUT / step) + 1
        dense = smooth_rows(filled.astype(np.float64), first, wide) > _REACHED
        reached = (dense.shape[1] - dense[:, ::-1].argmax(axis=1)) * step + _UPPER[1]
        lower = dense.any(axis=1) & (reached > max(voxels.height - _LOWER[0], _LOWER[1])) & (reached < voxels.height)
        height[lower] = reached[lower]
        return np.stack([height, height])
    return np.where(np.isfinite(ceilings), ceilings, height)


def _is_cornice(
    hiding: FloatArray, lower_down: FloatArray, farther: FloatArray, top: FloatArray, lower: FloatArray
) -> BoolArray:
    """Where (m,) something stands out under the ceiling, neither lower down nor farther, and hides the wall there."""
    alone = (hiding > 0.7) & (np.maximum(lower_down, farther) < 0.3)
    hidden: BoolArray = alone & (top < 0.3) & (lower > 0.5)
    return hidden


def usual(part: FloatArray, whole: FloatArray) -> float:
    """What part (m,) of an elevation is usual where a wall is well seen, by the share of it that is filled."""
    seen = part[whole > 0.3 * whole.max(initial=0)]
    return float(np.percentile(seen, 75)) if len(seen) else 1.0


def _as_if_dense(front: FloatArray, behind: FloatArray, whole: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Shares (m,) of the steps before and behind which floor or ceiling was seen, as a dense cloud would show them.

    Before a well seen wall a dense cloud shows them at every step. A thin one misses some; behind, where a strip half
    as wide is looked at, more. What hardly ever shows was not scanned.
    """
    full = usual(front, whole)
    if full < 0.3:
        return np.zeros_like(front), np.zeros_like(behind)
    half = 1 - np.sqrt(1 - min(full, 1.0))
    return np.minimum(front / full, 1), np.minimum(behind / half, 1)


def ceiling_heights(place: FloatArray, along: FloatArray, towards: FloatArray, voxels: StoreyVoxels) -> FloatArray:
    """Height of the ceiling (m above the floor) to one side of places (n, 2); NaN where none is seen.

    The highest voxel of each cell of 10 cm is sampled up to 0.9 m to the side; the ceiling is a high percentile, so
    that lamps and beams under it do not count.
    """
    # By a wall it may be lower: a cove, a tray, a beam.
    ceiling, by_wall = (
        _height_about(place, along, towards, voxels.tops, samples, 0.7) for samples in (_SAMPLES, _SAMPLES[:_BY_WALL])
    )
    return np.where((by_wall < ceiling - 0.1) & (by_wall > ceiling - _COVE), by_wall, ceiling)


def floor_heights(place: FloatArray, along: FloatArray, towards: FloatArray, voxels: StoreyVoxels) -> FloatArray:
    """Height of the floor (m above the storey's) to one side of places (n, 2): rooms may lie a few steps higher."""
    found = _height_about(place, along, towards, voxels.bottoms, _SAMPLES, 0.3, _LEVEL)
    return np.where(np.isnan(found), 0.0, found)


def _height_about(
    place: FloatArray,
    along: FloatArray,
    towards: FloatArray,
    grid: tuple[IntArray, FloatArray],
    samples: FloatArray,
    share: float,
    level: float = 0.0,
) -> FloatArray:
    """A height (n,), m, to one side of places, of samples (k, 2) in a grid; NaN where fewer than four are known.

    It is the one at a `share` from the least to the greatest, or 0 where a quarter of them lie within `level` (m) of 0.
    """
    low, heights = grid
    first = (int(low[0]), int(low[1]))
    return _core.height_about(
        heights, first, TOP_CELL, samples, place, towards, along, share=share, least=4, level=level
    )


Ends: TypeAlias = tuple[FloatArray | float, FloatArray | float]


def _ranges(
    steps: int, side: FloatArray | float, depth: Ends, about: FloatArray | float, height: Ends
) -> tuple[FloatArray, tuple[FloatArray, FloatArray], FloatArray, tuple[FloatArray, FloatArray]]:
    """What counts at each step, as `_core.Hits` takes it: each as an array (steps,), m, also where it is the same."""

    def each(value: FloatArray | float) -> FloatArray:
        return np.broadcast_to(np.asarray(value, dtype=np.float64), steps)

    return each(side), (each(depth[0]), each(depth[1])), each(about), (each(height[0]), each(height[1]))


def twin_distance(hits: _core.Hits, front_is: int, ceiling: FloatArray, first: IntArray, step: float) -> FloatArray:
    """How far behind each step the other face of its wall stands, m; the depth of the elevation where none is seen.

    `front_is` 1 if the room is on the left of the line, else -1. Another face is filled in the upper zone, which a
    door leaf in the wall's opening is not.
    """
    upper = (ceiling - _UPPER[0], ceiling - _UPPER[1])
    behind = _ranges(len(ceiling), -front_is, (ON_PLANE + 0.01, np.inf), 0.0, upper)
    filled = hits.by_depth(behind, 0.02, int(np.ceil(_DEPTH / 0.02)))
    dense = smooth_rows(filled.astype(np.float64), first, 2 * round(0.5 / step) + 1)
    dense[:, :-1] += dense[:, 1:]
    needed = 0.25 * (_UPPER[0] - _UPPER[1]) / step
    face = dense >= needed
    return np.where(face.any(axis=1), face.argmax(axis=1) * 0.02 + 0.02, _DEPTH)


def smooth(values: FloatArray, first: IntArray, width: int) -> FloatArray:
    """Mean over `width` steps around each step (m,), never across lines."""
    return smooth_rows(values[:, None].astype(np.float64), first, width)[:, 0]


def smooth_rows(values: FloatArray, first: IntArray, width: int) -> FloatArray:
    """Mean over `width` steps around each step (m, k), never across lines."""
    return _core.means_along(np.ascontiguousarray(values), np.asarray(first, dtype=np.int64), width)


def _long_runs(found: BoolArray, first: IntArray, least: int) -> BoolArray:
    """Which steps (m,) are of runs of at least so many that were found, never across lines."""
    new = np.diff(found, prepend=False)
    new[first[:-1]] = True
    run = np.cumsum(new)
    long: BoolArray = found & (np.bincount(run)[run] >= least)
    return long


def close_gaps(values: FloatArray, first: IntArray, width: int) -> FloatArray:
    """Fill gaps of fewer than `width` steps to the level of their shores (grey closing), never across lines.

    Scan lines that fall on a far wall leave gaps between them; ends stay where they are.
    """
    return _core.close_gaps(np.ascontiguousarray(values), np.asarray(first, dtype=np.int64), width)


def _close_sparse(filled: BoolArray, first: IntArray) -> BoolArray:
    """Cells of elevations (m, rows), with the gaps between filled ones closed where only few are filled.

    On what is far from all scanners, points lie farther apart than cells are long; a surface they are all the same.
    """
    around, share, width = _SPARSE
    return _core.close_sparse(filled, np.asarray(first, dtype=np.int64), around=around, share=share, width=width)


def filled_below(filled: BoolArray) -> IntArray:
    """How many of the heights below each (total, rows + 1) hold a voxel, by those that do (total, rows)."""
    below = np.zeros((len(filled), filled.shape[1] + 1), dtype=np.int16)
    np.cumsum(filled, axis=1, out=below[:, 1:])
    return below


def share_filled(below: IntArray, low: FloatArray, high: FloatArray, step: float) -> FloatArray:
    """Share of the heights from `low` to `high` (m) that are filled, for each row of `filled_below`."""
    row = np.arange(len(below))
    first, last = (np.clip(np.round(h / step).astype(np.int64), 0, below.shape[1] - 1) for h in (low, high))
    shares: FloatArray = (below[row, last] - below[row, first]) / np.maximum(last - first, 1)
    return shares
