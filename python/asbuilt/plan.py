"""The floor plan: plain data, and its native file format.

`plan.geojson` is a FeatureCollection in the input's own frame and metres, one Feature per thing with
``properties.kind`` and ``properties.storey`` (0 = lowest). `load_plan` reads back what `FloorPlan.to_geojson` writes.
"""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from asbuilt.errors import InputError

Point = tuple[float, float]
FRAME = "x, y of the input's own frame, in metres; z up; not longitude and latitude unless crs says so"


@dataclass(frozen=True)
class WallFace:
    """One visible face of a wall, as a straight segment.

    Attributes
    ----------
    start, end : (x, y), m. The room that sees the face is on its left where that is known.
    seen : share of the length with points on it, 0..1.
    rms : root mean square distance of the points to the segment, m.
    voxels : number of evidence voxels that support it.
    curve : id shared by the faces of one curved wall, else None.
    """

    start: Point
    end: Point
    seen: float = 0.0
    rms: float = 0.0
    voxels: int = 0
    curve: int | None = None
    id: str = ""

    @property
    def length(self) -> float:
        """Length, m."""
        return float(((self.end[0] - self.start[0]) ** 2 + (self.end[1] - self.start[1]) ** 2) ** 0.5)


@dataclass(frozen=True)
class Storey:
    """One level: its heights in the input's z (m), its outline ring (x, y) or None, and what stands on it."""

    index: int
    floor: float
    ceiling: float
    outline: tuple[Point, ...] | None = None
    wall_faces: tuple[WallFace, ...] = ()


@dataclass(frozen=True)
class FloorPlan:
    """Storeys, lowest first, and where they come from.

    Attributes
    ----------
    storeys : the storeys that were asked for; `Storey.index` counts all of the building.
    parameters : every parameter that was used, by stage.
    inputs : name, size and checksum of each input.
    crs : WKT or "EPSG:n" of the coordinates, or None.
    notes : one line for each thing the reader should know, such as a stage that came up empty.
    """

    storeys: tuple[Storey, ...] = ()
    parameters: dict[str, Any] = field(default_factory=dict)
    inputs: tuple[dict[str, Any], ...] = ()
    crs: str | None = None
    notes: tuple[str, ...] = ()

    def __iter__(self) -> Iterator[Storey]:
        return iter(self.storeys)

    @property
    def wall_faces(self) -> tuple[WallFace, ...]:
        """The wall faces of all storeys."""
        return tuple(face for storey in self.storeys for face in storey.wall_faces)

    def to_geojson(self) -> dict[str, Any]:
        """The plan as a GeoJSON FeatureCollection (plain dicts and lists)."""
        from asbuilt import __version__

        return {
            "type": "FeatureCollection",
            "asbuilt": {
                "version": __version__,
                "parameters": self.parameters,
                "inputs": list(self.inputs),
                "notes": list(self.notes),
            },
            "frame": FRAME,
            "crs": self.crs,
            "features": [feature for storey in self.storeys for feature in _storey_features(storey)],
        }


def load_plan(path: str | os.PathLike[str]) -> FloorPlan:
    """Read a plan that `asbuilt plan` wrote as GeoJSON.

    Raises
    ------
    InputError : the file cannot be read, is not JSON, or is not a plan of asbuilt.
    """
    try:
        with open(path, encoding="utf-8") as stream:
            return plan_from_geojson(json.load(stream))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: expected a GeoJSON plan written by asbuilt, found {error!r}") from error


def plan_from_geojson(data: dict[str, Any]) -> FloorPlan:
    """The inverse of `FloorPlan.to_geojson`; raises KeyError, TypeError or ValueError where `data` is not a plan."""
    storeys: dict[int, Storey] = {}
    faces: dict[int, list[WallFace]] = {}
    for feature in data["features"]:
        properties, geometry = feature["properties"], feature["geometry"]
        index = properties["storey"]
        if properties["kind"] == "storey":
            ring = None if geometry is None else tuple((x, y) for x, y in geometry["coordinates"][0][:-1])
            storeys[index] = Storey(index, properties["floor"], properties["ceiling"], ring)
        elif properties["kind"] == "wall_face":
            (x1, y1), (x2, y2) = geometry["coordinates"]
            kept = {key: properties[key] for key in ("id", "seen", "rms", "voxels", "curve")}
            faces.setdefault(index, []).append(WallFace((x1, y1), (x2, y2), **kept))
    about = data.get("asbuilt", {})
    return FloorPlan(
        storeys=tuple(
            dataclasses.replace(storeys[index], wall_faces=tuple(faces.get(index, ()))) for index in sorted(storeys)
        ),
        parameters=about.get("parameters", {}),
        inputs=tuple(about.get("inputs", ())),
        crs=data.get("crs"),
        notes=tuple(about.get("notes", ())),
    )


def _storey_features(storey: Storey) -> Iterator[dict[str, Any]]:
    outline = None
    if storey.outline:
        ring = [list(point) for point in (*storey.outline, storey.outline[0])]
        outline = {"type": "Polygon", "coordinates": [ring]}
    heights = {"floor": storey.floor, "ceiling": storey.ceiling}
    yield _feature(outline, "storey", storey.index, **heights)
    for face in storey.wall_faces:
        line = {"type": "LineString", "coordinates": [list(face.start), list(face.end)]}
        figures = {"id": face.id, "seen": face.seen, "rms": face.rms, "voxels": face.voxels, "curve": face.curve}
        yield _feature(line, "wall_face", storey.index, **figures)


def _feature(geometry: dict[str, Any] | None, kind: str, storey: int, **properties: Any) -> dict[str, Any]:
    return {"type": "Feature", "geometry": geometry, "properties": {"kind": kind, "storey": storey, **properties}}
