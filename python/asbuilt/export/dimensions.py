"""Chains of dimensions along the outer walls, as on a surveyor's plan.

All outer walls that look the same way share chains, outside of the building: jambs of openings nearest to it, then
wall faces, then the whole. Only what was seen is dimensioned: the ends of wall faces, hence clear widths and measured
thicknesses; the outside of a wall that was scanned from inside alone is in no chain. A plan that has faces but no
walls gets its width and depth.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, Polygon
from shapely.affinity import rotate
from shapely.geometry.base import BaseGeometry

from asbuilt.export import marks
from asbuilt.export.marks import DIMENSION_TEXT, Dimension, Text, text_width
from asbuilt.export.symbols import polygons, swept
from asbuilt.plan import Point, Storey, Wall, WallFace

_FIRST = 9.0
"""From the building to the first chain, and from each chain to the next, mm of paper."""
_STEP = 7.0
RAISED = 1.3
"""By how much a number is raised, in heights of text."""
_OVER_LINE = 0.7
"""From the line to the number over it, mm of paper."""
_CLEAR = 0.8
"""Between a number and what else is drawn, mm of paper."""
_TRIES = 3
"""Places farther and farther out where a chain is tried before it is left out."""
_SAME = 0.02
"""Stations nearer to each other are one, m."""
_GAP = 0.3
"""Gaps between what stands on the ground are closed up to twice this, m."""
_PARALLEL = math.radians(1.0)
_UPSIDE_DOWN = math.radians(100.0)
"""Numbers are turned up to this far: those of a house a little off the axes all read from the right."""
_SHORTEST = 1.0
"""Shorter outer walls have no chains of their own, m."""


@dataclass
class _Side:
    """Outer walls that look along `outward`, and the range along them, m."""

    outward: Point
    walls: list[Wall]
    low: float
    high: float

    @property
    def along(self) -> Point:
        """Unit vector along the walls."""
        return self.outward[1], -self.outward[0]

    @property
    def reach(self) -> float:
        """How far its walls reach outward, m along the normal."""
        corners = [corner for wall in self.walls for corner in (*wall.outline, wall.start, wall.end)]
        return max(_dot(corner, self.outward) for corner in corners)


def dimensions(storey: Storey, metre: float) -> Iterator[Dimension]:
    """The dimensions of a storey, on paper where a metre takes `metre` mm; none where it has no wall faces."""
    if not storey.wall_faces:
        return
    hull = _ground(storey)
    if hull.is_empty or not storey.walls:
        yield from _width_and_depth(storey.wall_faces, metre)
        return
    openings = (*storey.doors, *storey.windows, *storey.unknown_openings)
    lines = [LineString([opening.start, opening.end]).buffer(2 * _SAME) for opening in openings]
    placed = shapely.union_all([hull.buffer(-2 * _SAME), *lines, *swept(storey)])
    for side in (part for whole in _sides(storey.walls, hull) for part in _clear(whole, placed, metre)):
        base = side.reach
        level = 0
        for stations in _chains(storey, side):
            levels = _levels(stations, metre)
            base += ((_FIRST if base == side.reach else _STEP) + RAISED * DIMENSION_TEXT * max(level, *levels)) / metre
            level = max(levels)
            for farther in range(_TRIES):
                chain = list(_chain(side, stations, levels, base + farther * _STEP / metre))
                strip = _strip(side, (stations[0], stations[-1]), base + farther * _STEP / metre, 2.5 / metre)
                taken = shapely.union_all([strip, *(_number_box(dimension, metre) for dimension in chain)])
                if not taken.intersects(placed):  # else another side's are there, or a wing stands there
                    placed = placed.union(taken)
                    base += farther * _STEP / metre
                    yield from chain
                    break


def _ground(storey: Storey) -> BaseGeometry:
    """What the building stands on, without courtyards: wall bodies, rooms and outline, small gaps closed."""
    rings = [*(room.ring for room in storey.rooms), storey.outline or ()]
    areas = [shapely.make_valid(Polygon(ring)) for ring in rings if len(ring) > 2]
    parts = shapely.union_all([*areas, *(Polygon(wall.outline) for wall in storey.walls)])
    closed = parts.buffer(_GAP, join_style="mitre").buffer(-_GAP, join_style="mitre")
    return shapely.union_all([Polygon(part.exterior) for part in polygons(closed)])


def _sides(walls: Iterable[Wall], hull: BaseGeometry) -> list[_Side]:
    """Outer walls sorted by where they look, those whose ranges overlap together; the longest side first."""
    sides: list[_Side] = []
    for wall in walls:
        outward = _outward(wall, hull)
        if outward is None:
            continue
        found = next((s.outward for s in sides if _cross(s.outward, outward) < math.sin(_PARALLEL)), outward)
        side = _Side(found, [wall], 0.0, 0.0)
        side.low, side.high = sorted(_dot(end, side.along) for end in (wall.start, wall.end))
        for other in [s for s in sides if s.outward == found and s.low < side.high + 0.5 and side.low < s.high + 0.5]:
            sides.remove(other)
            side.walls = other.walls + side.walls
            side.low, side.high = min(side.low, other.low), max(side.high, other.high)
        sides.append(side)
    return sorted(sides, key=lambda side: side.low - side.high)


def _clear(side: _Side, building: BaseGeometry, metre: float) -> list[_Side]:
    """The side as it is; where its chains would run across the building, its walls by how far out they lie."""
    depth = (_FIRST + 2 * _STEP) / metre
    if not _strip(side, (side.low, side.high), side.reach + depth / 2, depth / 2).intersects(building):
        return [side]
    parts: dict[int, _Side] = {}
    for wall in side.walls:
        low, high = sorted(_dot(end, side.along) for end in (wall.start, wall.end))
        part = parts.setdefault(round(_dot(wall.start, side.outward)), _Side(side.outward, [], low, high))
        part.walls.append(wall)
        part.low, part.high = min(part.low, low), max(part.high, high)
    return sorted(parts.values(), key=lambda part: part.low - part.high)


def _outward(wall: Wall, hull: BaseGeometry) -> Point | None:
    """The unit normal of an outer wall that points away from the building; None for other walls, and curved ones."""
    if wall.curve is not None or wall.length < _SHORTEST:
        return None
    nx, ny = -(wall.end[1] - wall.start[1]) / wall.length, (wall.end[0] - wall.start[0]) / wall.length
    x, y = (wall.start[0] + wall.end[0]) / 2, (wall.start[1] + wall.end[1]) / 2
    reach = wall.drawn_thickness / 2 + 0.1
    for side in (1.0, -1.0):
        if not hull.contains(shapely.Point(x + side * reach * nx, y + side * reach * ny)):
            return side * nx, side * ny
    return None


def _chains(storey: Storey, side: _Side) -> Iterator[list[float]]:
    """Stations of each chain of a side, ascending, m along the side: openings, faces, the whole."""
    names = {wall.id for wall in side.walls}
    faces = {face.id: face for face in storey.wall_faces}
    openings = [o for o in (*storey.doors, *storey.windows) if o.wall in names and o.wall]
    jambs = _merged(_dot(end, side.along) for opening in openings for end in (opening.start, opening.end))
    ends: list[float] = []
    for wall in side.walls:
        low, high = sorted(_dot(end, side.along) for end in (wall.start, wall.end))
        seen = [_dot(end, side.along) for f in wall.faces if f in faces for end in (faces[f].start, faces[f].end)]
        ends += [end for end in seen if low - _GAP < end < high + _GAP]  # a face may run on beside another wall
    # faces stop at doors, which are in the chain of the openings
    stations = _merged(end for end in ends if all(abs(end - jamb) > 2 * _SAME for jamb in jambs))
    if len(stations) < 2:
        return
    whole = [stations[0], stations[-1]]
    if jambs:
        yield _merged([*whole, *jambs])
    if len(stations) > 2:
        yield stations
    yield whole


def _chain(side: _Side, stations: list[float], levels: list[int], base: float) -> Iterator[Dimension]:
    """The dimensions between stations on a line `base` (m) along the side's normal."""
    for (start, end), level in zip(itertools.pairwise(stations), levels, strict=True):
        ends = _readable(_at(side, start, side.reach), _at(side, end, side.reach))
        yield Dimension(*ends, _at(side, start, base), level, layer=marks.DIMENSION)


