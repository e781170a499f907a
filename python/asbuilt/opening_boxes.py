"""Boxes in the pictures of walls' sides in which something shows behind the plane (not in the paper).

What shows behind one opening hangs together: reveals about it, what stands in it, the floor that goes through. Where
furniture hides a part of it, its pieces are joined unless there is wall between them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from asbuilt import _core
from asbuilt.grid import BoolArray, FloatArray, IntArray
from asbuilt.wall_sides import LOWEST, PLANE, WallSides, close_cells

DOOR_WIDTH = (0.5, 3.0)
"""Doors are this wide, m."""
_LEAF_WIDTH = 1.4
"""A leaf is no wider, m."""
WINDOW_SIZE = (0.35, 0.35)
"""Windows are at least this wide and high, m."""
_BAR = 0.12
"""What lies on the plane across an opening and is no higher is a bar of its frame, m."""
SILL = 0.25
"""What begins less than this over the floor can be walked through, m."""


@dataclass(frozen=True)
class Box:
    """A rectangle of cells of the unrolled sides: columns and rows from `low` and `bottom` to before `high`, `top`."""

    side: int
    low: int
    high: int
    bottom: int
    top: int
    cells: int

    def joined(self, other: Box) -> Box:
        """The rectangle about both."""
        return Box(
            self.side,
            min(self.low, other.low),
            max(self.high, other.high),
            min(self.bottom, other.bottom),
            max(self.top, other.top),
            self.cells + other.cells,
        )


def look_behind(sides: WallSides) -> BoolArray:
    """Which cells (c, k) show something in the body of a wall; in gaps down to the floor, the floor that goes on."""
    z = LOWEST + np.arange(sides.wall.shape[1], dtype=np.float64) * sides.step
    upper = _share(sides.wall, z, sides.ceiling - 0.45, sides.ceiling - 0.1)
    lower = _share(sides.wall, z, sides.floor + 0.15, sides.floor + 1.9)
    # Beyond its faces a side goes on under a lintel, or before a shut leaf: a door in the corner of a room.
    leaf = _between(_share(sides.body, z, sides.floor + 0.15, sides.floor + 1.9) > 0.5, lower > 0.5, sides.step)
    lintel = close_cells((upper > 0.25)[:, None], 5, 1)[:, 0]
    inside = sides.covered | lintel | leaf
    run = np.cumsum(np.diff(inside, prepend=False))
    inside &= np.isin(run, run[sides.covered])
    for first, last in zip(sides.first[:-1], sides.first[1:], strict=True):
        covered = first + np.flatnonzero(sides.covered[first:last])
        inside[covered[0] : covered[-1] + 1] = True
    seen = sides.body & inside[:, None]
    seen &= (z > sides.floor[:, None] + 0.1) & (z < sides.ceiling[:, None] - 0.02)
    beyond = (sides.depth > PLANE) & (sides.depth < np.maximum(sides.twin - PLANE, 2 * PLANE)[sides.column])
    above = sides.z - sides.floor[sides.column]
    going_on = beyond & (above > -0.08) & (above < 0.16)
    # Behind a mirror the floor goes on, too, but under it is wall.
    foot = _share(sides.wall, z, sides.floor + 0.1, sides.floor + 0.3)
    open_below = inside & (lower < 0.2) & (foot < 0.5)
    through = np.zeros(len(inside), dtype=np.bool_)
    through[sides.column[going_on]] = True
    # Of the floor in a thin wall only some voxels lie clear of both planes.
    through = close_cells((through & open_below)[:, None], round(0.4 / sides.step), 1)[:, 0]
    passed = np.flatnonzero(through & open_below)
    seen[passed, sides.row(sides.floor[passed])] = True
    return seen


def _between(leaf: BoolArray, wall: BoolArray, step: float) -> BoolArray:
    """Runs of columns (c,) that a leaf fills, as wide as one, where wall stands close by on both sides."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], leaf, [False]]).astype(np.int8)))
    low, high = ends[::2], ends[1::2]
    near = np.concatenate([[0], np.cumsum(wall)])
    reach = 3

    def any_wall(first: IntArray, last: IntArray) -> BoolArray:
        some: BoolArray = near[np.clip(last, 0, len(wall))] > near[np.clip(first, 0, len(wall))]
        return some

    width = (high - low) * step
    fits = (width > DOOR_WIDTH[0]) & (width < _LEAF_WIDTH) & any_wall(low - reach, low) & any_wall(high, high + reach)
    filled = np.zeros(len(leaf), dtype=np.bool_)
    for first, last in zip(low[fits], high[fits], strict=True):
        filled[max(first - reach, 0) : last + reach] = True
    return filled


