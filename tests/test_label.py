"""Labelled clouds: truth by construction, read back with laspy and pye57."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pye57
import pyquaternion
import pytest
import shapely

import asbuilt
from asbuilt import FloorPlan, InputError, OutputError, ParameterError
from asbuilt.export import export
from asbuilt.label import Labels, PlanLookup, PointClass, check_output, label_cloud
from asbuilt.plan import Door, Room, Storey, Wall, WallFace
from plans import EAST, NORTH, complete_plan, mapped
from readback.clouds import read_e57

FLOORS = (112.5, 115.3)
NOISE = 0.003  # m; far less than the tolerance of 0.05 m
rng = np.random.default_rng(5)


def box(x, y, z, count: int = 400) -> np.ndarray:
    """Points within intervals of the plan's own metres; a number stands for the interval of that alone."""
    sides = [side if isinstance(side, tuple) else (side, side) for side in (x, y, z)]
    return np.column_stack([rng.uniform(low, high, count) for low, high in sides])


#: What `complete_plan` is made of: points, class, and ids of wall and room ("": none, or either is right).
TRUTH = {
    "west floor": (box((0.1, 3.9), (0.1, 4.9), 0.0), PointClass.FLOOR, "", "R1"),
    "floor along the wall": (box((3.85, 3.94), (0.1, 1.9), 0.0), PointClass.FLOOR, "", "R1"),
    "west ceiling": (box((0.1, 3.9), (0.1, 4.9), 2.5), PointClass.CEILING, "", "R1"),
    "east ceiling, lower": (box((4.2, 7.9), (0.1, 4.9), 2.4), PointClass.CEILING, "", "R2"),
    "west wall": (box(0.0, (0.1, 4.9), (0.1, 2.4)), PointClass.WALL, "W5", ""),
    "one face of the partition": (box(3.95, (0.1, 1.9), (0.1, 2.4)), PointClass.WALL, "W1", ""),
    "its other face": (box(4.05, (3.0, 4.9), (0.1, 2.3)), PointClass.WALL, "W1", ""),
    "lintel": (box(3.95, (2.1, 2.8), (2.1, 2.4)), PointClass.WALL, "W1", ""),
    "shut leaf": (box(4.0, (2.05, 2.85), (0.1, 1.95)), PointClass.DOOR, "W1", ""),
    "threshold": (box((3.97, 4.03), (2.05, 2.85), 0.0), PointClass.FLOOR, "", ""),
    "pane": (box((5.05, 6.15), -0.05, (0.95, 2.05)), PointClass.WINDOW, "W2", ""),
    "parapet": (box((5.1, 6.1), 0.0, (0.1, 0.85)), PointClass.WALL, "W2", ""),
    "above the window": (box((5.1, 6.1), 0.0, (2.15, 2.3)), PointClass.WALL, "W2", ""),
    "where nobody looked through": (box(8.0, (1.1, 1.7), (0.1, 2.3)), PointClass.WALL, "W3", ""),
    "round column": (
        np.column_stack([
            6.5 + 0.175 * np.cos(np.linspace(0, 2 * np.pi, 400)),
            3.5 + 0.175 * np.sin(np.linspace(0, 2 * np.pi, 400)),
            np.linspace(0.1, 2.3, 400),
        ]),
        PointClass.COLUMN, "", "R2",
    ),
    "steps": (box((4.2, 4.95), (0.1, 1.9), (0.2, 1.5)), PointClass.STAIR, "", "R2"),
    "table": (box((2.0, 3.0), (1.0, 2.0), 0.75), PointClass.CLUTTER, "", "R1"),
    "cupboard along the wall": (box(0.3, (1.0, 2.0), (0.1, 2.0)), PointClass.CLUTTER, "", "R1"),
    "the street": (box((5.0, 6.0), (-5.0, -1.0), (0.1, 2.0)), PointClass.OUTSIDE, "", ""),
}  # fmt: skip
HERE = np.array([EAST, NORTH, FLOORS[0]])


@pytest.fixture(scope="module")
def lookup() -> PlanLookup:
    return PlanLookup(complete_plan())


