"""Building models: IFC by IfcOpenShell, the challenge's forms by a JSON parser."""

from __future__ import annotations

import itertools
import json
import warnings
from pathlib import Path
from typing import Any
from unittest import mock

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element
import ifcopenshell.util.geolocation
import ifcopenshell.util.placement
import ifcopenshell.util.shape
import ifcopenshell.validate
import numpy as np
import shapely

from asbuilt import FloorPlan, Storey

MM = 0.001


def complaints(path: Path) -> list[Any]:
    """What IfcOpenShell's validator has to say of a file, by the schema and its express rules.

    It has pytest word what breaks a rule, which takes seconds to make ready; so that is done only where a rule is
    broken, which without it is an error that has no words.
    """
    names = (
        "compare_instances_by_value",
        "unpack_non_aggregate_inverses",
    )  # which that error leaves as rules need them
    settings = mock.patch.multiple(ifcopenshell.settings, **{n: getattr(ifcopenshell.settings, n) for n in names})
    try:
        with mock.patch("_pytest.assertion.rewrite.rewrite_asserts"), settings:
            return _complaints(path)
    except IndexError:
        return _complaints(path)


def _complaints(path: Path) -> list[Any]:
    logger = ifcopenshell.validate.json_logger()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # it leaves the file of its own rules open
        ifcopenshell.validate.validate(str(path), logger, express_rules=True)
    return logger.statements


def check_ifc(plan: FloorPlan, written: tuple[Path, ...]) -> None:
    (path,) = written
    assert complaints(path) == []
    model = ifcopenshell.open(str(path))
    assert bool(model.by_type("IfcMapConversion")) == (plan.crs is not None)
    storeys = sorted(model.by_type("IfcBuildingStorey"), key=lambda storey: storey.Elevation)
    assert [storey.Elevation for storey in storeys] == [storey.floor for storey in plan]
    for storey, entity in zip(plan, storeys, strict=True):
        _check_storey(storey, _Entities(model, entity))


class _Entities:
    """What a storey of a model holds, and where that is in the frame of the map."""

    def __init__(self, model: Any, storey: Any) -> None:
        self.model = model
        self.all = ifcopenshell.util.element.get_decomposition(storey)
        self.settings = ifcopenshell.geom.settings()
        self.settings.set("use-world-coords", True)
        self.settings.set("disable-opening-subtractions", True)

    def of(self, kind: str) -> dict[str, Any]:
        return {entity.Tag: entity for entity in self.all if entity.is_a(kind)}

    def on_map(self, points: Any) -> Any:
        to_map = ifcopenshell.util.geolocation.auto_xyz2enh
        return np.array([to_map(self.model, *point) for point in np.asarray(points, dtype=float).tolist()])

    def corners(self, entity: Any) -> Any:
        shape = ifcopenshell.geom.create_shape(self.settings, entity)
        return self.on_map(ifcopenshell.util.shape.get_vertices(shape.geometry))

    def volume(self, entity: Any) -> float:
        return float(ifcopenshell.util.shape.get_volume(ifcopenshell.geom.create_shape(self.settings, entity).geometry))

    def axis(self, entity: Any) -> Any:
        place = ifcopenshell.util.placement.get_local_placement(entity.ObjectPlacement)
        (line,) = (shape for shape in entity.Representation.Representations if shape.RepresentationIdentifier == "Axis")
        points = [(place @ (*point.Coordinates, 0.0, 1.0))[:3] for point in line.Items[0].Points]
        return self.on_map(points)[:, :2]


