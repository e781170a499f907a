"""The vertical profile of each ground cell (not in the paper).

Walls stand from floor to ceiling; clutter does not. Where the paper counts the voxels above a cell, this keeps which
heights they fill and where, to a millimetre, their points lie.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from asbuilt import _core
from asbuilt.evidence import Evidence
from asbuilt.grid import FloatArray, IntArray
from asbuilt.storeys import SLAB, Level

_BELOW_FLOOR = 0.3
"""Voxels this far below the floor of the lowest storey still belong to it, m: steps, thresholds, sunken floors."""
_OVER_CEILING = 0.1
"""And this far over its ceiling, m: the ceiling's own points."""
TOP_CELL = 0.1
"""Ground cells in which the highest voxels are looked up, m."""
_OVERHEAD = 1.7
"""Lower voxels are no ceiling's, m."""
_UNDERFOOT = 0.7
"""No floor of a storey lies higher over the usual one, m."""


@dataclass(frozen=True)
class StoreyVoxels:
    """The evidence of one storey, about its floor.

    Attributes
    ----------
    origin : (2,) m; x, y of the frame in which `xy` counts.
    index : (n, 2) ground cell of each voxel.
    xy : (n, 2) mean of each voxel's points, m from the origin.
    z : (n,) mean height of each voxel's points above the floor, m.
    covariance : (n, 3: xx, xy, yy) of each voxel's points, m^2.
    voxel : side of a voxel, m.
    height : from floor to ceiling, m.
    thinness : share of the voxels between floor and ceiling that hold one point only; above a half, the cloud is too
        thin to fill the voxels of a surface.
    """

    origin: FloatArray
    index: IntArray
    xy: FloatArray
    z: FloatArray
    covariance: FloatArray
    voxel: float
    height: float
    thinness: float = 0.0

    @cached_property
    def first(self) -> IntArray:
        """Where the voxels of each ground cell begin, and past the last: they come sorted by cell, and upwards."""
        x, y = np.ascontiguousarray(self.index.T)
        new = np.flatnonzero((np.diff(x) != 0) | (np.diff(y) != 0)) + 1
        return np.concatenate([[0], new, [len(x)]]) if len(x) else np.zeros(1, dtype=np.int64)

    @cached_property
    def _places(self) -> _core.Places:
        return _core.Places(self.xy, self.index.astype(np.int32, copy=False), self.voxel)

    def strips(
        self,
        segments: FloatArray,
        half_width: float,
        margin: float = 0.0,
        between: tuple[float, float] | None = None,
    ) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
        """The voxels within `half_width` (m) of each segment (n, 4) and at most `margin` (m) beyond its ends; those
        `between` two heights (m) alone, if they are given.

        Returns
        -------
        segment, voxel : (h,) indices, in their order.
        along, offset : (h,) m from the segment's start, and to its left.
        """
        return self._places.strips(
            np.ascontiguousarray(segments), half_width, margin, self.z if between else None, between
        )

    def hits(self, lines: FloatArray, half_width: float, margin: float, step: float, first: IntArray) -> _core.Hits:
        """The voxels of such strips, to be counted by the steps of each line: they are `step` (m) long and begin at the
        margin before its start; `first` (n + 1,) is where each line's begin.
        """
        steps = np.asarray(first, dtype=np.int64)
        return self._places.hits(self.z, np.ascontiguousarray(lines), half_width, margin, step, steps)

    def in_box(
        self,
        low: Sequence[float] | FloatArray,
        high: Sequence[float] | FloatArray,
        between: tuple[float, float] | None = None,
    ) -> IntArray:
        """Indices (h,) of the voxels in a rectangle between two corners (2,), m; in order. Those `between` two heights
        (m) alone, if they are given.
        """
        ends = (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))
        return self._places.in_box(*ends, self.z if between else None, between)

    @cached_property
    def tops(self) -> tuple[IntArray, FloatArray]:
        """The highest voxel over each cell of `TOP_CELL`: index (2,) of the first cell, and heights (nx, ny) above the
        floor, m. It is minus infinity below 1.7 m, and on the border.
        """
        high = self.first[1:] - 1
        high = high[self.z[high] > _OVERHEAD]
        x, y = np.floor(self.xy[high] / TOP_CELL).astype(np.int64).T
        low = np.array([x.min(initial=0), y.min(initial=0)]) - 1
        tops = np.full((x.max(initial=0) - low[0] + 2, y.max(initial=0) - low[1] + 2), -np.inf)
        np.maximum.at(tops, (x - low[0], y - low[1]), self.z[high])
        return low, tops

    @cached_property
    def bottoms(self) -> tuple[IntArray, FloatArray]:
        """The lowest voxel over each cell of `TOP_CELL`, as in `tops`; infinity above 0.7 m, and on the border."""
        lowest = self.first[:-1]
        lowest = lowest[self.z[lowest] < _UNDERFOOT]
        x, y = np.floor(self.xy[lowest] / TOP_CELL).astype(np.int64).T
        low = np.array([x.min(initial=0), y.min(initial=0)]) - 1
        bottoms = np.full((x.max(initial=0) - low[0] + 2, y.max(initial=0) - low[1] + 2), np.inf)
        np.minimum.at(bottoms, (x - low[0], y - low[1]), self.z[lowest])
        return low, bottoms

    @cached_property
    def roofed(self) -> float:
        """Share of the ground cells in which floor was seen over which something is seen higher than 1.7 m; 1 without
        floor.
        """
        (low, heights), (other, tops) = self.bottoms, self.tops
        x, y = np.array(np.nonzero(np.isfinite(heights))) + (low - other)[:, None]
        inside = (x >= 0) & (y >= 0) & (x < tops.shape[0]) & (y < tops.shape[1])
        covered = np.isfinite(tops[x[inside], y[inside]])
        return float(np.count_nonzero(covered) / len(x)) if len(x) else 1.0


