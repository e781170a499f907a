"""IFC4 through IfcOpenShell: storeys with walls, doors, windows, spaces, slabs, columns and stairs, as solids.

A wall's body is its outline, from the floor up. Its material layer has the thickness that was measured; a wall of
which one side was not seen is drawn with the plan's `drawn_thickness`, says ``Asbuilt_Trust.ThicknessObserved`` false,
and has no material layer. Every element carries in `Asbuilt_Trust` how far it can be trusted. An element keeps its GUID
as long as the scans and its id are the same.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from asbuilt.export.ifc_file import Entity, Frame, IfcFile, Placed
from asbuilt.export.ifc_level import Level
from asbuilt.export.ifc_openings import add_openings
from asbuilt.export.ifc_rooms import add_column, add_room, add_slab, add_stair
from asbuilt.export.ifc_site import add_map, map_system, model_origin
from asbuilt.export.ifc_walls import add_walls
from asbuilt.plan import FloorPlan, Storey

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence


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
    model.describe(placed.entity, [("Floor", "IfcLengthMeasure", storey.floor), ceiling])
    level = Level(model, storey, placed)
    model.aggregate(placed.entity, [add_room(level, room) for room in storey.rooms])
    add_openings(level, add_walls(level))
    add_slab(level, below)
    for column in storey.columns:
        add_column(level, column)
    for stair in storey.stairs:
        add_stair(level, stair)
    level.finish()
    return placed.entity
