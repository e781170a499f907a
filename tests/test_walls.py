"""Faces become walls: thickness only where both faces were seen, junctions that close, one wall over its doors."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from asbuilt.plan import Door, Point, Wall, WallFace
from asbuilt.walls import attach, find_walls

Array = NDArray[np.float64]
EXACT = 1e-9
"""Only rounding parts corners that are the same, m."""


def faces(*chains: list[Point]) -> list[WallFace]:
    """Faces along chains of points, the room on their left."""
    pairs = [pair for chain in chains for pair in pairwise(chain)]
    return [WallFace(a, b, id=f"S0-F{i + 1}", seen=0.9, rms=0.002, voxels=100) for i, (a, b) in enumerate(pairs)]


def ring(x0: float, y0: float, x1: float, y1: float) -> list[Point]:
    """Inside of a room, from its first corner back to it."""
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]


def walls(found: list[WallFace], *doors: Door, unseen: float = 0.1) -> tuple[Wall, ...]:
    return find_walls(found, doors, 0, unseen)


def along_x(found: tuple[Wall, ...], y: float) -> list[Wall]:
    """Walls whose centrelines lie at a height of the plan."""
    return [w for w in found if abs(w.start[1] - y) < 1e-6 and abs(w.end[1] - y) < 1e-6]


def has_corner(wall: Wall, corner: Point, within: float = EXACT) -> bool:
    return bool(np.hypot(*(np.array(wall.outline) - corner).T).min() < within)


def turned(found: list[WallFace], degrees: float, shift: Point) -> list[WallFace]:
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))

    def moved(point: Point) -> Point:
        return float(cos * point[0] - sin * point[1] + shift[0]), float(sin * point[0] + cos * point[1] + shift[1])

    return [WallFace(moved(f.start), moved(f.end), id=f.id, seen=f.seen, rms=f.rms, voxels=f.voxels) for f in found]


def test_two_faces_measure_a_thickness_and_one_does_not() -> None:
    [wall] = walls(faces([(0, 0), (4, 0)], [(4, -0.24), (0, -0.24)]))
    assert wall.thickness == pytest.approx(0.24)
    assert wall.drawn_thickness == pytest.approx(0.24)
    assert wall.faces == ("S0-F1", "S0-F2")
    assert (*wall.start, *wall.end) == pytest.approx((0, -0.12, 4, -0.12))
    assert (wall.id, wall.voxels) == ("S0-W1", 200)
    assert wall.seen == pytest.approx(0.9)
    [single] = walls(faces([(0, 0), (4, 0)]), unseen=0.16)
    assert single.thickness is None
    assert single.drawn_thickness == pytest.approx(0.16)
    assert single.start == pytest.approx((0, -0.08))  # its body lies behind the face that was seen


def test_a_face_shorter_than_any_wall_is_none() -> None:
    assert walls(faces([(0, 0), (0.05, 0)])) == ()


@pytest.mark.parametrize("apart", [0.02, 0.8])
def test_what_is_too_thin_or_too_thick_is_no_wall_of_two_faces(apart: float) -> None:
    found = walls(faces([(0, 0), (4, 0)], [(4, -apart), (0, -apart)]))
    assert [wall.thickness for wall in found] == [None, None]


def test_faces_that_look_at_each_other_are_two_walls() -> None:
    found = walls(faces([(0, 0), (4, 0)], [(4, 0.5), (0, 0.5)]))
    assert [wall.thickness for wall in found] == [None, None]


def test_a_wall_is_measured_where_both_rooms_see_it_and_not_beyond() -> None:
    found = walls(faces([(0, 0), (6, 0)], [(3, -0.2), (0, -0.2)]))
    assert [wall.length for wall in found] == pytest.approx([3, 3])
    assert sorted(wall.thickness is None for wall in found) == [False, True]


@pytest.mark.parametrize(("degrees", "shift"), [(0.0, (0.0, 0.0)), (33.0, (0.0, 0.0)), (12.0, (4.5e5, 5.4e6))])
def test_at_an_l_both_walls_share_their_corners(degrees: float, shift: Point) -> None:
    inner, outer = [(0.0, 3.0), (0.0, 0.0), (4.0, 0.0)], [(4.0, -0.3), (-0.3, -0.3), (-0.3, 3.0)]
    one, other = walls(turned(faces(inner, outer), degrees, shift))
    rounding = EXACT * max(1.0, *shift)
    assert one.thickness == pytest.approx(0.3, abs=rounding)
    [diagonal] = turned(faces([inner[1], outer[1]]), degrees, shift)
    for corner in (diagonal.start, diagonal.end):
        assert has_corner(one, corner, rounding)
        assert has_corner(other, corner, rounding)
    apart = [np.hypot(*np.subtract(a, b)) for a in (one.start, one.end) for b in (other.start, other.end)]
    assert min(apart) < rounding


def test_at_a_t_the_wall_ends_on_the_face_of_the_one_that_goes_on() -> None:
    found = walls(faces([(0, 0), (2, 0), (2, 3)], [(2.1, 3), (2.1, 0), (5, 0)], [(5, -0.2), (0, -0.2)]))
    [through] = along_x(found, -0.1)
    assert (through.start[0], through.end[0]) == pytest.approx((0, 5))
    [stem] = [w for w in found if w is not through]
    assert stem.thickness == pytest.approx(0.1)
    assert has_corner(stem, (2, 0))
    assert has_corner(stem, (2.1, 0))
    assert min(stem.start[1], stem.end[1]) == pytest.approx(-0.1)  # centreline to centreline


def test_a_wall_goes_on_over_its_door_and_nowhere_else() -> None:
    split = faces([(0, 0), (2, 0)], [(2.9, 0), (5, 0)], [(5, -0.2), (2.9, -0.2)], [(2, -0.2), (0, -0.2)])
    door = Door((2.0, -0.1), (2.9, -0.1), id="S0-D1")
    [wall] = walls(split, door)
    assert wall.length == pytest.approx(5)
    assert len(wall.faces) == 4
    assert sorted(w.length for w in walls(split)) == pytest.approx([2.0, 2.1])


def test_a_door_is_drawn_on_the_centreline_of_its_wall() -> None:
    found = walls(faces([(0, 0), (5, 0)], [(5, -0.2), (0, -0.2)], [(0, 4), (0, 0)]))
    [door] = attach([Door((2.0, -0.03), (2.9, -0.03), id="S0-D1")], found)
    [wall] = along_x(found, -0.1)
    assert door.wall == wall.id
    assert (*door.start, *door.end) == pytest.approx((2.0, -0.1, 2.9, -0.1))
    lost = Door((2.0, 2.0), (2.9, 2.0), id="S0-D2")
    assert attach([lost], found) == (lost,)
    assert attach([lost], ()) == (lost,)


def test_an_opening_in_a_wall_seen_from_one_side_lies_in_the_wall_as_drawn() -> None:
    found = walls(faces([(0, 0), (5, 0)]))
    for aside in (0.0, -0.17):  # on the face, or in the middle of what was guessed from behind
        [door] = attach([Door((2.9, aside), (2.0, aside), id="S0-D1")], found)
        assert door.wall == "S0-W1"
        assert (*door.start, *door.end) == pytest.approx((2.9, -0.05, 2.0, -0.05))


def test_a_wall_goes_on_over_the_door_in_the_corner_of_a_room() -> None:
    sides = faces([(0, 4), (0, 0)], [(1.1, 0), (5, 0)], [(5, -0.2), (1.1, -0.2)])
    door = Door((0.1, -0.1), (1.0, -0.1), id="S0-D1")
    [wall] = along_x(walls(sides, door), -0.1)
    assert sorted((wall.start[0], wall.end[0])) == pytest.approx([-0.05, 5])  # the other's centreline
    assert has_corner(wall, (0, 0))
    [attached] = attach([door], [wall])
    assert attached.wall == wall.id
    [short] = along_x(walls(sides), -0.1)
    assert short.length == pytest.approx(3.9)
    far = Door((-2.0, -0.1), (-1.1, -0.1), id="S0-D2")
    assert along_x(walls(sides, far), -0.1) == [short]


def test_an_opening_within_one_wall_does_not_stretch_the_next() -> None:
    found = walls(
        faces([(0, 0), (3, 0)], [(3, 0.1), (6, 0.1)], [(6, -0.2), (0, -0.2)]), Door((3.2, 0.0), (4.1, 0.0), id="D")
    )
    assert sorted(wall.length for wall in found) == pytest.approx([3, 3], abs=0.01)


def test_a_room_has_four_walls_that_close_about_it() -> None:
    found = walls(faces(ring(0, 0, 4, 3)))
    assert len(found) == 4
    for x, y in ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)):
        assert sum(has_corner(wall, (x, y)) for wall in found) == 2
    for x, y in ((-0.1, -0.1), (4.1, -0.1), (4.1, 3.1), (-0.1, 3.1)):
        assert sum(has_corner(wall, (x, y)) for wall in found) == 2


@pytest.mark.parametrize("length", [0.15, 0.3, 0.5, 0.9])
@pytest.mark.parametrize("thickness", [0.1, 0.3])
def test_a_short_wall_meets_another_with_one_end_only(length: float, thickness: float) -> None:
    # a pier that stands on a wall: both its ends are near the wall
    pier = [(0.0, 0.0), (2.0, 0.0), (2.0, length), (2.0 + thickness, length), (2.0 + thickness, 0.0), (5.0, 0.0)]
    step = [(0.0, 0.0), (0.0, length), (4.0, length)]
    for found in (walls(faces(pier, [(5, -0.2), (0, -0.2)])), walls(faces(step))):
        assert min(wall.length for wall in found) > 0.09


def test_no_outline_crosses_itself_however_faces_stand_together() -> None:
    for seed in range(300):
        rng = np.random.default_rng(seed)
        # walls shorter than thick, corners that coincide: to a decimetre as often as to a centimetre
        ends = np.round(rng.uniform(0, 1, (int(rng.integers(2, 9)), 2, 2)), 1 + seed % 2).tolist()
        found = walls([WallFace((*a,), (*b,), id=f"F{i}") for i, (a, b) in enumerate(ends) if a != b])
        for ring in (shapely.Polygon(wall.outline) for wall in found):
            assert ring.is_valid
            assert ring.area > 0
            assert ring.exterior.is_ccw


def test_a_wall_whose_mitres_meet_within_it_is_a_triangle() -> None:
    # a bevel of 12 cm on a corner that stands into the room, its walls drawn 20 cm thick
    found = walls(faces([(3.0, 0.0), (0.085, 0.0), (0.0, 0.085), (0.0, 3.0)]), unseen=0.2)
    bevel = next(wall for wall in found if wall.faces == ("S0-F2",))
    assert len(bevel.outline) == 3
    for corner in ((0.085, 0.0), (0.0, 0.085)):
        assert has_corner(bevel, corner)


def test_chords_of_a_round_wall_stay_single() -> None:
    turns = np.radians(np.arange(0.0, 91.0, 7.5))
    inner, outer = ([(float(r * np.cos(t)), float(r * np.sin(t))) for t in turns] for r in (5.0, 5.2))
    found = [WallFace(face.start, face.end, 0, id=face.id) for face in faces(inner, outer[::-1])]
    chords = walls(found)
    assert {wall.curve for wall in chords} == {0}
    measured = [wall.thickness for wall in chords if wall.thickness is not None]
    assert len(measured) >= 12
    assert measured == pytest.approx([0.2] * len(measured), abs=0.005)
    assert max(wall.length for wall in chords) < 0.9


def test_survey_coordinates_lose_nothing() -> None:
    far = (4.5e5, 5.4e6)
    near = walls(faces(ring(0, 0, 4, 3), [(4, -0.2), (0, -0.2)]))
    found = walls(turned(faces(ring(0, 0, 4, 3), [(4, -0.2), (0, -0.2)]), 0, far))
    for one, other in zip(near, found, strict=True):
        assert np.array(other.outline) - far == pytest.approx(np.array(one.outline), abs=1e-6)
        assert other.thickness == (None if one.thickness is None else pytest.approx(one.thickness, abs=1e-6))


def test_without_faces_there_are_no_walls() -> None:
    assert find_walls([], [], 0, 0.1) == ()