def _check_storey(storey: Storey, found: _Entities) -> None:
    walls = found.of("IfcWall")
    straight = [wall for wall in storey.walls if wall.curve is None]
    assert len(walls) == len(straight) + len({wall.curve for wall in storey.walls} - {None})
    for wall in straight:
        axis, corners = found.axis(walls[wall.id]), found.corners(walls[wall.id])
        np.testing.assert_allclose(axis, [wall.start, wall.end], atol=MM)
        assert (ifcopenshell.util.element.get_material(walls[wall.id]) is not None) == (wall.thickness is not None)
        _same_box(corners, np.array(wall.outline))
        top = storey.ceiling if wall.height is None else storey.floor + wall.height
        np.testing.assert_allclose([corners[:, 2].min(), corners[:, 2].max()], [storey.floor, top], atol=MM)
    for curve in {wall.curve for wall in storey.walls} - {None}:
        pieces = [wall for wall in storey.walls if wall.curve == curve]
        ends = [point for piece in pieces for point in (piece.start, piece.end)]
        distance = shapely.distance(shapely.LineString(found.axis(walls[pieces[0].id])), shapely.points(ends))
        assert distance.max() < MM
    leaves = {door.id: door for door in storey.doors if door.state != "cased"}
    curved = {wall.id for wall in storey.walls if wall.curve is not None}
    assert found.of("IfcDoor").keys() == leaves.keys()
    assert found.of("IfcWindow").keys() == {window.id for window in storey.windows}
    gaps = {gap.id for gap in storey.unknown_openings}
    assert gaps <= found.of("IfcBuildingElementProxy").keys()
    for opening in (*leaves.values(), *storey.windows):
        entity = found.of("IfcDoor" if opening.id in leaves else "IfcWindow")[opening.id]
        if opening.wall in {wall.id for wall in storey.walls} - curved:
            assert len(entity.FillsVoids) == 1, opening.id
            assert abs(entity.OverallWidth - opening.width) < MM, opening.id
        (x1, y1), (x2, y2) = opening.start, opening.end
        along = np.array([x2 - x1, y2 - y1]) / opening.width
        reach = (found.corners(entity)[:, :2] - (x1, y1)) @ along
        lag = 0.1 * opening.width if opening.wall in curved else MM
        np.testing.assert_allclose([reach.min(), reach.max()], [0.0, opening.width], atol=lag)
    spaces = {space.Name: space for space in found.all if space.is_a("IfcSpace")}
    assert len(spaces) == len(storey.rooms)
    for room in storey.rooms:
        space = spaces[room.number or room.id]
        corners = found.corners(space)
        assert abs(found.volume(space) / np.ptp(corners[:, 2]) - room.area) < 1e-3
        _same_box(corners, np.array(room.ring))
    assert len(found.of("IfcColumn")) == len(storey.columns)
    for column in storey.columns:
        middle = found.corners(found.of("IfcColumn")[column.id]).mean(axis=0)[:2]
        np.testing.assert_allclose(middle, column.centre, atol=MM)
    assert len(found.of("IfcStair")) == len(storey.stairs)
    slabs = list(found.of("IfcSlab").values())
    assert len(slabs) == bool(storey.outline)
    for slab in slabs:
        thickness = np.ptp(found.corners(slab)[:, 2])
        assert abs(found.volume(slab) / thickness - shapely.Polygon(storey.outline).area) < 1e-2


def _same_box(corners: Any, ring: Any) -> None:
    np.testing.assert_allclose(corners[:, :2].min(axis=0), ring.min(axis=0), atol=MM)
    np.testing.assert_allclose(corners[:, :2].max(axis=0), ring.max(axis=0), atol=MM)


def check_2d(plan: FloorPlan, written: tuple[Path, ...]) -> None:
    for storey, path in zip(plan, written, strict=True):
        data = json.loads(path.read_text(encoding="utf-8"))
        layers = [data[f"layer {i}"] for i in range(data["header"]["layer number"])]
        assert len(data) == 1 + len(layers)
        assert [len(layer["points"]) for layer in layers] == data["header"]["structure number"]
        lines = {layer["layer name"]: [_points(structure) for structure in layer["points"]] for layer in layers}
        doors = [door for door in storey.doors if door.state != "cased"]
        for name, elements in (("A_WALL", storey.wall_faces), ("A_DOOR", doors)):
            for line, element in zip(lines[name], elements, strict=True):
                np.testing.assert_allclose(line, [element.start, element.end], atol=MM)
        for line, column in zip(lines["A_COLUMN"], storey.columns, strict=True):
            np.testing.assert_allclose(line[:-1].mean(axis=0), column.centre, atol=MM)


def _points(structure: dict[str, Any]) -> Any:
    points = np.array(structure["coordinates"]).reshape(-1, 2)
    assert len(points) == structure["point number"]
    return points


def check_3d(plan: FloorPlan, written: tuple[Path, ...]) -> None:
    (path,) = written
    data = json.loads(path.read_text(encoding="utf-8"))
    walls = [(storey, wall) for storey in plan for wall in storey.walls]
    for box, (storey, wall) in zip(data["walls"], walls, strict=True):
        ends = [(*wall.start, storey.floor), (*wall.end, storey.floor)]
        np.testing.assert_allclose([box["start_pt"], box["end_pt"]], ends, atol=MM)
        assert abs(box["width"] - wall.drawn_thickness) < MM
    doors = [(storey, door) for storey in plan for door in storey.doors if door.state != "cased"]
    for box, (_, door) in zip(data["doors"], doors, strict=True):
        turn = np.radians(box["rotation"])
        half = box["width"] / 2 * np.array([np.cos(turn), np.sin(turn)])
        ends = [box["loc"][:2] - half, box["loc"][:2] + half]
        np.testing.assert_allclose(ends, [door.start, door.end], atol=MM)
    columns = itertools.chain.from_iterable(storey.columns for storey in plan)
    for box, column in zip(data["columns"], columns, strict=True):
        np.testing.assert_allclose(box["loc"][:2], column.centre, atol=MM)
        np.testing.assert_allclose([box["width"], box["depth"]], [column.width, column.depth], atol=MM)
