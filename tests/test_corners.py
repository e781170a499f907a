"""Faces meet exactly where the walls of a known room meet."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt import extract_floor_plan
from asbuilt.corners import cut_at_walls, drop_columns
from asbuilt.faces import Face
from rooms import box, box_room, evidence, level, segments, walls, without

CORNER = 0.005


def plan(*parts: np.ndarray) -> np.ndarray:
    return segments(extract_floor_plan(evidence(*parts)))


def ring_of(found: np.ndarray) -> np.ndarray:
    """Corners of faces that follow one another around a room, from the least one on; each start is another's end."""
    following = {tuple(face[:2]): tuple(face[2:]) for face in found}
    assert len(following) == len(found)
    corners = [min(following)]
    while following[corners[-1]] != corners[0]:
        corners.append(following[corners[-1]])
    assert len(corners) == len(found)
    return np.array(corners)


def off(corners: np.ndarray, ring: list[tuple[float, float]]) -> float:
    """How far the corners, from whichever on, are from those of a ring at most, m."""
    assert len(corners) == len(ring)
    return min(float(np.hypot(*(np.roll(corners, i, axis=0) - ring).T).max()) for i in range(len(ring)))


@pytest.mark.parametrize(
    ("ring", "floor"),
    [
        pytest.param([(0, 0), (5, 0), (5, 4), (0, 4)], [(0, 0, 5, 4)], id="rectangle"),
        pytest.param(
            [(0, 0), (6, 0), (6, 3), (3, 3), (3, 5), (0, 5)], [(0, 0, 6, 3), (0, 3, 3, 5)], id="a corner inward"
        ),
        pytest.param(
            [(0, 0), (6, 0), (6, 4), (4, 4), (4, 3.4), (3, 3.4), (3, 4), (0, 4)],
            [(0, 0, 6, 3.4), (0, 3.4, 3, 4), (4, 3.4, 6, 4)],
            id="a chimney breast",
        ),
    ],
)
def test_faces_close_around_a_room(ring: list[tuple[float, float]], floor: list[tuple[float, ...]]) -> None:
    levels = [level(*part, z) for part in floor for z in (0.0, 2.6)]
    found = ring_of(plan(walls(ring), *levels))
    assert off(found, ring) < CORNER


def test_splayed_walls_meet_where_their_lines_cross() -> None:
    ring = [(0.0, 0.0), (6.0, 0.0), (5.0, 4.0), (1.0, 3.0)]
    inside = level(0, 0, 6, 4, 0)
    for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
        normal = np.array([a[1] - b[1], b[0] - a[0]])
        inside = inside[(inside[:, :2] - a) @ normal > 0]
    found = ring_of(plan(walls(ring), inside, inside + np.array([0, 0, 2.6])))
    assert off(found, ring) < CORNER


def test_a_hidden_corner_is_closed() -> None:
    # a wardrobe stands in the corner: up to 2.2 m neither wall is seen within 0.6 m of it, nor the floor
    wardrobe = box(0, 0, 0.6, 0.6, 2.2)
    seen = wardrobe[(wardrobe[:, :2] > 0.001).all(axis=1)]
    found = plan(without(box_room(0, 0, 5, 4), (-0.1, -0.1, -0.1), (0.6, 0.6, 2.2)), seen)
    assert off(ring_of(found), [(0, 0), (5, 0), (5, 4), (0, 4)]) < CORNER


def test_a_column_is_left_out() -> None:
    room = without(without(box_room(0, 0, 7, 5), (3, 2, -0.01), (3.4, 2.4, 0.01)), (3, 2, 2.59), (3.4, 2.4, 2.61))
    column = box(3, 2, 3.4, 2.4, 2.6)
    assert len(plan(room, column[column[:, 2] < 2.59])) == 4


def faces(*lines: tuple[float, float, float, float]) -> list[Face]:
    return [Face(i, np.array(line[:2], float), np.array(line[2:], float), 9.0) for i, line in enumerate(lines)]


def ends(found: list[Face]) -> list[list[float]]:
    return [[round(float(v), 6) for v in (*face.start, *face.end)] for face in found]


def test_a_face_is_cut_where_a_wall_stands_against_it() -> None:
    # a wall of 0.2 m stands on the long face: the rooms to its left and right see one face each
    found = cut_at_walls(faces((0, 0, 9, 0), (4, 0.02, 4, 3), (4.2, 3, 4.2, -0.01)))
    assert ends(found) == [[0, 0, 4, 0], [4.2, 0, 9, 0], [4, 0, 4, 3], [4.2, 3, 4.2, 0]]
    assert cut_at_walls([]) == []


def test_columns_are_loops_that_look_outward() -> None:
    outward = faces((0, 0, 0, 0.4), (0, 0.4, 0.4, 0.4), (0.4, 0.4, 0.4, 0), (0.4, 0, 0, 0))
    inward = [Face(face.line, face.end, face.start, face.score) for face in outward]
    assert drop_columns(outward) == []
    assert drop_columns(inward) == inward
    wide = [Face(face.line, face.start * 9 + 5, face.end * 9 + 5, face.score) for face in outward]
    assert drop_columns(wide + outward) == wide
    assert drop_columns([]) == []