def _levels(stations: list[float], metre: float) -> list[int]:
    """How far each number must be raised so that none runs into another or over the ticks of its own distance."""
    ends: list[float] = []  # of what is written on each level so far, mm
    levels = []
    for start, end in itertools.pairwise(stations):
        half = text_width(dimension_text(end - start), DIMENSION_TEXT) / 2 + 0.5
        middle = (start + end) / 2 * metre
        level = 0 if 2 * half <= (end - start) * metre else 1
        while level < len(ends) and ends[level] > middle - half:
            level += 1
        ends += [-math.inf] * (level + 1 - len(ends))
        ends[level] = middle + half
        levels.append(level)
    return levels


def _readable(start: Point, end: Point) -> tuple[Point, Point]:
    """The ends in the order in which text along them is read from below or from the right."""
    angle = math.atan2(end[1] - start[1], end[0] - start[0])
    return (start, end) if _UPSIDE_DOWN - math.pi < angle <= _UPSIDE_DOWN else (end, start)


def dimension_line(dimension: Dimension) -> tuple[Point, Point]:
    """Both ends of the line on which a dimension is written: its start and end, moved to run through its base."""
    (x1, y1), (x2, y2), (xb, yb) = dimension.start, dimension.end, dimension.base
    length = math.hypot(x2 - x1, y2 - y1)
    nx, ny = -(y2 - y1) / length, (x2 - x1) / length
    out = (xb - x1) * nx + (yb - y1) * ny
    return (x1 + out * nx, y1 + out * ny), (x2 + out * nx, y2 + out * ny)


