"""Floors and ceilings of rooms of known height."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt import (
    evidence_from_points,
    extract_floor_plan,
    find_floor_and_ceiling,
    find_floor_and_ceiling_by_scan,
    find_storeys,
    height_histogram,
)
from asbuilt.indices import unique_rows
from asbuilt.storeys import drop_strays
from rooms import box, box_room, evidence, level, wall, walls, without

#: The median of a floor's voxels, each by the mean of its own points: 5 mm leaves room for noise of 2 mm that falls
#: into two voxels.
FLOOR = 0.005
#: A ceiling is known to its voxel of 10 cm.
CEILING = 0.1


@pytest.mark.parametrize("floor", [0.0, 0.025, 0.05, 0.09, -3.37, 431.25])
def test_one_storey(floor: float) -> None:
    (found,) = find_storeys(evidence(box_room(0, 0, 5, 4, floor, floor + 2.6)))
    assert found.index == 0
    assert found.floor == pytest.approx(floor, abs=FLOOR)
    assert found.ceiling == pytest.approx(floor + 2.6, abs=CEILING)


def test_three_storeys_with_slabs() -> None:
    floors = (-2.83, 0.0, 3.11)
    found = find_storeys(evidence(*(box_room(0, 0, 6, 5, z, z + 2.55) for z in floors)))
    assert [storey.index for storey in found] == [0, 1, 2]
    assert [storey.floor for storey in found] == pytest.approx(floors, abs=FLOOR)
    assert [storey.ceiling for storey in found] == pytest.approx([z + 2.55 for z in floors], abs=CEILING)


def test_a_missing_ceiling() -> None:
    room = box_room(0, 0, 6, 5)
    (found,) = find_storeys(evidence(room[room[:, 2] < 2.45]))
    assert found.floor == pytest.approx(0.0, abs=FLOOR)
    # what stands on the floor tells how high the room is
    assert found.ceiling == pytest.approx(2.45, abs=CEILING)


def test_missing_ceilings_under_another_storey() -> None:
    """The floor above, which falls into two bins of voxels, is no ceiling."""
    floors = (0.0, 3.002)
    rooms = [box_room(0, 0, 6, 5, z, z + 2.8) for z in floors]
    rooms = [room[room[:, 2] < z + 2.65] for room, z in zip(rooms, floors, strict=True)]
    noise = np.random.default_rng(0).normal(0, 0.004, (sum(map(len, rooms)), 3))
    found = find_storeys(evidence(np.concatenate(rooms) + noise))
    assert [storey.floor for storey in found] == pytest.approx(floors, abs=FLOOR)
    assert [storey.ceiling for storey in found] == pytest.approx([z + 2.65 for z in floors], abs=CEILING)


def test_a_roof_over_missing_ceilings() -> None:
    """The tops of walls under a roof are no floor, and the roof is no ceiling."""
    east = box_room(0, 0, 3, 5)
    west = box_room(3.2, 0, 8, 5)
    rooms = [room[room[:, 2] < 2.45] for room in (east, west)]
    # A pitched roof, from 3 m at the eaves to 5.5 m at the ridge.
    roof = level(-0.5, -0.5, 8.5, 5.5, 0.0)
    roof[:, 2] = 3.0 + 2.5 * (1 - np.abs(roof[:, 1] - 2.5) / 3.0)
    (found,) = find_storeys(evidence(*rooms, roof))
    assert found.floor == pytest.approx(0.0, abs=FLOOR)
    assert found.ceiling == pytest.approx(2.45, abs=CEILING)


def test_strays_above_and_below() -> None:
    rng = np.random.default_rng(4)
    strays = np.concatenate([rng.uniform((-500, -500, z), (500, 500, z + 400), (700, 3)) for z in (-400, 3)])
    (found,) = find_storeys(evidence(box_room(0, 0, 6, 5), strays))
    assert found.floor == pytest.approx(0.0, abs=FLOOR)
    assert found.ceiling == pytest.approx(2.6, abs=CEILING)


def test_the_ground_outside_is_no_floor() -> None:
    ground = without(level(-6, -6, 14, 12, -0.35), (-0.3, -0.3, -1), (8.3, 6.3, 1))
    outside = walls([(-0.3, -0.3), (-0.3, 6.3), (8.3, 6.3), (8.3, -0.3)], -0.35, 3.0)
    (found,) = find_storeys(evidence(box_room(0, 0, 8, 6), ground, outside))
    assert found.floor == pytest.approx(0.0, abs=FLOOR)


def test_tables_and_dropped_ceilings_are_neither() -> None:
    room = without(box_room(0, 0, 8, 6), (0, 0, 2.5), (4, 6, 2.7))
    dropped = level(0, 0, 4, 6, 2.4)
    (found,) = find_storeys(evidence(room, dropped, *(box(x, 2, x + 1.6, 3, 0.75) for x in (1, 3, 5))))
    assert found.floor == pytest.approx(0.0, abs=FLOOR)
    assert found.ceiling == pytest.approx(2.6, abs=CEILING)


def test_another_building_at_half_a_storey_is_told() -> None:
    cloud = evidence(box_room(0, 0, 6, 5), box_room(12, 0, 17, 5, 1.3, 3.9))
    (found,) = find_storeys(cloud)
    assert found.floor == pytest.approx(0.0, abs=FLOOR)
    assert found.steps == pytest.approx((1.3,), abs=CEILING)
    (note,) = extract_floor_plan(cloud).notes
    assert "floors at 0.00 and about 1.4 m are taken for one storey" in note  # to a voxel of 10 cm
    stage = without(box_room(0, 0, 8, 6), (-1, -1, -1), (1.5, 7, 0.6))
    (found,) = find_storeys(evidence(stage, level(0, 0, 1.5, 6, 0.6)))
    assert found.steps == ()


def test_nothing_to_stand_on() -> None:
    assert find_storeys(evidence_from_points(np.zeros((0, 3)))) == []
    assert find_storeys(evidence_from_points(np.zeros((1, 3)))) == []
    assert find_storeys(evidence(wall((0, 0), (5, 0)))) == []


def test_the_papers_floor_and_ceiling() -> None:
    occupied = evidence(box_room(0, 0, 6, 5, 0.03, 2.63)).occupied(0.1)
    histogram = height_histogram(occupied, 0.1)
    assert histogram.counts.sum() == len(occupied)
    assert np.array_equal(histogram.counts, np.bincount(occupied[:, 2] - occupied[:, 2].min()))
    assert find_floor_and_ceiling(histogram) == pytest.approx((0.05, 2.65), abs=1e-9)


def test_a_histogram_without_peaks() -> None:
    empty = height_histogram(np.zeros((0, 3), dtype=np.int32), 0.1)
    assert len(empty.counts) == len(empty.heights) == 0
    assert find_floor_and_ceiling(empty) is None
    assert find_floor_and_ceiling(height_histogram(np.zeros((1, 3), dtype=np.int32), 0.1)) is None


def test_drop_strays_leaves_surfaces_whole() -> None:
    surface = unique_rows(evidence(box_room(0, 0, 5, 4)).occupied(0.1))
    alone = np.array([[500, 500, 500], [-300, 2, 7]])
    both = unique_rows(np.concatenate([surface, alone]))
    assert np.array_equal(drop_strays(both), surface)
    assert np.array_equal(drop_strays(drop_strays(both)), surface)
    assert len(drop_strays(both[:0])) == 0


def test_each_scan_has_the_heights_of_its_own_room() -> None:
    low = evidence_from_points(box_room(0, 0, 5, 4, 0.0, 2.4), scan="low")
    high = evidence_from_points(box_room(8, 0, 13, 4, 0.5, 3.6), scan="high")
    found = find_floor_and_ceiling_by_scan(low.merged(high))
    # the middle of a bin of 10 cm, on either side of a surface that lies on its edge
    assert found["low"] == pytest.approx((0.0, 2.4), abs=CEILING)
    assert found["high"] == pytest.approx((0.5, 3.6), abs=CEILING)
    assert find_floor_and_ceiling_by_scan(evidence_from_points(np.zeros((0, 3)))) == {}
