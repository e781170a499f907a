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


def near_ahead(segments: FloatArray, ahead: float, aside: float) -> tuple[IntArray, IntArray]:
    """Pairs of segments (n, 4), m, and those whose boxes meet theirs, if each goes on by so much at both ends and is so
    much wider to both sides: all that may continue it.

    Returns
    -------
    segment, other : (k,) indices, in their order; each is a pair with itself, too.
    """
    start, end = segments[:, :2], segments[:, 2:]
    further = ahead * (end - start) / np.maximum(np.hypot(*(end - start).T), 1e-12)[:, None]
    ends = np.stack([start - further, end + further])
    tree = shapely.STRtree(_shapes(segments))
    segment, other = tree.query(shapely.box(*(ends.min(axis=0) - aside).T, *(ends.max(axis=0) + aside).T))
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
