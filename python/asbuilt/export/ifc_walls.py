"""Walls of an IFC model with what interrupts them: openings that void them, doors and windows that fill the openings.

The pieces of one curved wall become one IfcWall, for a door may reach over several of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import shapely

from asbuilt.export.ifc_file import Frame, Placed, Property
from asbuilt.export.ifc_level import Level, area_in
from asbuilt.plan import Door, Opening, Point, UnknownOpening, Wall, Window

#: How far an opening reaches beyond the wall's faces, m: a cut along a face leaves it to rounding what remains.
BEYOND = 0.01
#: Thickness that the leaf of a door and the pane of a window are drawn with, m.
PANEL = 0.04


def add_walls(level: Level) -> None:
    """Add the walls of a storey with its doors and windows, and its gaps that no scan could look through."""
    hosts: dict[str, _Host] = {}
    for pieces in _walls(level.storey.walls):
        made = _add_wall(level, pieces)
        hosts.update({piece.id: _Host(made, piece, pieces) for piece in pieces if piece.id})
    for door in level.storey.doors:
        _add_opening(level, door, hosts.get(door.wall or ""))
    for window in level.storey.windows:
        _add_opening(level, window, hosts.get(window.wall or ""))
    for gap in level.storey.unknown_openings:
        _add_gap(level, gap)


# --- walls ---


def _walls(walls: tuple[Wall, ...]) -> Iterator[tuple[Wall, ...]]:
    """Each straight wall alone, the pieces of each curved one together, in the plan's order."""
    curves: dict[int, list[Wall]] = {}
    for wall in walls:
        if wall.curve is not None:
            curves.setdefault(wall.curve, []).append(wall)
    for wall in walls:
        if wall.curve is None:
            yield (wall,)
        elif wall is curves[wall.curve][0]:
            yield tuple(curves[wall.curve])


def _add_wall(level: Level, pieces: tuple[Wall, ...]) -> Placed:
    model, wall = level.model, _joined(pieces)
    frame = Frame.between(wall.start, pieces[0].end, level.floor)
    axis = [frame.local(point) for piece in pieces for point in (piece.start, piece.end)]
    shape = model.shapes(
        model.lines("Axis", [point for i, point in enumerate(axis) if i == 0 or point != axis[i - 1]]),
        model.prism(_body(pieces, frame), _height(level, wall)),
    )
    properties: list[Property] = [
        ("ThicknessObserved", "IfcBoolean", wall.thickness is not None),
        ("Thickness", "IfcLengthMeasure", wall.thickness),
        ("DrawnThickness", "IfcLengthMeasure", wall.drawn_thickness),
        ("SeenSide", "IfcLabel", _seen_side(level, pieces) if wall.thickness is None else None),
        ("Faces", "IfcText", ", ".join(wall.faces) or None),
        ("Pieces", "IfcText", ", ".join(piece.id for piece in pieces) if len(pieces) > 1 else None),
    ]
    made = level.add("IfcWall", wall, frame, shape, properties, Tag=wall.id, PredefinedType="STANDARD")
    level.contents.append(made.entity)
    length = sum(piece.length for piece in pieces)
    model.measure(
        made.entity, "Qto_WallBaseQuantities", Length=length, Height=_height(level, wall), Width=wall.thickness
    )
    if wall.thickness is not None:
        model.layer(made.entity, wall.thickness)
    return made


def _joined(pieces: tuple[Wall, ...]) -> Wall:
    """One wall for the pieces of a curved one: what they have by the metre is averaged, what limits them is not."""
    if len(pieces) == 1:
        return pieces[0]
    total = sum(piece.length for piece in pieces) or 1.0

    def mean(values: list[float]) -> float:
        return sum(value * piece.length for value, piece in zip(values, pieces, strict=True)) / total

    thicknesses = [piece.thickness for piece in pieces if piece.thickness is not None]
    sigmas = [piece.sigma for piece in pieces if piece.sigma is not None]
    heights = [piece.height for piece in pieces if piece.height is not None]
    every = len(pieces)
    return Wall(
        pieces[0].start,
        pieces[-1].end,
        mean(thicknesses) if len(thicknesses) == every else None,
        mean([piece.drawn_thickness for piece in pieces]),
        tuple(dict.fromkeys(face for piece in pieces for face in piece.faces)),
        height=max(heights) if len(heights) == every else None,
        curve=pieces[0].curve,
        id=pieces[0].id,
        seen=mean([piece.seen for piece in pieces]),
        rms=math.sqrt(mean([piece.rms**2 for piece in pieces])),
        voxels=sum(piece.voxels for piece in pieces),
        sigma=max(sigmas) if len(sigmas) == every else None,
        confidence=min(piece.confidence for piece in pieces),
    )


