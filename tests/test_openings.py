"""Doors and windows of rooms whose openings are known: where, how wide, how high, open or shut."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from shapely import LineString, Polygon

from asbuilt import extract_floor_plan
from asbuilt.elevations import draw_elevations
from asbuilt.faces import Face
from asbuilt.leaves import find_leaves
from asbuilt.openings import find_openings
from asbuilt.plan import Storey
from asbuilt.profiles import storey_voxels
from asbuilt.storeys import find_storeys
from asbuilt.wall_sides import close_cells
from rooms import box, box_room, evidence, level, voxels_of, wall, walls, without

Array = NDArray[np.float64]

ALONG, WIDTH, HEIGHT = 0.02, 0.015, 0.05
"""How far a middle, a width and a height may be off, m."""
THICK = 0.2
"""Of the wall between the two rooms: its faces lie at y = 4.0 and 4.2."""


def two_rooms(*openings: tuple[float, float, float, float], high: float = 2.6) -> Array:
    """Rooms before and behind a wall with openings (x from, to, z from, to) and their reveals."""
    points = np.concatenate([box_room(0, 0, 6, 4, high=high), box_room(0, 4 + THICK, 6, 8, high=high)])
    return opened(points, *openings)


def opened(points: Array, *openings: tuple[float, float, float, float], deep: float = THICK) -> Array:
    """Points with openings through what stands from y = 4.0 on, with their reveals."""
    for x0, x1, z0, z1 in openings:
        points = without(points, (x0, 3.9, z0 - 0.001), (x1, 4.1 + deep, z1))
        reveals = [wall((x, 4), (x, 4 + deep), z0, z1) for x in (x0, x1)]
        reveals += [level(x0, 4, x1, 4 + deep, z) for z in (z0, z1)]
        points = np.concatenate([points, *reveals])
    return points


def storey(*parts: Array, degrees: float = 0.0) -> Storey:
    """The planned storey, the cloud turned about (30, 10)."""
    points = np.concatenate(parts)
    turn = np.radians(degrees)
    about = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    points[:, :2] = (points[:, :2] - (30, 10)) @ about + (30, 10)
    return extract_floor_plan(evidence(points)).storeys[0]


def leaf(hinge: tuple[float, float], tip: tuple[float, float], high: float = 2.1) -> Array:
    """Both sides of an open leaf, 4 cm thick, a centimetre clear of the floor and of its hinge."""
    start, end = np.array(hinge), np.array(tip)
    along = (end - start) / np.hypot(*(end - start))
    aside = 0.02 * np.array([-along[1], along[0]])
    start = start + 0.01 * along
    return np.concatenate([wall(start + s * aside, end + s * aside, 0.01, high - 0.01) for s in (-1, 1)])


def test_a_doorway_seen_from_both_rooms_is_one_door_on_the_centreline() -> None:
    plan = storey(two_rooms((2.0, 2.9, 0.0, 2.1)))
    [door] = plan.doors
    assert plan.windows + plan.unknown_openings == ()
    assert door.id == "S0-D1"
    assert sorted((door.start[0], door.end[0])) == pytest.approx([2.0, 2.9], abs=ALONG)
    assert (door.start[1], door.end[1]) == pytest.approx((4.1, 4.1), abs=0.005)
    assert door.width == pytest.approx(0.9, abs=WIDTH)
    assert door.sill == 0.0  # the floor, not a cell below it
    assert door.head == pytest.approx(2.1, abs=HEIGHT)
    assert (door.state, door.hinge, door.swing) == ("cased", None, None)


def test_a_doorway_up_to_the_ceiling() -> None:
    [door] = storey(two_rooms((2.0, 3.2, 0.0, 2.6))).doors
    assert door.width == pytest.approx(1.2, abs=WIDTH)
    assert door.head == pytest.approx(2.6, abs=0.1)


@pytest.mark.parametrize("degrees", [0.0, 20.0])
@pytest.mark.parametrize("wide", [0.9, 2.2])
def test_a_doorway_in_the_corner_of_a_room(wide: float, degrees: float) -> None:
    [door] = storey(two_rooms((0.0, wide, 0.0, 2.1)), degrees=degrees).doors
    assert door.width == pytest.approx(wide, abs=WIDTH)


def test_a_doorway_up_some_steps_between_rooms_without_ceilings() -> None:
    rooms = [box_room(0, 0, 6, 4, high=2.8), box_room(0, 4 + THICK, 6, 8, 0.28, high=2.8)]
    points = opened(without(np.concatenate(rooms), (-1, -1, 2.75), (7, 9, 2.85)), (2.0, 2.9, 0.28, 2.3))
    plan = storey(points, window(2.0, 2.9, 0.28, 2.3)[:300])  # what strays where the leaf was pushed open
    [door] = plan.doors
    assert plan.windows == ()
    assert door.sill == pytest.approx(0.28, abs=HEIGHT)


def test_a_shut_door_is_flush_with_one_face_and_in_a_recess_of_the_other() -> None:
    points = two_rooms((2.0, 2.9, 0.0, 2.1))
    plan = storey(points, wall((2.0, 4.0), (2.9, 4.0), 0, 2.1), wall((2.0, 4.05), (2.9, 4.05), 0, 2.1))
    [door] = plan.doors
    assert door.width == pytest.approx(0.9, abs=WIDTH)
    assert (door.state, door.hinge) == ("shut", None)
    assert plan.windows == ()


@pytest.mark.parametrize("degrees", [0.0, 33.0])
def test_an_open_leaf_tells_hinge_and_swing(degrees: float) -> None:
    hung = leaf((2.9, 4.0), (2.9 - 0.88 * np.cos(1.2), 4.0 - 0.88 * np.sin(1.2)))
    [door] = storey(two_rooms((2.0, 2.9, 0.0, 2.1)), hung, degrees=degrees).doors
    assert door.state == "open"
    turn = np.radians(degrees)
    about = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    hinge, into = (np.array(point) - (30, 10) @ np.eye(2) for point in ((2.9, 4.1), (2.45, 3.0)))
    hinge, into = hinge @ about + (30, 10), into @ about + (30, 10)
    start, end = np.array(door.start), np.array(door.end)
    assert np.hypot(*((start if door.hinge == "start" else end) - hinge)) < 0.03
    along, relative = end - start, into - start
    left = along[0] * relative[1] - along[1] * relative[0] > 0
    assert door.swing == ("left" if left else "right")


def test_two_leaves_stand_open() -> None:
    leaves = [leaf((2.0, 4.0), (1.9, 3.22)), leaf((3.6, 4.0), (3.7, 3.22))]
    [door] = storey(two_rooms((2.0, 3.6, 0.0, 2.1)), *leaves).doors
    assert door.width == pytest.approx(1.6, abs=WIDTH)
    assert door.state == "open"


def test_a_wall_against_the_jamb_is_no_leaf() -> None:
    points = two_rooms((2.0, 2.9, 0.0, 2.1))
    stub = np.concatenate([wall((2.0, 4.0), (2.0, 1.5)), wall((1.9, 1.5), (1.9, 4.0)), wall((2.0, 1.5), (1.9, 1.5))])
    [door] = storey(without(points, (1.9, 3.99, -1), (2.0, 4.01, 3)), stub).doors
    assert door.state == "cased"


def window(x0: float, x1: float, z0: float, z1: float, deep: float = 0.1) -> Array:
    """Frame, a mullion in the middle, so `deep` behind the face, and the few points that come back from glass."""
    rng = np.random.default_rng(3)
    glass = np.column_stack([rng.uniform(x0, x1, 300), np.full(300, 4.02 + deep), rng.uniform(z0, z1, 300)])
    middle, y = (x0 + x1) / 2, 4 + deep
    posts = [wall((x, y), (x + 0.06, y), z0, z1) for x in (x0, middle - 0.03, x1 - 0.06)]
    bars = [wall((x0, y), (x1, y), z, z + 0.06) for z in (z0, z1 - 0.06)]
    return np.concatenate([glass, *posts, *bars])


@pytest.mark.parametrize("degrees", [0.0, 33.0])
def test_a_window_seen_from_one_side_lies_in_the_wall_as_drawn(degrees: float) -> None:
    points = opened(box_room(0, 0, 6, 4), (2.0, 3.6, 0.9, 2.2), deep=0.15)
    plan = storey(points, window(2.0, 3.6, 0.9, 2.2), degrees=degrees)
    [found] = plan.windows
    assert plan.doors + plan.unknown_openings == ()
    assert found.id == "S0-G1"
    assert found.width == pytest.approx(1.6, abs=WIDTH)
    assert (found.sill, found.head) == pytest.approx((0.9, 2.2), abs=HEIGHT)
    [wall] = [wall for wall in plan.walls if wall.id == found.wall]
    assert Polygon(wall.outline).buffer(1e-6).covers(LineString([found.start, found.end]))


def test_a_bar_across_a_window_does_not_make_two_of_it() -> None:
    parts = [(2.0, 3.6, 0.6, 1.2), (2.0, 3.6, 1.28, 2.2)]
    points = opened(box_room(0, 0, 6, 4), *parts, deep=0.15)
    [found] = storey(points, *(window(*part) for part in parts)).windows
    assert found.width == pytest.approx(1.6, abs=WIDTH)
    assert (found.sill, found.head) == pytest.approx((0.6, 2.2), abs=HEIGHT)


@pytest.mark.parametrize("corner", [0.0, 1.5])
@pytest.mark.parametrize("behind", [False, True])
def test_the_wall_above_a_panelling_is_no_window(corner: float, behind: bool) -> None:
    """The panelling stands 5 cm before the wall, and its plane is taken for the wall's."""
    front = [wall((4.5, 3.95), (corner, 3.95), 0, 2.2), level(corner, 3.95, 4.5, 4, 2.2)]
    beside = [wall(a, b, 0, 2.2) for a, b in (((6, 4), (4.5, 4)), ((corner, 4), (0, 4))) if a != b]
    above = [wall((6, 4), (0, 4), 2.2, 3.0)]
    rest = [wall(a, b, 0, 3) for a, b in (((0, 4), (0, 0)), ((0, 0), (6, 0)), ((6, 0), (6, 4)))]
    rest += [level(0, 0, 6, 4, z) for z in (0.0, 3.0)] + [box_room(0, 4.2, 6, 8, high=3.0)] * behind
    voxels = voxels_of(*front, *beside, *above, *rest)
    line = np.array([[4.5, 3.95, corner, 3.95]]) - np.tile(voxels.origin, 2)
    elevations = draw_elevations(line, np.array([False]), voxels)
    faces = [Face(0, line[0, :2], line[0, 2:], 1.0)]
    assert find_openings(faces, elevations, np.zeros(len(elevations.upper)), voxels, 0).all == ()


