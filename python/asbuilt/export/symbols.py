"""The elements of a storey as marks: walls filled, doors with leaf and swing, windows, columns, stairs.

Signs as on architects' plans at 1:100. A plan that has wall faces alone, as the paper's, is drawn with these alone.

What was not seen is dashed: the sides of wall bodies on which no face lies, doors whose leaf nobody saw, and openings
that no scan looked through.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import shapely
from shapely import LineString, MultiLineString, Polygon
from shapely.geometry.base import BaseGeometry

from asbuilt.export import marks
from asbuilt.export.marks import Arc, Fill, Layer, Mark, Ring, Stroke, Text
from asbuilt.plan import Column, Door, Opening, Point, Stair, Storey, Wall, WallFace, Window

_ON_FACE = 0.008
"""A side of a body this near to a wall face is that face, m."""
_SHORTEST = 0.03
"""Shorter rests of a side are rounding, m."""
_LEAF = 0.04
"""Thickness that a door leaf is drawn with, m."""
_GLASS = 0.025
"""Half the distance of the two lines of a window's glass, m."""
_RISER = 0.175
"""A flight is drawn with steps of about this height, m; their number is not measured."""


@dataclass(frozen=True)
class _Hole:
    """Where an opening lies in its wall: a box along the opening, `half` (m) to each side; 0 without a wall."""

    start: Point
    along: Point
    width: float
    half: float

    def at(self, along: float, left: float) -> Point:
        """The point so far along the opening and to its left."""
        (x, y), (ux, uy) = self.start, self.along
        return x + along * ux - left * uy, y + along * uy + left * ux

    @property
    def box(self) -> Polygon:
        """The box, a little thicker than the wall, so that nothing is left at its sides."""
        half = self.half + 1e-3
        corners = ((0.0, -half), (self.width, -half), (self.width, half), (0.0, half))
        return Polygon([self.at(*corner) for corner in corners])


def storey_marks(storey: Storey) -> Iterator[Mark]:
    """The marks of a storey's elements; none for an empty storey."""
    walls = {wall.id: wall for wall in storey.walls}
    openings = (*storey.doors, *storey.windows, *storey.unknown_openings)
    holes = [_hole(opening, walls.get(opening.wall or "")) for opening in openings]
    if storey.outline:
        yield Stroke(storey.outline, True, layer=marks.OUTLINE)
    for room in storey.rooms:
        for ring in (room.ring, *room.holes):
            yield Stroke(ring, True, layer=marks.AREA, id=room.id)
    for stair in storey.stairs:
        yield from _stair(stair)
    yield from _bodies(storey.walls, storey.wall_faces, [hole.box for hole in holes])
    for wall in storey.walls:
        yield Stroke((wall.start, wall.end), curve=wall.curve, layer=marks.WALL_CENTRELINE, id=wall.id)
    for face in storey.wall_faces:
        yield Stroke((face.start, face.end), curve=face.curve, layer=marks.WALL, id=face.id)
    for column in storey.columns:
        yield from _column(column)
    for opening, hole in zip(openings, holes, strict=True):
        if hole.half > 0:
            yield Fill((tuple(hole.box.exterior.coords)[:-1],), layer=marks.BLANK)
        if isinstance(opening, Door):
            yield from _door(opening, hole)
        elif isinstance(opening, Window):
            yield from _window(opening, hole)
        else:
            yield from _unknown_opening(opening, hole)


def _hole(opening: Opening, wall: Wall | None) -> _Hole:
    (x1, y1), (x2, y2) = opening.start, opening.end
    width = math.hypot(x2 - x1, y2 - y1) or 1.0
    along = ((x2 - x1) / width, (y2 - y1) / width)
    return _Hole(opening.start, along, opening.length, 0.0 if wall is None else wall.drawn_thickness / 2)