def dimension_number(dimension: Dimension, metre: float) -> Text:
    """The distance as it stands over its line, on paper where a metre takes `metre` mm."""
    (x1, y1), (x2, y2) = dimension_line(dimension)
    angle = math.atan2(y2 - y1, x2 - x1)
    up = (_OVER_LINE + RAISED * DIMENSION_TEXT * dimension.level) / metre
    at = (x1 + x2) / 2 - math.sin(angle) * up, (y1 + y2) / 2 + math.cos(angle) * up
    text = dimension_text(math.dist(dimension.start, dimension.end))
    return Text(at, text, DIMENSION_TEXT, "centre", angle, layer=dimension.layer)


def _number_box(dimension: Dimension, metre: float) -> BaseGeometry:
    """What the number of a dimension covers, and a little more around it, m."""
    number = dimension_number(dimension, metre)
    half = text_width(number.text, number.height) / 2 / metre
    (x, y), pad = number.at, _CLEAR / metre
    box = shapely.box(x - half - pad, y - pad, x + half + pad, y + number.height / metre + pad)
    return rotate(box, number.rotation, origin=number.at, use_radians=True)


def dimension_text(distance: float) -> str:
    """A distance (m) as it is written: to the centimetre.

    >>> dimension_text(3.954)
    '3.95'
    """
    return f"{distance:.2f}"


def _width_and_depth(faces: tuple[WallFace, ...], metre: float) -> Iterator[Dimension]:
    """The extent of the faces along the direction most of them have, and across it: below and on the left."""
    ends = np.array([(face.start, face.end) for face in faces])
    angle = main_direction(ends)
    turns = (angle, angle + math.pi / 2)
    origin = ends[0, 0]
    for turn, sign in zip(turns, (-1.0, 1.0), strict=True):
        along, outward = np.array([math.cos(turn), math.sin(turn)]), np.array([-math.sin(turn), math.cos(turn)]) * sign
        u, v = (ends - origin) @ along, (ends - origin) @ outward
        if np.ptp(u) < _SAME:
            continue
        rows = (v.max(), v.max(), v.max() + _FIRST / metre)
        points = [origin + u_ * along + v_ * outward for u_, v_ in zip((u.min(), u.max(), u.min()), rows, strict=True)]
        start, end, base = ((float(x), float(y)) for x, y in points)
        yield Dimension(*_readable(start, end), base, layer=marks.DIMENSION)


def main_direction(ends: NDArray[np.float64]) -> float:
    """The direction within 45 degrees of the x axis that most length lies along or across, rad, of ends (n, 2, 2)."""
    vectors = ends[:, 1] - ends[:, 0]
    length = np.hypot(*vectors.T)
    angles = np.arctan2(vectors[:, 1], vectors[:, 0])
    apart = np.angle(np.exp(4j * (angles[:, None] - angles))) / 4
    best = int(np.argmax((np.abs(apart) < _PARALLEL) @ length))
    return float(np.angle(np.exp(4j * angles[best])) / 4)


def _strip(side: _Side, ends: tuple[float, float], middle: float, half: float) -> Polygon:
    """A strip along a side between its ends, `half` to each side of its middle, all m."""
    low, high = middle - half, middle + half
    return Polygon([_at(side, u, v) for u, v in ((ends[0], low), (ends[1], low), (ends[1], high), (ends[0], high))])


def _merged(stations: Iterable[float]) -> list[float]:
    """Sorted, without those that are the same but for rounding."""
    merged: list[float] = []
    for station in sorted(stations):
        if not merged or station - merged[-1] > _SAME:
            merged.append(station)
    return merged


def _at(side: _Side, along: float, out: float) -> Point:
    (ux, uy), (nx, ny) = side.along, side.outward
    return along * ux + out * nx, along * uy + out * ny


def _dot(a: Point, b: Point) -> float:
    return a[0] * b[0] + a[1] * b[1]


def _cross(a: Point, b: Point) -> float:
    """How far from parallel two unit vectors are; 2 if they look away from each other."""
    return abs(a[0] * b[1] - a[1] * b[0]) if _dot(a, b) > 0 else 2.0