def test_windows_side_by_side_stay_two() -> None:
    windows = [(1.0, 2.2, 0.9, 2.2), (2.4, 3.8, 0.9, 2.2)]
    points = opened(box_room(0, 0, 6, 4), *windows, deep=0.15)
    found = storey(points, *(window(*opening) for opening in windows)).windows
    assert sorted(w.width for w in found) == pytest.approx([1.2, 1.4], abs=WIDTH)


@pytest.mark.parametrize("deep", [0.1, 0.35])
def test_a_window_to_the_floor_that_leads_outside_is_a_window(deep: float) -> None:
    points = opened(box_room(0, 0, 6, 4), (2.0, 3.2, 0.0, 2.2), deep=deep + 0.05)
    plan = storey(points, window(2.0, 3.2, 0.0, 2.2, deep))
    [found] = plan.windows
    assert plan.doors == ()
    assert found.width == pytest.approx(1.2, abs=WIDTH)
    assert found.sill == 0.0


def test_half_a_window_behind_a_cupboard_is_as_wide_as_its_lintel_shows() -> None:
    points = opened(box_room(0, 0, 6, 4), (2.0, 3.6, 0.9, 2.2), deep=0.15)
    points = np.concatenate([points, window(2.0, 3.6, 0.9, 2.2)])
    hidden = without(points, (3.0, 3.7, -0.1), (4.5, 4.3, 2.0))
    [found] = storey(hidden, box(3.0, 3.5, 4.5, 3.95, 2.0)).windows
    assert found.width == pytest.approx(1.6, abs=0.03)