def tell(lookup: PlanLookup, points: np.ndarray) -> Labels:
    return lookup.labels(*np.asarray(points, dtype=float).T)


def on_storey(points: np.ndarray, storey: int) -> np.ndarray:
    noisy = points + rng.normal(0.0, NOISE, points.shape).clip(-3 * NOISE, 3 * NOISE)
    return noisy + np.array([EAST, NORTH, FLOORS[storey]])


def named(names: tuple[str, ...], numbers: np.ndarray) -> set[str]:
    return {names[number - 1] if number else "" for number in numbers}


@pytest.mark.parametrize("storey", [0, 1])
@pytest.mark.parametrize("surface", TRUTH)
def test_every_point_of_a_surface_has_its_class_and_wall(surface, storey, lookup):
    points, kind, wall, room = TRUTH[surface]
    labels = tell(lookup, on_storey(points, storey))
    assert {PointClass(found) for found in labels.classes} == {kind}
    if wall or kind not in (PointClass.WALL, PointClass.DOOR, PointClass.WINDOW):
        assert named(lookup.walls, labels.walls) == {f"S{storey}-{wall}" if wall else ""}
    if room:
        assert named(lookup.rooms, labels.rooms) == {f"S{storey}-{room}"}


@pytest.mark.parametrize("z", [-1.0, 20.0])
def test_a_mirror_world_below_the_floor_and_the_sky_are_outside(z, lookup):
    assert set(tell(lookup, box((1.0, 3.0), (1.0, 4.0), z) + HERE).classes) == {PointClass.OUTSIDE}


def test_far_away_is_outside(lookup):
    far = np.array([[0.0, 0.0, 0.0], [1e9, -1e9, 1e9], [EAST, NORTH, -1e9], [EAST + 1e4, NORTH + 2.0, 113.0]])
    assert set(tell(lookup, far).classes) == {PointClass.OUTSIDE}


def test_no_points_and_no_plan():
    assert len(tell(PlanLookup(FloorPlan()), np.zeros((0, 3))).classes) == 0
    assert set(tell(PlanLookup(FloorPlan()), np.zeros((5, 3))).classes) == {PointClass.OUTSIDE}
    assert set(tell(PlanLookup(FloorPlan((Storey(0, 0.0, 2.5),))), np.zeros((5, 3))).classes) == {PointClass.OUTSIDE}


def test_the_same_as_geometry_says_far_from_its_borders(lookup):
    """Against brute force: the nearest wall body or column by shapely, where no border is nearer than a cell."""
    storey = complete_plan().storeys[0]
    points = np.column_stack([rng.uniform(-1, 9, 20000), rng.uniform(-1, 6, 20000), np.full(20000, 2.2)])
    points += (EAST, NORTH, storey.floor)
    places = shapely.points(points[:, :2])
    bodies = [shapely.Polygon(wall.outline) for wall in storey.walls]
    columns = [shapely.Polygon(column.ring) for column in storey.columns]
    walls = np.array([shapely.distance(places, body) for body in bodies]).min(axis=0)
    column = np.array([shapely.distance(places, body) for body in columns]).min(axis=0)
    inside = shapely.covers(shapely.Polygon(storey.outline), places)
    labels = tell(lookup, points).classes
    margin = 0.015  # half a cell's diagonal
    for kind, distance, other in ((PointClass.WALL, walls, column), (PointClass.COLUMN, column, walls)):
        assert (labels[(distance < 0.05 - margin) & (other > 0.05 + margin)] == kind).all()
        assert not (labels[distance > 0.05 + margin] == kind).any()
    free = (walls > 0.05 + margin) & (column > 0.05 + margin)
    assert set(labels[free & inside]) == {PointClass.CLUTTER}
    assert set(labels[free & ~inside]) == {PointClass.OUTSIDE}