def _seen_side(level: Level, pieces: tuple[Wall, ...]) -> str | None:
    """LEFT or RIGHT of the axis, on which all of the wall's faces are; None where they are on both, or not known."""
    faces = {face.id: face for face in level.storey.wall_faces if face.id}
    left = set()
    for piece in pieces:
        frame = Frame.between(piece.start, piece.end, 0.0)
        for face in (faces[name] for name in piece.faces if name in faces):
            left.add(frame.local(face.start)[1] + frame.local(face.end)[1] > 0)
    return None if len(left) != 1 else "LEFT" if left.pop() else "RIGHT"


def _height(level: Level, wall: Wall) -> float:
    return level.height if wall.height is None else wall.height


def _body(pieces: tuple[Wall, ...], frame: Frame) -> Any:
    """What the pieces stand on, as a polygon in `frame`; several where they do not touch."""
    areas = [area_in(frame, piece.outline or _rectangle(piece)) for piece in pieces]
    return areas[0] if len(areas) == 1 else shapely.union_all(areas, grid_size=1e-6)


def _rectangle(wall: Wall) -> tuple[Point, ...]:
    frame, half = Frame.between(wall.start, wall.end, 0.0), wall.drawn_thickness / 2
    corners = ((0.0, -half), (wall.length, -half), (wall.length, half), (0.0, half))
    return tuple(frame.moved(x, y).origin for x, y in corners)


# --- what interrupts them ---


@dataclass(frozen=True)
class _Host:
    """The wall that an opening is in: its entity, the piece that the opening names, and all its pieces."""

    made: Placed
    piece: Wall
    pieces: tuple[Wall, ...]

    def stretch(self, opening: Opening) -> tuple[Frame, float]:
        """The frame on the piece's centreline where the opening begins, and how far it goes from there, m."""
        axis = Frame.between(self.piece.start, self.piece.end, self.made.frame.z)
        first, last = sorted(axis.local(point)[0] for point in (opening.start, opening.end))
        return axis.moved(first), last - first

    def sides(self, frame: Frame, width: float) -> tuple[float, float]:
        """From where to where across `frame` the wall lies between 0 and `width` along it, m."""
        # beyond the bulge of a curved wall, short of its far side
        reach = self.piece.drawn_thickness + width / 2
        nearby = shapely.intersection(_body(self.pieces, frame), shapely.box(0.0, -reach, width, reach))
        axis = shapely.LineString([(0.0, 0.0), (width, 0.0)])
        part = min(shapely.get_parts(nearby), key=lambda part: float(shapely.distance(part, axis)), default=nearby)
        if part.is_empty:
            return -self.piece.drawn_thickness / 2, self.piece.drawn_thickness / 2
        _, right, _, left = part.bounds
        return right, left


def _add_opening(level: Level, opening: Door | Window, host: _Host | None) -> None:
    """Add a door or window, in the hole that it fills where its wall is known, else on its own."""
    sill = opening.sill or 0.0
    top = level.height if host is None else _height(level, host.piece)
    height = (top if opening.head is None else opening.head) - sill
    if host is None:
        frame, width = Frame.between(opening.start, opening.end, level.floor + sill), opening.width
        hole, middle = None, frame
    else:
        frame, width = host.stretch(opening)
        frame = frame.moved(dz=sill)
        right, left = host.sides(frame, width)
        hole = _add_hole(level, host.made, frame, opening, (width, height), (right - BEYOND, left + BEYOND))
        middle = frame.moved(0.0, (right + left) / 2)
    if isinstance(opening, Door) and opening.state == "cased":
        return
    made = _add_filling(level, opening, middle, (width, height), hole)
    level.contents.append(made.entity)
    if hole is not None:
        relating = {"RelatingOpeningElement": hole.entity, "RelatedBuildingElement": made.entity}
        level.model.relate("IfcRelFillsElement", made.entity, **relating)


