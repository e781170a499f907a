"""What an elevation shows of a wall: its parts against the room it was made from."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt.elevations import Elevations, ceiling_heights, close_gaps, draw_elevations, smooth
from asbuilt.profiles import StoreyVoxels, storey_voxels
from asbuilt.storeys import Level
from rooms import box, box_room, evidence, level, rectangle, voxels_of, wall, walls, without


def elevation(voxels: StoreyVoxels, *line: float) -> Elevations:
    """The elevation of one line, given in the cloud's frame."""
    return draw_elevations(np.array([line]) - np.tile(voxels.origin, 2), np.zeros(1, dtype=np.bool_), voxels)


ROOM = box_room(0, 0, 6, 4)


def on_wall(drawn: Elevations, low: float, high: float) -> np.ndarray:
    place = drawn.position(0)
    return (place > low) & (place < high)


@pytest.mark.parametrize("line", [(0, 0, 6, 0), (6, 0, 0, 0)])
def test_a_bare_wall_is_filled_and_seen_from_its_room(line: tuple[float, ...]) -> None:
    drawn = elevation(voxels_of(ROOM), *line)
    wall = on_wall(drawn, 0.1, 5.9)
    for part in (drawn.upper, drawn.lower, drawn.whole):
        assert part[wall].min() > 0.9
        assert part[~on_wall(drawn, -0.1, 6.1)].max() == 0
    assert (drawn.left[wall] == (line[0] < line[2])).all()
    assert drawn.front[wall].mean() > 1.5
    for part in (drawn.floor_behind, drawn.ceiling_behind, drawn.low_behind):
        assert part[wall].max() == 0


def test_a_line_through_the_middle_has_the_room_on_both_sides() -> None:
    drawn = elevation(voxels_of(ROOM), 0, 2.012, 6, 2.012)
    middle = on_wall(drawn, 0.3, 5.7)
    assert drawn.whole[middle].max() < 0.1
    assert drawn.front[middle].mean() > 1.5
    assert drawn.floor_behind[middle].mean() > 0.9
    assert drawn.ceiling_behind[middle].mean() > 0.9


def test_a_window_leaves_the_wall_under_and_over_it() -> None:
    drawn = elevation(voxels_of(without(ROOM, (2, -0.1, 0.9), (4, 0.1, 2.1))), 0, 0, 6, 0)
    window, wall = on_wall(drawn, 2.2, 3.8), on_wall(drawn, 0.2, 1.8)
    assert drawn.lower[wall].min() > 0.9
    # of 0.15 to 1.9 m, 0.15 to 0.9 m
    assert drawn.lower[window].mean() == pytest.approx(0.75 / 1.75, abs=0.05)
    assert drawn.upper[window].min() > 0.9
    assert drawn.floor_behind[window].max() == 0


def test_behind_a_doorway_the_floor_goes_on() -> None:
    room = without(ROOM, (2, -0.1, 0.02), (3, 0.1, 2.1))
    drawn = elevation(voxels_of(room, level(2, -0.2, 3, 0, 0), box_room(0, -4.2, 6, -0.2)), 0, 0, 6, 0)
    door, wall = on_wall(drawn, 2.2, 2.8), on_wall(drawn, 3.2, 5.8)
    assert drawn.lower[door].max() < 0.1
    assert drawn.floor_behind[door].mean() > 0.8
    assert drawn.floor_behind[wall].max() == 0


def test_ceilings_of_two_rooms() -> None:
    voxels = voxels_of(box_room(0, 0, 6, 4), box_room(0, 4.2, 6, 8, 0, 2.2))
    place = np.array([[3.0, 4.1]]) - voxels.origin
    along, up = np.array([[1.0, 0.0]]), np.array([[0.0, 1.0]])
    assert ceiling_heights(place, along, -up, voxels) == pytest.approx(2.6, abs=0.01)
    assert ceiling_heights(place, along, up, voxels) == pytest.approx(2.2, abs=0.01)
    assert np.isnan(ceiling_heights(place + 50, along, up, voxels)).all()


def test_a_lower_room_whose_ceiling_was_not_scanned() -> None:
    """What stands on the plane tells how high its room is; a cupboard is lower than rooms are."""
    high, low = box_room(0, 0, 8, 4, 0, 3.1), box_room(0, 4.2, 6, 8, 0, 2.7)
    cupboard = wall((1, 2), (3, 2), 0, 2.0)
    cloud = evidence(high[high[:, 2] < 2.95], low[low[:, 2] < 2.55], cupboard)
    voxels = storey_voxels(cloud, Level(0, 0.0, 3.0), None)
    drawn = elevation(voxels, 6, 8, 0, 8)
    assert drawn.upper[on_wall(drawn, 0.5, 5.5)].min() > 0.9
    drawn = elevation(voxels, 1, 2, 3, 2)
    assert drawn.upper[on_wall(drawn, 0.2, 1.8)].max() == 0