def test_moving_and_turning_plan_and_points_changes_nothing_but_near_borders(lookup):
    points = np.concatenate([surface for surface, *_ in TRUTH.values()]) + HERE
    before = tell(lookup, points)
    angle = math.radians(28.0)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])

    def moved(place):
        return tuple((turn @ (np.array(place) - (EAST, NORTH)) + (12.345, -6.789)).tolist())

    after = tell(
        PlanLookup(mapped(complete_plan(), moved, angle)),
        np.column_stack([(points[:, :2] - (EAST, NORTH)) @ turn.T + (12.345, -6.789), points[:, 2]]),
    )
    # points lie on the faces, 5 cm from the borders of the tolerance; what rests is between jambs and at corners
    assert (before.classes == after.classes).mean() > 0.995
    assert (before.walls == after.walls).mean() > 0.995


def test_faces_and_outline_alone_are_enough():
    """The plan as the paper has it: wall faces, no rooms."""
    corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0)]
    sides = zip(corners, corners[1:] + corners[:1], strict=True)
    faces = tuple(WallFace(a, b, id=f"F{i}") for i, (a, b) in enumerate(sides))
    for outline in (tuple(corners), None):
        lookup = PlanLookup(FloorPlan((Storey(0, 0.0, 2.5, outline, faces),)))
        labels = tell(
            lookup, [(3, 0.0, 1), (6.0, 2, 1), (3, 2, 0.01), (3, 2, 2.49), (3, 2, 1), (3, -2, 1), (3, 0.03, 0)]
        )
        expected = ["wall", "wall", "floor", "ceiling", "clutter", "outside", "floor"]
        assert [PointClass(found).title for found in labels.classes] == expected
        assert named(lookup.walls, labels.walls[:2]) == {"F0", "F1"}


def test_a_hall_goes_through_the_storey_above():
    """Its upper half is the upper storey's height, where that storey has nothing."""
    hall = Room(((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)), floor=0.0, ceiling=6.0, id="hall")
    office = Room(((10.2, 0.0), (15.0, 0.0), (15.0, 10.0), (10.2, 10.0)), floor=3.0, ceiling=5.5, id="office")
    wall = Wall((0.0, 0.0), (10.0, 0.0), drawn_thickness=0.1, id="W1")
    plan = FloorPlan((Storey(0, 0.0, 2.7, rooms=(hall,), walls=(wall,)), Storey(1, 3.0, 5.5, rooms=(office,))))
    lookup = PlanLookup(plan)
    labels = tell(lookup, [(5, 5, 4.0), (5, 5, 5.99), (5, 5, 3.0), (12, 5, 3.0), (5, 0.0, 5.0), (12, 5, 1.0)])
    expected = ["clutter", "ceiling", "clutter", "floor", "wall", "outside"]
    assert [PointClass(found).title for found in labels.classes] == expected
    assert named(lookup.rooms, labels.rooms[:3]) == {"hall"}


def test_a_low_wall_ends_where_it_ends():
    outline = ((2.0, 1.95), (4.0, 1.95), (4.0, 2.05), (2.0, 2.05))
    wall = Wall((2.0, 2.0), (4.0, 2.0), 0.1, 0.1, outline=outline, height=1.2, id="W1")
    room = Room(((0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0)), floor=0.0, ceiling=2.5)
    lookup = PlanLookup(FloorPlan((Storey(0, 0.0, 2.5, walls=(wall,), rooms=(room,)),)))
    labels = tell(lookup, [(3, 2.05, 1.1), (3, 2.05, 1.4)])
    assert [PointClass(found).title for found in labels.classes] == ["wall", "clutter"]


def test_a_door_without_known_wall_or_head():
    door = Door((2.0, 0.0), (3.0, 0.0), id="D1")
    lookup = PlanLookup(FloorPlan((Storey(0, 0.0, 2.5, doors=(door,)),)))
    assert PointClass(tell(lookup, [(2.5, 0.0, 1.0)]).classes[0]) is PointClass.DOOR


@pytest.mark.parametrize("tolerance", [0.0, -0.1, 2.0, float("nan")])
def test_a_tolerance_out_of_range_is_told(tolerance):
    with pytest.raises(ParameterError, match="tolerance is"):
        PlanLookup(complete_plan(), tolerance)


