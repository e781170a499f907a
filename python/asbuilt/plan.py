"""The floor plan: plain data, and its native file format.

`plan.geojson` is a FeatureCollection in the input's own frame and metres, one Feature per thing with
``properties.kind`` and ``properties.storey`` (0 = lowest). `load_plan` reads back what `FloorPlan.to_geojson` writes.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import math
import os
import re
import types
import typing
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar

from asbuilt.errors import InputError, told

_Made = TypeVar("_Made")
Point = tuple[float, float]
DoorState = Literal["open", "shut", "cased", "unknown"]
FRAME = "x, y of the input's own frame, in metres; z up; not longitude and latitude unless crs says so"
#: The CRS that stands in a file for none: a GIS that reads no CRS takes metres for degrees.
NO_CRS = (
    'ENGCRS["local frame of the scans",EDATUM["local frame of the scans"],CS[Cartesian,2],'
    'AXIS["x",unspecified],AXIS["y",unspecified],LENGTHUNIT["metre",1]]'
)


#: Upper limit of each band of the USIBD Level of Accuracy at 95 % confidence, m, the best band first.
LOA_BANDS = {"LOA50": 0.001, "LOA40": 0.005, "LOA30": 0.015, "LOA20": 0.05, "LOA10": float("inf")}
#: Sigmas of a normal distribution within which 95 % lie.
LOA_SIGMAS = 1.96


def loa_band(distance: float) -> str:
    """Name of the USIBD band of an error (m) at 95 % confidence.

    >>> loa_band(0.0042), loa_band(0.02), loa_band(0.2)
    ('LOA40', 'LOA20', 'LOA10')
    """
    return next(band for band, limit in LOA_BANDS.items() if distance <= limit + 1e-9)


@dataclass(frozen=True, kw_only=True)
class Element:
    """What every element of a plan carries: its name, and how far it can be trusted.

    Attributes
    ----------
    id : name within the plan, such as S0-W3; "" where it has none.
    seen : share of its length (or of its outline) with points on it, 0..1; None where it was not worked out.
    rms : root mean square distance of its points to it, m; None likewise, and where there are none.
    voxels : number of evidence voxels that support it.
    sigma : standard deviation of its position by fit and registration, m; None where it cannot be told.
    confidence : how likely it is real, 0..1; calibrated for wall faces: of those given 0.9, nine in ten are real. None
        where it was not worked out, as by the paper's preset.
    """

    id: str = ""
    seen: float | None = None
    rms: float | None = None
    voxels: int = 0
    sigma: float | None = None
    confidence: float | None = None

    @property
    def loa(self) -> str | None:
        """USIBD band that its position meets at 95 % confidence; None without a sigma."""
        return None if self.sigma is None else loa_band(LOA_SIGMAS * self.sigma)


@dataclass(frozen=True)
class _Line(Element):
    """An element along a straight segment from `start` to `end`, (x, y), m."""

    start: Point
    end: Point

    @property
    def length(self) -> float:
        """Length, m."""
        return float(((self.end[0] - self.start[0]) ** 2 + (self.end[1] - self.start[1]) ** 2) ** 0.5)


@dataclass(frozen=True)
class WallFace(_Line):
    """One visible face of a wall, as a straight segment. The room that sees it is on its left where that is known.

    Attributes
    ----------
    curve : id shared by the faces of one curved wall, else None.
    """

    curve: int | None = None


@dataclass(frozen=True)
class Wall(_Line):
    """A wall along its centreline. It runs on through its doors and windows.

    Attributes
    ----------
    thickness : distance of its two faces, m; None where only one of them was seen.
    drawn_thickness : the thickness, or what an unseen side is drawn with (`--unseen-thickness`), m.
    faces : ids of its wall faces: those on the left of the centreline first.
    outline : ring (x, y) of its body on the ground, not closed; the bodies of walls that meet share corners.
    height : of its top above the storey's floor, m; None where it reaches the ceiling.
    curve : id shared by the walls of one curved wall, else None.
    """

    thickness: float | None = None
    drawn_thickness: float = 0.0
    faces: tuple[str, ...] = ()
    outline: tuple[Point, ...] = ()
    height: float | None = None
    curve: int | None = None


@dataclass(frozen=True)
class Opening(_Line):
    """A hole in a wall, from jamb to jamb along the wall's centreline; without a wall, along the face that was seen.

    Attributes
    ----------
    wall : id of its wall, or None.
    sill, head : heights of its lower and upper edge above the storey's floor, m; None where not seen.
    """

    wall: str | None = None
    sill: float | None = None
    head: float | None = None

    @property
    def width(self) -> float:
        """Clear width, m."""
        return self.length


@dataclass(frozen=True)
class Door(Opening):
    """An opening to walk through.

    Attributes
    ----------
    state : "open" (a leaf stands open), "shut" (a leaf fills it), "cased" (no leaf), or "unknown".
    hinge : "start" or "end", where the leaf is hung; None where the leaf was not seen.
    swing : "left" or "right" of the line from start to end, the side to which the leaf opens; None likewise.
    """

    state: DoorState = "unknown"
    hinge: Literal["start", "end"] | None = None
    swing: Literal["left", "right"] | None = None


@dataclass(frozen=True)
class Window(Opening):
    """An opening with a sill, or one that cannot be walked through."""


@dataclass(frozen=True)
class UnknownOpening(Opening):
    """A gap in a wall that no scan could look through: it may be a door, a niche, or wall that something hides."""


@dataclass(frozen=True)
class Room(Element):
    """A room within the faces of its walls.

    Attributes
    ----------
    ring : outer ring (x, y), counter-clockwise, not closed.
    holes : rings of what stands in it from floor to ceiling, not closed.
    number : as on a door plate, such as "101".
    floor, ceiling : heights of the room's own floor and ceiling, z in m; None where not seen.
    scans : keys of the scans that stand in it.
    """

    ring: tuple[Point, ...]
    holes: tuple[tuple[Point, ...], ...] = ()
    number: str = ""
    floor: float | None = None
    ceiling: float | None = None
    scans: tuple[str, ...] = ()

    @property
    def area(self) -> float:
        """Area to the faces of the walls, m2."""
        return _ring_area(self.ring) - sum(_ring_area(hole) for hole in self.holes)

    @property
    def perimeter(self) -> float:
        """Length of the outer ring, m."""
        return sum(math.dist(a, b) for a, b in zip(self.ring, self.ring[1:] + self.ring[:1], strict=True))

    @property
    def height(self) -> float | None:
        """Clear height from floor to ceiling, m; None where either was not seen."""
        return None if self.floor is None or self.ceiling is None else self.ceiling - self.floor


@dataclass(frozen=True)
class Column(Element):
    """A column: a rectangle, or a circle of diameter `width`.

    Attributes
    ----------
    centre : (x, y), m.
    shape : "square" for any rectangle, or "round".
    width, depth : sides along and across `rotation`, m; the diameter, twice, of a round one.
    rotation : of its width against the x axis, rad, in [0, pi).
    """

    centre: Point
    width: float
    depth: float
    shape: Literal["square", "round"] = "square"
    rotation: float = 0.0

    @property
    def ring(self) -> tuple[Point, ...]:
        """Corners of the rectangle, or 24 points of the circle, counter-clockwise, not closed."""
        if self.shape == "round":
            turns = [2 * math.pi * i / 24 for i in range(24)]
            corners = [(self.width / 2 * math.cos(t), self.width / 2 * math.sin(t)) for t in turns]
        else:
            corners = [(self.width / 2 * i, self.depth / 2 * j) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        cos, sin = math.cos(self.rotation), math.sin(self.rotation)
        return tuple((self.centre[0] + x * cos - y * sin, self.centre[1] + x * sin + y * cos) for x, y in corners)


@dataclass(frozen=True)
class Stair(Element):
    """A flight of stairs.

    Attributes
    ----------
    ring : outline (x, y), counter-clockwise, not closed.
    path : line (x, y) along which it goes up; empty where the direction was not seen.
    rise : height from its lowest to its highest step, m.
    """

    ring: tuple[Point, ...]
    path: tuple[Point, ...] = ()
    rise: float | None = None


@dataclass(frozen=True)
class Storey:
    """One level: its heights in the input's z (m), its outline ring (x, y) or None, and what stands on it."""

    index: int
    floor: float
    ceiling: float
    outline: tuple[Point, ...] | None = None
    wall_faces: tuple[WallFace, ...] = ()
    walls: tuple[Wall, ...] = ()
    doors: tuple[Door, ...] = ()
    windows: tuple[Window, ...] = ()
    unknown_openings: tuple[UnknownOpening, ...] = ()
    rooms: tuple[Room, ...] = ()
    columns: tuple[Column, ...] = ()
    stairs: tuple[Stair, ...] = ()


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
            "crs": _crs_member(self.crs),
            "features": [feature for storey in self.storeys for feature in _storey_features(storey)],
        }


