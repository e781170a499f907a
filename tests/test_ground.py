"""The ground-plane histogram and its threshold, against plain NumPy."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from asbuilt import ground_plane_histogram, threshold_cells
from asbuilt.grid import Grid
from rooms import box_room, evidence


def voxels(seed: int = 0) -> np.ndarray:
    return np.unique(np.random.default_rng(seed).integers((-9, 4, 0), (12, 20, 25), (800, 3)), axis=0)


def test_counts_voxels_above_each_cell() -> None:
    occupied = voxels()
    histogram = ground_plane_histogram(occupied, 0.1)
    twin = Counter(map(tuple, occupied[:, :2].tolist()))
    low = occupied[:, :2].min(axis=0)
    assert histogram.grid.low == tuple(low)
    for (ix, iy), count in np.ndenumerate(histogram.counts):
        assert count == twin[ix + low[0], iy + low[1]]
    assert histogram.counts.sum() == len(occupied)


def test_moving_the_voxels_moves_the_grid_alone() -> None:
    here, there = (
        ground_plane_histogram(voxels(), 0.1),
        ground_plane_histogram(voxels() + np.array([1000, -70, 5]), 0.1),
    )
    assert np.array_equal(here.counts, there.counts)
    assert there.grid.low == (here.grid.low[0] + 1000, here.grid.low[1] - 70)


def test_cells_become_metres_in_their_middle() -> None:
    grid = Grid(0.1, (-3, 20), (5, 4))
    assert grid.to_metres(np.array([[0, 0], [4, 3]])) == pytest.approx(np.array([[-0.25, 2.05], [0.15, 2.35]]))
    assert grid.extent == pytest.approx((-0.3, 0.2, 2.0, 2.4))
    # half a cell each way is the cell's own rectangle
    assert grid.to_metres(np.array([-0.5, -0.5])) == pytest.approx((-0.3, 2.0))


def test_what_lies_outside_of_a_grid_is_not_counted() -> None:
    grid = Grid(0.1, (0, 0), (2, 2))
    assert np.array_equal(grid.count(np.array([[0, 0], [1, 1], [1, 1], [2, 0], [-1, 1]])), [[1, 0], [0, 2]])


@pytest.mark.parametrize("over", ["all", "occupied"])
@pytest.mark.parametrize("sigmas", [-1.0, 0.0, 1.0, 2.5])
def test_threshold(over: str, sigmas: float) -> None:
    histogram = ground_plane_histogram(voxels(), 0.1)
    sample = histogram.counts.ravel()
    if over == "occupied":
        sample = sample[sample > 0]
    limit = sample.mean() + sigmas * sample.std()
    expected = [cell for cell, count in np.ndenumerate(histogram.counts) if count > limit]
    assert [tuple(cell) for cell in threshold_cells(histogram, sigmas, over)] == expected


def test_walls_are_dense_and_floors_are_not() -> None:
    occupied = evidence(box_room(0.05, 0.05, 5.05, 4.05), sigma=0.0).occupied(0.1)
    histogram = ground_plane_histogram(occupied, 0.1)
    dense = {tuple(cell) for cell in threshold_cells(histogram, 1.0)}
    rim = {(i, j) for i in range(51) for j in range(41) if i in (0, 50) or j in (0, 40)}
    assert dense == rim


def test_no_voxels() -> None:
    histogram = ground_plane_histogram(np.zeros((0, 3), dtype=np.int32), 0.1)
    assert histogram.counts.shape == histogram.grid.shape == (0, 0)
    for over in ("all", "occupied"):
        assert threshold_cells(histogram, 2.0, over).shape == (0, 2)
