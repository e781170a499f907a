"""The Hough transform against a readable twin that counts its votes anew for every line."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from asbuilt import detect_lines
from asbuilt.grid import Grid
from asbuilt.ground import GroundPlaneHistogram
from asbuilt.params import LineParameters

CELL = 0.1


def histogram(cells: np.ndarray, low: tuple[int, int] = (0, 0)) -> GroundPlaneHistogram:
    """Ten voxels above each of the cells, in a field that is empty enough for every one to be dense."""
    counts = np.zeros((80, 80), dtype=np.int64)
    counts[tuple(cells.T)] = 10
    return GroundPlaneHistogram(Grid(CELL, low, counts.shape), counts)


def row(x0: int, x1: int, y: int) -> np.ndarray:
    return np.array([(x, y) for x in range(x0, x1)])


def twin(cells: np.ndarray, parameters: LineParameters) -> Iterator[np.ndarray]:
    """Section 3.3's incremental search, by brute force: segments in cells, strongest first."""
    count = round(np.pi / parameters.theta_step)
    normals = np.stack([np.cos(np.pi * np.arange(count) / count), np.sin(np.pi * np.arange(count) / count)])
    x, y = cells.T[:, :, None]  # sums written out: a matrix product may round its last bit otherwise
    reach = np.hypot(*cells.T).max() + 1
    rho = x * normals[0] + y * normals[1]
    bins = np.floor((rho + reach) / parameters.rho_step + 0.5).astype(int)  # (cells, orientations)
    alive = np.ones(len(cells), dtype=bool)
    passed_over = set()
    while True:
        votes = np.stack([np.bincount(bins[alive, i], minlength=bins.max() + 1) for i in range(count)])
        for peak in passed_over:
            votes[peak] = -1
        orientation, bin_ = np.unravel_index(votes.argmax(), votes.shape)
        if votes[orientation, bin_] < parameters.min_votes:
            return
        cosine, sine = normals[:, orientation]
        support = np.flatnonzero(alive & (bins[:, orientation] == bin_))
        along = cells[support, 1] * cosine - cells[support, 0] * sine
        support, along = support[np.argsort(along)], np.sort(along)
        cuts = np.flatnonzero(np.diff(along) > parameters.fill_gap / CELL) + 1
        runs = list(zip(np.split(support, cuts), np.split(along, cuts), strict=True))
        members, place = max(runs, key=lambda run: np.ptp(run[1]))
        if np.ptp(place) < parameters.min_length / CELL or len(members) < parameters.min_votes:
            passed_over.add((orientation, bin_))
            continue
        alive[members] = False
        distance = bin_ * parameters.rho_step - reach
        foot, way = distance * np.array([cosine, sine]), np.array([-sine, cosine])
        yield np.concatenate([foot + place[0] * way, foot + place[-1] * way])


def scattered(seed: int) -> np.ndarray:
    """Four oblique walls and clutter."""
    rng = np.random.default_rng(seed)
    ends = rng.uniform(5, 75, (4, 2, 2))
    share = np.linspace(0, 1, 120)[:, None]
    lines = [np.round(a + share * (b - a)).astype(int) for a, b in ends]
    return np.unique(np.concatenate([*lines, rng.integers(0, 80, (30, 2))]), axis=0)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("change", [{}, {"fill_gap": 0.2}, {"min_length": 1.0}, {"rho_step": 2.0}, {"min_votes": 12}])
def test_incremental_against_its_twin(seed: int, change: dict[str, float]) -> None:
    cells = scattered(seed)
    # three degrees keep the twin quick; a rho of k halves would be decided by a float's last bit
    parameters = LineParameters(sigmas=0.0, theta_step=np.pi / 61, **change)
    expected = np.array(list(twin(cells, parameters))).reshape(-1, 4)
    found = detect_lines(histogram(cells), parameters)
    assert len(expected) >= 4
    assert np.allclose(found, (expected + 0.5) * CELL, atol=1e-9)


@pytest.mark.parametrize("method", ["incremental", "batch"])
def test_a_row_is_one_segment(method: str) -> None:
    found = detect_lines(histogram(row(10, 60, 33)), LineParameters(method=method))
    # orientations within a degree get the same votes over a row of cells one wide: a cell over its length
    assert np.sort(found[0, [0, 2]]) == pytest.approx([1.05, 5.95], abs=0.05)
    assert found[0, [1, 3]] == pytest.approx(3.35, abs=CELL)


def test_the_grids_place_is_the_segments_place() -> None:
    cells = scattered(1)
    here, there = (detect_lines(histogram(cells, low)) for low in ((0, 0), (400, -30)))
    assert np.allclose(here + np.array([40, -3, 40, -3]), there, atol=1e-9)


def test_batch_uses_cells_again_and_incremental_does_not() -> None:
    cross = np.concatenate([row(10, 60, 30), row(10, 60, 30)[:, ::-1]])
    incremental, batch = (
        detect_lines(histogram(np.unique(cross, axis=0)), LineParameters(sigmas=0.0, method=method))
        for method in ("incremental", "batch")
    )
    assert len(incremental) == 2
    assert len(batch) >= 2


def test_stop_by_number() -> None:
    cells = scattered(2)
    strongest = detect_lines(histogram(cells), LineParameters(sigmas=0.0))
    for count in (1, 2, 3):
        for method in ("incremental", "batch"):
            some = detect_lines(histogram(cells), LineParameters(sigmas=0.0, method=method, max_lines=count))
            assert len(some) == count
            if method == "incremental":
                assert np.array_equal(some, strongest[:count])


def test_stop_by_strength() -> None:
    cells = np.concatenate([row(0, 40, 5), row(0, 20, 25), row(0, 8, 45)])
    for votes, expected in ((4, 3), (9, 2), (21, 1), (41, 0)):
        assert len(detect_lines(histogram(cells), LineParameters(sigmas=0.0, min_votes=votes))) == expected


@pytest.mark.parametrize("method", ["incremental", "batch"])
@pytest.mark.parametrize(("gap", "expected"), [(0.45, 2), (0.55, 1)])
def test_fill_gap(method: str, gap: float, expected: int) -> None:
    # four empty cells: five cells from centre to centre
    cells = np.concatenate([row(0, 30, 20), row(34, 70, 20)])
    found = detect_lines(
        histogram(cells), LineParameters(sigmas=0.0, fill_gap=gap, method=method, theta_step=np.pi / 2)
    )
    level = found[np.abs(found[:, 1] - found[:, 3]) < 1e-9]
    assert len(level) == expected


def test_nothing_dense() -> None:
    for method in ("incremental", "batch"):
        parameters = LineParameters(method=method)
        assert detect_lines(histogram(np.zeros((0, 2), dtype=int)), parameters).shape == (0, 4)
        empty = GroundPlaneHistogram(Grid(CELL, (0, 0), (0, 0)), np.zeros((0, 0), dtype=np.int64))
        assert detect_lines(empty, parameters).shape == (0, 4)