#: What values raise that do not belong where they stand.
_ODD = (ValueError, LookupError, TypeError, AttributeError, OverflowError, RecursionError)


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
    except _ODD as error:
        raise InputError(
            f"{path}: expected a plan that asbuilt wrote as .geojson, found {told(error)}; asbuilt plan writes one anew"
        ) from error


def plan_from_geojson(data: dict[str, Any]) -> FloorPlan:
    """The inverse of `FloorPlan.to_geojson`; raises what `load_plan` catches where `data` is no plan."""
    storeys: dict[int, Storey] = {}
    parts: dict[int, dict[str, Any]] = {}
    if "features" not in data:
        raise ValueError("JSON without features")
    for number, feature in enumerate(data["features"], start=1):
        try:
            properties, geometry = feature["properties"], feature["geometry"]
            index, kind = properties["storey"], properties["kind"]
            if kind == "storey":
                ring = None if geometry is None else _open_ring(geometry["coordinates"][0])
                storeys[index] = _checked(Storey(index, properties["floor"], properties["ceiling"], ring))
            elif kind in _KINDS:
                of_storey, where = parts.setdefault(index, {}), _KINDS[kind][0]
                of_storey[where] = (*of_storey.get(where, ()), _element(kind, properties, geometry))
        except _ODD as error:
            raise ValueError(f"{told(error)} in feature {number}") from error
    about = data.get("asbuilt", {})
    plan = FloorPlan(
        storeys=tuple(dataclasses.replace(storeys[index], **parts.get(index, {})) for index in sorted(storeys)),
        parameters=about.get("parameters", {}),
        inputs=tuple(about.get("inputs", ())),
        crs=_crs_of(data.get("crs")),
        notes=tuple(about.get("notes", ())),
    )
    return _checked(plan)


