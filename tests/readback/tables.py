"""Tables and layers of features: GeoJSON and GeoPackage by GDAL and SQLite, schedules by Python's csv and openpyxl."""

from __future__ import annotations

import csv
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pyogrio
import pyogrio.raw
import shapely

from asbuilt import FloorPlan, load_plan

MM = 0.001
KINDS = ("wall_faces", "walls", "doors", "windows", "unknown_openings", "rooms", "columns", "stairs")
LINES = KINDS[:5]


def features(path: Path, layer: str | None = None) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Geometry and attributes of each feature of a layer."""
    about, _, shapes, columns = pyogrio.raw.read(path, layer=layer)
    for i, shape in enumerate(shapes):
        geometry = None if shape is None else shapely.from_wkb(shape)
        yield geometry, {name: column[i] for name, column in zip(about["fields"], columns, strict=True)}


def elements(plan: FloorPlan, kind: str) -> list[tuple[int, Any]]:
    return [(storey.index, element) for storey in plan for element in getattr(storey, kind)]


def _check_crs(plan: FloorPlan, path: Path, layer: str | None) -> None:
    seen = pyogrio.read_info(path, layer=layer)["crs"]
    assert seen.startswith("LOCAL_CS") if plan.crs is None else not seen.startswith("LOCAL_CS")


def _check_feature(kind: str, index: int, element: Any, geometry: Any, said: dict[str, Any]) -> None:
    assert (said["storey"], said["id"]) == (index, element.id)
    shape = shapely.LineString([element.start, element.end]) if kind in LINES else shapely.Polygon(element.ring)
    assert shapely.hausdorff_distance(geometry.boundary, shape.boundary) < MM or kind == "rooms"
    if kind == "rooms":
        assert abs(geometry.area - element.area) < 1e-6
        assert abs(said["area"] - element.area) < 1e-6
        assert said["number"] == element.number


def check_geojson(plan: FloorPlan, written: tuple[Path, ...]) -> None:
    (path,) = written
    read = load_plan(path)
    assert (read.storeys, read.crs, read.inputs, read.notes) == (plan.storeys, plan.crs, plan.inputs, plan.notes)
    _check_crs(plan, path, None)
    found = list(features(path))
    assert len(found) == len(plan.storeys) + sum(len(elements(plan, kind)) for kind in KINDS)
    for kind in KINDS:
        of_kind = [(geometry, said) for geometry, said in found if said["kind"] == kind.removesuffix("s")]
        for (geometry, said), (index, element) in zip(of_kind, elements(plan, kind), strict=True):
            _check_feature(kind, index, element, geometry, said)


def check_gpkg(plan: FloorPlan, written: tuple[Path, ...]) -> None:
    (path,) = written
    with closing(sqlite3.connect(path)) as database:
        assert database.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert database.execute("PRAGMA foreign_key_check").fetchall() == []
    for kind in KINDS:
        _check_crs(plan, path, kind)
        for (geometry, said), (index, element) in zip(features(path, kind), elements(plan, kind), strict=True):
            _check_feature(kind, index, element, geometry, said)
    for (geometry, said), (_, wall) in zip(features(path, "wall_bodies"), elements(plan, "walls"), strict=True):
        assert geometry.is_valid, said["id"]
        assert abs(geometry.area - shapely.Polygon(wall.outline).area) < 1e-6
    storeys = [said["floor"] for _, said in features(path, "storeys")]
    assert storeys == [storey.floor for storey in plan]


def _check_schedule(plan: FloorPlan, kind: str, rows: Sequence[dict[str, Any]]) -> None:
    """Rows of one schedule, each by its headers; cells as text or as numbers."""
    for row, (index, element) in zip(rows, elements(plan, kind), strict=True):
        assert row["id" if kind == "rooms" else "number"] == element.id
        assert int(row["storey"]) == index
        if kind == "rooms":
            assert abs(float(row["area (m2)"]) - element.area) < 1e-3
            assert row["number"] == element.number
        elif kind == "walls":
            assert abs(float(row["length (m)"]) - element.length) < MM
            assert (row["thickness observed"] == "yes") == (element.thickness is not None)
        else:
            assert abs(float(row["width (m)"]) - element.width) < MM
            middle = (np.array(element.start) + element.end) / 2
            np.testing.assert_allclose([float(row["middle x (m)"]), float(row["middle y (m)"])], middle, atol=MM)
            assert row["wall"] == (element.wall or "") or (row["wall"], element.wall) == (None, None)


def check_csv(plan: FloorPlan, written: tuple[Path, ...]) -> None:
    for kind, path in zip(("rooms", "doors", "windows"), written, strict=True):
        with path.open(encoding="utf-8", newline="") as stream:
            _check_schedule(plan, kind, list(csv.DictReader(stream)))


def check_xlsx(plan: FloorPlan, written: tuple[Path, ...]) -> None:
    (path,) = written
    book = openpyxl.load_workbook(path)
    assert book.sheetnames == ["rooms", "doors", "windows", "walls"]
    for kind in book.sheetnames:
        headers, *rows = book[kind].iter_rows(values_only=True)
        _check_schedule(plan, kind, [dict(zip(headers, row, strict=True)) for row in rows])
