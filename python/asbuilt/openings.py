"""Doors and windows (not in the paper, which names them as future work).

On the unrolled sides of the walls an opening is a rectangle where the plane is not filled and something is seen in the
body of the wall: reveals, a leaf, a pane and its frame, or the floor that goes on. What hides a wall leaves a gap in
its plane too, but shows nothing behind it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, TypedDict

import numpy as np

from asbuilt.directed import Directed
from asbuilt.elevations import Elevations
from asbuilt.faces import Face
from asbuilt.grid import BoolArray, FloatArray, IntArray
from asbuilt.leaves import Leaf, find_leaves
from asbuilt.neighbours import near_each
from asbuilt.opening_boxes import DOOR_WIDTH, SILL, WINDOW_SIZE, Box, Rim, find_boxes, look_behind, measure_rim
from asbuilt.plan import Door, DoorState, Opening, Point, UnknownOpening, Window
from asbuilt.profiles import StoreyVoxels
from asbuilt.wall_sides import DEPTH, LOWEST, PLANE, REACH, WallSides, unroll_sides

_DOOR_HEIGHT = 1.75
"""Doors are at least this high, m."""
_CLEAR_HEIGHT = 1.92
"""Without a leaf in them they are higher than this, m: lower ones are gaps before which something hangs."""
_LEAF = 0.45
"""A leaf fills more than this share of an opening; a pane, through which rays pass, less."""
_CLOSED = 0.8
"""What the other side of its wall fills more than this is no opening, unless a leaf fills it: something hides it."""
_LEAF_THICK = 0.09
"""A leaf and what the other side of its wall lies beyond it are no thicker, m."""
_LEAFED = 0.34
"""Leaves up to the ceiling are in walls no thicker, m; in thicker ones there are niches."""
_REVEAL = 0.3
"""The surface of a jamb is looked for up to this deep in its wall, m."""
_PANE = 0.015
"""Share of an opening that a pane fills at least."""
_BESIDE = 0.4
"""The threshold of a doorway ends no further than this from its jamb, m."""
_JAMB = 0.7
"""A jamb that shows over more than this share of its height shows all over..."""
_JAMB_HEIGHT = 1.0
"""...if that is more than this, m: of a threshold any share shows."""
_HIDDEN = 0.35
"""Nor does the frame of a window, m."""
_GATHERED = 0.025
"""Voxels of a jamb lie this near to one another along its side, m."""
_AGREE = 0.04
"""Places of a jamb that differ less, as seen from both sides of its wall, are averaged, m."""
_SAME_OPENING = 2 * DOOR_WIDTH[1]
"""Holes whose starts are further apart are not the same opening, m."""
_THICKEST = 0.8
"""The two sides of a wall are no further apart, m."""


@dataclass(frozen=True)
class Openings:
    """The openings of one storey, in the input's frame."""

    doors: tuple[Door, ...] = ()
    windows: tuple[Window, ...] = ()
    unknown: tuple[UnknownOpening, ...] = ()

    @property
    def all(self) -> tuple[Opening, ...]:
        """Doors, windows and what is unknown."""
        return (*self.doors, *self.windows, *self.unknown)

    @property
    def to_floor(self) -> tuple[Opening, ...]:
        """Those through which the floor goes on: doors, and windows without a sill to step over."""
        return (*self.doors, *(window for window in self.windows if window.sill is not None and window.sill < SILL))


class Measured(TypedDict):
    """What any `Opening` says of itself."""

    id: str
    seen: float
    voxels: int
    sill: float
    head: float


class Hung(TypedDict):
    """What `Door` says of its leaf."""

    state: DoorState
    hinge: Literal["start", "end"] | None
    swing: Literal["left", "right"] | None


@dataclass(frozen=True)
class Hole(Directed):
    """An opening as one side of its wall shows it.

    Attributes
    ----------
    side : the side of a wall; low, high : its jambs, m along it.
    sill, head : heights above the storey's floor, m.
    kind : "door", "window" or "unknown".
    score : share of its rim that was seen, 0..1.
    cells : number of its cells of a voxel's size in which something was seen.
    density : share of it that something in the wall's body fills, 0..1.
    twin : how far behind the plane the other side of the wall is, m; None where that was not seen.
    sure : whether each jamb was seen as a surface of its own, or shows all over.
    start, end : (2,) where its jambs meet the plane, m from the storey's origin.
    """

    side: int
    low: float
    high: float
    sill: float
    head: float
    kind: str
    score: float
    cells: int
    density: float
    twin: float | None
    sure: tuple[bool, bool]
    start: FloatArray
    end: FloatArray