#: `properties.kind` of each element: where a storey keeps it, and its type.
_KINDS: dict[str, tuple[str, type[Element]]] = {
    "wall_face": ("wall_faces", WallFace),
    "wall": ("walls", Wall),
    "door": ("doors", Door),
    "window": ("windows", Window),
    "unknown_opening": ("unknown_openings", UnknownOpening),
    "room": ("rooms", Room),
    "column": ("columns", Column),
    "stair": ("stairs", Stair),
}
#: What the geometry of a feature holds; and what can be worked out, which is written for other programs alone.
_IN_GEOMETRY = ("start", "end", "ring", "holes")
_DERIVED = ("loa", "width", "area", "perimeter", "height")


def _crs_member(crs: str | None) -> dict[str, Any]:
    """The named CRS of GeoJSON 2008. RFC 7946 has none (all is longitude and latitude), but GIS programs read it."""
    name = NO_CRS if crs is None else re.sub(r"^EPSG:(\d+)$", r"urn:ogc:def:crs:EPSG::\1", crs)
    return {"type": "name", "properties": {"name": name}}


def _crs_of(member: dict[str, Any] | str | None) -> str | None:
    # the first plan files held the bare name, or null
    name = member["properties"]["name"] if isinstance(member, dict) else member
    return None if name in (None, NO_CRS) else re.sub(r"^urn:ogc:def:crs:EPSG::(\d+)$", r"EPSG:\1", name)


def _storey_features(storey: Storey) -> Iterator[dict[str, Any]]:
    outline = None if not storey.outline else {"type": "Polygon", "coordinates": [_closed_ring(storey.outline)]}
    yield _feature(outline, "storey", storey.index, {"floor": storey.floor, "ceiling": storey.ceiling})
    for kind, (where, _) in _KINDS.items():
        for element in getattr(storey, where):
            own = {f.name: getattr(element, f.name) for f in dataclasses.fields(element) if f.name not in _IN_GEOMETRY}
            derived = {name: getattr(element, name) for name in _DERIVED if name not in own and hasattr(element, name)}
            yield _feature(_geometry(element), kind, storey.index, {**own, **derived})