def _bodies(walls: tuple[Wall, ...], faces: Iterable[WallFace], holes: list[Polygon]) -> Iterator[Mark]:
    """What is filled, darker where the thickness was measured, and the sides of it that nobody saw."""
    if not walls:
        return
    bodies = [(wall, Polygon(wall.outline)) for wall in walls]
    cut = shapely.union_all(holes)
    measured = shapely.union_all([body for wall, body in bodies if wall.thickness is not None])
    unseen = shapely.union_all([body for wall, body in bodies if wall.thickness is None]).difference(measured)
    for layer, body in ((marks.WALL_PATTERN, measured), (marks.WALL_UNSEEN_PATTERN, unseen)):
        for polygon in polygons(body.difference(cut)):
            yield Fill(tuple(_open(ring.coords) for ring in (polygon.exterior, *polygon.interiors)), layer=layer)
    seen = shapely.union_all([LineString([face.start, face.end]).buffer(_ON_FACE) for face in faces])
    outlines = [polygon.boundary for polygon in polygons(shapely.union_all([measured, unseen]))]
    sides = shapely.union_all(outlines).difference(seen).difference(cut)
    for line in _lines(shapely.line_merge(sides)):
        if line.length > _SHORTEST:
            yield Stroke(tuple(line.coords), layer=marks.WALL_UNSEEN)


def _door(door: Door, hole: _Hole) -> Iterator[Mark]:
    """Jambs; a leaf at right angles with its swing, a leaf in the opening, the head alone, or a question mark."""
    yield from _across(hole, (0.0, hole.width), marks.DOOR, door.id)
    leaf_seen = door.hinge is not None and door.swing is not None
    if door.state in ("cased", "unknown") or (door.state == "open" and not leaf_seen):
        yield from _along(hole, sorted({-hole.half, hole.half}), marks.DOOR_HEAD, door.id)
    if door.state == "unknown":
        yield _question(hole, marks.DOOR, door.id)
    if door.state == "shut":
        corners = ((0.0, -_LEAF / 2), (hole.width, -_LEAF / 2), (hole.width, _LEAF / 2), (0.0, _LEAF / 2))
        leaf = tuple(hole.at(u, v) for u, v in corners)
        yield Stroke(leaf, True, layer=marks.DOOR, id=door.id)
    if leaf_seen and door.state in ("open", "shut"):
        yield from _swing(door, hole)


def _swing(door: Door, hole: _Hole) -> Iterator[Mark]:
    """The leaf's edge as a quarter circle about the hinge; the leaf itself where it stands open."""
    side = 1.0 if door.swing == "left" else -1.0
    hinge, towards = (0.0, 1.0) if door.hinge == "start" else (hole.width, -1.0)
    base = side * hole.half
    at = hole.at(hinge, base)
    shut = math.atan2(*reversed([b - a for a, b in zip(at, hole.at(hinge + towards, base), strict=True)]))
    quarter = side * towards * math.pi / 2
    start, end = sorted((shut, shut + quarter))
    yield Arc(at, hole.width, start, end, layer=marks.DOOR_SWING, id=door.id)
    if door.state == "open":
        corners = ((0.0, 0.0), (0.0, hole.width), (_LEAF, hole.width), (_LEAF, 0.0))
        leaf = tuple(hole.at(hinge + towards * u, base + side * v) for u, v in corners)
        yield Stroke(leaf, True, layer=marks.DOOR, id=door.id)


def swept(storey: Storey) -> Iterator[Polygon]:
    """The ground that each door's leaf sweeps, where it was seen."""
    walls = {wall.id: wall for wall in storey.walls}
    for door in storey.doors:
        for mark in _door(door, _hole(door, walls.get(door.wall or ""))):
            if isinstance(mark, Arc) and mark.radius > 0:
                yield Polygon([mark.centre, *mark.points])


def _window(window: Window, hole: _Hole) -> Iterator[Mark]:
    """Reveals, the sill's edges, and the glass: two lines where the wall has room for them at 1:100, else one."""
    yield from _across(hole, (0.0, hole.width), marks.GLAZING, window.id)
    glass = {-_GLASS, _GLASS} if hole.half > 4 * _GLASS else {0.0}
    yield from _along(hole, sorted({-hole.half, hole.half} | glass), marks.GLAZING, window.id)


def _unknown_opening(opening: Opening, hole: _Hole) -> Iterator[Mark]:
    yield from _along(hole, sorted({-hole.half, hole.half}), marks.UNKNOWN_OPENING, opening.id)
    yield from _across(hole, (0.0, hole.width), marks.UNKNOWN_OPENING, opening.id)
    yield _question(hole, marks.UNKNOWN_OPENING, opening.id)