# ---- files ----


WAVEFORM = {*laspy.PointFormat(5).dimension_names} - {*laspy.PointFormat(3).dimension_names}


def surfaces() -> tuple[np.ndarray, np.ndarray]:
    """All points of the truth and their classes."""
    points = np.concatenate([on_storey(points, 0) for points, *_ in TRUTH.values()])
    return points, np.concatenate([np.full(len(points), kind) for points, kind, *_ in TRUTH.values()])


def write_las(path: Path, points: np.ndarray, point_format: int = 7, version: str = "1.4", scale=0.0001) -> Path:
    las = laspy.create(point_format=point_format, file_version=version)
    las.header.scales, las.header.offsets = [scale] * 3, [EAST, NORTH, 0.0]
    las.add_extra_dim(laspy.ExtraBytesParams("amplitude", "float32", "of the return"))
    las.x, las.y, las.z = points.T
    numbers = np.arange(len(points))
    las.intensity, las.point_source_id, las.amplitude = numbers % 65536, numbers % 17, numbers / 7
    las.classification[:] = 3
    las.return_number, las.number_of_returns = numbers % 4 + 1, np.full(len(points), 4)
    if "gps_time" in las.point_format.dimension_names:
        las.gps_time = numbers * 0.5
    if "red" in las.point_format.dimension_names:
        las.red, las.green, las.blue = numbers % 65536, numbers % 3, numbers % 5
    las.write(path)
    return path


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize(
    ("point_format", "version"), [(0, "1.2"), (1, "1.2"), (3, "1.2"), (5, "1.3"), (6, "1.4"), (8, "1.4")]
)
def test_las_keeps_all_it_carried_and_gets_classes(point_format, version, suffix, tmp_path):
    points, truth = surfaces()
    source = write_las(tmp_path / f"in{suffix}", points, point_format, version)
    out = tmp_path / f"out{suffix}"
    counts = label_cloud(asbuilt.read(source), complete_plan(), out)
    before, after = laspy.read(source), laspy.read(out)
    assert (after.header.version.minor, after.header.point_format.id in (6, 7, 8)) == (4, True)
    assert after.header.are_points_compressed == (suffix == ".laz")
    names = set(before.point_format.dimension_names) - {"classification", "scan_angle_rank"} - WAVEFORM
    assert names <= set(after.point_format.dimension_names)
    for name in names:
        np.testing.assert_array_equal(np.asarray(before[name]), np.asarray(after[name]), err_msg=name)
    np.testing.assert_array_equal(np.asarray(after.classification), truth)
    assert counts == {kind: int((truth == kind).sum()) for kind in PointClass}


def test_las_says_what_the_numbers_mean(tmp_path):
    points, truth = surfaces()
    label_cloud(asbuilt.read(write_las(tmp_path / "in.las", points)), complete_plan(), tmp_path / "out.laz")
    las = laspy.read(tmp_path / "out.laz")
    names = json.loads(next(vlr for vlr in las.header.vlrs if vlr.user_id == "asbuilt").record_data)
    walls = np.asarray(las["wall"])
    start = sum(len(surface) for surface, *_ in list(TRUTH.values())[: list(TRUTH).index("its other face")])
    assert {names["wall"][number - 1] for number in walls[start : start + 400]} == {"S0-W1"}
    assert {names["room"][number - 1] for number in np.asarray(las["room"])[:400]} == {"S0-R1"}
    assert (walls[truth == PointClass.FLOOR] == 0).all()
    (lookup,) = las.header.vlrs.get("ClassificationLookupVlr")
    assert lookup.lookups == {int(kind): kind.title for kind in PointClass}
    assert str(las.header.creation_date) == str(laspy.read(tmp_path / "in.las").header.creation_date)


def test_the_same_input_gives_the_same_bytes(tmp_path):
    source = write_las(tmp_path / "in.laz", surfaces()[0])
    for name in ("a.laz", "b.laz"):
        label_cloud(asbuilt.read(source), complete_plan(), tmp_path / name)
    assert (tmp_path / "a.laz").read_bytes() == (tmp_path / "b.laz").read_bytes()