def _add_hole(
    level: Level, wall: Placed, frame: Frame, opening: Opening, size: Point, sides: tuple[float, float]
) -> Placed:
    width, height = size
    body = level.model.prism(shapely.box(0.0, sides[0], width, sides[1]), height)
    hole = level.add(
        "IfcOpeningElement", opening, frame, level.model.shapes(body), _said(opening), wall, PredefinedType="OPENING"
    )
    relating = {"RelatingBuildingElement": wall.entity, "RelatedOpeningElement": hole.entity}
    level.model.relate("IfcRelVoidsElement", hole.entity, **relating)
    return hole


def _add_filling(level: Level, opening: Door | Window, frame: Frame, size: Point, hole: Placed | None) -> Placed:
    """Add the door or window itself; a leaf or a pane in the middle of the wall stands for it."""
    (width, height), model = size, level.model
    body = model.shapes(model.prism(shapely.box(0.0, -PANEL / 2, width, PANEL / 2), height))
    observed = height > 0 and opening.head is not None and (isinstance(opening, Door) or opening.sill is not None)
    attributes = {
        "Tag": opening.id,
        "OverallWidth": width if width > 0 else None,
        "OverallHeight": float(height) if observed else None,
    }
    if isinstance(opening, Window):
        return level.add("IfcWindow", opening, frame, body, _said(opening), hole, **attributes, PredefinedType="WINDOW")
    turned, operation = _operation(opening, frame)
    if turned:
        frame = frame.moved(width, turned=True)
    attributes |= {"PredefinedType": "DOOR", "OperationType": operation}
    return level.add("IfcDoor", opening, frame, body, _said(opening), hole, **attributes)


def _operation(door: Door, frame: Frame) -> tuple[bool, str]:
    """Whether a door's frame must be turned for the door to open towards its y axis, as IFC has it, and how it opens.

    The hinges are left or right as seen by who looks along the y axis.
    """
    step = (door.end[0] - door.start[0], door.end[1] - door.start[1])
    forward = frame.local_direction(step)[0] >= 0
    opens_to_y = door.swing == ("left" if forward else "right")
    hung_at_origin = door.hinge == ("start" if forward else "end")
    if door.swing is None or door.hinge is None:
        return door.swing is not None and not opens_to_y, "NOTDEFINED"
    return not opens_to_y, "SINGLE_SWING_LEFT" if hung_at_origin == opens_to_y else "SINGLE_SWING_RIGHT"


def _said(opening: Opening) -> tuple[Property, ...]:
    """What was seen of an opening; heights are in m above the storey's floor."""
    seen: tuple[Property, ...] = (
        ("Width", "IfcLengthMeasure", opening.width),
        ("Sill", "IfcLengthMeasure", opening.sill),
        ("Head", "IfcLengthMeasure", opening.head),
    )
    if isinstance(opening, Door):
        seen += (
            ("State", "IfcLabel", opening.state),
            ("Hinge", "IfcLabel", opening.hinge),
            ("Swing", "IfcLabel", opening.swing),
        )
    return seen


def _add_gap(level: Level, gap: UnknownOpening) -> None:
    """Add a gap that no scan could look through as a line on the floor: it voids nothing, for it may be wall."""
    frame = Frame.between(gap.start, gap.end, level.floor)
    shape = level.model.shapes(level.model.lines("FootPrint", [(0.0, 0.0), (gap.length, 0.0)]))
    properties = (*_said(gap), ("Wall", "IfcLabel", gap.wall))
    kind: dict[str, Any] = {"PredefinedType": "USERDEFINED", "ObjectType": "UNKNOWNOPENING", "Tag": gap.id}
    made = level.add("IfcBuildingElementProxy", gap, frame, shape, properties, **kind)
    level.contents.append(made.entity)