def find_openings(
    faces: list[Face], elevations: Elevations, scores: FloatArray, voxels: StoreyVoxels, storey: int
) -> Openings:
    """The openings in the walls on which faces stand.

    Parameters
    ----------
    faces, elevations, scores : of the storey's walls, m from its origin.
    storey : its index, for the names of the openings.

    Returns
    -------
    Openings : doors, windows, and gaps that no scan could look through; empty where there are no faces.
    """
    sides = unroll_sides(faces, elevations, voxels)
    if len(sides.segments) == 0:
        return Openings()
    seen = look_behind(sides)
    boxes = find_boxes(sides, seen)
    holes = [
        hole
        for box, beyond in zip(boxes, floors_beyond(sides, voxels, boxes), strict=True)
        if (hole := _measure(sides, voxels, seen, box, float(beyond))) is not None
    ]
    return _draw(pair_holes(holes), find_unknown(sides, holes), voxels, storey)


def floors_beyond(sides: WallSides, voxels: StoreyVoxels, boxes: list[Box]) -> FloatArray:
    """Height (n,) of the floor of the room behind each box, m; NaN where it leads outside, or nothing is known.

    The ground outside is no room's floor: it lies lower, and no ceiling over it.
    """
    if not boxes:
        return np.zeros(0)
    segments = np.zeros((len(boxes), 4))
    floor = np.zeros(len(boxes))
    for i, box in enumerate(boxes):
        start, end = (
            sides.at(box.side, (column - sides.first[box.side]) * sides.step)[0] for column in (box.low, box.high)
        )
        along = (end - start) / max(float(np.hypot(*(end - start))), 1e-12)
        behind = float(np.median(sides.twin[box.low : box.high])) + 0.5
        segments[i] = np.tile(behind * np.array([along[1], -along[0]]), 2) + np.concatenate([start, end])
        floor[i] = np.median(sides.floor[box.low : box.high])
    of_box, voxel, place, offset = voxels.strips(segments, 0.4)
    z = voxels.z[voxel]
    deep, high = 8, 21
    length = np.maximum(np.hypot(*(segments[:, 2:] - segments[:, :2]).T), 0.1)
    wide = int(length.max(initial=0) / 0.1) + 1
    cell = (of_box * wide + (place / 0.1).astype(np.int64)) * deep + np.minimum((offset + 0.4) / 0.1, deep - 1).astype(
        np.int64
    )
    cells = len(boxes) * wide * deep

    def covered(chosen: BoolArray, layer: IntArray, layers: int) -> FloatArray:
        filled = np.zeros((layers, cells), dtype=np.bool_)
        filled[layer[chosen], cell[chosen]] = True
        shares: FloatArray = filled.reshape(layers, len(boxes), -1).sum(axis=2) / (length / 0.1 * deep)
        return shares

    roofed = covered(z > 2.0, np.zeros(len(z), np.int64), 1)[0] > 0.3
    at = np.round((z + 0.5) / 0.05).astype(np.int64)
    shares = covered((at >= 0) & (at < high), at, high)
    shares = shares + np.maximum(np.pad(shares, ((1, 0), (0, 0)))[:-1], np.pad(shares, ((0, 1), (0, 0)))[1:])
    heights = np.arange(high) * 0.05 - 0.5
    shares[~roofed & ((heights[:, None] < np.minimum(floor, 0.0) - 0.12) | (heights[:, None] > floor + 0.45))] = 0.0
    return np.where(shares.max(axis=0) > 0.3, heights[shares.argmax(axis=0)], np.nan)


