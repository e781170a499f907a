"""Sides of rooms are drawn from corner to corner, but for their doors; what stands on no side stays or goes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from asbuilt.elevations import Elevations, draw_elevations
from asbuilt.faces import Face, score_steps
from asbuilt.params import Parameters
from asbuilt.plan import Door, Window
from asbuilt.profiles import StoreyVoxels, storey_voxels
from asbuilt.room_faces import draw_room_faces
from asbuilt.storeys import find_storeys
from rooms import box, box_room, evidence, without

Array = NDArray[np.float64]
CORNERS = np.array([(0.0, 0.0), (5.0, 0.0), (5.0, 4.0), (0.0, 4.0)])
DOOR = (2.0, 2.9)
"""The room of 5 by 4 m has a doorway in its southern wall, and a cupboard before its northern one."""


@cache
def scene() -> tuple[StoreyVoxels, Elevations, Array]:
    room = without(box_room(0, 0, 5, 4), (DOOR[0], -0.1, -0.1), (DOOR[1], 0.1, 2.05))
    room = without(room, (1.0, 3.9, -0.1), (2.5, 4.1, 2.2))
    cloud = evidence(room, box(1.0, 3.4, 2.5, 3.99, 2.2))
    [level] = find_storeys(cloud)
    voxels = storey_voxels(cloud, level, None)
    ring = np.roll(CORNERS, -1, axis=0)
    lines = np.hstack([CORNERS, ring]) - np.tile(voxels.origin, 2)
    elevations = draw_elevations(lines, np.zeros(4, dtype=bool), voxels)
    return voxels, elevations, score_steps(elevations, Parameters().walls)


def face(line: int, start: tuple[float, float], end: tuple[float, float], curve: int | None = None) -> Face:
    origin = scene()[0].origin
    return Face(line, np.array(start) - origin, np.array(end) - origin, 5.0, curve=curve)


def room() -> shapely.Polygon:
    return shapely.Polygon(CORNERS - scene()[0].origin)


def drawn(faces: list[Face], *doors: Door, rooms: list[shapely.Polygon] | None = None) -> list[Face]:
    voxels, elevations, scores = scene()
    return draw_room_faces(faces, [room()] if rooms is None else rooms, doors, [], elevations, scores, voxels)


def ends(faces: list[Face]) -> Array:
    """Start and end of each (n, 4) in the room's frame, sorted."""
    origin = np.tile(scene()[0].origin, 2)
    return np.array(sorted((np.round(np.concatenate([f.start, f.end]) + origin, 6) + 0.0).tolist() for f in faces))


EAST, WEST = ((5.0, 0.0), (5.0, 4.0)), ((0.0, 4.0), (0.0, 0.0))


def others() -> list[Face]:
    return [face(1, *EAST), face(3, *WEST)]


def test_a_side_is_drawn_from_corner_to_corner_but_for_its_door() -> None:
    south = [face(0, (0.1, 0.0), (2.0, 0.0)), face(0, (2.9, 0.0), (4.9, 0.0))]
    north = [face(2, (5.0, 4.0), (0.0, 4.0))]
    found = drawn([*south, *north, *others()], Door((DOOR[0], -0.1), (DOOR[1], -0.1)))
    expected = [(0, 0, 2.0, 0), (2.9, 0, 5, 0), (5, 0, 5, 4), (5, 4, 0, 4), (0, 4, 0, 0)]
    assert ends(found) == pytest.approx(np.array(sorted(expected)), abs=1e-6)


def test_faces_share_the_corners_of_their_room() -> None:
    south = [face(0, (0.1, 0.0), (2.0, 0.0)), face(0, (2.9, 0.0), (4.9, 0.0))]
    found = drawn([*south, face(2, (5.0, 4.0), (0.2, 4.0)), *others()], Door((DOOR[0], 0.0), (DOOR[1], 0.0)))
    for corner in shapely.get_coordinates(room().exterior)[:-1]:
        assert sum(np.array_equal(f.start, corner) and f.fixed[0] for f in found) == 1
        assert sum(np.array_equal(f.end, corner) and f.fixed[1] for f in found) == 1