def test_under_a_cove_a_wall_ends_lower() -> None:
    """The ceiling is 30 cm lower within 40 cm of the walls: their upper zone is under that."""
    cove = walls([(0, 0), (6, 0), (6, 4), (0, 4)], 0, 2.3)
    tray = without(level(0, 0, 6, 4, 2.3), (0.4, 0.4, 2), (5.6, 3.6, 3))
    room = np.concatenate([cove, level(0, 0, 6, 4, 0), tray, level(0.4, 0.4, 5.6, 3.6, 2.6)])
    drawn = elevation(voxels_of(room), 0, 0, 6, 0)
    assert drawn.upper[on_wall(drawn, 0.5, 5.5)].min() > 0.9


@pytest.mark.parametrize(("width", "cornice"), [(4.0, True), (1.0, False)])
def test_a_cornice_is_told_from_the_lintel_before_a_shut_door(width: float, cornice: bool) -> None:
    high, low = 1 + width, 1.0
    room = without(ROOM, (low + 0.01, -0.1, 0.001), (high - 0.01, 0.1, 2.15))
    reveals = [wall((x, 0), (x, -0.12), 0, 2.15) for x in (low, high)]
    recess = [
        wall((low, -0.12), (high, -0.12), 0, 2.15),
        level(low, -0.12, high, 0, 0),
        level(low, -0.12, high, 0, 2.15),
    ]
    drawn = elevation(voxels_of(room, *reveals, *recess), low, -0.12, high, -0.12)
    middle = on_wall(drawn, width / 2 - 0.2, width / 2 + 0.2)
    assert (drawn.upper[middle].min() > 0.9) == cornice
    assert (drawn.top[middle].min() > 0.9) == cornice


def test_the_top_of_a_wall_is_filled_and_that_of_a_cupboard_is_not() -> None:
    cupboard = box(2, 0, 4, 0.6, 2.3)
    drawn = elevation(voxels_of(ROOM, cupboard[cupboard[:, 1] > 0.001]), 0, 0.6, 6, 0.6)
    assert drawn.top[on_wall(drawn, 2.1, 3.9)].max() == 0
    assert elevation(voxels_of(ROOM), 0, 0, 6, 0).top[on_wall(drawn, 0.1, 5.9)].min() > 0.9


def test_what_a_thin_cloud_shows_counts_as_in_a_dense_one() -> None:
    few = np.random.default_rng(5).random(len(ROOM)) < 0.03
    drawn = elevation(voxels_of(ROOM[few]), 0, 2.012, 6, 2.012)
    middle = on_wall(drawn, 0.3, 5.7)
    assert drawn.ceiling_behind[middle].mean() > 0.8
    assert drawn.floor_behind[middle].mean() > 0.8


@pytest.mark.parametrize(("spacing", "filled"), [(0.2, 0.9), (0.4, 0.0)])
def test_a_wall_far_from_scanners_is_filled_though_its_points_are_few(spacing: float, filled: float) -> None:
    # A point in four cells each way is a surface, one in eight is none.
    far = rectangle((6, 0, 0), (0, 4, 0), (0, 0, 2.6), spacing)
    drawn = elevation(voxels_of(ROOM[ROOM[:, 0] < 5.9], far), 6, 0, 6, 4)
    assert drawn.whole[on_wall(drawn, 0.3, 3.7)].mean() == pytest.approx(filled, abs=0.1)
    assert drawn.covered[on_wall(drawn, 0.3, 3.7)].all()


def test_smoothing_never_crosses_lines() -> None:
    first = np.array([0, 4, 7])
    values = np.array([0, 0, 0, 9.0, 0, 0, 3])
    assert smooth(values, first, 3) == pytest.approx([0, 0, 3, 4.5, 0, 1, 1.5])
    assert smooth(values, first, 1) == pytest.approx(values)


def test_closing_fills_narrow_gaps_alone() -> None:
    first = np.array([0, 9, 12])
    values = np.array([0, 1, 0, 1, 0, 0, 0, 1, 0, 1.0, 0, 1])
    assert close_gaps(values, first, 3) == pytest.approx([0, 1, 1, 1, 0, 0, 0, 1, 0, 1, 1, 1])