def storey_voxels(evidence: Evidence, level: Level, above: Level | None) -> StoreyVoxels:
    """The voxels between the floor of a storey and its ceiling, strays left out.

    `above` is the storey over this one, or None.
    """
    height = level.ceiling - level.floor
    top = height + _OVER_CEILING
    if above is not None:
        top = min(top, above.floor - SLAB - level.floor)
    # What lies lower under another floor is the ceiling of the storey below.
    low = -(_BELOW_FLOOR if level.index == 0 else SLAB)
    layer = _core.layer_of(
        evidence.index.astype(np.int32, copy=False),
        evidence.mean,
        evidence.height,
        evidence.voxel,
        floor=level.floor,
        between=(low, top),
        factor=2,
        least=8,
    )
    kept = layer["kept"]
    z = evidence.height.take(kept) - level.floor
    single = evidence.count[kept[(z > 0.3) & (z < height - 0.2)]] == 1
    thinness = float(single.mean()) if len(single) else 0.0
    covariance = evidence.covariance.take(kept, axis=0)
    return StoreyVoxels(layer["origin"], layer["cells"], layer["xy"], z, covariance, evidence.voxel, height, thinness)


@dataclass(frozen=True)
class Columns:
    """Ground cells by what stands on them.

    Attributes
    ----------
    index : (n, 2) the cell of each column, sorted.
    xy : (n, 2) mean over the voxels of each column, m from the storey's origin.
    filled : (n,) number of voxels filled between floor and ceiling.
    """

    index: IntArray
    xy: FloatArray
    filled: FloatArray


def columns(voxels: StoreyVoxels, low: float = 0.15, under_ceiling: float = 0.1) -> Columns:
    """Gather the voxels from `low` (m above the floor) to `under_ceiling` (m) into their ground cells."""
    inside = (voxels.z > low) & (voxels.z < voxels.height - under_ceiling)
    if not inside.any():
        return Columns(np.zeros((0, 2), dtype=np.int32), np.zeros((0, 2)), np.zeros(0))
    first = voxels.first
    column = np.repeat(np.arange(len(first) - 1), np.diff(first))
    filled = np.bincount(column, inside).astype(np.float64, copy=False)
    some = filled > 0
    total = [np.bincount(column, np.where(inside, voxels.xy[:, axis], 0.0)) for axis in (0, 1)]
    return Columns(voxels.index[first[:-1][some]], np.column_stack(total)[some] / filled[some, None], filled[some])
