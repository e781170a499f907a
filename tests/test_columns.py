"""Columns made by construction: where they stand, how large they are, and what is none."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import asbuilt
import buildings
import rooms
from asbuilt.columns import find_columns, fit_shape
from asbuilt.plan import Column
from asbuilt.profiles import StoreyVoxels

Array = NDArray[np.float64]
HEIGHT = 2.6
ROOM = rooms.box_room(0, 0, 8, 6, 0.0, HEIGHT)


def cylinder(x: float, y: float, radius: float, low: float = 0.0, high: float = HEIGHT, seen: float = 360.0) -> Array:
    """Points of the outside of an upright cylinder, of which `seen` degrees were seen."""
    turns = np.radians(np.arange(0, seen, np.degrees(rooms.SPACING / radius)))
    turn, z = (part.ravel() for part in np.meshgrid(turns, np.arange(low, high, rooms.SPACING)))
    return np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn), z])


def without_top(x0: float, y0: float, x1: float, y1: float, high: float = HEIGHT) -> Array:
    """The four sides of a column."""
    return rooms.walls([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], 0.0, high)


def room_with(*parts: Array) -> Array:
    """The empty room with more in it, on whose footprints no floor is seen."""
    room = ROOM
    for part in parts:
        room = rooms.without(room, (*part[:, :2].min(axis=0), -0.1), (*part[:, :2].max(axis=0), 0.1))
    return np.concatenate([room, *parts])


def found(*parts: Array) -> tuple[Column, ...]:
    """The columns in the empty room with more in it."""
    return find_columns(rooms.voxels_of(room_with(*parts)), 0)


def test_a_square_column_is_measured_to_millimetres() -> None:
    (column,) = found(without_top(3.0, 2.0, 3.4, 2.6))
    assert column.id == "S0-C1"
    assert column.shape == "square"
    assert column.centre == pytest.approx((3.2, 2.3), abs=0.003)
    assert sorted([column.width, column.depth]) == pytest.approx([0.4, 0.6], abs=0.005)
    assert column.seen > 0.9
    assert 0 < column.rms < 0.01


def test_a_round_column_is_measured_to_millimetres() -> None:
    (column,) = found(cylinder(4.0, 3.0, 0.15))
    assert column.shape == "round"
    assert column.centre == pytest.approx((4.0, 3.0), abs=0.003)
    assert column.width == column.depth == pytest.approx(0.3, abs=0.004)


def test_the_rotation_is_that_of_the_width() -> None:
    parts = rooms.turned(room_with(without_top(3.0, 2.0, 3.7, 2.4)), 28.0)
    (column,) = find_columns(rooms.voxels_of(parts), 0)
    corners = rooms.turned(np.array([[3.0, 2.0, 0], [3.7, 2.0, 0], [3.7, 2.4, 0], [3.0, 2.4, 0]]), 28.0)[:, :2]
    ring = np.array(column.ring)
    apart = np.hypot(*(ring[:, None] - corners).transpose(2, 0, 1))
    assert apart.min(axis=0).max() < 0.006


def test_columns_are_named_from_left_to_right() -> None:
    columns = found(cylinder(6.0, 3.0, 0.2), without_top(2.0, 2.0, 2.3, 2.3), cylinder(4.0, 2.0, 0.1))
    assert [column.id for column in columns] == ["S0-C1", "S0-C2", "S0-C3"]
    assert [column.shape for column in columns] == ["square", "round", "round"]


def test_half_a_round_column_is_enough() -> None:
    (column,) = found(cylinder(4.0, 3.0, 0.2, seen=200.0))
    assert column.centre == pytest.approx((4.0, 3.0), abs=0.005)
    assert column.seen < 0.8


def test_two_sides_that_meet_give_a_rectangle() -> None:
    sides = [rooms.wall((3.0, 2.0), (3.5, 2.0), 0, HEIGHT), rooms.wall((3.0, 2.0), (3.0, 2.4), 0, HEIGHT)]
    (column,) = found(np.concatenate(sides))
    assert column.centre == pytest.approx((3.25, 2.2), abs=0.015)
    assert sorted([column.width, column.depth]) == pytest.approx([0.4, 0.5], abs=0.02)


@pytest.mark.parametrize(
    "thing",
    [
        rooms.box(3.0, 2.0, 3.6, 2.6, 2.0),  # a cupboard that stands free
        rooms.box(3.0, 2.0, 3.4, 2.4, HEIGHT, low=1.9),  # a hood under the ceiling
        cylinder(4.0, 3.0, 0.02),  # a pole
        rooms.wall((3.0, 2.0), (3.6, 2.0), 0, HEIGHT),  # one side of something
        without_top(3.0, 2.0, 3.6, 2.08),  # the end of a partition
        without_top(3.0, 0.0, 3.5, 0.4),  # a pilaster
        without_top(3.0, 2.0, 5.0, 4.0),  # a shaft
    ],
    ids=["cupboard", "hood", "pole", "side", "partition", "pilaster", "shaft"],
)
def test_what_is_no_column(thing: Array) -> None:
    assert found(thing) == ()


def test_a_pier_under_a_lintel_is_wall() -> None:
    pier = without_top(3.0, 2.0, 3.5, 2.25)
    lintel = [rooms.wall(a, b, 2.0, HEIGHT) for y in (2.0, 2.25) for a, b in (((0, y), (3, y)), ((3.5, y), (8, y)))]
    assert find_columns(rooms.voxels_of(room_with(pier), *lintel), 0) == ()
    assert len(found(pier)) == 1


def test_the_floor_goes_on_in_the_corner_of_a_room() -> None:
    """Two walls that meet look like two sides of a column from the wrong side."""
    sides = [rooms.wall((3.0, 2.0), (3.6, 2.0), 0, HEIGHT), rooms.wall((3.0, 2.0), (3.0, 2.6), 0, HEIGHT)]
    corner = np.concatenate(sides)
    assert find_columns(rooms.voxels_of(ROOM, corner), 0) == ()
    assert len(found(corner)) == 1


def test_empty() -> None:
    nothing = np.zeros((0, 2))
    voxels = StoreyVoxels(
        np.zeros(2), nothing.astype(np.int32), nothing, np.zeros(0), np.zeros((0, 3)), voxel=0.05, height=2.5
    )
    assert find_columns(voxels, 0) == ()


def test_points_all_about_fit_neither_shape() -> None:
    points = np.random.default_rng(1).uniform(0, 0.8, (2000, 2))
    assert fit_shape(points, np.zeros((2000, 3))) is None


def test_a_column_is_no_wall_face() -> None:
    plan = asbuilt.extract_floor_plan(
        rooms.evidence(room_with(without_top(3.0, 2.0, 3.6, 2.8), cylinder(6.0, 3.0, 0.3)))
    )
    (storey,) = plan.storeys
    assert [column.shape for column in storey.columns] == ["square", "round"]
    middles = [((f.start[0] + f.end[0]) / 2, (f.start[1] + f.end[1]) / 2) for f in storey.wall_faces]
    assert len(middles) == 4
    assert all(math.dist(middle, column.centre) > 1 for middle in middles for column in storey.columns)


@cache
def building(name: str) -> buildings.Building:
    preset, seed = name.rsplit("-", 1)
    return buildings.generate(int(seed), preset=preset)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["office-7", "museum-8", "flat-0"])
def test_columns_of_generated_buildings(name: str) -> None:
    made = building(name)
    plan = asbuilt.extract_floor_plan(asbuilt.evidence_from_points(made.points))
    for storey, truth in zip(plan.storeys, made.truth["storeys"], strict=True):
        true = [np.array(column["polygon"])[:-1].mean(axis=0) for column in truth["columns"]]
        hits = [min((math.dist(c.centre, t) for t in true), default=9.0) < 0.05 for c in storey.columns]
        assert all(hits)
        assert sum(hits) >= 0.8 * len(true)