def _measure(sides: WallSides, voxels: StoreyVoxels, seen: BoolArray, box: Box, beyond: float) -> Hole | None:
    """What a box is, and where its jambs are; None where it is no opening."""
    step = sides.step
    # The threshold lies as high as the higher of both floors.
    floor = float(np.nanmax([np.median(sides.floor[box.low : box.high]), beyond]))
    ceiling = float(np.median(sides.ceiling[box.low : box.high]))
    sill = LOWEST + (box.bottom - 0.5) * step
    walkable = sill - floor < SILL
    edge = measure_rim(box, sides, seen)
    grown = _grown(box, sides, floor, ceiling) if walkable else _widened(box, sides)
    # Beyond a jamb that shows all over an opening does not go on.
    tall = (box.top - box.bottom) * step > _JAMB_HEIGHT
    first, last = (tall and shown > _JAMB for shown in (edge.left, edge.right))
    box = replace(grown, low=box.low if first else grown.low, high=box.high if last else grown.high)
    head = LOWEST + (box.top - 0.5) * step
    width = (box.high - box.low) * step
    rim = measure_rim(box, sides, seen)
    to_ceiling = head > ceiling - 0.12
    # Leaves, and what the other side of a wall fills, are asked for where one could walk.
    leaf, other_side = _filled(sides, box) if walkable else (0.0, 0.0)
    if walkable and not to_ceiling:
        rim = replace(rim, density=max(rim.density, leaf))
    # A recess up to the ceiling is a niche, unless what closes it is as thin as a leaf.
    closes = not to_ceiling or _leaf_behind(sides, box, sill, head)
    twin = float(np.median(sides.twin[box.low : box.high]))
    open_behind = other_side < _CLOSED or twin < _LEAF_THICK
    kind = _classify(rim, width, sill - floor, head - sill, to_ceiling, closes, bool(np.isfinite(beyond)), open_behind)
    if kind is None:
        return None
    jambs = [_jamb(sides, voxels, box, at_end) for at_end in (False, True)]
    (low, sure_low), (high, sure_high) = jambs
    if high - low < min(WINDOW_SIZE[0], DOOR_WIDTH[0]):
        return None
    start, end = sides.at(box.side, low)[0], sides.at(box.side, high)[0]
    score = (rim.left + rim.right + rim.bottom + rim.top) / 4
    return Hole(
        box.side,
        low,
        high,
        sill,
        head,
        kind,
        score,
        box.cells,
        rim.density,
        twin if twin < DEPTH else None,
        (sure_low or first, sure_high or last),
        start,
        end,
    )


def _grown(box: Box, sides: WallSides, floor: float, ceiling: float) -> Box:
    """A box on the floor, grown up to the lintel, or to the ceiling where there is none, and out to the wall beside it.

    Of a doorway in a thin wall only a part of the threshold may show.
    """
    start, stop = int(sides.row(floor + 1.0)), int(sides.row(ceiling))
    if box.top < start + round(0.9 / sides.step):
        wall = sides.wall[box.low : box.high, start:stop]
        first = np.where(wall.any(axis=1), wall.argmax(axis=1), stop - start)
        box = replace(box, top=max(box.top, start + int(np.median(first))))
    reach = round(_BESIDE / sides.step)
    columns = _about(box, reach, sides)
    gap: BoolArray = np.logical_not(sides.wall[columns, start : box.top - 1].any(axis=1))
    gap &= sides.wall[columns, box.top : box.top + 3].any(axis=1)
    low, high = box.low, box.high
    while low - 1 >= columns[0] and gap[low - 1 - columns[0]]:
        low -= 1
    while high <= columns[-1] and gap[high - columns[0]]:
        high += 1
    # Where the gap goes on further, something hides the wall.
    low = low if low > columns[0] else box.low
    high = high if high <= columns[-1] else box.high
    return replace(box, low=low, high=high)


def _about(box: Box, reach: int, sides: WallSides) -> IntArray:
    """The columns of a box and up to `reach` more to either side, as far as its wall's side goes."""
    first, last = sides.first[box.side], sides.first[box.side + 1]
    return np.arange(max(box.low - reach, first), min(box.high + reach, last), dtype=np.int64)


def _widened(box: Box, sides: WallSides) -> Box:
    """A box grown out to the wall beside it: of a reveal that is seen from the side nothing shows."""
    reach = round(_HIDDEN / sides.step)
    columns = _about(box, reach, sides)
    filled = sides.wall[columns, box.bottom : box.top].mean(axis=1)
    low, high = box.low, box.high
    while low - 1 > columns[0] and filled[low - 1 - columns[0]] < 0.1:
        low -= 1
    while high < columns[-1] and filled[high - columns[0]] < 0.1:
        high += 1
    # Where no wall begins, something hides it.
    low = low if filled[max(low - 1 - columns[0], 0)] > 0.5 else box.low
    high = high if filled[min(high, columns[-1]) - columns[0]] > 0.5 else box.high
    return replace(box, low=low, high=high)


