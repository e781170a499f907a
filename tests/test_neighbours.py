"""Segments found by place, against a look at all pairs."""

from __future__ import annotations

import numpy as np
import shapely

from asbuilt.neighbours import near_ahead, near_each, near_pairs

RANDOM = np.random.default_rng(3)
SEGMENTS = np.hstack([places := RANDOM.uniform(0, 20, (60, 2)), places + RANDOM.normal(0, 2, (60, 2))])
OTHERS = RANDOM.uniform(0, 20, (40, 4))


def test_pairs_are_those_that_are_near() -> None:
    lines, others = (shapely.linestrings(ends.reshape(-1, 2, 2)) for ends in (SEGMENTS, OTHERS))
    expected = np.nonzero(shapely.distance(lines[:, None], others) <= 0.7)
    assert len(expected[0]) > 20
    assert np.array_equal(near_pairs(SEGMENTS, OTHERS, 0.7), expected)


def test_of_each_in_order() -> None:
    near = near_each(SEGMENTS[:, :2], OTHERS[:, 2:], 3.0)
    apart = np.hypot(*np.moveaxis(SEGMENTS[:, None, :2] - OTHERS[:, 2:], 2, 0))
    assert near == [np.flatnonzero(row <= 3.0).tolist() for row in apart]
    assert [] in near


def test_what_may_continue_a_segment_is_ahead_of_it() -> None:
    along = SEGMENTS[:, 2:] - SEGMENTS[:, :2]
    further = np.tile(2.0 * along / np.hypot(*along.T)[:, None], 2) * [-1, -1, 1, 1]
    pairs = set(zip(*(found.tolist() for found in near_ahead(SEGMENTS, 2.0, 0.5)), strict=True))
    lines, others = (shapely.linestrings(ends.reshape(-1, 2, 2)) for ends in (SEGMENTS + further, SEGMENTS))
    continuing = shapely.distance(lines[:, None], others) <= 0.5
    assert pairs >= set(zip(*(found.tolist() for found in np.nonzero(continuing)), strict=True))
    level = np.array([[0.0, 0.0, 1.0, 0.0], [4.0, 0.1, 5.0, 0.1], [0.0, 0.7, 1.0, 0.7], [3.1, 0.0, 4.0, 0.0]])
    assert np.array_equal(near_ahead(level, 2.0, 0.5), [[0, 0, 1, 1, 2, 3, 3, 3], [0, 3, 1, 3, 2, 0, 1, 3]])


def test_none() -> None:
    nothing = np.zeros((0, 4))
    assert near_each(nothing, SEGMENTS, 1.0) == []
    assert near_each(SEGMENTS[:2], nothing, 1.0) == [[], []]
