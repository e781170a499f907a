"""Where a room's number and area are written: inside the room, clear of what stands in it, turned if need be."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import shapely
from shapely import MultiPolygon, Polygon
from shapely import Point as ShapelyPoint
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from asbuilt.export import marks
from asbuilt.export.marks import Tag, TagLine, tag_height, text_width
from asbuilt.export.symbols import polygons, swept
from asbuilt.plan import Room, Storey

_SIZES = (1.0, 0.75)
"""Shares of the full height of text that are tried; smaller text could not be read."""
_CLEAR = 0.8
"""Between a tag and what is around it, mm of paper."""
_GRID = 0.001
"""Corners are taken to this, m: of slivers between a room and its walls GEOS makes shapes that it cannot cut again."""


def room_tags(storey: Storey, metre: float) -> Iterator[Tag]:
    """A tag for each room, on paper where a metre takes `metre` mm; none for a storey without rooms."""
    obstacles = shapely.union_all(
        [Polygon(column.ring) for column in storey.columns]
        + [Polygon(stair.ring) for stair in storey.stairs]
        + list(swept(storey))
        + [Polygon(wall.outline) for wall in storey.walls]
    )
    for room in storey.rooms:
        shape = _areas(shapely.set_precision(shapely.make_valid(Polygon(room.ring, room.holes)), _GRID))
        yield _placed(room, shape, _areas(shapely.difference(shape, obstacles, grid_size=_GRID)), metre)


def room_lines(room: Room) -> tuple[TagLine, ...]:
    """What a room's tag says at full size: its number, its area, and its clear height where that was seen."""
    lines = [TagLine("NUMBER", room.number, 3.0)] if room.number else []
    lines.append(TagLine("AREA", f"{room.area:.2f} m²", 2.2))
    if room.height is not None:
        lines.append(TagLine("HEIGHT", f"h {room.height:.2f} m", 1.8))
    return tuple(lines)


def _placed(room: Room, shape: BaseGeometry, free: BaseGeometry, metre: float) -> Tag:
    """The tag that fits: whole before without its last lines, in free space before on top of something, level."""
    lines = room_lines(room)
    shorter = [lines[:count] for count in range(len(lines), 0, -1)]
    for said, space, turn, size in product(shorter, (free, shape), (0.0, math.pi / 2), _SIZES):
        scaled = tuple(replace(line, height=round(size * line.height, 2)) for line in said)
        width = max(text_width(line.text, line.height, line is scaled[0]) for line in scaled) + 2 * _CLEAR
        height = tag_height(scaled) + 2 * _CLEAR
        at = _middle(space, width / metre, height / metre, turn)
        if at is not None:
            return Tag((at.x, at.y), scaled, turn, layer=marks.ROOM_TAG, id=room.id)
    point = ShapelyPoint(room.ring[0]) if shape.is_empty else shape.representative_point()
    return Tag((point.x, point.y), scaled, layer=marks.ROOM_TAG, id=room.id)


def _middle(space: BaseGeometry, width: float, height: float, turn: float) -> ShapelyPoint | None:
    """Where the middle of a box of that size (m) can lie so that all of the box is in `space`; None if nowhere."""
    if space.is_empty:
        return None
    across, up = (height, width) if turn else (width, height)
    tried = [space.centroid]
    tried += [shapely.maximum_inscribed_circle(part, tolerance=0.05).interpolate(0) for part in polygons(space)]
    for part in polygons(space):
        # where the box's middle may be if the room were convex: the room moved by half the box either way, in common
        halves = ((-across / 2, -up / 2), (across / 2, -up / 2), (across / 2, up / 2), (-across / 2, up / 2))
        common = _areas(part)
        for dx, dy in halves:
            common = _areas(shapely.intersection(common, translate(part, dx, dy), grid_size=_GRID))
        if not common.is_empty:
            tried.append(common.representative_point())
    for point in tried:
        box = shapely.box(point.x - across / 2, point.y - up / 2, point.x + across / 2, point.y + up / 2)
        if space.contains(box):
            return point
    return None


def _areas(geometry: BaseGeometry) -> MultiPolygon:
    """Its polygons: GEOS cuts no mixture of these with lines, which is what polygons that touch have in common."""
    return MultiPolygon(list(polygons(geometry)))
