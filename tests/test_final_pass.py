"""One face, one segment: what is joined, what stays apart, and what is left out."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt.faces import Face
from asbuilt.final_pass import finish_faces


def face(x1: float, y1: float, x2: float, y2: float, curve: int | None = None) -> Face:
    return Face(0, np.array([x1, y1]), np.array([x2, y2]), 1.0, curve=curve)


def ends(faces: list[Face]) -> set[tuple[float, ...]]:
    return {tuple(np.round([*one.start, *one.end], 6).tolist()) for one in faces}


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_pieces_of_one_face_are_joined(order: tuple[int, ...]) -> None:
    # bent by 2 cm, and with a gap too narrow for an opening
    pieces = [face(0, 0, 2, 0.02), face(2, 0.02, 4, 0), face(4.2, 0, 6, 0)]
    assert ends(finish_faces([pieces[i] for i in order])) == {(0, 0, 6, 0)}


@pytest.mark.parametrize(
    "second",
    [
        (2.5, 0, 4, 0),  # an opening between
        (2, 0.1, 4, 0.1),  # a step of 10 cm
        (4, 0, 2, 0),  # the other way
        (2, 0, 4, 0.6),  # a corner of 17 degrees
    ],
)
def test_faces_of_their_own_stay_apart(second: tuple[float, float, float, float]) -> None:
    assert len(finish_faces([face(0, 0, 2, 0), face(*second)])) == 2


def test_faces_between_which_a_wall_stands_stay_apart() -> None:
    # a wall of 0.2 m stands against the plane of both
    apart = [face(0, 0, 2, 0), face(2.2, 0, 4, 0), face(2, 0, 2, 3), face(2.2, 3, 2.2, 0)]
    assert ends(finish_faces(apart)) == ends(apart)


def test_chords_of_a_curve_are_not_joined() -> None:
    chords = [face(0, 0, 1, 0.02, curve=0), face(1, 0.02, 2, 0, curve=0)]
    assert ends(finish_faces(chords)) == ends(chords)


def test_a_bit_inside_a_wall_is_left_out() -> None:
    wall = [face(0, 0, 4, 0), face(4, -0.2, 0, -0.2)]
    assert ends(finish_faces([*wall, face(2, 0, 2.1, -0.2)])) == ends(wall)
    # the end of a wall, and a face as long as a wall's, are none
    for kept in (face(4, 0, 4, -0.2), face(2, 0, 2, 1.0)):
        assert len(finish_faces([*wall, kept])) == 3


def test_nothing_gives_nothing() -> None:
    assert finish_faces([]) == []
