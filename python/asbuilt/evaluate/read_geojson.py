"""Read our own `plan.geojson`, by its features' kinds, into a `Drawing`."""

from __future__ import annotations

from typing import Any

import shapely

from asbuilt.errors import InputError, told
from asbuilt.evaluate.drawing import Drawing, DrawingStorey, Face, Opening, Room, Wall


def is_geojson(data: Any) -> bool:
    """Whether parsed JSON is a GeoJSON FeatureCollection."""
    return isinstance(data, dict) and data.get("type") == "FeatureCollection"


def geojson_drawing(data: dict[str, Any], name: str = "plan") -> Drawing:
    """Make a drawing of a parsed GeoJSON plan.

    Parameters
    ----------
    data : a FeatureCollection whose features carry `properties.kind` and `properties.storey`. Kinds read: storey,
        wall_face, wall, door, window, room; others are passed over.
    name : what to call it in messages.

    Returns
    -------
    Drawing
        Storeys lowest first. A face outside any storey feature makes a storey without a floor height.

    Raises
    ------
    InputError : the features are not those of a plan of asbuilt.
    """
    storeys: dict[int, dict[str, Any]] = {}
    try:
        for feature in data["features"]:
            properties = feature["properties"]
            index = int(properties.get("storey", 0))
            parts = storeys.setdefault(index, {"index": index, "floor": None})
            _add(parts, properties["kind"], properties, feature.get("geometry"))
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        raise InputError(f"{name}: expected a plan that asbuilt wrote as .geojson, found {told(error)}") from error
    lists = ("faces", "doors", "windows", "rooms", "walls")
    made = []
    for index in sorted(storeys):
        parts = storeys[index]
        made.append(DrawingStorey(**{**parts, **{key: tuple(parts.get(key, ())) for key in lists}}))
    return Drawing(tuple(made), name=name)


def _add(parts: dict[str, Any], kind: str, properties: dict[str, Any], geometry: dict[str, Any] | None) -> None:
    coordinates = [] if geometry is None else geometry["coordinates"]
    if kind == "storey":
        floor = properties.get("floor")
        parts["floor"] = None if floor is None else float(floor)
    elif kind == "wall_face":
        face = Face(
            _line(coordinates), str(properties.get("id", "")), curve=properties.get("curve"), properties=properties
        )
        parts.setdefault("faces", []).append(face)
    elif kind == "wall":
        thickness = properties.get("thickness")
        faces = tuple(str(face) for face in properties.get("faces") or ())
        parts.setdefault("walls", []).append(Wall(faces, None if thickness is None else float(thickness)))
    elif kind in ("door", "window"):
        line = _line(coordinates)
        width = properties.get("width")
        if width is None:
            width = ((line[2] - line[0]) ** 2 + (line[3] - line[1]) ** 2) ** 0.5
        parts.setdefault(f"{kind}s", []).append(Opening(line, float(width), properties))
    elif kind == "room":
        ring, *holes = (tuple((float(point[0]), float(point[1])) for point in part) for part in coordinates)
        area = properties.get("area")
        area = float(shapely.Polygon(coordinates[0], coordinates[1:]).area) if area is None else float(area)
        parts.setdefault("rooms", []).append(Room(ring, area, properties, tuple(holes)))


def _line(coordinates: Any) -> tuple[float, float, float, float]:
    first, last = coordinates[0], coordinates[-1]
    return float(first[0]), float(first[1]), float(last[0]), float(last[1])