def find_boxes(sides: WallSides, seen: BoolArray) -> list[Box]:
    """Rectangles about what is seen behind the planes; pieces with no wall between them are one."""
    patch = _core.patches_of(close_cells(seen, 5, 5) & ~sides.wall)
    cells = np.argwhere(seen & (patch > 0))
    number = patch[tuple(cells.T)]
    order = np.argsort(number, kind="stable")
    first = np.flatnonzero(np.diff(number[order], prepend=0))
    counts = np.diff(first, append=len(order))
    low, last = (end.reduceat(cells[order], first) if len(first) else cells for end in (np.minimum, np.maximum))
    of_side: dict[int, list[Box]] = {}
    side_of = np.searchsorted(sides.first, low[:, 0], side="right") - 1
    for side, (left, bottom), (right, top), count in zip(
        side_of.tolist(), low.tolist(), last.tolist(), counts.tolist(), strict=True
    ):
        if count >= 3:
            of_side.setdefault(side, []).append(Box(side, left, right + 1, bottom, top + 1, count))
    joined = [box for boxes in of_side.values() for box in _join(boxes, sides, seen)]
    wide, high = (size / sides.step - 2 for size in WINDOW_SIZE)
    # A threshold may be all that shows of a door.
    wanted = [
        box
        for box in joined
        if box.high - box.low > wide and (box.top - box.bottom > high or box.bottom < _foot(box, sides))
    ]
    return [part for box in wanted for part in _split(box, sides, seen)]


def _foot(box: Box, sides: WallSides) -> float:
    """Row below which a box begins that can be walked through."""
    return float(np.median(sides.row(sides.floor[box.low : box.high]))) + SILL / sides.step


def _join(boxes: list[Box], sides: WallSides, seen: BoolArray) -> list[Box]:
    while True:
        joined: list[Box] = []
        for box in sorted(boxes, key=lambda b: (-b.cells, b.low, b.bottom)):
            for i, other in enumerate(joined):
                if _belong(box, other, sides, seen):
                    joined[i] = other.joined(box)
                    break
            else:
                joined.append(box)
        if len(joined) == len(boxes):
            return joined
        boxes = joined


def _belong(a: Box, b: Box, sides: WallSides, seen: BoolArray) -> bool:
    """Whether two boxes are parts of one opening."""
    step = sides.step
    apart = max(a.low, b.low) - min(a.high, b.high)
    over = max(a.bottom, b.bottom) - min(a.top, b.top)
    narrower, lower = min(a.high - a.low, b.high - b.low), min(a.top - a.bottom, b.top - b.bottom)
    if apart <= 1 and over <= 1:
        return True
    if over > 0 and -apart >= 0.3 * narrower and narrower * step > 0.25:
        between = sides.wall[max(a.low, b.low) : min(a.high, b.high), min(a.top, b.top) : max(a.bottom, b.bottom)]
        return bool(over * step < _BAR or between.mean() < 0.15)
    if 0 < apart * step < DOOR_WIDTH[1] - 0.4 and -over >= 0.5 * lower and lower * step > 0.25:
        left, right = (a, b) if a.low < b.low else (b, a)
        # Beyond its jamb an opening does not go on; a jamb alone does not yet say on which side it is.
        if _is_jamb(seen[left.high - 2 : left.high], left, step) or _is_jamb(
            seen[right.low : right.low + 2], right, step
        ):
            return False
        between = sides.wall[left.high : right.low, max(a.bottom, b.bottom) : min(a.top, b.top)]
        return bool(between.mean() < 0.15)
    return False


