"""Where walls stand and where they do not, on rooms that are known: to 2 mm aside, 5 mm at the corners."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from asbuilt import extract_floor_plan
from asbuilt.doubtful_faces import drop_doubles, drop_leaves, turn_backs
from asbuilt.elevations import draw_elevations
from asbuilt.faces import Face, find_faces, maximal_runs, score_steps, segments_of
from asbuilt.params import WallParameters
from asbuilt.partitions import find_partitions
from asbuilt.profiles import columns
from asbuilt.wall_lines import find_wall_lines
from rooms import box, box_room, evidence, level, lying_on, rectangle, segments, voxels_of, wall, walls, without

ASIDE = 0.002
CORNER = 0.005


def plan(*parts: np.ndarray) -> np.ndarray:
    return segments(extract_floor_plan(evidence(*parts)))


def two_rooms(x: float, thickness: float, door: tuple[float, float] | None = None, head: float = 2.05) -> np.ndarray:
    """Two rooms of 4 m depth with a wall from `x` to `x + thickness`, and a cased opening in it."""
    first, second = box_room(0, 0, x, 4), box_room(x + thickness, 0, 9, 4)
    if door is None:
        return plan(first, second)
    low, high = door
    gap = ((x - 0.1, low, 0.02), (x + thickness + 0.1, high, head))
    frame = [wall((x, y), (x + thickness, y), 0, head) for y in door]
    frame += [level(x, low, x + thickness, high, 0), level(x, low, x + thickness, high, head)]
    return plan(without(first, *gap), without(second, *gap), *frame)


def test_four_walls_and_no_more() -> None:
    found = plan(box_room(0, 0, 5, 4))
    assert len(found) == 4
    for start, end in [((0, 0), (5, 0)), ((5, 0), (5, 4)), ((5, 4), (0, 4)), ((0, 4), (0, 0))]:
        ((low, high),) = lying_on(found, start, end, ASIDE)
        assert (low, high) == pytest.approx((0, np.hypot(end[0] - start[0], end[1] - start[1])), abs=CORNER)


@pytest.mark.parametrize("thickness", [0.1, 0.15, 0.24, 0.5])
def test_both_faces_of_a_wall(thickness: float) -> None:
    found = two_rooms(5, thickness)
    assert len(found) == 8
    for x in (5, 5 + thickness):
        ((low, high),) = lying_on(found, (x, 0), (x, 4), ASIDE)
        assert (low, high) == pytest.approx((0, 4), abs=CORNER)


@pytest.mark.parametrize("x", [5.0, 5.012, 5.025, 5.037])
@pytest.mark.parametrize("thickness", [0.15, 0.24, 0.4])
@pytest.mark.parametrize("head", [2.05, 2.4])
def test_a_door_gap_stays_open(x: float, thickness: float, head: float) -> None:
    found = two_rooms(x, thickness, (1.0, 1.9), head)
    for face in (x, x + thickness):
        pieces = lying_on(found, (face, 0), (face, 4), 2 * ASIDE)
        assert pieces == pytest.approx(np.array([[0, 1.0], [1.9, 4]]), abs=CORNER)


@pytest.mark.parametrize("x", [5.0, 5.012, 5.025, 5.037])
def test_a_door_gap_in_a_thin_wall_stays_open(x: float) -> None:
    found = two_rooms(x, 0.1, (1.0, 1.9))
    for face in (x, x + 0.1):
        pieces = lying_on(found, (face, 0), (face, 4), 3 * ASIDE)
        # half a voxel: the floor between the faces is hardly more than a voxel wide
        assert pieces == pytest.approx(np.array([[0, 1.0], [1.9, 4]]), abs=0.025)


def test_a_window_does_not_break_the_face() -> None:
    gap = ((1.5, -0.1, 0.9), (3.2, 0.1, 2.1))
    sill = rectangle((1.5, -0.15, 0.9), (1.7, 0, 0), (0, 0.15, 0))
    found = plan(without(box_room(0, 0, 5, 4), *gap), sill)
    ((low, high),) = lying_on(found, (0, 0), (5, 0), ASIDE)
    assert (low, high) == pytest.approx((0, 5), abs=CORNER)
    assert len(found) == 4


def test_a_cupboard_is_no_wall() -> None:
    # 2.2 m high in a room of 3 m, along a wall: what stands behind it is hidden
    room = without(
        without(box_room(0, 0, 5, 4, 0, 3), (1, -0.01, -0.01), (3, 0.01, 2.2)), (1, 0, -0.01), (3, 0.6, 0.01)
    )
    cupboard = box(1, 0, 3, 0.6, 2.2)
    found = plan(room, cupboard[cupboard[:, 1] > 0.001])
    assert len(found) == 4
    ((low, high),) = lying_on(found, (0, 0), (5, 0), ASIDE)
    assert (low, high) == pytest.approx((0, 5), abs=CORNER)


def test_a_cupboard_nearly_to_the_ceiling_is_no_wall() -> None:
    # the ceiling goes on over it, which shows through a gap of 0.2 m
    room = without(without(box_room(0, 0, 5, 4), (1, -0.01, -0.01), (3, 0.01, 2.4)), (1, 0, -0.01), (3, 0.6, 0.01))
    # no scanner sees its top
    sides = [wall(a, b, 0, 2.4) for a, b in (((1, 0.6), (1, 0)), ((3, 0.6), (1, 0.6)), ((3, 0), (3, 0.6)))]
    found = plan(room, *sides)
    assert len(found) == 4
    ((low, high),) = lying_on(found, (0, 0), (5, 0), ASIDE)
    assert (low, high) == pytest.approx((0, 5), abs=CORNER)


@pytest.mark.parametrize(
    ("deep", "high"), [(0.12, 0.2), (0.12, 0.3), (0.08, 0.3), (0.12, 0.45), (0.18, 0.45), (0.12, 0.6)]
)
def test_walls_under_a_cornice(deep: float, high: float) -> None:
    outer, inner = ([(d, d), (5 - d, d), (5 - d, 4 - d), (d, 4 - d)] for d in (0.0, deep))
    under = 3.2 - high
    ledge = without(level(0, 0, 5, 4, under), (deep, deep, 0), (5 - deep, 4 - deep, 3.2))
    cornice = [walls(inner, under, 3.2), ledge, level(deep, deep, 5 - deep, 4 - deep, 3.2)]
    found = plan(walls(outer, 0, under), level(0, 0, 5, 4, 0), *cornice)
    assert len(found) == 4
    for a, b in pairwise([*outer, outer[0]]):
        assert len(lying_on(found, a, b, ASIDE)) == 1


@pytest.mark.parametrize("rise", [-0.2, 0.4])
def test_a_beam_over_another_floor_is_no_wall(rise: float) -> None:
    # the second room lies some steps lower or higher; a beam of 0.25 m hangs in it
    high = box_room(5.2, 0, 10, 4, rise, 2.6)
    beam = [wall(a, b, 2.35, 2.6) for a, b in (((7.4, 4), (7.4, 0)), ((7.6, 0), (7.6, 4)))]
    high = without(high, (7.401, 0.001, 2.59), (7.599, 3.999, 2.61))
    found = plan(box_room(0, 0, 5, 4), high, *beam, level(7.4, 0, 7.6, 4, 2.35))
    assert len(found) == 8


def test_a_thin_wall_before_which_a_cupboard_stands_has_both_faces() -> None:
    # the floor on the far side is nearer to the hidden face than any on its own side
    west = without(box_room(0, 0, 5, 4), (4.5, 0.5, -0.01), (5, 3.5, 0.01))
    west = without(west, (4.5, 0.5, 2.59), (5.01, 3.5, 2.61))
    found = plan(west, box_room(5.1, 0, 9, 4))
    for x, facing in ((5.0, 1), (5.1, -1)):
        ((low, high),) = lying_on(found, (x, 0), (x, 4), ASIDE)
        assert (low, high) == pytest.approx((0, 4), abs=CORNER)
        (own,) = (row for row in found if abs(row[0] - x) < 0.01 and abs(row[2] - x) < 0.01)
        assert np.sign(own[3] - own[1]) == facing


def some_face(x1: float, y1: float, x2: float, y2: float, score: float) -> Face:
    return Face(0, np.array([x1, y1]), np.array([x2, y2]), score)


@pytest.mark.parametrize(
    ("weaker", "kept"),
    [
        ((1, 0.1, 3, 0.1), False),  # a board before the wall
        ((3, 0.1, 1, 0.1), False),  # the back of what stands before it: no room is so narrow
        ((3, -0.1, 1, -0.1), True),  # the other face of the wall
        ((4.0, 0.0, 4.3, 0.05), False),  # a bit that goes on from it, a little turned
        ((4.2, 0.0, 4.5, 0.05), True),
        ((3, 0.5, 1, 0.5), True),  # the other side of a closet
        ((1, -0.15, 1.9, 0.25), False),  # what leans on it and passes through
        ((1, 0.0, 1.9, 0.4), True),  # another wall, which begins on it
        ((1, -0.4, 1.5, 0.35), False),  # what is seen through openings in it
        ((1, -0.04, 2.9, 0.04), False),  # a chord from the end of a wall to the beginning of the next
        ((1, -0.2, 1.6, 0.4), True),  # a wall that meets it, drawn too far
        ((1, -0.4, 1.4, 0.4), True),
    ],
)
def test_a_room_sees_one_of_the_faces_behind_one_another(weaker: tuple[float, ...], kept: bool) -> None:
    wall_face = some_face(0, 0, 4, 0, 9.0)
    assert len(drop_doubles([some_face(*weaker, 1.0), wall_face])) == 1 + kept


@pytest.mark.parametrize(
    ("thick", "long", "room", "kept"),
    [
        (0.04, 0.9, 4.0, False),  # a leaf that stands open: about its end one can walk
        (0.04, 0.9, 0.95, True),  # from wall to wall
        (0.12, 0.9, 4.0, True),  # a short wall
        (0.04, 1.8, 4.0, True),  # a screen
    ],
)
def test_a_leaf_as_high_as_the_room_is_no_wall(thick: float, long: float, room: float, kept: bool) -> None:
    wall_face, across = some_face(0, 0, 4, 0, 9.0), some_face(4, room, 0, room, 9.0)
    leaf = [some_face(2, 0.05, 2, long, 1.0), some_face(2 + thick, long, 2 + thick, 0.05, 1.0)]
    assert len(drop_leaves([wall_face, across, *leaf])) == 2 + 2 * kept
    assert drop_leaves([]) == []


@pytest.mark.parametrize(("x", "y", "kept"), [(9, 0, False), (5, 4.1, True)])
def test_a_wall_that_hardly_shows_meets_another(x: float, y: float, kept: bool) -> None:
    apart = [wall((x, y), (x, y + 4), 1.9, 2.6), level(x - 0.3, y, x, y + 0.8, 0)]
    found = plan(box_room(0, 0, 5, 4), *apart)
    assert len(lying_on(found, (x, y + 0.5), (x, y + 3.5), ASIDE)) == kept


def test_which_side_sees_a_face_the_other_face_of_its_wall_tells() -> None:
    voxels, parameters = voxels_of(box_room(0, 0, 4, 4), box_room(4.1, 0, 9, 4)), WallParameters()
    lines = find_wall_lines(columns(voxels), voxels, parameters)
    elevations = draw_elevations(*find_partitions(lines, voxels), voxels)
    faces = find_faces(elevations, score_steps(elevations, parameters), parameters)
    assert turn_backs(faces, elevations) == faces  # all are sure
    at = np.array([abs(face.start[0] + voxels.origin[0] - 4) + abs(face.end[0] - face.start[0]) for face in faces])
    line = faces[int(at.argmin())].line
    left = elevations.left.copy()
    left[elevations.first[line] : elevations.first[line + 1]] ^= np.arange(np.diff(elevations.first)[line]) % 5 < 3
    doubtful = replace(elevations, left=left)
    wrong = find_faces(doubtful, score_steps(elevations, parameters), parameters)
    assert len(drop_doubles(wrong)) == len(faces) - 1
    np.testing.assert_array_equal(segments_of(turn_backs(wrong, doubtful)), segments_of(faces))


def test_tables_and_beds_are_no_walls() -> None:
    things = [(1, 1, 2.4, 1.8, 0.75), (3, 0, 4.4, 2.0, 0.5), (0, 2.5, 0.5, 3.5, 1.2)]
    assert len(plan(box_room(0, 0, 5, 4), *(box(*thing) for thing in things))) == 4


def test_nothing_between_floor_and_ceiling() -> None:
    found = extract_floor_plan(evidence(box_room(0, 0, 5, 4)))
    assert all(face.seen > 0.95 for face in found.wall_faces)
    # noise of 2 mm, the bias of voxels on the plane included
    assert all(0.0015 < face.rms < 0.004 for face in found.wall_faces)
    assert [face.id for face in found.wall_faces] == [f"S0-F{i + 1}" for i in range(4)]


def twin_of_maximal_runs(scores: np.ndarray, least: float, drop: float) -> list[tuple[int, int, float]]:
    """Prefix sums in place of running totals."""
    runs, i = [], 0
    while i < len(scores):
        if scores[i] <= 0:
            i += 1
            continue
        sums = np.cumsum(scores[i:])
        highest = np.maximum.accumulate(sums)
        over = np.flatnonzero((sums < highest - drop) | (sums < 0))
        best = int(np.argmax(sums[: over[0]] if len(over) else sums))
        if sums[best] >= least:
            runs.append((i, i + best + 1, float(sums[best])))
        i += best + 1
    return runs


@pytest.mark.parametrize("seed", range(20))
def test_maximal_runs_against_their_twin(seed: int) -> None:
    scores = np.random.default_rng(seed).normal(0.05, 1, 300)
    found, expected = maximal_runs(scores, 4.0, 5.0), twin_of_maximal_runs(scores, 4.0, 5.0)
    assert [run[:2] for run in found] == [run[:2] for run in expected]
    assert [run[2] for run in found] == pytest.approx([run[2] for run in expected])


def test_runs_end_at_their_highest() -> None:
    scores = np.array([-1, 2, 2, -1, 2, -3, -3, 1, 1, 1, 1.0])
    assert maximal_runs(scores, 4.0, 5.0) == [(1, 5, 5.0), (7, 11, 4.0)]
    assert maximal_runs(scores, 6.0, 5.0) == []
    assert maximal_runs(np.zeros(0), 1.0, 1.0) == []