def test_labelling_twice_changes_nothing(tmp_path):
    source = write_las(tmp_path / "in.las", surfaces()[0])
    label_cloud(asbuilt.read(source), complete_plan(), tmp_path / "once.las")
    label_cloud(asbuilt.read(tmp_path / "once.las"), complete_plan(), tmp_path / "twice.las")
    once, twice = laspy.read(tmp_path / "once.las"), laspy.read(tmp_path / "twice.las")
    assert once.point_format == twice.point_format
    np.testing.assert_array_equal(once.points.array, twice.points.array)


def test_several_files_of_different_kinds_become_one(tmp_path, monkeypatch):
    from asbuilt.label import las as writer

    monkeypatch.setattr(writer, "_CHUNK", 1000)  # many chunks
    points, truth = surfaces()
    parts = np.array_split(np.arange(len(points)), 3)
    write_las(tmp_path / "a.las", points[parts[0]], 1, "1.2", 0.001)
    write_las(tmp_path / "b.laz", points[parts[1]], 7, "1.4", 0.0001)
    np.savetxt(tmp_path / "c.xyz", points[parts[2]], fmt="%.4f")
    cloud = asbuilt.read(*(tmp_path / name for name in ("a.las", "b.laz", "c.xyz")))
    label_cloud(cloud, complete_plan(), tmp_path / "out.laz")
    las = laspy.read(tmp_path / "out.laz")
    np.testing.assert_allclose(las.xyz[parts[0]], points[parts[0]], atol=0.00051)
    np.testing.assert_allclose(las.xyz[parts[1]], points[parts[1]], atol=0.000051)
    np.testing.assert_allclose(las.xyz[parts[2]], points[parts[2]], atol=0.000051)
    np.testing.assert_array_equal(np.asarray(las.classification), truth)
    assert las.header.point_format.id == 7
    np.testing.assert_array_equal(np.asarray(las.intensity)[parts[1]], np.arange(len(parts[1])))
    assert set(np.asarray(las.point_source_id)[parts[2]]) == {1}


def test_the_plan_of_another_building_is_told(run, tmp_path):
    points, _ = surfaces()
    away = points + np.array([40.0, 0.0, 0.0])
    own = write_las(tmp_path / "own.las", points)
    yard = write_las(tmp_path / "yard.las", np.concatenate([points, away]))

    def told(scan: Path, made_from: Path, *options: str) -> str:
        about = {"name": "scan", "size": 1, "checksum": asbuilt.read(made_from).files[0].checksum()}
        export(replace(complete_plan(), inputs=(about,)), tmp_path / "plan.geojson")
        command = ("label", scan, "--plan", tmp_path / "plan.geojson", "-o", tmp_path / "labelled.las", *options)
        code, _, err = run(*command)
        assert code == 0
        return err

    assert told(own, yard) == ""
    assert told(yard, yard) == ""  # its own, though half of it is outdoors
    assert "% of the points are outside: " in told(yard, own)
    assert "% of the points are outside: " in told(own, own, "--unit", "ft")


def test_units_and_axes_are_for_looking_up_only(tmp_path):
    points, truth = surfaces()
    local = points - (EAST, NORTH, 0.0)
    millimetres = local[:, [0, 2, 1]] * (1000, 1000, -1000)  # y up
    np.savetxt(tmp_path / "in.xyz", millimetres, fmt="%.3f")
    cloud = asbuilt.read(tmp_path / "in.xyz", unit="mm", up="y")
    label_cloud(cloud, complete_plan(0.0, 0.0), tmp_path / "out.las")
    las = laspy.read(tmp_path / "out.las")
    np.testing.assert_allclose(las.xyz, millimetres, atol=0.051)
    np.testing.assert_array_equal(np.asarray(las.classification), truth)


