"""The Scan-to-BIM challenge's 3D building model as JSON: boxes for the walls, doors and columns of all storeys.

The challenge's own programs take one file a class, each of them one of the three lists here. Where the form has no
place for *not seen*, its own default of 0 stands.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asbuilt.plan import Column, Door, FloorPlan, Point, Storey, Wall

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence

_DECIMALS = 6  # of a metre and of a degree


def write(plan: FloorPlan, path: Path, evidence: Evidence | None = None) -> None:
    """Write all storeys: walls with the thickness they are drawn with, doors with a leaf, columns.

    A storey that has wall faces only, as the paper's, has these as walls of no width.
    """
    data: dict[str, list[dict[str, Any]]] = {"walls": [], "doors": [], "columns": []}
    for storey in plan:
        faces = () if storey.walls else storey.wall_faces
        data["walls"] += [_wall(storey, wall.start, wall.end, wall) for wall in storey.walls]
        data["walls"] += [_wall(storey, face.start, face.end, None) for face in faces]
        data["doors"] += [_door(storey, door) for door in storey.doors if door.state != "cased"]
        data["columns"] += [_column(storey, column) for column in storey.columns]
    path.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def _wall(storey: Storey, start: Point, end: Point, wall: Wall | None) -> dict[str, Any]:
    height = storey.ceiling - storey.floor if wall is None or wall.height is None else wall.height
    return {
        "start_pt": _place(start, storey.floor),
        "end_pt": _place(end, storey.floor),
        "width": _number(0.0 if wall is None else wall.drawn_thickness),
        "height": _number(height),
    }


def _door(storey: Storey, door: Door) -> dict[str, Any]:
    (x1, y1), (x2, y2) = door.start, door.end
    sill = door.sill or 0.0
    return {
        "width": _number(door.width),
        "depth": _number(next((wall.drawn_thickness for wall in storey.walls if wall.id == door.wall), 0.0)),
        "height": _number(0.0 if door.head is None else door.head - sill),
        "loc": _place(((x1 + x2) / 2, (y1 + y2) / 2), storey.floor + sill),
        "rotation": _number(math.degrees(math.atan2(y2 - y1, x2 - x1)) % 360.0),
    }


def _column(storey: Storey, column: Column) -> dict[str, Any]:
    return {
        "width": _number(column.width),
        "depth": _number(column.depth),
        "height": _number(storey.ceiling - storey.floor),
        "loc": _place(column.centre, storey.floor),
        "rotation": _number(math.degrees(column.rotation)),
    }


def _place(point: Point, z: float) -> list[float]:
    return [_number(point[0]), _number(point[1]), _number(z)]


def _number(value: float) -> float:
    return round(float(value), _DECIMALS)