def test_what_hides_a_wall_is_no_opening() -> None:
    cupboard = without(box_room(0, 0, 6, 4), (2.0, 3.9, 0.0), (2.9, 4.1, 2.0))
    picture = without(cupboard, (4.0, 3.95, 1.0), (5.0, 4.1, 2.0))
    plan = storey(picture, box(2.0, 3.5, 2.9, 3.95, 2.0), wall((4.0, 3.96), (5.0, 3.96), 1.0, 2.0))
    assert plan.doors + plan.windows + plan.unknown_openings == ()


def test_a_niche_to_the_ceiling_is_no_door() -> None:
    ring = [(0, 0), (6, 0), (6, 4), (4, 4), (4, 4.15), (3, 4.15), (3, 4), (0, 4)]
    plan = storey(walls(ring), *(level(*part, z) for part in ((0, 0, 6, 4), (3, 4, 4, 4.15)) for z in (0, 2.6)))
    assert plan.doors + plan.windows == ()


def test_a_shut_door_up_to_the_ceiling_is_no_niche() -> None:
    points = two_rooms((2.0, 2.9, 0.0, 2.6))
    leaves = [wall((2.0, y), (2.9, y), 0, 2.6) for y in (4.15, 4.2)]
    [door] = storey(points, *leaves).doors
    assert door.state == "shut"
    assert door.width == pytest.approx(0.9, abs=WIDTH)


