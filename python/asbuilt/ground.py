"""The ground-plane histogram (section 3.2 of the paper): occupied voxels above each cell of the ground plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asbuilt.grid import Grid, IntArray


@dataclass(frozen=True)
class GroundPlaneHistogram:
    """Counts of occupied voxels over a grid of ground cells.

    Attributes
    ----------
    grid : its cells; one voxel wide.
    counts : (nx, ny) occupied voxels above each cell.
    """

    grid: Grid
    counts: IntArray


def ground_plane_histogram(occupied: IntArray, voxel: float) -> GroundPlaneHistogram:
    """Project occupied voxels (n, 3) of side `voxel` (m) onto the ground plane and count them (section 3.2, figure 3).

    Without voxels the grid has the shape (0, 0).
    """
    grid = Grid.around(occupied[:, :2], voxel)
    return GroundPlaneHistogram(grid, grid.count(occupied[:, :2]))


def threshold_cells(histogram: GroundPlaneHistogram, sigmas: float, over: str = "all") -> NDArray[np.int32]:
    """Cells (n, 2), from the grid's first cell, that are denser than mean + `sigmas` * deviation (3.3, figure 4a).

    `over` takes mean and standard deviation over "all" cells of the rectangle or the "occupied" ones; the paper does
    not say which.
    """
    counts = histogram.counts
    sample = counts if over == "all" else counts[counts > 0]
    if sample.size == 0:
        return np.zeros((0, 2), dtype=np.int32)
    return np.argwhere(counts > sample.mean() + sigmas * sample.std()).astype(np.int32)
