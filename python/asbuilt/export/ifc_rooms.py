"""Rooms of an IFC model, and what else stands on a storey beside walls: slabs, columns and stairs."""

from __future__ import annotations

import math
from collections.abc import Sequence

import shapely

from asbuilt.export.ifc_file import Entity, Frame, IfcFile
from asbuilt.export.ifc_level import Level, area_in
from asbuilt.plan import Column, Point, Room, Stair, Storey

#: Thickness that a slab is drawn with where no storey below shows its underside, m.
UNSEEN_SLAB = 0.1


def add_room(level: Level, room: Room) -> Entity:
    """Add a space to the faces of its walls; where its floor or ceiling was not seen, its body takes the storey's."""
    floor = level.floor if room.floor is None else room.floor
    ceiling = level.storey.ceiling if room.ceiling is None else room.ceiling
    frame = Frame(room.ring[0] if room.ring else level.placed.frame.origin, floor)
    area = area_in(frame, room.ring, room.holes)
    made = level.add(
        "IfcSpace",
        room,
        frame,
        level.model.shapes(level.model.prism(area, ceiling - floor)),
        "A-AREA",
        [("Scans", "IfcText", ", ".join(room.scans) or None), ("Number", "IfcLabel", room.number or None)],
        Name=room.number or room.id,
        CompositionType="ELEMENT",
        PredefinedType="SPACE",
    )
    gross = shapely.Polygon(area.exterior).area
    level.model.measure(
        made.entity,
        "Qto_SpaceBaseQuantities",
        Height=room.height,
        GrossPerimeter=room.perimeter,
        GrossFloorArea=gross,
        NetFloorArea=room.area,
        GrossVolume=None if room.height is None else gross * room.height,
        NetVolume=None if room.height is None else room.area * room.height,
    )
    return made.entity


def add_slab(level: Level, below: Storey | None) -> None:
    """Add the floor within the storey's outline, down to the ceiling of the storey below where that was seen."""
    storey = level.storey
    if not storey.outline:
        return
    observed = below is not None and below.index == storey.index - 1 and storey.floor > below.ceiling
    thickness = storey.floor - below.ceiling if below is not None and observed else UNSEEN_SLAB
    name = f"S{storey.index}-floor"
    frame = Frame(storey.outline[0], storey.floor - thickness)
    body = level.model.prism(area_in(frame, storey.outline), thickness)
    shape = level.model.shapes(body)
    attributes = {"Name": name, "Tag": name, "PredefinedType": "FLOOR", "Representation": shape}
    made = level.model.product("IfcSlab", name, frame, level.placed, **attributes)
    level.contents.append(made.entity)
    level.draw_on("A-FLOR-OTLN", shape)
    properties = [
        ("ThicknessObserved", "IfcBoolean", observed),
        ("Thickness", "IfcLengthMeasure", thickness if observed else None),
        ("DrawnThickness", "IfcLengthMeasure", thickness),
    ]
    level.model.describe(made.entity, properties)


def add_column(level: Level, column: Column) -> None:
    """Add a column from floor to ceiling."""
    along = (math.cos(column.rotation), math.sin(column.rotation))
    frame = Frame(column.centre, level.floor, along)
    if column.shape == "round":
        body = level.model.cylinder(column.width, level.height)
    else:
        width, depth = column.width / 2, column.depth / 2
        body = level.model.prism(shapely.box(-width, -depth, width, depth), level.height)
    properties = [
        ("Shape", "IfcLabel", column.shape),
        ("Width", "IfcLengthMeasure", column.width),
        ("Depth", "IfcLengthMeasure", column.depth),
    ]
    shape = level.model.shapes(body)
    made = level.add("IfcColumn", column, frame, shape, "A-COLS", properties, Tag=column.id, PredefinedType="COLUMN")
    level.contents.append(made.entity)


def add_stair(level: Level, stair: Stair) -> None:
    """Add a stair: its outline, the way up, and below the pitch of a straight flight of known rise a solid."""
    frame = Frame(stair.ring[0], level.floor)
    ring, path = ([frame.local(point) for point in points] for points in (stair.ring, stair.path))
    straight = len(path) == 2 and path[0] != path[1]
    shape = level.model.shapes(
        level.model.lines("FootPrint", [*ring, ring[0]]),
        level.model.lines("Axis", path),
        _flight(level.model, ring, path, stair.rise) if straight and stair.rise else None,
    )
    kind = "STRAIGHT_RUN_STAIR" if straight else "NOTDEFINED"
    properties = [("Rise", "IfcLengthMeasure", stair.rise)]
    made = level.add("IfcStair", stair, frame, shape, "A-FLOR-STRS", properties, Tag=stair.id, PredefinedType=kind)
    level.contents.append(made.entity)


def _flight(model: IfcFile, ring: Sequence[Point], path: Sequence[Point], rise: float) -> Entity | None:
    """A block as high as the stair, cut off above the plane through the lower and the upper end of its path."""
    block = model.solid(shapely.Polygon(ring), rise)
    if block is None:
        return None
    (x1, y1), (x2, y2) = path
    run = math.dist(*path)
    ux, uy = (x2 - x1) / run, (y2 - y1) / run
    slant = math.hypot(run, rise)
    plane = model.plane((x1, y1, 0.0), (-ux * rise / slant, -uy * rise / slant, run / slant), (-uy, ux, 0.0))
    above = model.make("IfcHalfSpaceSolid", plane, False)
    return model.body("Clipping", model.make("IfcBooleanClippingResult", "DIFFERENCE", block, above))
