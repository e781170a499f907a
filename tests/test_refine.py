"""Merging collinear pieces, and fitting lines to their cells."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt import fit_to_cells, merge_collinear
from asbuilt.grid import Grid
from asbuilt.ground import GroundPlaneHistogram
from asbuilt.params import LineParameters, RefineParameters


def turned(segments: list[tuple[float, float, float, float]], degrees: float) -> np.ndarray:
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return (np.array(segments).reshape(-1, 2) @ np.array([[cosine, sine], [-sine, cosine]])).reshape(-1, 4)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0, 179.0])
def test_pieces_of_one_line_become_one(degrees: float) -> None:
    pieces = [(0.0, 0.0, 3.0, 0.0), (3.5, 0.02, 5.0, 0.02), (7.0, 0.0, 5.6, 0.0), (1.0, 0.05, 2.0, 0.05)]
    merged = merge_collinear(turned(pieces, degrees))
    # the longest piece keeps its line
    assert merged == pytest.approx(turned([(0.0, 0.0, 7.0, 0.0)], degrees))


def test_a_piece_between_two_joins_them_in_any_order() -> None:
    pieces = turned([(0, 0, 2, 0), (2.5, 0, 4, 0), (4.5, 0, 6, 0)], 12)
    for order in ([0, 1, 2], [2, 0, 1], [1, 2, 0]):
        assert merge_collinear(pieces[order]) == pytest.approx(turned([(0, 0, 6, 0)], 12))


@pytest.mark.parametrize(
    "other",
    [
        pytest.param((3.8, 0, 5, 0), id="too wide a gap"),
        pytest.param((3.2, 0.12, 5, 0.12), id="too far aside"),
        pytest.param((3.2, 0.0, 4.0, 0.06), id="turned too far"),
        pytest.param((1, -1, 1, 1), id="across"),
    ],
)
def test_what_stays_apart(other: tuple[float, float, float, float]) -> None:
    assert len(merge_collinear(turned([(0, 0, 3, 0), other], 33))) == 2


def test_each_limit_is_a_parameter() -> None:
    pieces = turned([(0, 0, 3, 0), (3.8, 0.12, 5, 0.12)], 0)
    assert len(merge_collinear(pieces, RefineParameters(merge_gap=0.9))) == 2
    assert len(merge_collinear(pieces, RefineParameters(merge_distance=0.2))) == 2
    assert len(merge_collinear(pieces, RefineParameters(merge_gap=0.9, merge_distance=0.2))) == 1


def test_merging_twice_changes_nothing() -> None:
    rng = np.random.default_rng(0)
    cuts = [np.sort(rng.uniform(0, 9, 8)).reshape(4, 2) for _ in range(6)]
    rows = [(low, y + rng.normal(0, 0.01), high, y) for y, row in enumerate(cuts) for low, high in row]
    once = merge_collinear(turned(rows, 25))
    assert 6 <= len(once) < len(rows)
    again = merge_collinear(once)
    assert again[np.lexsort(again.T)] == pytest.approx(once[np.lexsort(once.T)])


def test_nothing_to_merge() -> None:
    assert merge_collinear(np.zeros((0, 4))).shape == (0, 4)


def test_a_line_moves_to_the_weighted_mean_of_its_cells() -> None:
    counts = np.zeros((40, 40), dtype=np.int64)
    counts[5:35, 20], counts[5:35, 21] = 30, 10
    histogram = GroundPlaneHistogram(Grid(0.1, (0, 0), counts.shape), counts)
    lines = LineParameters(sigmas=0.5)
    mean = (30 * 2.05 + 10 * 2.15) / 40
    fitted = fit_to_cells(np.array([[0.6, 2.08, 3.4, 2.08], [3.4, 2.1, 0.6, 2.1]]), histogram, lines)
    assert fitted == pytest.approx(np.array([[0.6, mean, 3.4, mean], [3.4, mean, 0.6, mean]]))


def test_a_line_without_cells_stays() -> None:
    counts = np.zeros((40, 40), dtype=np.int64)
    counts[5:35, 20] = 30
    histogram = GroundPlaneHistogram(Grid(0.1, (0, 0), counts.shape), counts)
    far = np.array([[0.5, 0.5, 2.0, 0.5], [1.0, 1.0, 1.0, 1.0]])
    assert np.array_equal(fit_to_cells(far, histogram, LineParameters()), far)
    assert fit_to_cells(far[:0], histogram, LineParameters()).shape == (0, 4)
