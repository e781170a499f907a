"""IFC4 through IfcOpenShell: storeys with walls, doors, windows, spaces, slabs, columns and stairs, as solids.

A wall's body is its outline, from the floor up. Its material layer has the thickness that was measured; a wall of
which one side was not seen is drawn with the plan's `drawn_thickness`, says ``Pset_AsBuilt.ThicknessObserved`` false,
and has no material layer. Every element carries in `Pset_AsBuilt` how far it can be trusted. An element keeps its GUID
as long as the scans and its id are the same.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import shapely

from asbuilt.export.ifc_file import Entity, Frame, IfcFile, Placed
from asbuilt.export.ifc_level import Level, area_in
from asbuilt.export.ifc_site import add_map, map_system, model_origin
from asbuilt.export.ifc_walls import add_walls
from asbuilt.plan import Column, FloorPlan, Point, Room, Stair, Storey

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence

#: Thickness that a slab is drawn with where no storey below shows its underside, m.
UNSEEN_SLAB = 0.1


def write(plan: FloorPlan, path: Path, evidence: Evidence | None = None) -> None:
    """Write `plan` as IFC4."""
    from asbuilt import __version__

    origin, system = model_origin(plan), map_system(plan.crs)
    scans = sorted(json.dumps(source, sort_keys=True, default=str) for source in plan.inputs)
    model = IfcFile(json.dumps(scans), (0.0, 0.0) if system is None else origin)
    if system is not None and plan.crs is not None:
        add_map(model, origin, system, plan.crs)
    # without a map, the site's own placement bears the way to it: nothing claims to be a map that is none
    site = model.product("IfcSite", "", Frame(origin), Name="Site", CompositionType="ELEMENT")
    building = model.product("IfcBuilding", "", site.frame, site, Name="Building", CompositionType="ELEMENT")
    model.aggregate(model.project, [site.entity])
    model.aggregate(site.entity, [building.entity])
    _describe(model, plan)
    below: Storey | None = None
    storeys = []
    for storey in plan:
        storeys.append(_add_storey(model, building, storey, below))
        below = storey
    model.aggregate(building.entity, storeys)
    model.write(path, f"asbuilt {__version__}")


def _describe(model: IfcFile, plan: FloorPlan) -> None:
    """What the plan was made from and how."""
    inputs = ", ".join(str(source.get("name", "")) for source in plan.inputs)
    model.describe(
        model.project,
        "Pset_AsBuilt",
        [
            ("Inputs", "IfcText", inputs or None),
            ("CRS", "IfcText", plan.crs or "none"),
            ("Notes", "IfcText", "; ".join(plan.notes) or None),
            ("Parameters", "IfcText", json.dumps(plan.parameters, sort_keys=True, default=str)),
        ],
    )


def _add_storey(model: IfcFile, building: Placed, storey: Storey, below: Storey | None) -> Entity:
    placed = model.product(
        "IfcBuildingStorey",
        f"S{storey.index}",
        Frame(building.frame.origin, storey.floor),
        building,
        Name=f"Storey {storey.index}",
        CompositionType="ELEMENT",
        Elevation=float(storey.floor),
    )
    ceiling = ("Ceiling", "IfcLengthMeasure", storey.ceiling)
    model.describe(placed.entity, "Pset_AsBuilt", [("Floor", "IfcLengthMeasure", storey.floor), ceiling])
    level = Level(model, storey, placed)
    model.aggregate(placed.entity, [_add_room(level, room) for room in storey.rooms])
    add_walls(level)
    _add_faces(level)
    _add_slab(level, below)
    for column in storey.columns:
        _add_column(level, column)
    for stair in storey.stairs:
        _add_stair(level, stair)
    model.contain(placed.entity, level.contents)
    return placed.entity


def _add_room(level: Level, room: Room) -> Entity:
    """A space to the faces of its walls; where its floor or ceiling was not seen, its body takes the storey's."""
    floor = level.floor if room.floor is None else room.floor
    ceiling = level.storey.ceiling if room.ceiling is None else room.ceiling
    frame = Frame(room.ring[0] if room.ring else level.placed.frame.origin, floor)
    area = area_in(frame, room.ring, room.holes)
    made = level.add(
        "IfcSpace",
        room,
        frame,
        level.model.shapes(level.model.prism(area, ceiling - floor)),
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


def _add_faces(level: Level) -> None:
    """The wall faces as lines on the floor where the plan has no walls, as those of the paper's preset."""
    if level.storey.walls or not level.storey.wall_faces:
        return
    faces = [
        [level.placed.frame.local(face.start), level.placed.frame.local(face.end)] for face in level.storey.wall_faces
    ]
    name = f"S{level.storey.index} wall faces"
    shape = level.model.shapes(level.model.lines("FootPrint", *faces))
    made = level.model.product("IfcAnnotation", name, level.placed.frame, level.placed, Name=name, Representation=shape)
    level.contents.append(made.entity)


def _add_slab(level: Level, below: Storey | None) -> None:
    """The floor within the storey's outline, down to the ceiling of the storey below where that was seen."""
    storey = level.storey
    if not storey.outline:
        return
    observed = below is not None and below.index == storey.index - 1 and storey.floor > below.ceiling
    thickness = storey.floor - below.ceiling if below is not None and observed else UNSEEN_SLAB
    name = f"S{storey.index}-floor"
    frame = Frame(storey.outline[0], storey.floor - thickness)
    body = level.model.prism(area_in(frame, storey.outline), thickness)
    slab = {"Name": name, "Tag": name, "PredefinedType": "FLOOR", "Representation": level.model.shapes(body)}
    made = level.model.product("IfcSlab", name, frame, level.placed, **slab)
    level.contents.append(made.entity)
    properties = [
        ("ThicknessObserved", "IfcBoolean", observed),
        ("Thickness", "IfcLengthMeasure", thickness if observed else None),
        ("DrawnThickness", "IfcLengthMeasure", thickness),
    ]
    level.model.describe(made.entity, "Pset_AsBuilt", properties)


def _add_column(level: Level, column: Column) -> None:
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
    made = level.add("IfcColumn", column, frame, shape, properties, Tag=column.id, PredefinedType="COLUMN")
    level.contents.append(made.entity)


def _add_stair(level: Level, stair: Stair) -> None:
    """The outline and the line of going up; and below the pitch of a straight flight of known rise, a solid."""
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
    made = level.add("IfcStair", stair, frame, shape, properties, Tag=stair.id, PredefinedType=kind)
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