def _filled(sides: WallSides, box: Box) -> tuple[float, float]:
    """Shares of a box, 0..1, that one plane in the body of its wall fills, a leaf, and the wall's other side."""
    low, high = ((column - sides.first[box.side]) * sides.step for column in (box.low + 2, box.high - 2))
    bottom, top = (LOWEST + row * sides.step for row in (box.bottom + 1.5, box.top - 2.5))
    near = sides.hits(box.side, low, high)
    near = near[(sides.depth[near] > PLANE) & (sides.z[near] > bottom) & (sides.z[near] < top)]
    cells = max((box.high - box.low - 4) * (box.top - box.bottom - 4), 1)
    cell = sides.column[near] * sides.wall.shape[1] + sides.row(sides.z[near])
    depth, twin = sides.depth[near], sides.twin[sides.column[near]]
    within = depth < np.where(twin < DEPTH, twin - PLANE, REACH)
    slot = (depth / PLANE).astype(np.int64)

    def share(chosen: BoolArray) -> float:
        return min(len(np.unique(cell[chosen])) / cells, 1.0)

    leaf = max((share(within & ((slot == at) | (slot == at + 1))) for at in np.unique(slot)), default=0.0)
    return leaf, share(np.abs(depth - twin) < 1.5 * PLANE)


def _leaf_behind(sides: WallSides, box: Box, sill: float, head: float) -> bool:
    """Whether what fills a box stands so near to the other side of its wall that it can only be a leaf."""
    low, high = ((column - sides.first[box.side]) * sides.step for column in (box.low, box.high))
    inside = sides.hits(box.side, low + 0.15, high - 0.15)
    inside = inside[(sides.z[inside] > sill + 0.2) & (sides.z[inside] < head - 0.2)]
    inside = inside[(sides.depth[inside] > PLANE) & (sides.depth[inside] < DEPTH)]
    behind = sides.twin[sides.column[inside]] - sides.depth[inside]
    # The back of the same leaf, flush with the other side, counts as that side.
    return (
        bool(len(inside))
        and bool(np.median(behind) < _LEAF_THICK)
        and bool(np.median(sides.twin[box.low : box.high]) < _LEAFED)
    )


def _classify(
    rim: Rim, width: float, sill: float, height: float, to_ceiling: bool, closes: bool, indoors: bool, open_behind: bool
) -> str | None:
    ends = (max(rim.left, rim.wall_left), max(rim.right, rim.wall_right))
    if rim.wall_within > 0.3 or min(ends) < 0.15:
        return None
    pane = _PANE < rim.density < _LEAF and rim.spread > 0.7
    if sill < SILL and height > _DOOR_HEIGHT and DOOR_WIDTH[0] <= width <= DOOR_WIDTH[1]:
        if pane and not indoors:
            return "window"
        if rim.density > _LEAF:
            return "door" if closes else None
        if not open_behind:
            return None
        jambs = max(rim.left, rim.right)
        if rim.bottom > 0.4 or (rim.top > 0.4 and jambs > 0.4):
            # Up to the ceiling there is no lintel: both jambs show, or the threshold of a room runs from wall to wall.
            threshold = indoors and rim.bottom > 0.8 and min(ends) > 0.8
            passage = not to_ceiling or min(rim.left, rim.right) > 0.3 or threshold
            return "door" if min(ends) > 0.4 and passage and height > _CLEAR_HEIGHT else None
        return None
    # What stands before a window may be taken for the floor.
    if width >= WINDOW_SIZE[0] and height >= WINDOW_SIZE[1] and (sill > 0.1 or (pane and height < _DOOR_HEIGHT)):
        if rim.density > _LEAF and to_ceiling:
            return None  # the wall above what stands before it
        return "window" if rim.left + rim.right + rim.bottom + rim.top > 1.0 else None
    return None


