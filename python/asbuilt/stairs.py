"""Flights of stairs (not in the paper).

A tread is a level patch with room over it for a person; a flight is a chain of at least five of them, each beside the
last and higher by the same rise. What else rises in steps does not do so regularly (furniture), or has no room over
each step (shelves), or rises between its steps too (roofs, vaults, ramps).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely

from asbuilt import _core
from asbuilt.grid import BoolArray, FloatArray, IntArray
from asbuilt.plan import Stair
from asbuilt.profiles import StoreyVoxels

_RISE = (0.14, 0.21)
"""Rise of a step, m."""
_EVEN = 0.02
"""Rises of one flight differ by no more than this from their common one, m."""
_HEADROOM = 1.2
"""Free height over a tread, m: enough to stand out from shelves, and met below the next turn of a spiral stair."""
_LEVEL = 0.035
"""Cells of one tread differ by less than this from their neighbours, m."""
_REACH = 2
"""Cells of one tread are at most this many cells apart."""
_MAX_LEVEL = 4.0
"""More than this area at one height, above a person's, is no step, m2."""
_STRAIGHT = 0.15
"""Middles of steps leave the way up of a straight flight by less than this, m."""
_MIN_TREADS = 5
_FIRST = 0.75
"""The lowest tread that is seen lies below this height, m."""
_TREAD = 5
"""A tread has so many cells at least."""
_LENGTH = (0.4, 4.0)
"""Length of a tread, m."""
_GOING = (0.12, 0.5)
"""From the middle of one tread to that of the next, m, in the middle of all."""
_BESIDE = 0.36
"""Treads that follow one another are no further apart than this, m; those that only show by their risers are apart."""


@dataclass(frozen=True)
class Tread:
    """A level patch: its cells (n, 2), m from the storey's origin, and its height above the floor, m."""

    xy: FloatArray
    height: float

    @property
    def middle(self) -> FloatArray:
        """The mean of its cells (2,)."""
        middle: FloatArray = self.xy.mean(axis=0)
        return middle


def find_stairs(voxels: StoreyVoxels, storey: int) -> tuple[Stair, ...]:
    """The flights that go up from a storey, in the input's frame, longest first; empty where none is seen.

    The outline is that of the steps that were seen: those above the scanners' eyes show by their risers alone, and what
    was seen from nowhere is missing.
    """
    xy, z = surfaces(voxels)
    near = _where_heights_change(xy, z)
    xy, z = xy[near], z[near]
    flights = find_flights(find_treads(xy, z, voxels.voxel))
    stairs = [_as_stair(flight, xy, z, voxels) for flight in flights if _rises_in_steps(flight, xy, z, voxels.voxel)]
    return tuple(replace(stair, id=f"S{storey}-ST{number}") for number, stair in enumerate(stairs, start=1))


def surfaces(voxels: StoreyVoxels) -> tuple[FloatArray, FloatArray]:
    """Cells (n, 2), m, and heights (n,), m, of the lowest surface over each that has room over it; floors left out."""
    if len(voxels.z) == 0:
        return np.zeros((0, 2)), np.zeros(0)
    above = np.append(np.diff(voxels.z), np.inf)
    above[voxels.first[1:] - 1] = np.inf
    free = np.flatnonzero((above > _HEADROOM) & (voxels.z > 0.08))
    cell = np.searchsorted(voxels.first, free, side="right")
    lowest = free[np.diff(cell, prepend=0) != 0]
    z = voxels.z[lowest]
    # A height at which there is more than a few steps' area is a ceiling.
    level = np.floor(z / 0.03).astype(np.int64)
    wide = np.bincount(level)[level] * voxels.voxel**2 > _MAX_LEVEL
    lowest = lowest[(z < 1.9) | ((z < voxels.height - 0.1) & ~wide)]
    return (voxels.index[lowest] + 0.5) * voxels.voxel, voxels.z[lowest]


def _where_heights_change(xy: FloatArray, z: FloatArray) -> BoolArray:
    """Which surfaces (n,) lie in blocks of half a metre about which there are several heights, as on any flight."""
    if len(z) == 0:
        return np.zeros(0, dtype=np.bool_)
    block = np.floor(xy / 0.5).astype(np.int64)
    block -= block.min(axis=0) - 1
    level = np.minimum((z / _RISE[0]).astype(np.int64), 19)
    shape = (*(block.max(axis=0) + 2), 20)
    counts = np.bincount(np.ravel_multi_index((*block.T, level), shape), minlength=int(np.prod(shape))).reshape(shape)
    found = counts >= 3
    for axis in (0, 1):
        found = found | np.roll(found, 1, axis) | np.roll(found, -1, axis)
    near: BoolArray = (found.sum(axis=2) >= 3)[tuple(block.T)]
    return near