def test_a_shut_door_up_to_the_ceiling_in_the_corner_of_a_room() -> None:
    """Of the wall beside it so little is left that no face is found on it."""
    points = two_rooms((5.0, 5.9, 0.0, 2.6))
    leaf_shut = [wall((5.0, y), (5.9, y), 0, 2.59) for y in (4.2, 4.15)]
    [door] = storey(points, *leaf_shut).doors
    assert door.width == pytest.approx(0.9, abs=WIDTH)
    assert door.state == "shut"


def test_a_gap_over_which_something_hangs_is_no_doorway() -> None:
    points = two_rooms((2.0, 2.9, 0.0, 1.85))
    assert storey(points).doors == ()


def test_what_a_mirror_shows_is_not_the_other_side_of_the_wall() -> None:
    """Behind a mirror beside the window stands what it shows, less deep than the window's frame."""
    points = opened(box_room(0, 0, 6, 4), (2.0, 3.2, 0.9, 2.2), deep=0.3)
    ghost = wall((4.0, 4.1), (4.9, 4.1), 0.6, 1.9)
    [found] = storey(points, window(2.0, 3.2, 0.9, 2.2, deep=0.15), ghost).windows
    assert found.width == pytest.approx(1.2, abs=WIDTH)


def test_a_shut_house_door_at_the_outer_side_of_a_thick_wall() -> None:
    points = opened(box_room(0, 0, 6, 4), (2.0, 3.0, 0.0, 2.1), deep=0.6)
    plan = storey(points, wall((2.0, 4.55), (3.0, 4.55), 0, 2.1))
    [door] = plan.doors
    assert door.width == pytest.approx(1.0, abs=WIDTH)
    assert door.state == "shut"
    assert plan.windows == ()


@pytest.mark.parametrize("foot", [0.0, 0.3])
def test_a_mirror_is_no_doorway_where_wall_shows_under_it_or_behind_it(foot: float) -> None:
    rooms = two_rooms() if foot == 0 else box_room(0, 0, 6, 4)
    ghost = level(2.0, 4.03, 2.9, 4.0 + THICK, 0.0)
    plan = storey(without(rooms, (2.0, 3.9, foot), (2.9, 4.1, 2.1)), ghost)
    assert plan.doors == ()