def test_a_face_goes_on_behind_what_hides_it() -> None:
    north = [face(2, (5.0, 4.0), (2.6, 4.0)), face(2, (0.9, 4.0), (0.0, 4.0))]
    found = drawn([face(0, (0.0, 0.0), (5.0, 0.0)), *north, *others()])
    assert [5.0, 4.0, 0.0, 4.0] in ends(found).tolist()


WINDOW = Window((DOOR[0], -0.1), (DOOR[1], -0.1), sill=0.0)


@pytest.mark.parametrize(("floor", "windows", "open_"), [(0.8, [], True), (0.8, [WINDOW], False), (0.0, [], False)])
def test_a_gap_stays_open_where_the_floor_goes_on_but_not_at_a_window(
    floor: float, windows: list[Window], open_: bool
) -> None:
    south = [face(0, (0.0, 0.0), (2.0, 0.0)), face(0, (2.9, 0.0), (5.0, 0.0))]
    voxels, elevations, scores = scene()
    start, along = elevations.lines[0, :2], elevations.along(0)
    place = (elevations.position(0)[:, None] * along + start + voxels.origin)[:, 0]
    gap = np.flatnonzero((place > DOOR[0]) & (place < DOOR[1])) + elevations.first[0]
    against, behind = scores.copy(), elevations.floor_behind.copy()
    against[gap], behind[gap] = -1.5, floor
    seen = replace(elevations, floor_behind=behind)
    found = draw_room_faces(south + others(), [room()], [], windows, seen, against, voxels)
    on_south = [end for end in ends(found).tolist() if end[1] == end[3] == 0]
    expected = [[0, 0, 2.0, 0], [2.9, 0, 5, 0]] if open_ else [[0, 0, 5, 0]]
    assert on_south == [pytest.approx(end) for end in expected]


def test_faces_outside_of_rooms_stay_as_they_are() -> None:
    outside = face(0, (-1.0, -2.0), (4.0, -2.0))
    [same] = drawn([outside], rooms=[])
    assert same is outside
    assert any(f is outside for f in drawn([outside, *others()]))


def test_what_stands_short_and_free_within_a_room_is_clutter() -> None:
    clutter, screen = face(0, (2.0, 2.0), (3.0, 2.0)), face(0, (1.0, 2.5), (3.5, 2.5))
    found = drawn([clutter, screen, *others()])
    assert not any(f is clutter for f in found)
    assert any(f is screen for f in found)


def test_a_board_before_a_side_is_no_wall_and_the_back_of_a_wall_is_one() -> None:
    board, back = face(2, (4.5, 3.85), (2.7, 3.85)), face(2, (0.0, 4.2), (5.0, 4.2))
    found = drawn([face(2, (5.0, 4.0), (0.0, 4.0)), board, back, *others()])
    assert not any(f is board for f in found)
    assert any(f is back for f in found)


def test_curves_are_left_alone() -> None:
    chord = face(1, (5.0, 0.0), (5.0, 4.0), curve=0)
    found = drawn([chord, face(3, *WEST)])
    assert any(f is chord for f in found)
    assert [5.0, 0.0, 5.0, 4.0] in ends(found).tolist()
    assert sum(bool(np.allclose(end, [5, 0, 5, 4])) for end in ends(found)) == 1


def test_without_faces_and_rooms_nothing_is_drawn() -> None:
    assert drawn([], rooms=[]) == []


def test_a_face_that_goes_on_into_a_room_that_was_not_found_goes_on() -> None:
    east_half = shapely.Polygon(np.array([(3.0, 0), (5, 0), (5, 4), (3.0, 4)]) - scene()[0].origin)
    north = face(2, (5.0, 4.0), (0.0, 4.0))
    found = ends(drawn([north], rooms=[east_half]))
    on_the_wall = found[np.abs(found[:, 1::2] - 4.0).max(axis=1) < 0.01]
    assert on_the_wall == pytest.approx(np.array([[3.0, 4.0, 0.0, 4.0], [5.0, 4.0, 3.0, 4.0]]), abs=0.02)