def _geometry(element: Element) -> dict[str, Any]:
    if isinstance(element, _Line):
        return {"type": "LineString", "coordinates": [list(element.start), list(element.end)]}
    if isinstance(element, Room):
        return {"type": "Polygon", "coordinates": [_closed_ring(ring) for ring in (element.ring, *element.holes)]}
    if isinstance(element, Column | Stair):
        return {"type": "Polygon", "coordinates": [_closed_ring(element.ring)]}
    raise TypeError(f"{type(element).__name__} has no geometry")


def _element(kind: str, properties: dict[str, Any], geometry: dict[str, Any]) -> Element:
    made = _KINDS[kind][1]
    coordinates = geometry["coordinates"]
    names = {f.name for f in dataclasses.fields(made)}
    values = {key: _tuples(value) for key, value in properties.items() if key in names}
    if issubclass(made, _Line):
        values["start"], values["end"] = (tuple(point) for point in coordinates)
    elif made is Room:
        values["ring"], *holes = (_open_ring(ring) for ring in coordinates)
        values["holes"] = tuple(holes)
    elif made is Stair:
        values["ring"] = _open_ring(coordinates[0])
    element = _checked(made(**values))
    if isinstance(element, Wall):
        _check_outline(element)
    return element


def _check_outline(wall: Wall) -> None:
    """Exports cut and join the bodies of walls, and can do so with simple rings alone."""
    from shapely import Polygon  # heavy: help and errors do not wait for it

    if wall.outline and not (len(wall.outline) > 2 and Polygon(wall.outline).is_valid):
        raise ValueError(f"an outline of wall {wall.id or 'without id'} that crosses itself or encloses nothing")


def _checked(made: _Made) -> _Made:
    """What was read, if its values are of the types that it states."""
    kind: Any = type(made)
    for name, hint in _hints(kind).items():
        value = getattr(made, name)
        if not _fits(value, hint):
            raise ValueError(f"{name} = {str(value)[:60]!r} of a {kind.__name__}")
    return made


@functools.cache
def _hints(kind: Any) -> dict[str, Any]:
    hints = typing.get_type_hints(kind)
    return {field.name: hints[field.name] for field in dataclasses.fields(kind)}


def _fits(value: Any, hint: Any) -> bool:
    """Whether a value is of a type; numbers must be finite, and whole ones do where others are expected."""
    origin, parts = typing.get_origin(hint), typing.get_args(hint)
    if hint in (int, float):
        known = int if hint is int else int | float
        return isinstance(value, known) and not isinstance(value, bool) and math.isfinite(value)
    if origin in (typing.Union, types.UnionType):
        return any(_fits(value, part) for part in parts)
    if origin is Literal:
        return value in parts
    if origin is tuple and parts[-1] is Ellipsis:
        return isinstance(value, tuple) and all(_fits(item, parts[0]) for item in value)
    if origin is tuple:
        return isinstance(value, tuple) and len(value) == len(parts) and all(map(_fits, value, parts))
    return isinstance(value, origin or hint)


def _tuples(value: Any) -> Any:
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value


def _closed_ring(ring: tuple[Point, ...]) -> list[list[float]]:
    return [list(point) for point in (*ring, ring[0])]


def _open_ring(ring: list[list[float]]) -> tuple[Point, ...]:
    if len(ring) < 4:
        raise ValueError(f"a ring of {len(ring)} points, expected at least 4, the last of them the first")
    return tuple((x, y) for x, y in ring[:-1])


def _ring_area(ring: tuple[Point, ...]) -> float:
    # about a corner, so that survey coordinates lose nothing
    x0, y0 = ring[0]
    following = ring[1:] + ring[:1]
    pairs = zip(ring, following, strict=True)
    return abs(sum((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0) for (x1, y1), (x2, y2) in pairs)) / 2


def _feature(geometry: dict[str, Any] | None, kind: str, storey: int, properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "geometry": geometry, "properties": {"kind": kind, "storey": storey, **properties}}