def test_the_crs_goes_with_it(tmp_path):
    wkt = (
        'PROJCS["ETRS89 / UTM zone 32N",GEOGCS["ETRS89",DATUM["D",SPHEROID["GRS 1980",6378137,298.257222101]],'
        'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],UNIT["metre",1]]'
    )
    source = write_las(tmp_path / "in.las", surfaces()[0])
    las = laspy.read(source)
    las.header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(wkt))
    las.header.global_encoding.wkt = True
    las.write(source)
    label_cloud(asbuilt.read(source), complete_plan(), tmp_path / "out.laz")
    assert asbuilt.read(tmp_path / "out.laz").crs == wkt


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="asks Linux for the peak of memory")
def test_points_are_never_held_as_a_whole(tmp_path):
    """Ten times the points take the same memory."""
    points = np.tile(surfaces()[0], (20, 1))
    export(complete_plan(), tmp_path / "plan.geojson")
    peaks = []
    for times in (1, 10):
        las = laspy.create(point_format=6, file_version="1.4")
        las.header.scales, las.header.offsets = [0.0001] * 3, [EAST, NORTH, 0.0]
        las.x, las.y, las.z = np.tile(points, (times, 1)).T
        las.write(tmp_path / "in.las")
        script = (
            "import asbuilt\nfrom asbuilt.label import label_cloud, las\nlas._CHUNK = 2**15\n"
            f"label_cloud(asbuilt.read({str(tmp_path / 'in.las')!r}), "
            f"asbuilt.load_plan({str(tmp_path / 'plan.geojson')!r}), {str(tmp_path / 'out.las')!r})\n"
            "print(next(line.split()[1] for line in open('/proc/self/status') if line.startswith('VmHWM')))"
        )
        peaks.append(int(subprocess.check_output([sys.executable, "-c", script])))
    assert peaks[1] < peaks[0] + 15_000  # KiB; the points alone would take 50 MB more


# ---- what can go wrong ----


def test_a_file_cut_short_is_one_line_and_leaves_nothing(tmp_path):
    source = write_las(tmp_path / "in.laz", surfaces()[0])
    cloud = asbuilt.read(source)
    source.write_bytes(source.read_bytes()[:-30000])
    with pytest.raises(InputError) as caught:
        label_cloud(cloud, complete_plan(), tmp_path / "out.laz")
    assert str(source) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == ["in.laz"]


def test_an_input_is_not_written_over(tmp_path):
    source = write_las(tmp_path / "in.las", surfaces()[0])
    content = source.read_bytes()
    with pytest.raises(OutputError, match="is one of the inputs"):
        label_cloud(asbuilt.read(source), complete_plan(), source)
    assert source.read_bytes() == content


def test_files_too_far_apart_for_one_las_are_told(tmp_path):
    a = write_las(tmp_path / "a.las", surfaces()[0], scale=0.00001)
    np.savetxt(tmp_path / "b.xyz", surfaces()[0] + 1e6, fmt="%.4f")
    with pytest.raises(InputError, match=r"b\.xyz: points .* label it by itself"):
        label_cloud(asbuilt.read(a, tmp_path / "b.xyz"), complete_plan(), tmp_path / "out.las")


# ---- E57 ----


