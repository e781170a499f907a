"""Stairs made by construction: their outline, which way they go up, and what rises but is no stair."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from shapely import Point, Polygon

import asbuilt
import buildings
import rooms
from asbuilt.plan import Stair
from asbuilt.profiles import StoreyVoxels
from asbuilt.stairs import find_stairs

Array = NDArray[np.float64]
HEIGHT = 2.8
ROOM = rooms.box_room(0, 0, 8, 6, 0.0, HEIGHT)


def flight(x: float, y: float, rise: float = 0.175, going: float = 0.28, width: float = 1.0, count: int = 15) -> Array:
    """Treads and risers of a straight flight that goes up along x."""
    parts = []
    for i in range(count):
        x0, z = x + i * going, (i + 1) * rise
        parts.append(rooms.level(x0, y, x0 + going, y + width, z))
        parts.append(rooms.wall((x0, y), (x0, y + width), z - rise, z))
    return np.concatenate(parts)


def spiral(x: float, y: float, radius: float = 0.9, rise: float = 0.19, count: int = 12, turn: float = 27.0) -> Array:
    """Open treads about a newel, counter-clockwise from the x axis."""
    parts = []
    for i in range(count):
        grid = np.arange(-radius, radius, rooms.SPACING)
        u, v = (part.ravel() for part in np.meshgrid(grid, grid))
        angle = np.degrees(np.arctan2(v, u)) % 360
        tread = (np.hypot(u, v) < radius) & (np.hypot(u, v) > 0.1) & (angle >= i * turn) & (angle < (i + 1) * turn)
        parts.append(np.column_stack([x + u[tread], y + v[tread], np.full(tread.sum(), (i + 1) * rise)]))
    return np.concatenate(parts)


def room_with(part: Array) -> Array:
    """The room with something in it, over which the ceiling is open."""
    low, high = part[:, :2].min(axis=0), part[:, :2].max(axis=0)
    return np.concatenate([rooms.without(ROOM, (*low, HEIGHT - 0.1), (*high, HEIGHT + 0.1)), part])


def found(part: Array) -> tuple[Stair, ...]:
    """The stairs in the room with something in it."""
    return find_stairs(rooms.voxels_of(room_with(part)), 0)


def test_a_straight_flight() -> None:
    (stair,) = found(flight(2.0, 3.0))
    assert stair.id == "S0-ST1"
    outline = Polygon(stair.ring)
    true = Polygon([(2.0, 3.0), (6.2, 3.0), (6.2, 4.0), (2.0, 4.0)])
    assert outline.intersection(true).area / outline.union(true).area > 0.9
    assert len(stair.ring) == 4
    assert outline.exterior.is_ccw
    start, end = stair.path
    assert start == pytest.approx((2.0, 3.5), abs=0.1)
    assert end == pytest.approx((6.2, 3.5), abs=0.25)
    assert stair.rise == pytest.approx(14 * 0.175, abs=0.2)


def test_it_goes_up_where_it_goes_up() -> None:
    down = flight(2.0, 3.0) * (-1, 1, 1) + (8.0, 0, 0)
    (stair,) = found(down)
    assert stair.path[0][0] > stair.path[-1][0]


@pytest.mark.parametrize("degrees", [17.0, 45.0, 120.0])
def test_at_any_angle(degrees: float) -> None:
    (stair,) = find_stairs(rooms.voxels_of(rooms.turned(room_with(flight(2.0, 3.0)), degrees)), 0)
    middle = rooms.turned(np.array([4.1, 3.5, 0]), degrees)
    assert Polygon(stair.ring).contains(Point(middle[:2]))
    assert Polygon(stair.ring).area == pytest.approx(4.2, rel=0.1)


def test_a_spiral_stair_turns() -> None:
    (stair,) = found(spiral(4.0, 3.0))
    outline = Polygon(stair.ring)
    assert outline.intersection(Point(4, 3).buffer(0.9)).area > 0.8 * outline.area
    assert outline.area > 1.3
    assert len(stair.path) > 2
    turned = np.unwrap([math.atan2(y - 3, x - 4) for x, y in stair.path])
    assert turned[-1] - turned[0] > math.radians(200)


def test_a_flight_of_which_the_upper_half_shows_by_its_risers() -> None:
    steps = flight(2.0, 3.0)
    treads = np.abs(steps[:, 2] / 0.175 - np.round(steps[:, 2] / 0.175)) < 1e-6
    (stair,) = found(steps[~treads | (steps[:, 2] < 1.5)])
    assert stair.path[-1][0] > 5.3
    assert Polygon(stair.ring).within(Polygon([(1.9, 2.9), (6.3, 2.9), (6.3, 4.1), (1.9, 4.1)]))


SHELVES = np.concatenate([rooms.level(3, 0.05, 4, 0.4, 0.17 * i) for i in range(1, 12)])
RAMP = np.column_stack([flight(2.0, 3.0)[:, :2], (flight(2.0, 3.0)[:, 0] - 2.0) * 0.6])
ROOF = np.column_stack([flight(2.0, 3.0)[:, :2], (flight(2.0, 3.0)[:, 0] - 2.0) * 1.0])


@pytest.mark.parametrize(
    "thing",
    [
        SHELVES,
        RAMP,
        ROOF,
        flight(2.0, 3.0, count=3),  # a dais
        flight(2.0, 3.0, rise=0.4, count=6),  # seats of a lecture hall
        flight(2.0, 3.0, rise=0.06, count=15),
        flight(2.0, 3.0, going=0.9, width=0.6, count=6),  # tables and cupboards, each higher than the last
        flight(2.0, 3.0, width=0.1),  # books
        np.add(flight(2.0, 3.0, count=6), (0, 0, 1.0)),  # it does not reach the floor
    ],
    ids=["shelves", "ramp", "roof", "dais", "seats", "low", "furniture", "narrow", "hanging"],
)
def test_what_is_no_stair(thing: Array) -> None:
    assert found(thing) == ()


def test_uneven_heights_are_no_flight() -> None:
    heights = [0.16, 0.42, 0.5, 0.75, 0.86, 1.1, 1.2, 1.45]
    boxes = [rooms.box(2 + 0.4 * i, 3, 2.4 + 0.4 * i, 3.6, high) for i, high in enumerate(heights)]
    assert found(np.concatenate(boxes)) == ()


def test_empty() -> None:
    nothing = np.zeros((0, 2))
    voxels = StoreyVoxels(
        np.zeros(2), nothing.astype(np.int32), nothing, np.zeros(0), np.zeros((0, 3)), voxel=0.05, height=2.5
    )
    assert find_stairs(voxels, 0) == ()
    assert found(np.zeros((1, 3))) == ()


def test_stairs_are_in_the_plan() -> None:
    plan = asbuilt.extract_floor_plan(rooms.evidence(room_with(flight(2.0, 3.0))))
    (stair,) = plan.storeys[0].stairs
    assert stair.id == "S0-ST1"


@pytest.mark.slow
def test_stairs_of_a_generated_house() -> None:
    made = buildings.generate(6, preset="house")
    plan = asbuilt.extract_floor_plan(asbuilt.evidence_from_points(made.points))
    for storey, truth in zip(plan.storeys, made.truth["storeys"], strict=True):
        assert len(storey.stairs) == len(truth["stairs"])
        for stair, true in zip(storey.stairs, truth["stairs"], strict=True):
            seen = Polygon(stair.ring)
            assert seen.intersection(Polygon(true["polygon"])).area > 0.75 * seen.area
            up = np.reshape(true["up"], (2, 2))
            way = np.subtract(stair.path[-1], stair.path[0])
            assert way @ (up[1] - up[0]) > 0.9 * np.hypot(*way) * np.hypot(*(up[1] - up[0]))
