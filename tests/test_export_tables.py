"""GeoPackage, schedules, and the CRS of plan.geojson, as QGIS (GDAL), openpyxl and Python's csv read them."""

from __future__ import annotations

import csv
import dataclasses
import subprocess
import sys

import openpyxl
import pyogrio
import pytest

from asbuilt import FloorPlan, load_plan
from asbuilt.errors import OutputError
from asbuilt.export import export
from asbuilt.export.schedules import schedules
from asbuilt.plan import Room, Storey, plan_from_geojson
from plans import EAST, NORTH, complete_plan
from readback.tables import features as rows

WKT = (
    'LOCAL_CS["site grid of the works",UNIT["metre",1]]',
    'PROJCRS["mine",BASEGEOGCRS["WGS 84",DATUM["World Geodetic System 1984",ELLIPSOID["WGS 84",6378137,298.257223563]]'
    '],CONVERSION["c",METHOD["Transverse Mercator"],PARAMETER["Latitude of natural origin",0],PARAMETER["Longitude of '
    'natural origin",9],PARAMETER["Scale factor at natural origin",1],PARAMETER["False easting",0],PARAMETER["False '
    'northing",0]],CS[Cartesian,2],AXIS["(E)",east],AXIS["(N)",north],LENGTHUNIT["metre",1]]',
)