def test_of_a_window_whose_reveals_on_one_side_were_not_seen_the_wall_beside_it_tells_the_width() -> None:
    points = opened(box_room(0, 0, 6, 4), (2.0, 3.6, 0.9, 2.2), deep=0.15)
    seen = without(np.concatenate([points, window(2.0, 3.6, 0.9, 2.2)]), (3.35, 4.01, 0), (3.7, 4.6, 2.5))
    [found] = storey(seen).windows
    assert found.width == pytest.approx(1.6, abs=0.05)


def test_a_window_behind_a_bench_is_no_gap_down_to_the_floor() -> None:
    """What stands before it may be taken for the floor."""
    points = opened(box_room(0, 0, 6, 4), (2.0, 2.8, 0.7, 2.1), deep=0.15)
    bench = box(0.1, 3.2, 5.9, 4.0, 0.65)
    points = without(points, (0.1, 3.2, -0.1), (5.9, 4.1, 0.65))
    [found] = storey(points, bench, window(2.0, 2.8, 0.7, 2.1)).windows
    assert found.width == pytest.approx(0.8, abs=WIDTH)


def test_a_gap_that_nobody_looked_through_is_unknown() -> None:
    points = without(box_room(0, 0, 6, 4), (2.0, 3.9, -0.1), (3.0, 4.1, 2.7))
    cloud = evidence(points)
    [found] = find_storeys(cloud)
    voxels = storey_voxels(cloud, found, None)
    lines = np.array([[6.0, 4.0, 0.0, 4.0]]) - np.tile(voxels.origin, 2)
    elevations = draw_elevations(lines, np.array([False]), voxels)
    ends = [np.array(tip) - voxels.origin for tip in ((6.0, 4.0), (3.0, 4.0), (2.0, 4.0), (0.0, 4.0))]
    faces = [Face(0, ends[0], ends[1], 1.0), Face(0, ends[2], ends[3], 1.0)]
    openings = find_openings(faces, elevations, np.zeros(len(elevations.upper)), voxels, 2)
    [unknown] = openings.unknown
    assert openings.doors + openings.windows == ()
    assert unknown.id == "S2-U1"
    assert unknown.width == pytest.approx(1.0, abs=0.06)


def test_partitions_have_no_openings() -> None:
    cloud = evidence(box_room(0, 0, 3, 3))
    voxels = storey_voxels(cloud, find_storeys(cloud)[0], None)
    ends = np.array([[0.0, 0.0], [3.0, 0.0]]) - voxels.origin
    elevations = draw_elevations(ends.reshape(1, 4), np.array([True]), voxels)
    assert find_openings([Face(0, *ends, 1.0)], elevations, np.zeros(len(elevations.upper)), voxels, 0).all == ()


def test_without_faces_there_are_no_openings() -> None:
    cloud = evidence(box_room(0, 0, 3, 3))
    voxels = storey_voxels(cloud, find_storeys(cloud)[0], None)
    elevations = draw_elevations(np.zeros((0, 4)), np.zeros(0, dtype=bool), voxels)
    assert find_openings([], elevations, np.zeros(0), voxels, 0).all == ()
    assert find_leaves(np.zeros((0, 4)), np.zeros(0), np.zeros(0), voxels) == []


@pytest.mark.parametrize(("across", "up"), [(4, 3), (5, 5), (8, 1)])
def test_closing_is_the_closing_of_morphology(across: int, up: int) -> None:
    from scipy import ndimage

    cells = np.random.default_rng(0).random((60, 40)) < 0.15
    padded = np.pad(cells, ((across, across), (up, up)))
    expected = ndimage.binary_closing(padded, np.ones((across, up)))[across:-across, up:-up]
    assert (close_cells(cells, across, up) == expected).all()
