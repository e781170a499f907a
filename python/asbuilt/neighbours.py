"""Segments and points found by place, so that work does not grow with all pairs of them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from asbuilt.grid import FloatArray, IntArray


def near_pairs(segments: FloatArray, others: FloatArray, within: float) -> tuple[IntArray, IntArray]:
    """Pairs of segments and others, (n, 4) or points (n, 2), m, that come within a distance (m) of each other.

    Returns
    -------
    segment, other : (k,) indices, in their order.
    """
    tree = shapely.STRtree(_shapes(others))
    segment, other = tree.query(_shapes(segments), predicate="dwithin", distance=within)
    order = np.lexsort((other, segment))
    return segment[order], other[order]


def near_boxes(segments: FloatArray, within: float) -> tuple[IntArray, IntArray]:
    """Pairs of segments (n, 4), m, whose boxes come within a distance (m) of each other along both axes: all that
    `near_pairs` finds and some more, much faster.

    Returns
    -------
    segment, other : (k,) indices, in their order; each is a pair with itself, too.
    """
    low, high = np.minimum(segments[:, :2], segments[:, 2:]), np.maximum(segments[:, :2], segments[:, 2:])
    tree = shapely.STRtree(_shapes(segments))
    segment, other = tree.query(shapely.box(*(low - within).T, *(high + within).T))
    order = np.lexsort((other, segment))
    return segment[order], other[order]


def near_each(segments: FloatArray, others: FloatArray, within: float) -> list[list[int]]:
    """For each segment or point, m, which others come within a distance (m) of it, in order; see `near_pairs`."""
    if len(segments) == 0:
        return []
    return of_each(len(segments), *near_pairs(segments, others, within))


def of_each(count: int, segment: IntArray, other: IntArray) -> list[list[int]]:
    """The others that each of `count` segments is paired with."""
    first, near = np.searchsorted(segment, np.arange(count + 1)).tolist(), other.tolist()
    return [near[low:high] for low, high in pairwise(first)]


def _shapes(ends: FloatArray) -> NDArray[np.object_]:
    shapes: NDArray[np.object_] = (
        shapely.points(ends) if ends.shape[1] == 2 else shapely.linestrings(ends.reshape(-1, 2, 2))
    )
    return shapes