def _jamb(sides: WallSides, voxels: StoreyVoxels, box: Box, at_end: bool) -> tuple[float, bool]:
    """Place of a jamb along its side, m, and whether it was seen as a surface of its own.

    A surface that turns into the wall gathers voxels at one place; else the jamb is where the voxels on the plane end.
    """
    guess = ((box.high if at_end else box.low) - sides.first[box.side]) * sides.step
    low, high = (LOWEST + (row - 0.5) * sides.step for row in (box.bottom, box.top))
    near = sides.hits(box.side, guess - 0.2, guess + 0.2)
    near = near[(sides.z[near] > low + 0.1) & (sides.z[near] < high - 0.1)]
    sign = 1.0 if at_end else -1.0
    _, along = sides.at(box.side, guess)
    xx, xy, yy = voxels.covariance[sides.voxel[near]].T
    variance = np.maximum(along[0] ** 2 * xx + 2 * along[0] * along[1] * xy + along[1] ** 2 * yy, 0.0)
    # Points spread evenly over a length reach the root of three standard deviations from their mean.
    out = sign * (sides.place[near] - guess)
    reach = np.sqrt(3 * variance)
    depth = sides.depth[near]
    behind = (depth > PLANE) & (depth < np.minimum(sides.twin[sides.column[near]] - PLANE, _REVEAL))
    inner, distinct = _last_place((out + reach)[behind & (np.abs(out) < 0.12)])
    if distinct:
        return guess + sign * inner, True
    on_plane = np.abs(depth) < PLANE
    edges = [] if math.isnan(inner) else [inner]
    if on_plane.sum() >= 5:
        row = np.round(sides.z[near][on_plane] / sides.step).astype(np.int64)
        nearest = np.full(int(np.ptp(row)) + 1, np.inf)
        np.minimum.at(nearest, row - row.min(), (out - reach)[on_plane])
        outer = float(np.median(nearest[np.isfinite(nearest)]))
        edges += [outer] if abs(outer) < 0.1 else []
    return guess + sign * (sum(edges) / len(edges) if edges else 0.0), False


def _last_place(places: FloatArray) -> tuple[float, bool]:
    """The last place (m) where many of some places gather, and whether many more do than before it; NaN if too few."""
    places = np.sort(places)
    within = np.searchsorted(places, places + _GATHERED, side="right") - np.arange(len(places))
    if len(places) < 5 or within.max() < 5:
        return np.nan, False
    last = int(np.flatnonzero(within >= 0.5 * within.max())[-1])
    about = np.flatnonzero((places > places[last] - _GATHERED) & (places <= places[last]))
    best = int(about[within[about].argmax()])
    place = float(np.median(places[best : best + within[best]]))
    before = best / max((places[best] + 0.12) / _GATHERED, 1.0)
    return place, bool(within[best] > 3 * before)


def pair_holes(holes: list[Hole]) -> list[list[Hole]]:
    """Holes that are the same opening seen from both sides of its wall, the better seen first.

    A hole that lies behind or before another one and looks the same way is the same opening once more: a pane or a
    frame makes a plane of its own.
    """
    holes = sorted(holes, key=lambda h: (-h.score, h.side, h.low))
    starts = np.array([hole.start for hole in holes]).reshape(-1, 2)
    pairs: dict[int, list[Hole]] = {}
    for i, near in enumerate(near_each(starts, starts, _SAME_OPENING)):
        together = next((pairs[j] for j in near if j in pairs and _are_one(pairs[j][0], holes[i])), None)
        if together is None:
            pairs[i] = [holes[i]]
        elif len(together) == 1 and _facing(together[0], holes[i]) < 0:
            together.append(holes[i])
    return list(pairs.values())


def _facing(a: Hole, b: Hole) -> float:
    """Cosine of the angle between two holes: -1 where they look away from each other."""
    return float(a.along @ b.along)


def _are_one(a: Hole, b: Hole) -> bool:
    """Whether two holes are in one wall, at the same place."""
    if math.dist(a.start.tolist(), b.start.tolist()) > _SAME_OPENING or abs(_facing(a, b)) < 0.96:
        return False
    relative = np.array([b.start, b.end]) - a.start
    low, high = np.sort(relative @ a.along)
    behind = -(relative @ a.normal)
    apart = (behind.min(), behind.max()) if _facing(a, b) < 0 else (0.0, np.abs(behind).max() * 2)
    overlap = min(high, a.length) - max(low, 0.0)
    lower, upper = max(a.sill, b.sill), min(a.head, b.head)
    return bool(
        overlap > 0.5 * min(high - low, a.length) and apart[0] > -0.05 and apart[1] < _THICKEST and upper > lower
    )


def find_unknown(sides: WallSides, holes: list[Hole]) -> list[FloatArray]:
    """Start and end (4,), m, of the gaps as wide as a door between the faces of a side in which no hole was seen."""
    gaps = []
    for side, (first, last) in enumerate(pairwise(sides.first)):
        covered = np.flatnonzero(sides.covered[first:last])
        gaps_after = np.flatnonzero(np.diff(covered) > DOOR_WIDTH[0] / sides.step)
        for i in gaps_after:
            low, high = (covered[i] + 1) * sides.step, covered[i + 1] * sides.step
            if high - low > DOOR_WIDTH[1]:
                continue
            start, end = sides.at(side, low)[0], sides.at(side, high)[0]
            gaps.append(np.concatenate([start, end]))
    near = near_each(
        np.array(gaps).reshape(-1, 4),
        np.array([[*hole.start, *hole.end] for hole in holes]).reshape(-1, 4),
        _THICKEST,
    )
    return [gap for gap, about in zip(gaps, near, strict=True) if not any(_shares(gap, holes[i]) for i in about)]


