"""What stands where on a storey, on cells of 2 cm: looked up in nanoseconds, however many walls there are.

Cells lie in tiles, and a tile that is all alike is kept once. So the memory goes with the length of the walls, not with
the extent of the building.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from asbuilt.grid import FloatArray, IntArray

CELL = 0.02
"""Side of a cell, m: what is decided at its middle holds for all of it, so borders are off by 14 mm at most."""
_TILE = 32  # cells along the side of a tile
_CELLS = _TILE * _TILE
_MAX_TILES = 2**20  # of 64 cm, 650 m each way; beyond that cells grow, so that a stray wall does not fill the memory


@dataclass(frozen=True)
class Frame:
    """Tiles over a rectangle: `columns` by `rows` of them from the corner (x0, y0), m, in cells of `cell` m."""

    x0: float
    y0: float
    columns: int
    rows: int
    cell: float = CELL

    @property
    def tile(self) -> float:
        """Side of a tile, m."""
        return _TILE * self.cell

    @property
    def cells(self) -> int:
        """How many cells a tile has."""
        return _CELLS

    @staticmethod
    def around(shapes: Sequence[shapely.Geometry], margin: float) -> Frame:
        """The frame that holds all shapes, with `margin` (m) and a tile around them."""
        x0, y0, x1, y1 = shapely.total_bounds(list(shapes)) if shapes else (0.0, 0.0, 0.0, 0.0)
        cell = CELL
        while (x1 - x0) * (y1 - y0) / (_TILE * cell) ** 2 > _MAX_TILES:
            cell *= 2.0
        side = _TILE * cell
        columns, rows = (int((high - low + 2 * margin) // side) + 3 for low, high in ((x0, x1), (y0, y1)))
        return Frame(float(x0) - margin - side, float(y0) - margin - side, columns, rows, cell)

    def boxes(self) -> NDArray[np.object_]:
        """The tiles as polygons, row after row."""
        x, y = (start + self.tile * np.arange(n) for start, n in ((self.x0, self.columns), (self.y0, self.rows)))
        xs, ys = (values.ravel() for values in np.meshgrid(x, y))
        boxes: NDArray[np.object_] = shapely.box(xs, ys, xs + self.tile, ys + self.tile)
        return boxes

    def centres(self, tiles: IntArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates x and y (m) of the middle of each cell of tiles (n,), each (n, 1024)."""
        rows, columns = np.divmod(tiles, self.columns)
        steps = (np.arange(_TILE) + 0.5) * self.cell
        y, x = (values.ravel() for values in np.meshgrid(steps, steps, indexing="ij"))
        return self.x0 + columns[:, None] * self.tile + x, self.y0 + rows[:, None] * self.tile + y


class Raster:
    """For each cell the number of a region, 0 for nothing.

    Parameters
    ----------
    frame : where the cells are.
    tiles : the tiles that hold several regions (n,), by their place in the frame.
    regions : numbers of their cells (n, 1024).
    plain : for each tile of the frame the region that fills it (columns * rows,).
    """

    def __init__(self, frame: Frame, tiles: IntArray, regions: IntArray, plain: IntArray) -> None:
        self.frame = frame
        most = int(max(regions.max(initial=0), plain.max(initial=0)))
        dtype = np.min_scalar_type(most)
        # a tile for each region, for wherever it fills tiles; after them those that hold several
        self._place = plain.astype(np.int64)
        self._place[tiles] = np.arange(len(tiles)) + most + 1
        filled = np.repeat(np.arange(most + 1, dtype=dtype), _CELLS)
        self._cells = np.concatenate([filled, regions.astype(dtype).ravel()])

    def at(self, x: FloatArray, y: FloatArray) -> IntArray:
        """The region of each point (n,)."""
        frame, scale = self.frame, 1.0 / self.frame.cell
        # whatever is far away falls into the empty tiles along the border
        ix = np.clip((x - frame.x0) * scale, 0, frame.columns * _TILE - 1).astype(np.int64)
        iy = np.clip((y - frame.y0) * scale, 0, frame.rows * _TILE - 1).astype(np.int64)
        place = self._place.take((iy >> 5) * frame.columns + (ix >> 5))
        cells: IntArray = self._cells.take(((place << 10) | ((iy & 31) << 5)) | (ix & 31))
        return cells


def distances(shape: shapely.Geometry, x: FloatArray, y: FloatArray) -> FloatArray:
    """Distance (m) of points to a polygon or a line, 0 within; shapely's own takes ten times as long for many points.

    Parameters
    ----------
    shape : Polygon without holes, or LineString.
    x, y : of the points, m, of any one shape.
    """
    corners = shapely.get_coordinates(shape)
    nearest: FloatArray = np.full(x.shape, np.inf)
    for (ax, ay), (bx, by) in itertools.pairwise(corners):
        ux, uy = bx - ax, by - ay
        px, py = x - ax, y - ay
        along = np.clip((px * ux + py * uy) / max(ux * ux + uy * uy, 1e-18), 0.0, 1.0)
        np.minimum(nearest, (px - along * ux) ** 2 + (py - along * uy) ** 2, out=nearest)
    np.sqrt(nearest, out=nearest)
    if shapely.get_dimensions(shape) == 2:
        shapely.prepare(shape)
        nearest[shapely.contains_xy(shape, x, y)] = 0.0
    return nearest
