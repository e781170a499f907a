"""Rooms of known plans: their rings, areas, heights and numbers, and what parts one from the next."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from asbuilt import evidence_from_points, extract_floor_plan
from asbuilt.elevations import Elevations, draw_elevations
from asbuilt.faces import Face
from asbuilt.plan import Door, Point, Room, Storey, Wall
from asbuilt.profiles import StoreyVoxels, storey_voxels
from asbuilt.rooms import close_openings, continue_circles, find_outline, find_rooms, measure_rooms
from asbuilt.storeys import find_storeys
from rooms import box, box_room, evidence, level, noisy, turned, wall, walls, without

Array = NDArray[np.float64]
LEVEL = 0.003
"""Heights are off by no more, m."""


def planned(*parts: Array) -> Storey:
    return extract_floor_plan(evidence(*parts)).storeys[0]


def two_rooms(x0: float, x1: float, head: float) -> Array:
    """Rooms of 5 by 3 m and 5 by 2.5 m and a doorway between, with its reveals."""
    points = np.concatenate([box_room(0, 0, 5, 3), box_room(0, 3.2, 5, 5.7)])
    points = without(points, (x0, 2.9, 0.001), (x1, 3.3, head - 0.001))
    lintel = [level(x0, 3, x1, 3.2, head)] if head < 2.6 else []
    return np.concatenate(
        [points, *lintel, level(x0, 3, x1, 3.2, 0), *(wall((x, 3), (x, 3.2), 0, head) for x in (x0, x1))]
    )


def overlap(room: Room, ring: Sequence[Point]) -> float:
    """Intersection over union of a room with a true ring."""
    found, true = shapely.Polygon(room.ring), shapely.Polygon(ring)
    return float(found.intersection(true).area / found.union(true).area)


def test_a_room_to_the_millimetre() -> None:
    [room] = planned(box_room(0, 0, 5, 4)).rooms
    assert room.area == pytest.approx(20, abs=2 * 9 * 0.001)  # each wall within a millimetre
    assert room.perimeter == pytest.approx(18, abs=0.008)
    assert len(room.ring) == 4
    assert shapely.LinearRing(room.ring).is_ccw
    assert (room.id, room.number) == ("S0-R1", "001")
    assert room.height == pytest.approx(2.6, abs=LEVEL)


@pytest.mark.parametrize("head", [2.05, 2.6])
def test_a_door_parts_two_rooms_with_a_lintel_and_without(head: float) -> None:
    found = planned(two_rooms(2.0, 2.9, head)).rooms
    assert sorted(room.area for room in found) == pytest.approx([12.5, 15.0], abs=0.01)


def test_a_wide_opening_under_a_beam_is_one_room() -> None:
    # not on the voxels' own planes: a floor that lies half in one layer of voxels, half in the next is seen less
    [room] = planned(np.add(two_rooms(0.7, 4.3, 2.2), (0.01, 0.01, 0.02))).rooms
    assert room.area == pytest.approx(15 + 12.5 + 0.2 * 3.6, abs=0.1)


def test_rooms_with_a_slit_between_them_are_two() -> None:
    # 0.25 m wide and up to the ceiling: nobody passes there
    storey = planned(two_rooms(2, 2.25, 2.6))
    assert [room.area for room in storey.rooms] == pytest.approx([15, 12.5], abs=0.1)


@pytest.mark.parametrize("degrees", [0.0, 33.0])
def test_an_l_shaped_room_is_one(degrees: float) -> None:
    ring = [(0.0, 0.0), (6.0, 0.0), (6.0, 2.0), (2.5, 2.0), (2.5, 4.5), (0.0, 4.5)]
    flat = [
        level(x0, y0, x1, y1, z) for x0, y0, x1, y1 in ((0.0, 0.0, 6.0, 2.0), (0.0, 2.0, 2.5, 4.5)) for z in (0.0, 2.6)
    ]
    far = np.array([340.0, -120.0, 52.0])
    points = turned(np.concatenate([walls(ring), *flat]), degrees, far)
    [room] = planned(points).rooms
    true = turned(np.column_stack([ring, np.zeros(len(ring))]), degrees, far)[:, :2]
    assert overlap(room, [(float(x), float(y)) for x, y in true]) > 0.998
    assert len(room.ring) == 6
    assert room.area == pytest.approx(12 + 6.25, abs=0.025)
    assert room.floor == pytest.approx(52.0, abs=LEVEL)
    assert room.ceiling == pytest.approx(54.6, abs=LEVEL)


def test_each_room_has_a_ceiling_of_its_own() -> None:
    low, high = box_room(0, 0, 4, 3, high=2.3), box_room(4.2, 0, 8, 3, high=2.9)
    found = planned(low, high).rooms
    assert [room.height for room in found] == pytest.approx([2.3, 2.9], abs=LEVEL)
    assert [room.number for room in found] == ["001", "002"]  # from west to east


def test_a_room_some_steps_up_under_a_lower_ceiling_is_one() -> None:
    hall, up = planned(box_room(0, 0, 8, 6, 0, 3.6), box_room(8.2, 0, 12, 6, 0.45, 2.8)).rooms
    assert (hall.floor, hall.ceiling) == pytest.approx((0, 3.6), abs=LEVEL)
    assert (up.floor, up.ceiling) == pytest.approx((0.45, 2.8), abs=LEVEL)


def test_a_hidden_corner_closes() -> None:
    wardrobe = box(0, 0, 0.6, 0.6, 2.2)
    seen = wardrobe[(wardrobe[:, :2] > 0.001).all(axis=1)]
    [room] = planned(without(box_room(0, 0, 5, 4), (-0.1, -0.1, -0.1), (0.6, 0.6, 2.2)), seen).rooms
    assert overlap(room, [(0, 0), (5, 0), (5, 4), (0, 4)]) > 0.998


def test_a_face_that_ends_a_hair_before_another_closes_the_room() -> None:
    """Between the backs of two faces lies the body of their wall, and not a strip of either room."""
    cloud = evidence(box_room(0, 0, 5, 3), box_room(0, 3.2, 5, 5.7))
    [storey] = find_storeys(cloud)
    voxels = storey_voxels(cloud, storey, None)
    ends = [
        (0, 0, 5, 0),
        (5, 0, 5, 5.7),
        (5 - 3e-4, 3, 3e-4, 3),
        (0, 5.7, 0, 0),
        (5, 5.7, 0, 5.7),
        (3e-4, 3.2, 5 - 3e-4, 3.2),
    ]
    lines = np.array(ends, dtype=float) - np.tile(voxels.origin, 2)
    elevations = draw_elevations(lines, np.zeros(len(lines), dtype=bool), voxels)
    faces = [Face(i, line[:2], line[2:], 5.0) for i, line in enumerate(lines)]
    assert sorted(room.area for room in find_rooms(faces, (), elevations, voxels)) == pytest.approx(
        [12.5, 15], abs=0.01
    )


@pytest.mark.parametrize("deep", [0.2, 0.4])
def test_the_recess_of_a_window_down_to_the_floor_is_none_of_its_room(deep: float) -> None:
    """Nor are its reveals faces, and the wall's face runs across it."""
    room = without(box_room(0, 0, 5, 4), (1.5, -0.1, 0.01), (3.0, 0.1, 2.3))
    reveals = [wall((x, 0), (x, -deep), 0, 2.3) for x in (1.5, 3.0)] + [level(1.5, -deep, 3, 0, z) for z in (0, 2.3)]
    posts = [wall((x, -deep), (x + 0.08, -deep), 0, 2.3) for x in (1.5, 2.2, 2.92)]
    rails = [wall((1.5, -deep), (3.0, -deep), z, z + 0.08) for z in (0, 2.22)]
    found = planned(room, *reveals, *posts, *rails)
    assert [opening.width for opening in found.windows] == pytest.approx([1.5], abs=0.02)
    assert [room.area for room in found.rooms] == pytest.approx([20], abs=0.03)
    assert sorted(face.length for face in found.wall_faces) == pytest.approx([4, 4, 5, 5], abs=0.01)