def find_treads(xy: FloatArray, z: FloatArray, voxel: float) -> list[Tread]:
    """Level patches, lowest first, among surfaces at cells (n, 2), m, of heights (n,), m."""
    if len(z) == 0:
        return []
    label = _joined(xy, z, voxel, _LEVEL)
    order = np.flatnonzero(np.bincount(label)[label] >= _TREAD)
    if len(order) == 0:
        return []
    order = order[np.argsort(label[order], kind="stable")]
    first = np.flatnonzero(np.diff(label[order], prepend=-1))
    last = np.append(first[1:], len(order)) - 1
    size = np.maximum.reduceat(xy[order], first) - np.minimum.reduceat(xy[order], first)
    length = np.hypot(*size.T) + voxel
    upwards = z[order[np.lexsort((z[order], label[order]))]]
    height = (upwards[(first + last) // 2] + upwards[(first + last + 1) // 2]) / 2
    treads = [
        Tread(xy[order[first[i] : last[i] + 1]], float(height[i]))
        for i in np.flatnonzero((length >= _LENGTH[0]) & (length <= _LENGTH[1])).tolist()
    ]
    return sorted(treads, key=lambda tread: tread.height)


def _joined(xy: FloatArray, z: FloatArray, voxel: float, step: float) -> IntArray:
    """Numbers (n,) of the patches of cells (n, 2), m, whose heights (n,) differ by less than `step` (m) from cell to
    cell.
    """
    index = np.round(xy / voxel - 0.5).astype(np.int64)
    index -= index.min(axis=0)
    width = int(index[:, 1].max()) + 2 * _REACH + 1
    key = index[:, 0] * width + index[:, 1]  # sorted, as the cells are
    pairs = []
    for dx in range(_REACH + 1):
        for dy in range(-_REACH if dx else 1, _REACH + 1):
            other = np.minimum(np.searchsorted(key, key + dx * width + dy), len(key) - 1)
            joined = (key[other] == key + dx * width + dy) & (np.abs(z[other] - z) < step)
            pairs.append(np.stack([np.flatnonzero(joined), other[joined]]))
    first, second = np.concatenate(pairs, axis=1)
    return _core.groups(len(key), first, second)


def find_flights(treads: list[Tread]) -> list[list[Tread]]:
    """Chains of treads that rise evenly, the longest first; each tread is in one of them at most."""
    steps = _steps(treads)
    flights: list[list[Tread]] = []
    used: set[int] = set()
    while True:
        best: list[int] = []
        for rise in np.arange(_RISE[0], _RISE[1] + 0.001, 0.005):
            even = [(i, j) for i, j, up in steps if abs(up - rise) <= _EVEN and not used & {i, j}]
            chain = _longest_chain(even)
            best = chain if len(chain) > len(best) else best
        flight = [treads[i] for i in best]
        if len(flight) < _MIN_TREADS:
            return flights
        used.update(best)
        going = np.median([np.hypot(*(a.middle - b.middle)) for a, b in pairwise(flight)])
        if flight[0].height < _FIRST and _GOING[0] < going < _GOING[1]:
            flights.append(flight)


def _steps(treads: list[Tread]) -> list[tuple[int, int, float]]:
    """Pairs of treads of which the second follows the first, with the rise, in the order of the first."""
    if not treads:
        return []
    heights = np.array([tread.height for tread in treads])
    low, high = (np.array([end(tread.xy, axis=0) for tread in treads]) for end in (np.min, np.max))
    wide = _BESIDE + 1e-6  # so that rounding leaves none out
    tree = shapely.STRtree(shapely.box(*low.T, *high.T))
    first, second = tree.query(shapely.box(*(low - wide).T, *(high + wide).T))
    follows = heights[second] >= heights[first] + _RISE[0] - _EVEN
    follows &= heights[second] < heights[first] + _RISE[1] + _EVEN
    follows &= np.maximum(low[second] - high[first], low[first] - high[second]).max(axis=1) < _BESIDE
    steps = []
    for i, j in sorted(zip(first[follows].tolist(), second[follows].tolist(), strict=True)):
        gaps = np.hypot(*(treads[i].xy[:, None] - treads[j].xy).transpose(2, 0, 1))
        if gaps.min() < _BESIDE:
            steps.append((i, j, treads[j].height - treads[i].height))
    return steps


def _longest_chain(steps: list[tuple[int, int]]) -> list[int]:
    """The longest chain of treads along steps, which come in the order of their first tread, upwards."""
    before: dict[int, int] = {}
    count: dict[int, int] = {}
    for i, j in steps:
        if count.get(i, 1) + 1 > count.get(j, 1):
            count[j], before[j] = count.get(i, 1) + 1, i
    if not count:
        return []
    chain = [max(count, key=lambda k: (count[k], -k))]
    while chain[-1] in before:
        chain.append(before[chain[-1]])
    return chain[::-1]


def _rises_in_steps(flight: list[Tread], xy: FloatArray, z: FloatArray, voxel: float) -> bool:
    """Whether what lies within the outline of a flight is level at the heights of its treads, and hardly between."""
    within = shapely.contains_xy(_outline(np.concatenate([tread.xy for tread in flight]), voxel), *xy.T)
    heights = np.array([tread.height for tread in flight])
    inside = z[within & (z > heights[0] - 0.1) & (z < heights[-1] + 0.1)]
    level = np.abs(inside[:, None] - heights).min(axis=1) < 0.03
    return bool(level.sum() > 0.7 * len(level))


def _as_stair(flight: list[Tread], xy: FloatArray, z: FloatArray, voxels: StoreyVoxels) -> Stair:
    """A flight with all steps that hang together with it: of some only a corner or the riser was seen."""
    heights = np.array([tread.height for tread in flight])
    rise, first = np.polyfit(np.arange(len(heights)), heights, 1)
    number = np.round((z - first) / rise)
    off = z - first - rise * number
    steps = np.flatnonzero((np.abs(off) < 0.035) & (number > -_MIN_TREADS))
    label = _joined(xy[steps], z[steps], voxels.voxel, rise + 0.05)
    own = {tuple(cell) for tread in flight for cell in tread.xy.tolist()}
    mine = [tuple(cell) in own for cell in xy[steps].tolist()]
    steps = steps[np.isin(label, label[mine])]
    middles = np.array([np.median(xy[steps][number[steps] == k], axis=0) for k in np.unique(number[steps])])
    ring, path = _straight(xy[steps], middles, voxels.voxel) or _turning(xy[steps], middles, voxels.voxel)
    return Stair(
        ring=_points(ring + voxels.origin),
        path=_points(path + voxels.origin),
        rise=float(np.ptp(number[steps]) * rise),
        seen=min(len(steps) * voxels.voxel**2 / float(shapely.Polygon(ring).area), 1.0),
        rms=float(np.sqrt(np.mean(off[steps] ** 2))),
        voxels=len(steps),
    )


def _straight(cells: FloatArray, middles: FloatArray, voxel: float) -> tuple[FloatArray, FloatArray] | None:
    """The rectangle and the way up of a flight whose middles of steps (n, 2) lie on a line; else None."""
    centre = middles.mean(axis=0)
    along = np.linalg.svd(middles - centre)[2][0]
    along = along if float((middles[-1] - middles[0]) @ along) > 0 else -along
    turn = np.column_stack([along, (-along[1], along[0])])
    if np.abs(((middles - centre) @ turn)[:, 1]).mean() > _STRAIGHT / 2:
        return None
    (x0, y0), (x1, y1) = np.percentile((cells - centre) @ turn, (1, 99), axis=0) + np.array([[-0.5], [0.5]]) * voxel
    ring, path = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)], [(x0, (y0 + y1) / 2), (x1, (y0 + y1) / 2)]
    return centre + np.array(ring) @ turn.T, centre + np.array(path) @ turn.T