def _column(column: Column) -> Iterator[Mark]:
    yield Fill((column.ring,), layer=marks.COLUMN_PATTERN, id=column.id)
    if column.shape == "round":
        yield Arc(column.centre, column.width / 2, layer=marks.COLUMN, id=column.id)
    else:
        yield Stroke(column.ring, True, layer=marks.COLUMN, id=column.id)


def _stair(stair: Stair) -> Iterator[Mark]:
    """The outline; where the direction was seen, an arrow that points up, and steps across it."""
    yield Stroke(stair.ring, True, layer=marks.STAIR, id=stair.id)
    if len(stair.path) < 2:
        return
    path, outline = LineString(stair.path), shapely.make_valid(Polygon(stair.ring))
    count = max(round((stair.rise or 0.0) / _RISER), 1)
    steps: list[LineString] = []
    for step in range(1, count):
        across = _step(path, path.length * step / count, 0.6 * outline.area / path.length)
        for part in _lines(across.intersection(outline)):
            # not the next flight's part of the line, nor where a sharp turn would have two of them meet
            if part.distance(path) < 0.1 and not any(part.intersects(other) for other in steps):
                steps.append(part)
                yield Stroke(tuple(part.coords), layer=marks.STAIR, id=stair.id)
    yield Stroke(stair.path, layer=marks.STAIR, id=stair.id)
    yield Arc(stair.path[0], 0.05, layer=marks.STAIR, id=stair.id)
    tip, before = stair.path[-1], path.interpolate(path.length - min(0.2, path.length / 2))
    ux, uy = (tip[0] - before.x, tip[1] - before.y)
    barbs = tuple((before.x + side * 0.5 * uy, before.y - side * 0.5 * ux) for side in (-1, 1))
    yield Stroke((barbs[0], tip, barbs[1]), layer=marks.STAIR, id=stair.id)


def _step(path: LineString, distance: float, half: float) -> LineString:
    """A line across the path, `half` to each side; where the path turns, across its direction over a step or so."""
    a, b = (path.interpolate(min(max(distance + ahead, 0.0), path.length)) for ahead in (-0.15, 0.15))
    length = math.hypot(b.x - a.x, b.y - a.y) or 1.0
    nx, ny = -(b.y - a.y) / length * half, (b.x - a.x) / length * half
    middle = path.interpolate(distance)
    return LineString([(middle.x - nx, middle.y - ny), (middle.x + nx, middle.y + ny)])


def _across(hole: _Hole, places: Iterable[float], layer: Layer, name: str) -> Iterator[Stroke]:
    if hole.half > 0:
        for along in places:
            yield Stroke((hole.at(along, -hole.half), hole.at(along, hole.half)), layer=layer, id=name)


def _along(hole: _Hole, places: Iterable[float], layer: Layer, name: str) -> Iterator[Stroke]:
    for left in places:
        yield Stroke((hole.at(0.0, left), hole.at(hole.width, left)), layer=layer, id=name)


def _question(hole: _Hole, layer: Layer, name: str) -> Text:
    """A question mark beside the opening."""
    x, y = hole.at(hole.width / 2, hole.half + 0.15)
    return Text((x, y - 0.1), "?", 2.0, "centre", layer=layer, id=name)


def _open(coordinates: Iterable[tuple[float, ...]]) -> Ring:
    return tuple((x, y) for x, y, *_ in coordinates)[:-1]


def polygons(geometry: BaseGeometry) -> Iterator[Polygon]:
    """The polygons of any geometry that have an area."""
    for part in shapely.get_parts(geometry):
        if isinstance(part, Polygon) and part.area > 0:
            yield part
        elif hasattr(part, "geoms"):
            yield from polygons(part)


def _lines(geometry: BaseGeometry) -> Iterator[LineString]:
    for part in shapely.get_parts(geometry):
        if isinstance(part, LineString) and part.length > 0:
            yield part
        elif isinstance(part, MultiLineString):
            yield from _lines(part)