def _shares(gap: FloatArray, hole: Hole) -> bool:
    """Whether a gap (4,) and a hole are of one wall and overlap."""
    start, end = gap[:2], gap[2:]
    way = (end - start) / max(float(np.hypot(*(end - start))), 1e-12)
    relative = np.array([hole.start, hole.end]) - start
    place = np.sort(relative @ way)
    aside = np.abs(relative @ np.array([-way[1], way[0]]))
    return bool(aside.max() < _THICKEST and place[1] > 0.1 and place[0] < float((end - start) @ way) - 0.1)


def _draw(pairs: list[list[Hole]], gaps: list[FloatArray], voxels: StoreyVoxels, storey: int) -> Openings:
    """The openings of a storey in the input's frame, each with its name."""
    placed = [(pair[0], np.concatenate(_line(pair))) for pair in pairs]
    placed = [(hole, line) for hole, line in placed if math.dist(line[:2], line[2:]) > WINDOW_SIZE[0]]
    doors, windows = ([(hole, line) for hole, line in placed if hole.kind == kind] for kind in ("door", "window"))
    lines = np.array([line for _, line in doors]).reshape(-1, 4)
    leaves = find_leaves(
        lines, np.array([hole.twin or 0.1 for hole, _ in doors]), np.array([hole.sill for hole, _ in doors]), voxels
    )

    def frame(line: FloatArray) -> tuple[Point, Point]:
        (x1, y1), (x2, y2) = (line.reshape(2, 2) + voxels.origin).tolist()
        return (x1, y1), (x2, y2)

    def measured(letter: str, number: int, hole: Hole) -> Measured:
        return {
            "id": f"S{storey}-{letter}{number}",
            "seen": hole.score,
            "voxels": hole.cells,
            # Less than a voxel tells nothing: what goes down to the floor has the floor for its sill.
            "sill": 0.0 if abs(hole.sill) <= voxels.voxel else hole.sill,
            "head": hole.head,
        }

    return Openings(
        tuple(
            Door(*frame(line), **measured("D", i, hole), **_hung(hole, leaf))
            for i, ((hole, line), leaf) in enumerate(zip(doors, leaves, strict=True), start=1)
        ),
        tuple(Window(*frame(line), **measured("G", i, hole)) for i, (hole, line) in enumerate(windows, start=1)),
        tuple(UnknownOpening(*frame(line), id=f"S{storey}-U{i}") for i, line in enumerate(gaps, start=1)),
    )


def _hung(hole: Hole, leaf: Leaf | None) -> Hung:
    """The state of a door, and its hinge and swing where its leaf stands open."""
    if hole.density > _LEAF:
        return {"state": "shut", "hinge": None, "swing": None}
    if leaf is None:
        return {"state": "cased", "hinge": None, "swing": None}
    return {"state": "open", "hinge": leaf.hinge, "swing": leaf.swing}


def _line(pair: list[Hole]) -> tuple[FloatArray, FloatArray]:
    """Where an opening starts and ends, (2,) each: on the wall's centreline, or on the one plane that was seen."""
    best = pair[0]
    way, normal = best.along, best.normal
    if len(pair) == 1:
        shift = -0.5 * (best.twin or 0.0) * normal
        return best.start + shift, best.end + shift
    other = pair[1]
    tips = ((best.start, other.end, best.sure[0], other.sure[1]), (best.end, other.start, best.sure[1], other.sure[0]))
    ends = []
    for outward, (mine, theirs, sure, theirs_sure) in zip((-1.0, 1.0), tips, strict=True):
        further = float((theirs - mine) @ way)
        if sure == theirs_sure:
            # What stands before one side may hide a part of the opening: the wider is the true one.
            further = further / 2 if abs(further) < _AGREE else max(outward * further, 0.0) * outward
        elif sure:
            further = 0.0
        ends.append(mine + further * way + 0.5 * float((theirs - mine) @ normal) * normal)
    return ends[0], ends[1]
