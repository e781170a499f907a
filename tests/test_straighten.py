"""Lines drawn askew by two planes: laid along the one that holds most of their points."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt import _core
from asbuilt.straighten import straighten

BAND = 0.03


def places_of(points: np.ndarray) -> _core.Places:
    cells = np.floor(points / 0.05).astype(np.int32)
    order = np.lexsort((cells[:, 1], cells[:, 0]))
    return _core.Places(points[order], cells[order], 0.05)


def straightened(line: list[float], points: np.ndarray) -> np.ndarray:
    return straighten(np.array([line]), places_of(points), np.ones(len(points)), BAND)[0]


def plane(low: float, high: float, y: float) -> np.ndarray:
    x = np.arange(low, high, 0.02)
    return np.column_stack([x, y + 0.002 * np.sin(40 * x)])


def test_a_line_from_a_wall_to_a_leaf_behind_it_follows_the_wall() -> None:
    points = np.concatenate([plane(0, 2.2, 0.0), plane(2.2, 3.1, 0.05)])
    assert straightened([0.0, -0.015, 3.1, 0.055], points) == pytest.approx([0, 0, 3.1, 0], abs=0.006)


def test_a_line_along_one_plane_and_a_short_one_stay() -> None:
    wall = plane(0, 3, 0.0)
    for line in ([0.0, 0.0, 3.0, 0.0], [0.0, -0.03, 0.9, 0.03]):
        assert straightened(line, wall) == pytest.approx(line, abs=0)


def test_the_chord_of_a_curve_stays() -> None:
    angle = np.arange(-0.3, 0.3, 0.004)
    radius = 5.0
    arc = np.column_stack([radius * np.sin(angle), radius * (1 - np.cos(angle))])
    chord = [-1.2, 0.07, 1.2, 0.07]
    assert straightened(chord, arc) == pytest.approx(chord, abs=0)


def test_no_lines() -> None:
    points = plane(0, 1, 0.0)
    assert straighten(np.zeros((0, 4)), places_of(points), np.ones(len(points)), BAND).shape == (0, 4)