def table(path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture
def package(tmp_path):
    (path,) = export(complete_plan(), tmp_path / "plan.gpkg")
    return path


def test_geopackage_has_a_layer_for_each_kind(package):
    layers = dict(pyogrio.list_layers(package).tolist())
    lines = {"walls", "wall_faces", "doors", "windows", "unknown_openings", "stair_paths"}
    assert {name for name, shape in layers.items() if shape == "LineString"} == lines
    polygons = {"storeys", "rooms", "wall_bodies", "columns", "stairs"}
    assert {name for name, shape in layers.items() if shape == "Polygon"} == polygons
    assert {pyogrio.read_info(package, layer=name)["features"] for name in ("walls", "wall_bodies")} == {10}


def test_geopackage_keeps_places_to_the_last_bit(package):
    plan = complete_plan()
    faces = [geometry.coords[:] for geometry, _ in rows(package, "wall_faces")]
    assert faces == [[face.start, face.end] for face in plan.wall_faces]
    rooms = [geometry.exterior.coords[:-1] for geometry, _ in rows(package, "rooms")]
    assert rooms == [list(room.ring) for storey in plan for room in storey.rooms]
    (path, _), _ = rows(package, "stair_paths")
    assert path.coords[-1] == (EAST + 4.55, NORTH + 1.9)


def test_geopackage_carries_every_attribute_and_no_made_up_thickness(package):
    first, second, *_ = (attributes for _, attributes in rows(package, "walls"))
    assert (first["id"], first["storey"], first["thickness"]) == ("S0-W1", 0, 0.1)
    assert first["faces"] == "S0-F2, S0-F3, S0-F9, S0-F10"
    assert (first["length"], first["loa"], first["confidence"]) == (5.0, "LOA40", 0.95)
    assert second["thickness"] != second["thickness"]  # null comes as NaN
    assert second["drawn_thickness"] == 0.1
    (_, door), _ = rows(package, "doors")
    assert (door["state"], door["hinge"], door["swing"], door["head"]) == ("open", "start", "left", 2.01)
    room = next(attributes for _, attributes in rows(package, "rooms"))
    assert (room["number"], room["scans"]) == ("001", "scan 1, scan 2")
    assert room["area"] == pytest.approx(19.75)
    (_, opening), _ = rows(package, "unknown_openings")
    assert opening["head"] != opening["head"]
    storeys = [(attributes["storey"], attributes["floor"]) for _, attributes in rows(package, "storeys")]
    assert storeys == [(0, 112.5), (1, 115.3)]


def test_geopackage_of_a_storey_without_outline(tmp_path):
    export(FloorPlan((Storey(0, 0.0, 2.5),)), tmp_path / "plan.gpkg")
    ((geometry, attributes),) = rows(tmp_path / "plan.gpkg", "storeys")
    assert geometry is None
    assert attributes["ceiling"] == 2.5


@pytest.mark.parametrize("suffix", [".gpkg", ".geojson"])
@pytest.mark.parametrize("crs", ["EPSG:25832", *WKT])
def test_a_gis_sees_the_crs(suffix, crs, tmp_path):
    (path,) = export(complete_plan(crs=crs), tmp_path / f"plan{suffix}")
    name = {"EPSG:25832": "EPSG:25832", WKT[0]: "site grid of the works", WKT[1]: '"mine"'}[crs]
    layer = "walls" if suffix == ".gpkg" else None
    assert name in pyogrio.read_info(path, layer=layer)["crs"]


@pytest.mark.parametrize("suffix", [".gpkg", ".geojson"])
def test_a_gis_takes_a_plan_without_crs_for_metres_not_degrees(suffix, tmp_path):
    (path,) = export(complete_plan(0.0, 0.0, crs=None), tmp_path / f"plan{suffix}")
    for layer in pyogrio.list_layers(path)[:, 0]:
        seen = pyogrio.read_info(path, layer=layer)["crs"]
        assert seen.startswith("LOCAL_CS")
        assert 'UNIT["metre",1]' in seen.replace("Meter", "metre")


@pytest.mark.parametrize("crs", ["EPSG:25832", WKT[1], None])
def test_the_crs_comes_back_from_geojson_and_from_its_first_form(crs, tmp_path):
    plan = complete_plan(crs=crs)
    export(plan, tmp_path / "plan.geojson")
    assert load_plan(tmp_path / "plan.geojson") == plan
    assert plan_from_geojson({**plan.to_geojson(), "crs": crs}) == plan  # a bare name or null, as at first


def test_a_crs_that_nobody_knows_is_one_line(tmp_path):
    with pytest.raises(OutputError, match=r"^GeoPackage: the plan's CRS 'PROJCRS\[x' is not known$"):
        export(complete_plan(crs="PROJCRS[x"), tmp_path / "plan.gpkg")
    assert list(tmp_path.iterdir()) == []


def test_without_pyogrio_the_command_that_installs_it_is_named():
    script = (
        "import sys; sys.modules['pyogrio'] = None\n"
        "from asbuilt.export import check_output\n"
        "from asbuilt.errors import MissingExtraError\n"
        "try: check_output('plan.gpkg')\n"
        "except MissingExtraError as error: print(error)"
    )
    told = subprocess.check_output([sys.executable, "-c", script], text=True)
    assert told == "writing GeoPackage needs pyogrio: pip install 'asbuilt[gis]'\n"


def test_the_callers_gdal_keeps_its_own_date(tmp_path):
    before = pyogrio.get_gdal_config_option("OGR_CURRENT_DATE")
    export(complete_plan(), tmp_path / "plan.gpkg")
    assert pyogrio.get_gdal_config_option("OGR_CURRENT_DATE") == before


def test_scans_in_a_room_are_counted_only_where_positions_are_known(tmp_path):
    def counted(*scans):
        rooms = [Room(((0, 0), (4, 0), (4, 3)), scans=keys) for keys in scans]
        path, *_ = export(FloorPlan((Storey(0, 0.0, 2.5, rooms=tuple(rooms)),)), tmp_path / "plan.csv")
        return [room["scans"] for room in table(path)]

    assert counted(("one", "two"), ()) == ["2", "0"]
    assert counted((), ()) == ["", ""]


def test_csv_writes_three_schedules(tmp_path):
    written = export(complete_plan(), tmp_path / "school.csv")
    assert [path.name for path in written] == ["school_rooms.csv", "school_doors.csv", "school_windows.csv"]
    rooms, doors, windows = (table(path) for path in written)
    assert [room["number"] for room in rooms] == ["001", "002", "101", "102"]
    assert (float(rooms[1]["area (m2)"]), float(rooms[1]["clear height (m)"])) == (19.75, 2.4)
    assert (rooms[2]["finished floor level z (m)"], rooms[2]["perimeter (m)"]) == ("115.3", "17.9")
    assert (doors[0]["number"], doors[0]["width (m)"], doors[0]["wall thickness (m)"]) == ("S0-D1", "0.9", "0.1")
    assert (doors[0]["room on the left"], doors[0]["room on the right"]) == ("001", "002")
    assert (windows[0]["sill above floor (m)"], windows[0]["height (m)"]) == ("0.9", "1.2")
    assert windows[0]["wall thickness (m)"] == ""  # seen from one side: not made up
    assert (windows[0]["room on the left"], windows[0]["room on the right"]) == ("002", "")
    assert windows[0]["LOA at 95 %"] == "LOA40"


@pytest.mark.parametrize(
    ("hinge", "swing", "handing"),
    [("start", "left", "right"), ("end", "left", "left"), ("start", "right", "left"), ("end", "right", "right")],
)
def test_handing_is_that_of_who_pulls_the_door(hinge, swing, handing):
    # the line goes north; who pulls it to the left (west) stands west and looks east: north, its end, is on the left
    storey = complete_plan().storeys[0]
    door = dataclasses.replace(storey.doors[0], hinge=hinge, swing=swing)
    doors = schedules(FloorPlan((dataclasses.replace(storey, doors=(door,)),)))["doors"]
    assert dict(zip(doors.headers, doors.rows[0], strict=True))["handing (DIN 107)"] == handing


def test_text_that_csv_must_quote_comes_back(tmp_path):
    storey = complete_plan().storeys[0]
    room = dataclasses.replace(storey.rooms[0], number='Büro "A", 1.\nStock')
    written = export(FloorPlan((dataclasses.replace(storey, rooms=(room,)),)), tmp_path / "plan.csv")
    assert table(written[0])[0]["number"] == room.number


def test_xlsx_has_a_sheet_for_each_schedule_with_numbers_as_numbers(tmp_path):
    export(complete_plan(), tmp_path / "plan.xlsx")
    book = openpyxl.load_workbook(tmp_path / "plan.xlsx")
    assert book.sheetnames == ["rooms", "doors", "windows", "walls"]
    for name, schedule in schedules(complete_plan()).items():
        headers, *lines = book[name].iter_rows(values_only=True)
        assert headers == schedule.headers
        assert [tuple(cell or None for cell in line) for line in lines] == [
            tuple(cell or None for cell in row) for row in schedule.rows
        ]
    headers, first, second, *_ = book["walls"].iter_rows(values_only=True)
    thickness = headers.index("thickness (m)")
    assert (first[thickness], first[thickness + 1]) == (0.1, "yes")
    assert (second[thickness], second[thickness + 1]) == (None, "no")


def test_xlsx_takes_text_for_text(tmp_path):
    storey = complete_plan().storeys[0]
    room = dataclasses.replace(storey.rooms[0], number="=1+1")
    export(FloorPlan((dataclasses.replace(storey, rooms=(room,)),)), tmp_path / "plan.xlsx")
    cell = openpyxl.load_workbook(tmp_path / "plan.xlsx")["rooms"]["A2"]
    assert (cell.value, cell.data_type) == ("=1+1", "s")
