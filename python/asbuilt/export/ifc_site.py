"""Where an IFC model lies: the origin that its coordinates count from, and the map they belong to."""

from __future__ import annotations

import math
import re

from asbuilt.export.ifc_file import IfcFile
from asbuilt.export.sheet import plan_bounds
from asbuilt.plan import FloorPlan, Point

#: Coordinates up to this are written as they are, m; farther out, viewers that count in single precision shake.
NEAR = 10_000.0
#: Origins are whole multiples of this, m, so that the models of one campus share theirs.
STEP = 1_000.0
_PROJECTED = re.compile(r"\b(?:PROJCS|PROJCRS|PROJECTEDCRS)\s*\[\s*\"([^\"]*)\"", re.IGNORECASE)
_AUTHORITY = re.compile(r"(?:AUTHORITY|ID)\s*\[\s*\"EPSG\"\s*,\s*\"?(\d+)\"?\s*\]", re.IGNORECASE)


def model_origin(plan: FloorPlan) -> Point:
    """The place in the plan's frame that the model's coordinates count from, m.

    It is (0, 0) where all coordinates are small, and for a plan that holds nothing; else the corner to the south-west
    of everything, at whole kilometres, so that a storey drawn alone gets the same.
    """
    bounds = plan_bounds(plan)
    if bounds is None or max(map(abs, bounds)) <= NEAR:
        return 0.0, 0.0
    return math.floor(bounds[0] / STEP) * STEP, math.floor(bounds[1] / STEP) * STEP


def map_system(crs: str | None) -> str | None:
    """The name of a projected reference system: "EPSG:n", or what its WKT calls itself; None where it is no map's.

    >>> map_system('PROJCS["Gauss", GEOGCS["DHDN", AUTHORITY["EPSG", "4314"]], AUTHORITY["EPSG", "31467"]]')
    'EPSG:31467'
    >>> map_system('PROJCRS["Site grid", BASEGEOGCRS["DHDN", ID["EPSG", 4314]]]'), map_system('LOCAL_CS["scanner"]')
    ('Site grid', None)
    """
    if crs is None or crs.upper().startswith("EPSG:"):
        return crs
    projected = _PROJECTED.search(crs)
    if projected is None:
        return None
    depth = 0
    for found in re.finditer(rf"{_AUTHORITY.pattern}|\"[^\"]*\"|[\[\]]", crs[projected.start() :], re.IGNORECASE):
        # of the nested authorities it is the system's own that stands directly within it
        if found[1] is not None and depth == 1:
            return f"EPSG:{found[1]}"
        depth += {"[": 1, "]": -1}.get(found[0], 0)
        if depth == 0 and found[0] == "]":
            break
    return projected[1] or "unnamed"


def add_map(model: IfcFile, origin: Point, name: str, crs: str) -> None:
    """Say where on the map `name` the model's origin is, and give the reference system as the input has it."""
    target = model.make("IfcProjectedCRS", Name=name[:255], Description=crs, MapUnit=model.metre)
    model.make(
        "IfcMapConversion",
        SourceCRS=model.context,
        TargetCRS=target,
        Eastings=origin[0],
        Northings=origin[1],
        OrthogonalHeight=0.0,
        XAxisAbscissa=1.0,
        XAxisOrdinate=0.0,
        Scale=1.0,
    )
