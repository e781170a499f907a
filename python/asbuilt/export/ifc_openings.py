"""What interrupts the walls of an IFC model: openings that void them, doors and windows that fill the openings."""

from __future__ import annotations

from typing import Any

import shapely

from asbuilt.export.ifc_file import Frame, Placed, Property
from asbuilt.export.ifc_level import Level
from asbuilt.export.ifc_walls import Host
from asbuilt.plan import Door, Opening, Point, UnknownOpening, Window

#: How far an opening reaches beyond the wall's faces, m: a cut along a face leaves it to rounding what remains.
BEYOND = 0.01
#: Share of an opening's width by which it may be shorter along its wall, as one across the pieces of a curve is.
ASKEW = 0.1
#: Thickness that the leaf of a door and the pane of a window are drawn with, m.
PANEL = 0.04


def add_openings(level: Level, hosts: dict[str, Host]) -> None:
    """Add the doors and windows of a storey, and its gaps that no scan could look through."""
    openings: tuple[Door | Window, ...] = (*level.storey.doors, *level.storey.windows)
    for opening in openings:
        _add_opening(level, opening, hosts.get(opening.wall or ""))
    for gap in level.storey.unknown_openings:
        _add_mark(level, gap, "UNKNOWNOPENING")


def _add_opening(level: Level, opening: Door | Window, host: Host | None) -> None:
    """Add a door or window, in the hole that it fills where its wall is known, else on its own."""
    sill = opening.sill or 0.0
    top = level.height if host is None else host.height
    height = (top if opening.head is None else opening.head) - sill
    hole = None
    frame, width = Frame.between(opening.start, opening.end, level.floor + sill), opening.width
    if host is not None:
        along, length = _stretch(host, opening)
        sides = _sides(host, along, length)
        # an opening that its wall does not reach stands alone, where it was seen
        if sides is not None and abs(length - width) <= ASKEW * width:
            frame, width, (right, left) = along.moved(dz=sill), length, sides
            hole = _add_hole(level, host.made, frame, opening, (width, height), (right - BEYOND, left + BEYOND))
            frame = frame.moved(0.0, (right + left) / 2)
    if isinstance(opening, Door) and opening.state == "cased":
        if hole is None:
            _add_mark(level, opening, "OPENING")
        return
    made = _add_filling(level, opening, frame, (width, height), hole)
    level.contents.append(made.entity)
    if hole is not None:
        relating = {"RelatingOpeningElement": hole.entity, "RelatedBuildingElement": made.entity}
        level.model.relate("IfcRelFillsElement", made.entity, **relating)


def _stretch(host: Host, opening: Opening) -> tuple[Frame, float]:
    """The frame on the piece's centreline where the opening begins, and how far it goes from there, m."""
    axis = Frame.between(host.piece.start, host.piece.end, host.made.frame.z)
    first, last = sorted(axis.local(point)[0] for point in (opening.start, opening.end))
    return axis.moved(first), last - first


def _sides(host: Host, frame: Frame, width: float) -> tuple[float, float] | None:
    """From where to where across `frame` the wall lies between 0 and `width` along it, m; None where it does not."""
    # beyond the bulge of a curved wall, short of its far side
    reach = host.piece.drawn_thickness + width / 2
    nearby = shapely.intersection(host.body(frame), shapely.box(0.0, -reach, width, reach))
    axis = shapely.LineString([(0.0, 0.0), (width, 0.0)])
    part = min(shapely.get_parts(nearby), key=lambda part: float(shapely.distance(part, axis)), default=nearby)
    if part.area <= 0:
        return None
    _, right, _, left = part.bounds
    return right, left


def _add_hole(
    level: Level, wall: Placed, frame: Frame, opening: Opening, size: Point, sides: tuple[float, float]
) -> Placed:
    width, height = size
    body = level.model.prism(shapely.box(0.0, sides[0], width, sides[1]), height)
    shape, layer = level.model.shapes(body), _layer(opening)
    hole = level.add("IfcOpeningElement", opening, frame, shape, layer, _said(opening), wall, PredefinedType="OPENING")
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
        kind, attributes = "IfcWindow", {**attributes, "PredefinedType": "WINDOW"}
    else:
        turned, operation = _operation(opening, frame)
        frame = frame.moved(width, turned=True) if turned else frame
        kind, attributes = "IfcDoor", {**attributes, "PredefinedType": "DOOR", "OperationType": operation}
    return level.add(kind, opening, frame, body, _layer(opening), _said(opening), hole, **attributes)


def _layer(opening: Opening) -> str:
    return "A-GLAZ" if isinstance(opening, Window) else "A-DOOR"


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


def _add_mark(level: Level, opening: Opening, kind: str) -> None:
    """Add a line on the floor, which voids nothing: what no scan could look through may be wall."""
    frame = Frame.between(opening.start, opening.end, level.floor)
    shape = level.model.shapes(level.model.lines("FootPrint", [(0.0, 0.0), (opening.length, 0.0)]))
    properties = (*_said(opening), ("Wall", "IfcLabel", opening.wall))
    layer = "A-OPNG-UNKN" if isinstance(opening, UnknownOpening) else "A-DOOR"
    types: dict[str, Any] = {"PredefinedType": "USERDEFINED", "ObjectType": kind, "Tag": opening.id}
    made = level.add("IfcBuildingElementProxy", opening, frame, shape, layer, properties, **types)
    level.contents.append(made.entity)