def faces_on(segments: Sequence[tuple[float, ...]], cloud: Array) -> tuple[list[Face], Elevations, StoreyVoxels]:
    """Faces as given, the room on their left, with what `find_rooms` asks for besides."""
    seen = evidence(cloud)
    [storey] = find_storeys(seen)
    voxels = storey_voxels(seen, storey, None)
    lines = np.array(segments, dtype=float) - np.tile(voxels.origin, 2)
    elevations = draw_elevations(lines, np.zeros(len(lines), dtype=np.bool_), voxels)
    return [Face(i, line[:2], line[2:], 5.0) for i, line in enumerate(lines)], elevations, voxels


def cells_of(*lines: Array) -> list[float]:
    """Areas of the cells into which lines (n, 4) divide the ground, the smallest first."""
    strings = shapely.linestrings(np.concatenate(lines).reshape(-1, 2, 2))
    return sorted(shapely.area(shapely.get_parts(shapely.polygonize([shapely.union_all(strings)]))).tolist())


def test_a_door_closes_a_wall_of_which_one_side_was_found_left_of_it_and_the_other_side_right() -> None:
    around = [(0, 0, 5, 0), (5, 0, 5, 5.7), (5, 5.7, 0, 5.7), (0, 5.7, 0, 0)]
    faces = np.array([*around, (5, 3, 2.9, 3), (0, 3.2, 2, 3.2)])
    lines = close_openings([Door((102.0, 53.1), (102.9, 53.1))], faces, np.array([100.0, 50.0]))
    south = 2 * 3.2 + 0.9 * 3.1 + 2.1 * 3.0
    assert cells_of(faces) == pytest.approx([28.5])
    assert cells_of(faces, lines) == pytest.approx([28.5 - south, south], abs=0.001)
    assert close_openings([], faces, np.zeros(2)).shape == (0, 4)