def _turning(cells: FloatArray, middles: FloatArray, voxel: float) -> tuple[FloatArray, FloatArray]:
    """The outline and the way up of a flight that turns."""
    outline = shapely.orient_polygons(_outline(cells, voxel))
    path = shapely.simplify(shapely.LineString(middles), _STRAIGHT)
    return shapely.get_coordinates(outline)[:-1], shapely.get_coordinates(path)


def _outline(cells: FloatArray, voxel: float) -> shapely.Polygon:
    """The polygon around cells (n, 2), with gaps closed and strays taken off; a rectangle where they fill one."""
    squares = shapely.union_all(shapely.box(*(cells - voxel / 2).T, *(cells + voxel / 2).T))
    closed = squares.buffer(0.25, join_style="mitre").buffer(-0.35, join_style="mitre").buffer(0.1, join_style="mitre")
    largest = max(shapely.get_parts(closed).tolist(), key=lambda part: float(part.area), default=squares.convex_hull)
    rectangle = shapely.minimum_rotated_rectangle(largest)
    return rectangle if largest.area > 0.8 * rectangle.area else shapely.Polygon(largest.exterior).simplify(2 * voxel)


def _points(xy: FloatArray) -> tuple[tuple[float, float], ...]:
    return tuple((float(x), float(y)) for x, y in xy)
