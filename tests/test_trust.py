"""What faces and the things built of them can be trusted with."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

import asbuilt
import rooms
from asbuilt.elevations import Elevations, draw_elevations
from asbuilt.evaluate.faces import reliability
from asbuilt.faces import Face, measure_faces
from asbuilt.plan import Column, Door, Room, Stair, Storey, Wall, WallFace
from asbuilt.profiles import StoreyVoxels
from asbuilt.trust import (
    FEATURES,
    MODEL,
    Looks,
    chance,
    drop_unlikely,
    look_at,
    position_sigma,
    trust_elements,
    trust_faces,
)

Array = NDArray[np.float64]


def unplaced(
    points: Array, *segments: tuple[float, float, float, float]
) -> tuple[list[Face], Elevations, StoreyVoxels]:
    """Faces along segments, each with its room on the left, and what the points of a room show of them."""
    voxels = rooms.voxels_of(points)
    lines = np.array(segments) - np.tile(voxels.origin, 2)
    elevations = draw_elevations(lines, np.zeros(len(lines), dtype=np.bool_), voxels)
    return [Face(i, line[:2], line[2:], 5.0) for i, line in enumerate(lines)], elevations, voxels


def looks_at(points: Array, *segments: tuple[float, float, float, float]) -> tuple[Looks, tuple[WallFace, ...]]:
    """What the points of a room show of faces along segments, each face with its room on the left."""
    faces, elevations, voxels = unplaced(points, *segments)
    wall_faces = trust_faces(measure_faces(faces, voxels, 0), faces, elevations, voxels)
    return look_at(faces, elevations, voxels), wall_faces


def wavy(points: Array, depth: float) -> Array:
    """The points with the southern wall moved in and out, a metre by a metre, as where two scans disagree."""
    moved = points.copy()
    south = np.abs(points[:, 1]) < 1e-9
    moved[south, 1] += np.where(points[south, 0] % 2 < 1, depth, -depth)
    return moved


ROOM = rooms.box_room(0, 0, 6, 5)
SOUTH = (0.0, 0.0, 6.0, 0.0)


def test_what_is_seen_of_a_plain_wall() -> None:
    looks, (face,) = looks_at(ROOM, SOUTH)
    assert looks.scatter[0] < 0.003
    assert looks.disagreement[0] < 0.001
    assert looks.features.shape == (1, len(FEATURES))
    assert face.sigma is not None
    assert 0 < face.sigma < 0.005
    assert face.confidence > 0.9
    assert face.loa in ("LOA50", "LOA40", "LOA30")


def test_stretches_that_disagree_cost_certainty() -> None:
    sigmas = [looks_at(wavy(ROOM, depth), SOUTH)[1][0].sigma for depth in (0.0, 0.003, 0.008)]
    assert sigmas == sorted(sigmas)
    assert sigmas[2] > 2 * sigmas[0]


def test_noise_of_the_points_costs_little() -> None:
    """Ten times the noise is averaged over hundreds of points; ten times the disagreement is not."""
    noisy = looks_at(rooms.noisy(ROOM, 0.006), SOUTH)[0]
    uneven = looks_at(wavy(ROOM, 0.006), SOUTH)[0]
    assert noisy.disagreement[0] < uneven.disagreement[0] / 4


def test_a_plane_in_the_middle_of_a_room_is_unlikely() -> None:
    """A screen below the ceiling and over the floor, both of which go on behind it."""
    screen = rooms.wall((2.0, 2.5), (4.0, 2.5), 0.8, 1.7)
    _, (wall, inside) = looks_at(np.concatenate([ROOM, screen]), SOUTH, (2.0, 2.5, 4.0, 2.5))
    assert inside.confidence < 0.5 < wall.confidence


def test_what_is_unlikely_is_drawn_on_long_sides_of_rooms_alone() -> None:
    """A screen below the ceiling and over the floor: in the room, as its long side, as its short side."""
    points = np.concatenate([ROOM, rooms.wall((2.0, 2.5), (5.0, 2.5), 0.8, 1.7)])
    faces, elevations, voxels = unplaced(points, SOUTH, (2.0, 2.5, 5.0, 2.5), (2.0, 2.5, 3.5, 2.5))
    south, long, short = faces
    half = shapely.transform(shapely.box(2, 2.5, 5, 5), lambda xy: xy - voxels.origin)
    assert drop_unlikely(faces, [], elevations, voxels) == [south]
    assert drop_unlikely(faces, [half], elevations, voxels) == [south, long]
    assert drop_unlikely([replace(short, curve=1)], [], elevations, voxels)
    assert drop_unlikely([], [half], elevations, voxels) == []


def test_the_other_face_of_a_wall_speaks_for_a_face() -> None:
    looks, faces = looks_at(
        np.concatenate([ROOM, rooms.box_room(0, -4.2, 6, -0.2)]), SOUTH, (6.0, -0.2, 0.0, -0.2), (6.0, 5.0, 0.0, 5.0)
    )
    other = looks.features[:, FEATURES.index("other_face")]
    assert other.tolist() == pytest.approx([1.0, 1.0, 0.0], abs=0.01)
    assert all(face.confidence > 0.9 for face in faces)


def test_without_voxels_there_is_no_sigma() -> None:
    _, (_, face) = looks_at(ROOM, SOUTH, (2.0, 2.0, 4.0, 2.0))
    assert face.sigma is None
    assert face.loa is None


def test_no_faces() -> None:
    voxels = rooms.voxels_of(ROOM)
    elevations = draw_elevations(np.array([SOUTH]), np.zeros(1, dtype=np.bool_), voxels)
    assert trust_faces((), (), elevations, voxels) == ()


def test_the_model_has_a_weight_for_each_feature() -> None:
    model = json.loads(MODEL.read_text(encoding="utf-8"))
    assert tuple(model["weights"]) == FEATURES
    assert model["sigma"] > 0


@pytest.mark.parametrize(
    ("feature", "sign"),
    [("scatter", -1), ("ceiling_behind", -1), ("floor_behind", -1), ("score", 1), ("other_face", 1)],
)
def test_what_speaks_for_a_face_and_against_it(feature: str, sign: int) -> None:
    features = np.zeros((2, len(FEATURES)))
    features[1, FEATURES.index(feature)] = 1.0
    without, with_it = chance(features)
    assert sign * (with_it - without) > 0


def test_sigma_grows_with_either_misfit() -> None:
    def sigma(scatter: float, disagreement: float) -> float:
        one = np.ones(1)
        return float(position_sigma(Looks(scatter * one, disagreement * one, np.zeros((1, len(FEATURES))), one > 0))[0])

    assert sigma(0.004, 0.001) == pytest.approx(2 * sigma(0.001, 0.001))
    assert sigma(0.001, 0.004) == pytest.approx(2 * sigma(0.001, 0.001))


FACES = (
    WallFace((0, 0), (4, 0), id="S0-F1", sigma=0.002, confidence=0.9),
    WallFace((4, -0.2), (0, -0.2), id="S0-F2", sigma=0.004, confidence=0.7),
    WallFace((4, 0), (4, 3), id="S0-F3", confidence=0.5),
)
STOREY = Storey(
    0,
    0.0,
    2.5,
    wall_faces=FACES,
    walls=(
        Wall((0, -0.1), (4, -0.1), thickness=0.2, faces=("S0-F1", "S0-F2"), id="S0-W1"),
        Wall((4, 0), (4, 3), faces=("S0-F3",), id="S0-W2"),
    ),
    doors=(
        Door((1, -0.1), (2, -0.1), wall="S0-W1", seen=0.5, rms=0.003, id="S0-D1"),
        Door((9, 9), (9, 8), seen=1.0, id="S0-D2"),
    ),
    rooms=(Room(((0, 0), (4, 0), (4, 3), (0, 3)), id="S0-R1"), Room(((7, 7), (8, 7), (8, 8)), id="S0-R2")),
    columns=(Column((2, 2), 0.3, 0.3, seen=1.0, rms=0.004, id="S0-C1"),),
    stairs=(Stair(((0, 0), (1, 0), (1, 1)), seen=0.6, id="S0-ST1"),),
)


def test_a_wall_of_two_faces_is_surer_than_either() -> None:
    both, one = trust_elements(STOREY).walls
    assert both.confidence == pytest.approx(0.8)
    assert both.sigma == pytest.approx(((0.002**2 + 0.004**2) / 2) ** 0.5 / 2**0.5)
    assert one.confidence == 0.5
    assert one.sigma is None


def test_an_opening_hangs_on_its_wall() -> None:
    in_wall, alone = trust_elements(STOREY).doors
    assert in_wall.confidence == pytest.approx(0.75 * 0.8)
    assert in_wall.sigma is not None
    assert in_wall.sigma > trust_elements(STOREY).walls[0].sigma
    assert alone.confidence == 1.0
    assert alone.sigma is None


def test_a_room_is_as_likely_as_the_faces_along_it() -> None:
    room, nowhere = trust_elements(STOREY).rooms
    assert room.confidence == pytest.approx((4 * 0.9 + 3 * 0.5) / 7, abs=0.02)
    assert nowhere.confidence == 0
    assert nowhere.sigma is None


def test_columns_and_stairs_stand_for_themselves() -> None:
    planned = trust_elements(STOREY)
    (column,) = planned.columns
    assert column.sigma == pytest.approx(0.002)
    assert column.confidence == 1.0
    (half_seen,) = trust_elements(replace(STOREY, columns=(replace(column, seen=0.5),))).columns
    assert half_seen.sigma > column.sigma
    assert half_seen.confidence < 1
    assert planned.stairs[0].sigma is None
    assert planned.stairs[0].confidence == pytest.approx(0.8)


def test_a_storey_without_anything() -> None:
    empty = Storey(0, 0.0, 2.5)
    assert trust_elements(empty) == empty


def test_every_face_of_a_plan_is_given_both() -> None:
    plan = asbuilt.extract_floor_plan(rooms.evidence(ROOM))
    assert len(plan.wall_faces) == 4
    assert all(0.5 < face.confidence <= 1 and face.sigma for face in plan.wall_faces)
    assert reliability([]) == []