def test_a_round_wall_goes_on_along_its_circle() -> None:
    """Where another wall meets it, half a metre has no face; a straight line would lie before the wall."""
    turns = np.linspace(0.1, 2 * np.pi - 0.1, 60)
    points = np.array([6.0, 5.0]) + 2.5 * np.column_stack([np.cos(turns), np.sin(turns)])
    chords = [Face(0, a, b, 5.0, curve=3) for a, b in pairwise(points)]
    straight = Face(1, np.array([0.0, 0.0]), np.array([9.0, 0.0]), 5.0)
    lines = continue_circles([*chords, straight])
    assert np.hypot(*(lines[:, :2] - (6, 5)).T) == pytest.approx(2.5, abs=0.001)
    [inside] = cells_of(np.array([[*chord.start, *chord.end] for chord in chords]), lines)
    assert inside == pytest.approx(np.pi * 2.5**2, rel=0.01)
    assert continue_circles([straight]).shape == (0, 4)
    # A rounded corner ends where it ends.
    assert continue_circles(chords[:8]).shape == (0, 4)


def test_between_the_two_sides_of_an_outer_wall_is_no_room() -> None:
    """Even where its outer face is taken for one that looks in: of floor and ceiling nothing shows there."""
    cloud = np.concatenate([box_room(0, 0, 6, 5), walls([(-0.5, -0.5), (6.5, -0.5), (6.5, 5.5), (-0.5, 5.5)], -0.3)])
    inner = [(0, 0, 6, 0), (6, 0, 6, 5), (6, 5, 0, 5), (0, 5, 0, 0)]
    outer = [(-0.5, -0.5, 6.5, -0.5), (6.5, -0.5, 6.5, 5.5), (6.5, 5.5, -0.5, 5.5), (-0.5, 5.5, -0.5, -0.5)]
    faces, elevations, voxels = faces_on([*inner, *outer], cloud)
    [room] = find_rooms(faces, (), elevations, voxels)
    assert room.area == pytest.approx(30, abs=0.05)


def test_a_shaft_is_a_hole_in_its_room() -> None:
    shaft = [(2.0, 1.5), (2.0, 2.5), (3.2, 2.5), (3.2, 1.5)]
    inside = np.concatenate([box_room(0, 0, 5, 4), walls(shaft)])
    inside = without(inside, (2.001, 1.501, -0.1), (3.199, 2.499, 2.7))
    [room] = planned(inside).rooms
    assert len(room.holes) == 1
    assert room.area == pytest.approx(20 - 1.2, abs=0.03)


def test_a_courtyard_that_was_not_seen_is_no_room() -> None:
    # rooms about a square of which nothing was seen but the walls' other sides
    found = planned(
        box_room(0, 0, 8, 2), box_room(0, 5.2, 8, 7.2), box_room(0, 2.2, 2.5, 5.0), box_room(5.5, 2.2, 8, 5.0)
    ).rooms
    assert len(found) == 4


