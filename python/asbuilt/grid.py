"""Grids: the one place where cells become metres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

IntArray = NDArray[np.integer]
FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class Grid:
    """A rectangle of square cells in the ground plane.

    Cells are anchored at multiples of their size in the input's frame, so a grid does not depend on the data's extent.

    Attributes
    ----------
    cell : side of a cell, m.
    low : index (ix, iy) of the first cell; cell (ix, iy) spans [ix, ix + 1) * cell metres.
    shape : number of cells along x and y.
    """

    cell: float
    low: tuple[int, int]
    shape: tuple[int, int]

    @classmethod
    def around(cls, index: IntArray, cell: float) -> Grid:
        """The smallest grid that holds the cells `index` (n, 2); without any it has the shape (0, 0)."""
        if len(index) == 0:
            return cls(cell, (0, 0), (0, 0))
        low, high = index.min(axis=0), index.max(axis=0)
        return cls(cell, (int(low[0]), int(low[1])), (int(high[0] - low[0]) + 1, int(high[1] - low[1]) + 1))

    def count(self, index: IntArray) -> IntArray:
        """How many of the cells `index` (n, 2) fall on each cell of the grid; those outside are left out."""
        local = index - np.array(self.low)
        inside = ((local >= 0) & (local < np.array(self.shape))).all(axis=1)
        flat = np.ravel_multi_index(tuple(local[inside].T), self.shape) if inside.any() else np.zeros(0, np.int64)
        return np.bincount(flat, minlength=self.shape[0] * self.shape[1]).reshape(self.shape)

    def to_metres(self, cells: NDArray[np.generic]) -> FloatArray:
        """World coordinates, m, of positions given in cells (..., 2) from the centre of the grid's first cell."""
        return (np.asarray(cells, dtype=np.float64) + np.array(self.low, dtype=np.float64) + 0.5) * self.cell

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """x0, x1, y0, y1 of the rectangle, m."""
        (ix, iy), (nx, ny) = self.low, self.shape
        return ix * self.cell, (ix + nx) * self.cell, iy * self.cell, (iy + ny) * self.cell
