"""An IFC4 file under construction: entities with names that last, places, shapes, properties and relations.

The exporter's other modules say what is written, this one how. Entities are made through IfcOpenShell in a fixed
order, and their GUIDs come from names, so that the same plan gives the same bytes.
"""

from __future__ import annotations

import math
import uuid
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import shapely

from asbuilt.errors import MissingExtraError
from asbuilt.plan import Point

try:
    import ifcopenshell
    import ifcopenshell.guid
except ImportError as error:
    raise MissingExtraError("writing IFC needs IfcOpenShell: pip install 'asbuilt[ifc]'") from error

Entity = Any  # an ifcopenshell.entity_instance: the schema knows its attributes, a type checker does not
#: Name, IFC measure and value of a property; it is left out where the value is None.
Property = tuple[str, str, Any]
#: Not Pset_...: that is reserved for the sets of buildingSMART.
PROPERTY_SET = "Asbuilt_Trust"

_NAMESPACE = uuid.uuid5(uuid.NAMESPACE_DNS, "asbuilt.ifc")
_PRECISION = 1e-5  # m, within which a reader may take two points for one
_DECIMALS = 6  # of a metre; what is below a micrometre is rounding, and makes files long
_TIME_STAMP = "1970-01-01T00:00:00"  # the header must have one, and the same plan gives the same bytes
_VIEWS = {"Body": "MODEL_VIEW", "Axis": "GRAPH_VIEW", "FootPrint": "PLAN_VIEW"}
_UNITS = {
    "LENGTHUNIT": "METRE",
    "AREAUNIT": "SQUARE_METRE",
    "VOLUMEUNIT": "CUBIC_METRE",
    "PLANEANGLEUNIT": "RADIAN",
}


@dataclass(frozen=True)
class Frame:
    """A place and a direction in which an element's shape is written; its y axis is on the left of `along`.

    Attributes
    ----------
    origin : (x, y) in the plan's frame, m.
    z : height in the plan's frame, m.
    along : unit vector of the x axis.
    """

    origin: Point
    z: float = 0.0
    along: Point = (1.0, 0.0)

    @classmethod
    def between(cls, start: Point, end: Point, z: float) -> Frame:
        """The frame at `start` whose x axis points to `end`, or east where both are one point."""
        length = math.dist(start, end)
        return cls(start, z, ((end[0] - start[0]) / length, (end[1] - start[1]) / length) if length > 0 else (1.0, 0.0))

    def local(self, point: Point) -> Point:
        """A point of the plan's frame in this one, m. The origin goes first, so survey coordinates lose nothing."""
        return self.local_direction((point[0] - self.origin[0], point[1] - self.origin[1]))

    def local_direction(self, vector: Point) -> Point:
        """A vector of the plan's frame in this one."""
        (x, y), (ax, ay) = vector, self.along
        return x * ax + y * ay, y * ax - x * ay

    def moved(self, x: float = 0.0, y: float = 0.0, dz: float = 0.0, turned: bool = False) -> Frame:
        """The frame at the local point x, y and `dz` higher, m; `turned` by half a turn or not."""
        (ax, ay), sign = self.along, -1.0 if turned else 1.0
        origin = (self.origin[0] + x * ax - y * ay, self.origin[1] + x * ay + y * ax)
        return Frame(origin, self.z + dz, (sign * ax, sign * ay))


@dataclass(frozen=True)
class Placed:
    """An entity and the frame it stands in."""

    entity: Entity
    frame: Frame