def _is_jamb(edge: BoolArray, box: Box, step: float) -> bool:
    wide = (box.high - box.low) * step > 0.3
    return bool(wide and edge[:, box.bottom : box.top].any(axis=0).mean() > 0.5)


def _split(box: Box, sides: WallSides, seen: BoolArray) -> list[Box]:
    """A door and a window that share a frame: part of the box stands on a sill, part of it is filled to the floor."""
    step = sides.step
    floor = int(sides.row(np.median(sides.floor[box.low : box.high])))
    low = slice(floor + round(0.1 / step), floor + round(0.5 / step))
    on_sill = sides.wall[box.low : box.high, low].mean(axis=1) > 0.5
    to_floor = seen[box.low : box.high, low].mean(axis=1) > 0.4
    least = round(0.4 / step)
    if on_sill.sum() < least or to_floor.sum() < least:
        return [box]
    # The cut that parts the two best.
    change = np.cumsum(on_sill.astype(np.int64) - to_floor)
    gain = np.abs(2 * change - change[-1])[:-1]
    at = int(gain.argmax()) + 1
    for sill, door in ((slice(0, at), slice(at, None)), (slice(at, None), slice(0, at))):
        if on_sill[sill].mean() > 0.7 and to_floor[door].mean() > 0.7:
            break
    else:
        return [box]
    cut = box.low + at
    parts = [_shrunk(replace(box, high=cut), seen), _shrunk(replace(box, low=cut), seen)]
    return [part for part in parts if part is not None]


def _shrunk(box: Box, seen: BoolArray) -> Box | None:
    """The rectangle about the seen cells within a box."""
    column, row = np.nonzero(seen[box.low : box.high, box.bottom : box.top])
    if len(column) < 3:
        return None
    low, bottom = box.low + int(column.min()), box.bottom + int(row.min())
    return Box(box.side, low, box.low + int(column.max()) + 1, bottom, box.bottom + int(row.max()) + 1, len(column))


@dataclass(frozen=True)
class Rim:
    """How much of a box's rim shows in the wall's body, and how much wall there is about it; shares, 0..1."""

    left: float
    right: float
    bottom: float
    top: float
    wall_left: float
    wall_right: float
    wall_within: float
    density: float
    spread: float


def measure_rim(box: Box, sides: WallSides, seen: BoolArray) -> Rim:
    """What shows on the rim of a box, within it and about it."""
    step = sides.step
    within = seen[box.low : box.high, box.bottom : box.top]
    beside = round(0.25 / step)
    rows = slice(box.bottom, box.top)
    left, right = sides.wall[max(box.low - beside, 0) : box.low, rows], sides.wall[box.high : box.high + beside, rows]
    inner = within[2:-2, 2:-2]
    blocks = [part for band in np.array_split(within, 4, axis=0) for part in np.array_split(band[:, 2:-2], 4, axis=1)]
    return Rim(
        left=_mean(within[:2].any(axis=0)),
        right=_mean(within[-2:].any(axis=0)),
        bottom=_mean(within[:, :2].any(axis=1)),
        top=_mean(within[:, -2:].any(axis=1)),
        wall_left=_mean(left.any(axis=0)),
        wall_right=_mean(right.any(axis=0)),
        wall_within=_mean(sides.wall[box.low : box.high, rows]),
        density=_mean(inner),
        spread=float(np.mean([part.any() for part in blocks])),
    )


def _share(cells: BoolArray, z: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Share of the cells (c, k) of each column that are filled between two heights (c,)."""
    between = (z > low[:, None]) & (z < high[:, None])
    shares: FloatArray = (cells & between).sum(axis=1) / np.maximum(between.sum(axis=1), 1)
    return shares


def _mean(values: BoolArray | np.bool_) -> float:
    return float(values.mean()) if values.size else 0.0
