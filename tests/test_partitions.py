"""Free-standing partitions have two faces; cupboards and tables that stand free have none."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt import extract_floor_plan
from asbuilt.partitions import find_partitions
from asbuilt.profiles import StoreyVoxels
from rooms import box, box_room, evidence, lying_on, segments, wall, without

#: Where the two faces share voxels, second moments part them: a few millimetres.
ASIDE = 0.006
#: A partition's end has no wall to meet: it is where its steps of 5 cm end.
END = 0.06


def plan(thing: tuple[float, ...], high: float, *more: np.ndarray) -> np.ndarray:
    """A room of 5.5 by 4 m with a box standing free in it."""
    x0, y0, x1, y1 = thing
    room = without(box_room(0, 0, 5.5, 4, 0, 3), (x0, y0, -0.01), (x1, y1, 0.01))
    return segments(extract_floor_plan(evidence(room, box(*thing, high), *more)))


@pytest.mark.parametrize(("thickness", "y"), [(0.06, 2.0), (0.06, 2.03), (0.1, 2.0), (0.1, 2.013), (0.12, 2.03)])
def test_a_partition_has_two_faces(thickness: float, y: float) -> None:
    found = plan((1, y, 4, y + thickness), 2.1)
    assert len(found) == 6
    for face in (y, y + thickness):
        ((low, high),) = lying_on(found, (1, face), (4, face), ASIDE)
        assert (low, high) == pytest.approx((0, 3), abs=END)


@pytest.mark.parametrize("thickness", [0.06, 0.1])
def test_each_face_is_seen_from_its_own_side(thickness: float) -> None:
    found = plan((1, 2, 4, 2 + thickness), 2.1)
    lower, upper = sorted((line for line in found if 1.9 < line[1] < 2.3), key=lambda line: line[1])
    assert lower[0] > lower[2]
    assert upper[0] < upper[2]


def test_a_partition_in_line_with_another_wall_has_two_faces() -> None:
    # a pier on the far wall stands in its line, 1.2 m further on
    pier = box(5.2, 1.95, 5.5, 2.15, 3.0)
    found = plan((1, 2, 4, 2.1), 2.1, pier[pier[:, 0] < 5.499])
    for face in (2.0, 2.1):
        pieces = lying_on(found, (1, face), (4, face), ASIDE)
        assert pieces == pytest.approx(np.array([[0, 3]]), abs=END)


def test_a_screen_where_the_floor_is_some_steps_higher() -> None:
    x0, y0, x1, y1 = 7.0, 2.0, 10.0, 2.1
    high = without(box_room(5.7, 0, 11, 4, 0.3, 3), (x0, y0, 0.29), (x1, y1, 0.31))
    found = segments(extract_floor_plan(evidence(box_room(0, -4, 5.5, 4, 0, 3), high, box(x0, y0, x1, y1, 2.4, 0.3))))
    for face in (y0, y1):
        ((low, end),) = lying_on(found, (x0, face), (x1, face), ASIDE)
        assert (low, end) == pytest.approx((0, 3), abs=END)


def test_a_screen_of_which_the_front_was_seen_has_a_back_and_parts_no_room() -> None:
    x0, y0, x1, y1 = 1.0, 2.0, 4.0, 2.06
    room = without(box_room(0, 0, 5.5, 4, 0, 3), (x0, y0, -0.01), (x1, y1, 0.01))
    storey = extract_floor_plan(evidence(room, wall((x1, y0), (x0, y0), 0, 2.1))).storeys[0]
    assert len(storey.wall_faces) == 6
    front, back = sorted((f for f in storey.wall_faces if 1.9 < f.start[1] < 2.1), key=lambda f: f.start[1])
    assert (front.start[1], back.start[1]) == pytest.approx((2.0, 2.05), abs=ASIDE)
    assert (front.seen, back.seen, back.voxels, back.sigma) == (pytest.approx(1, abs=0.05), 0, 0, None)
    # it is drawn so thick, but that was not measured
    (screen,) = (w for w in storey.walls if set(w.faces) == {front.id, back.id})
    assert screen.thickness is None
    assert screen.drawn_thickness == pytest.approx(0.05, abs=1e-6)
    (whole,) = storey.rooms
    assert whole.area == pytest.approx(22, abs=0.2)


@pytest.mark.parametrize(
    ("thing", "high"),
    [
        pytest.param((1, 2, 4, 2.6), 2.1, id="cupboard"),
        pytest.param((2, 2, 2.9, 2.04), 2.0, id="door leaf"),
        pytest.param((2, 2, 3.2, 2.1), 1.6, id="short screen"),
        pytest.param((1, 2, 4, 2.9), 0.75, id="table"),
        pytest.param((2, 2, 4.5, 2.4), 1.2, id="low shelf"),
    ],
)
def test_furniture_is_no_partition(thing: tuple[float, ...], high: float) -> None:
    assert len(plan(thing, high)) == 4


def test_without_lines_or_voxels_nothing_changes() -> None:
    nothing = StoreyVoxels(np.zeros(2), *(np.zeros((0, 2)),) * 2, np.zeros(0), np.zeros((0, 3)), 0.05, 2.6)
    lines, partition = find_partitions(np.zeros((0, 4)), nothing)
    assert lines.shape == (0, 4)
    assert partition.shape == (0,)