class IfcFile:
    """An IFC4 file in metres, with a project.

    Parameters
    ----------
    source : what tells the scans of this building from those of others. GUIDs come from it and from names.
    origin : the place in the plan's frame that the file's coordinates count from, (x, y), m.
    """

    def __init__(self, source: str, origin: Point = (0.0, 0.0)) -> None:
        self._world = Frame(origin)
        self._file: Any = ifcopenshell.file(schema="IFC4")
        self._namespace = uuid.uuid5(_NAMESPACE, source)
        self._names: Counter[tuple[str, str]] = Counter()
        self._material: Entity | None = None
        self._up = self.make("IfcDirection", (0.0, 0.0, 1.0))
        self._zero = self.make("IfcAxis2Placement3D", self._point((0.0, 0.0, 0.0)))
        self.context = self.make(
            "IfcGeometricRepresentationContext",
            ContextType="Model",
            CoordinateSpaceDimension=3,
            Precision=_PRECISION,
            WorldCoordinateSystem=self._zero,
        )
        self._views = {
            name: self.make(
                "IfcGeometricRepresentationSubContext",
                ContextIdentifier=name,
                ContextType="Model",
                ParentContext=self.context,
                TargetView=view,
            )
            for name, view in _VIEWS.items()
        }
        units = [self.make("IfcSIUnit", UnitType=kind, Name=name) for kind, name in _UNITS.items()]
        self.metre = units[0]
        self.project = self.root(
            "IfcProject",
            "",
            Name="As-built plan",
            RepresentationContexts=[self.context],
            UnitsInContext=self.make("IfcUnitAssignment", units),
        )

    def write(self, path: Path, program: str) -> None:
        """Write the file; `program` is the name and version of what made it."""
        header = self._file.header
        header.file_description.description = ("ViewDefinition [DesignTransferView_V1.0]",)
        header.file_name.time_stamp = _TIME_STAMP
        header.file_name.originating_system = program
        self._file.write(str(path))

    # --- entities ---

    def make(self, kind: str, *values: Any, **attributes: Any) -> Entity:
        """An entity that others refer to."""
        return self._file.create_entity(kind, *values, **attributes)

    def root(self, kind: str, name: str, **attributes: Any) -> Entity:
        """An entity with a GUID, which comes from its kind and its name, and from its turn among those of one name."""
        self._names[kind, name] += 1
        guid = uuid.uuid5(self._namespace, f"{kind} {name} {self._names[kind, name]}")
        return self.make(kind, GlobalId=ifcopenshell.guid.compress(guid.hex), **attributes)

    def product(self, kind: str, name: str, frame: Frame, within: Placed | None = None, **attributes: Any) -> Placed:
        """An entity with a place, which is given relative to that of the entity it stands within."""
        return Placed(self.root(kind, name, ObjectPlacement=self._placement(frame, within), **attributes), frame)

    def _placement(self, frame: Frame, within: Placed | None) -> Entity:
        outer = self._world if within is None else within.frame
        along = outer.local_direction(frame.along)
        axes = () if along == (1.0, 0.0) else (self._up, self.make("IfcDirection", (*along, 0.0)))
        location = self._point((*outer.local(frame.origin), frame.z - outer.z))
        place = self.make("IfcAxis2Placement3D", location, *axes)
        return self.make("IfcLocalPlacement", None if within is None else within.entity.ObjectPlacement, place)

    # --- shapes, in the frame of the entity that has them ---

    def shapes(self, *representations: Entity | None) -> Entity | None:
        """All representations of one entity; None without any."""
        present = [one for one in representations if one is not None]
        return self.make("IfcProductDefinitionShape", None, None, present) if present else None

    def prism(self, area: Any, height: float) -> Entity | None:
        """The body that stands on an area, `height` m high; None where it would have no volume."""
        solids = [self.solid(part, height) for part in shapely.get_parts(area)]
        return self.body("SweptSolid", *(solid for solid in solids if solid is not None))

    def solid(self, polygon: Any, height: float) -> Entity | None:
        """A solid that stands on a polygon, `height` m high; None where it would have no volume."""
        polygon = shapely.remove_repeated_points(polygon, _PRECISION)
        if polygon.geom_type != "Polygon" or polygon.area < _PRECISION**2 or height < _PRECISION:
            return None
        outer, *inner = (self._polyline(ring.coords) for ring in (polygon.exterior, *polygon.interiors))
        if inner:
            return self._extruded(self.make("IfcArbitraryProfileDefWithVoids", "AREA", None, outer, inner), height)
        return self._extruded(self.make("IfcArbitraryClosedProfileDef", "AREA", None, outer), height)

    def cylinder(self, diameter: float, height: float) -> Entity | None:
        """The body of a cylinder that stands on the origin, m."""
        centre = self.make("IfcAxis2Placement2D", self._point((0.0, 0.0)))
        circle = self.make("IfcCircleProfileDef", "AREA", None, centre, float(diameter) / 2)
        return self.body("SweptSolid", self._extruded(circle, height))

    def body(self, kind: str, *solids: Entity) -> Entity | None:
        """Solids as the representation "Body"; None without any."""
        return self.make("IfcShapeRepresentation", self._views["Body"], "Body", kind, solids) if solids else None

    def lines(self, view: str, *lines: Sequence[Point]) -> Entity | None:
        """Lines on the ground as the representation "Axis" or "FootPrint"; None without any."""
        cleaned = (shapely.remove_repeated_points(shapely.LineString(line), _PRECISION) for line in lines if line[1:])
        drawn = [self._polyline(line.coords) for line in cleaned if line.length > _PRECISION]
        return self.make("IfcShapeRepresentation", self._views[view], view, "Curve2D", drawn) if drawn else None

    def plane(self, point: Sequence[float], normal: Sequence[float], along: Sequence[float]) -> Entity:
        """A plane through a point, with its normal and a direction that lies in it."""
        axes = (self.make("IfcDirection", tuple(vector)) for vector in (normal, along))
        return self.make("IfcPlane", self.make("IfcAxis2Placement3D", self._point(point), *axes))

    def _extruded(self, profile: Entity, height: float) -> Entity:
        return self.make("IfcExtrudedAreaSolid", profile, self._zero, self._up, round(float(height), _DECIMALS))

    def _polyline(self, points: Iterable[Point]) -> Entity:
        points = list(points)
        # a closed line ends in the very entity that it starts from
        made = {point: self._point(point) for point in dict.fromkeys(points)}
        return self.make("IfcPolyline", [made[point] for point in points])

    def _point(self, point: Sequence[float]) -> Entity:
        # adding 0.0 turns -0.0 into 0.0
        return self.make("IfcCartesianPoint", tuple(round(float(value), _DECIMALS) + 0.0 for value in point))

    # --- what is said of entities, and how they hang together ---

    def describe(self, entity: Entity, properties: Iterable[Property]) -> None:
        """Give an entity our set of properties."""
        made = [
            self.make("IfcPropertySingleValue", Name=key, NominalValue=self.make(measure, _plain(value)))
            for key, measure, value in properties
            if value is not None
        ]
        if made:
            self._define(entity, "IfcPropertySet", PROPERTY_SET, HasProperties=made)

    def measure(self, entity: Entity, name: str, **quantities: float | None) -> None:
        """Give an entity a set of quantities: m2 and m3 where their names end in Area and Volume, else m."""
        made = []
        for key, value in quantities.items():
            kind = next((kind for kind in ("Area", "Volume") if key.endswith(kind)), "Length")
            if value is not None:
                made.append(self.make(f"IfcQuantity{kind}", key, None, None, float(value)))
        if made:
            self._define(entity, "IfcElementQuantity", name, Quantities=made)

    def _define(self, entity: Entity, kind: str, name: str, **attributes: Any) -> None:
        definition = self.root(kind, f"{entity.GlobalId} {name}", Name=name, **attributes)
        self.relate(
            "IfcRelDefinesByProperties", definition, RelatedObjects=[entity], RelatingPropertyDefinition=definition
        )

    def layer(self, wall: Entity, thickness: float) -> None:
        """Give a wall one material layer about its axis, as thick as was measured, m; of what, no scan can tell."""
        if self._material is None:
            self._material = self.make("IfcMaterial", "not observed")
        layers = self.make("IfcMaterialLayerSet", [self.make("IfcMaterialLayer", self._material, float(thickness))])
        usage = self.make("IfcMaterialLayerSetUsage", layers, "AXIS2", "POSITIVE", -float(thickness) / 2)
        self.relate("IfcRelAssociatesMaterial", wall, RelatedObjects=[wall], RelatingMaterial=usage)

    def aggregate(self, whole: Entity, parts: Sequence[Entity]) -> None:
        """Make entities the parts of another; nothing without parts."""
        if parts:
            self.relate("IfcRelAggregates", whole, RelatingObject=whole, RelatedObjects=parts)

    def contain(self, storey: Entity, elements: Sequence[Entity]) -> None:
        """Put elements on a storey; nothing without elements."""
        if elements:
            related = {"RelatingStructure": storey, "RelatedElements": elements}
            self.relate("IfcRelContainedInSpatialStructure", storey, **related)

    def relate(self, kind: str, named_after: Entity, **attributes: Any) -> None:
        """Make a relation, which takes its GUID from that of one of the entities it joins."""
        self.root(kind, named_after.GlobalId, **attributes)


def _plain(value: Any) -> Any:
    """A number that NumPy computed, as Python's own."""
    return value.item() if hasattr(value, "item") else value