def test_scans_stand_in_their_rooms() -> None:
    first = evidence_from_points(noisy(box_room(0, 0, 4, 3)), scan="a")
    second = evidence_from_points(noisy(box_room(4.2, 0, 8, 3)), scan="b")
    cloud = first.merged(second)
    [found] = find_storeys(cloud)
    voxels = storey_voxels(cloud, found, None)
    x, y = voxels.origin
    rings = [shapely.box(0 - x, 0 - y, 4 - x, 3 - y), shapely.box(4.2 - x, 0 - y, 8 - x, 3 - y)]
    scans = [("a", (1.0, 1.0, 1.5), 9), ("b", (7.0, 1.0, 1.5), 9), ("c", None, 9), ("d", (1.0, 1.0, 9.5), 9)]
    west, east = measure_rooms(rings, voxels, found, scans)
    assert (west.scans, east.scans) == (("a",), ("b",))
    assert west.floor == pytest.approx(0, abs=LEVEL)
    drawn = draw_elevations(np.zeros((0, 4)), np.zeros(0, dtype=np.bool_), voxels)
    assert find_rooms([], [], drawn, voxels) == []
    assert measure_rooms([], voxels, found, scans) == ()


def test_rooms_are_numbered_from_north_to_south_and_from_west_to_east() -> None:
    cloud = evidence(box_room(0, 0, 4, 3))
    [found] = find_storeys(cloud)
    corners = [(0, 0), (6, 0), (0, 6), (6, 6)]
    rings = [shapely.box(x, y, x + 4, y + 4) for x, y in corners]
    rooms = measure_rooms(rings, storey_voxels(cloud, found, None), found, [])
    middles = [shapely.Polygon(room.ring).centroid for room in rooms]
    assert [room.number for room in rooms] == ["001", "002", "003", "004"]
    assert middles[0].y == middles[1].y > middles[2].y == middles[3].y
    assert middles[0].x == middles[2].x < middles[1].x == middles[3].x


def test_a_floor_that_was_not_seen_has_no_height() -> None:
    cloud = evidence(box_room(0, 0, 4, 3))
    [found] = find_storeys(cloud)
    voxels = storey_voxels(cloud, found, None)
    beyond = shapely.box(10, 10, 12, 12)
    [room] = measure_rooms([beyond], voxels, found, [])
    assert (room.floor, room.ceiling, room.height) == (None, None, None)


def rectangle(x0: float, y0: float, x1: float, y1: float) -> tuple[Point, ...]:
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def test_the_outline_runs_about_rooms_and_walls() -> None:
    room = Room(rectangle(0, 0, 4, 3))
    wall_below = Wall((0, -0.1), (4, -0.1), outline=rectangle(-0.2, -0.2, 4.2, 0))
    ring = find_outline([room], [wall_below])
    assert ring is not None
    assert shapely.LinearRing(ring).is_ccw
    assert shapely.Polygon(ring).area == pytest.approx(12 + 4.4 * 0.2)


def test_the_outline_covers_wings_between_which_nothing_was_found() -> None:
    wings = [Room(rectangle(0, 0, 10, 8)), Room(rectangle(11.5, 0, 18, 8))]
    ring = find_outline(wings, [])
    assert ring is not None
    assert shapely.Polygon(ring).area == pytest.approx(18 * 8)
    # a stray bit far off is left out, and does not change the rest
    alone = find_outline([wings[0], Room(rectangle(40, 40, 41, 41))], [])
    assert alone is not None
    assert shapely.Polygon(alone).area == pytest.approx(80)


def test_an_outline_is_found_where_rounding_defeats_the_exact_union(monkeypatch: pytest.MonkeyPatch) -> None:
    union = shapely.union_all

    def only_on_a_lattice(shapes: NDArray[np.object_], grid_size: float | None = None) -> shapely.Geometry:
        if grid_size is None:
            raise shapely.GEOSException("TopologyException: found non-noded intersection")
        return union(shapes, grid_size=grid_size)

    rooms = [Room(rectangle(0, 0, 10, 8)), Room(rectangle(9.5, 0, 18, 8))]
    exact = find_outline(rooms, [])
    monkeypatch.setattr(shapely, "union_all", only_on_a_lattice)
    assert find_outline(rooms, []) == pytest.approx(np.array(exact), abs=1e-6)


def test_without_rooms_and_walls_there_is_no_outline() -> None:
    assert find_outline([], []) is None
    assert find_outline([], [Wall((0, 0), (1, 0))]) is None