def write_e57(path: Path, points: np.ndarray) -> Path:
    """Two scans at different places, the second turned, with colours, intensity, rows and invalid returns."""
    with_poses = pye57.E57(str(path), mode="w")
    for i, part in enumerate(np.array_split(points, 2)):
        translation = np.array([EAST + 2.0 + i, NORTH + 2.5, FLOORS[0] + 1.5])
        rotation = pyquaternion.Quaternion(axis=[0, 0, 1], degrees=33.0 * i)
        local = (part - translation) @ rotation.rotation_matrix
        numbers = np.arange(len(part))
        data = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), local.T, strict=True))
        data |= {"intensity": (numbers / len(part)).astype(np.float32)}
        data |= {f"color{name}": (numbers % 256).astype(np.uint8) for name in ("Red", "Green", "Blue")}
        data |= {"rowIndex": numbers.astype(np.int32) % 50, "columnIndex": numbers.astype(np.int32) // 50}
        data |= {"cartesianInvalidState": (numbers % 10 == 0).astype(np.int8)}
        with_poses.write_scan_raw(data, name=f"setup {i}", rotation=rotation.elements, translation=translation)
    with_poses.close()
    return path


def test_e57_keeps_scans_poses_and_fields_and_gets_classes(tmp_path, monkeypatch):
    from asbuilt.label import e57 as writer

    monkeypatch.setattr(writer, "_CHUNK", 1000)  # many chunks
    points, truth = surfaces()
    source = write_e57(tmp_path / "in.e57", points)
    counts = label_cloud(asbuilt.read(source), complete_plan(), tmp_path / "out.e57")
    before, after = read_e57(source), read_e57(tmp_path / "out.e57")
    assert len(after) == 2
    for old, new, expected in zip(before, after, np.array_split(truth, 2), strict=True):
        np.testing.assert_array_equal(new.rotation, old.rotation)
        np.testing.assert_array_equal(new.translation, old.translation)
        assert (new.name, new.guid) == (old.name, old.guid)
        fields, found = old.fields, new.fields
        assert list(found) == [*fields, "asbuilt:class", "asbuilt:wall", "asbuilt:room"]
        for name, values in fields.items():
            np.testing.assert_array_equal(found[name], values, err_msg=name)
        valid = fields["cartesianInvalidState"] == 0
        # coordinates of single precision are off by micrometres
        np.testing.assert_array_equal(found["asbuilt:class"][valid], expected[valid])
        assert set(found["asbuilt:class"][~valid]) == {PointClass.OUTSIDE}
        assert not found["asbuilt:wall"][~valid].any()
    assert sum(counts.values()) == sum(int((scan.fields["cartesianInvalidState"] == 0).sum()) for scan in before)
    with pye57.E57(str(tmp_path / "out.e57")) as out:
        names = json.loads(out.root["asbuilt:names"].value())
    assert names["wall"][0] == "S0-W1"


def test_e57_is_read_by_programs_that_know_nothing_of_classes(tmp_path):
    points, _ = surfaces()
    label_cloud(asbuilt.read(write_e57(tmp_path / "in.e57", points)), complete_plan(), tmp_path / "out.e57")
    with pye57.E57(str(tmp_path / "out.e57")) as out:
        scan = out.read_scan(1, intensity=True, colors=True)
    expected = np.array_split(points, 2)[1]
    expected = expected[np.arange(len(expected)) % 10 != 0]
    found = np.column_stack([scan[f"cartesian{axis}"] for axis in "XYZ"])
    np.testing.assert_allclose(found, expected, atol=2e-6)
    assert asbuilt.read(tmp_path / "out.e57").points == len(points)


def test_e57_twice_is_the_same_file(tmp_path):
    source = write_e57(tmp_path / "in.e57", surfaces()[0])
    for name in ("a.e57", "b.e57"):
        label_cloud(asbuilt.read(source), complete_plan(), tmp_path / name)
    assert (tmp_path / "a.e57").read_bytes() == (tmp_path / "b.e57").read_bytes()
    label_cloud(asbuilt.read(tmp_path / "a.e57"), complete_plan(), tmp_path / "again.e57")
    for once, twice in zip(read_e57(tmp_path / "a.e57"), read_e57(tmp_path / "again.e57"), strict=True):
        assert once.fields.keys() == twice.fields.keys()
        for name, values in once.fields.items():
            np.testing.assert_array_equal(values, twice.fields[name], err_msg=name)


FIXTURES = sorted((Path(__file__).parent / "data").glob("e57_*.e57"))


@pytest.mark.parametrize("source", FIXTURES, ids=lambda path: path.stem)
def test_e57_of_every_kind_is_told_as_its_points_are(source, tmp_path):
    """Two ways to the coordinates: libE57 with our poses and spheres, and our own reader."""
    cloud = asbuilt.read(source)
    if cloud.points == 0:
        label_cloud(cloud, FloorPlan(), tmp_path / "out.e57")
        assert asbuilt.read(tmp_path / "out.e57").points == 0
        return
    points = np.concatenate(list(cloud))
    here = points[np.linalg.norm(points - points[-1], axis=1) < 1000.0]  # some have scans in Africa and in Europe
    (x0, y0, z0), (x1, y1, z1) = here.min(axis=0), here.max(axis=0)
    middle = (x0 + x1) / 2
    room = Room(((x0, y0), (middle, y0), (middle, y1), (x0, y1)), floor=z0, ceiling=z1, id="R1")
    plan = FloorPlan((Storey(0, z0, z1, rooms=(room,), walls=(Wall((x0, y0), (x1, y1), id="W1"),)),))
    expected = np.bincount(tell(PlanLookup(plan), points).classes, minlength=256)
    counts = label_cloud(cloud, plan, tmp_path / "out.e57")
    assert counts == {kind: expected[kind] for kind in PointClass}
    assert len([kind for kind, count in counts.items() if count]) >= 2
    np.testing.assert_array_equal(np.concatenate(list(asbuilt.read(tmp_path / "out.e57"))), points)


def test_las_becomes_one_scan_and_ptx_as_many_as_it_has(tmp_path):
    points, truth = surfaces()
    label_cloud(asbuilt.read(write_las(tmp_path / "in.las", points)), complete_plan(), tmp_path / "las.e57")
    (scan,) = read_e57(tmp_path / "las.e57")
    np.testing.assert_array_equal(scan.fields["asbuilt:class"], truth)
    found = np.column_stack([scan.fields[f"cartesian{axis}"] for axis in "XYZ"]) + scan.translation
    np.testing.assert_allclose(found, points, atol=0.000101)
    places = [(EAST + 2.0, NORTH + 2.5, 114.0), (EAST + 6.0, NORTH + 2.5, 114.0)]
    with (tmp_path / "in.ptx").open("w") as stream:
        for place, part in zip(places, np.array_split(points, 2), strict=True):
            stream.write(f"{len(part)}\n1\n{' '.join(map(str, place))}\n1 0 0\n0 1 0\n0 0 1\n")
            stream.write("1 0 0 0\n0 1 0 0\n0 0 1 0\n" + " ".join(map(str, place)) + " 1\n")
            np.savetxt(stream, np.column_stack([part - place, np.full(len(part), 0.5)]), fmt="%.5f")
    label_cloud(asbuilt.read(tmp_path / "in.ptx"), complete_plan(), tmp_path / "ptx.e57")
    scans = read_e57(tmp_path / "ptx.e57")
    assert [tuple(scan.translation) for scan in scans] == places
    np.testing.assert_array_equal(np.concatenate([scan.fields["asbuilt:class"] for scan in scans]), truth)


def test_an_e57_cut_short_is_one_line_and_leaves_nothing(tmp_path):
    source = write_e57(tmp_path / "in.e57", surfaces()[0])
    cloud = asbuilt.read(source)
    content = bytearray(source.read_bytes())
    content[3000:60000] = bytes(57000)
    source.write_bytes(content)
    with pytest.raises(InputError) as caught:
        label_cloud(cloud, complete_plan(), tmp_path / "out.e57")
    assert str(source) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == ["in.e57"]


@pytest.mark.parametrize("library", ["laspy", "pye57"])
def test_without_its_library_the_command_that_installs_it_is_named(library):
    suffix = ".las" if library == "laspy" else ".e57"
    script = (
        f"import sys; sys.modules[{library!r}] = None\n"
        "from asbuilt.label import check_output\nfrom asbuilt.errors import MissingExtraError\n"
        f"try: check_output('out{suffix}')\nexcept MissingExtraError as error: print(error)"
    )
    assert "pip install 'asbuilt[label]'" in subprocess.check_output([sys.executable, "-c", script], text=True)


@pytest.mark.parametrize("name", ["out.docx", "absent/out.las", "folder.laz"])
def test_a_place_that_cannot_be_written_is_found_before_any_work(name, tmp_path):
    (tmp_path / "folder.laz").mkdir()
    with pytest.raises(OutputError):
        check_output(tmp_path / name)
