"""Segments found by place, so that work does not grow with all pairs of them."""

from __future__ import annotations

import numpy as np
import shapely

from asbuilt.grid import FloatArray, IntArray


def near_pairs(segments: FloatArray, others: FloatArray, within: float) -> tuple[IntArray, IntArray]:
    """Pairs of segments (n, 4) and others (m, 4), m, that come within a distance (m) of each other.

    Returns
    -------
    segment, other : (k,) indices, in their order. A segment may be a point.
    """
    lines, tree = (shapely.linestrings(ends.reshape(-1, 2, 2)) for ends in (segments, others))
    segment, other = shapely.STRtree(tree).query(lines, predicate="dwithin", distance=within)
    order = np.lexsort((other, segment))
    return segment[order], other[order]


def near_each(segments: FloatArray, others: FloatArray, within: float) -> list[list[int]]:
    """For each segment (n, 4), m, which others (m, 4) come within a distance (m) of it, in order."""
    if len(segments) == 0:
        return []
    segment, other = near_pairs(segments, others, within)
    return [part.tolist() for part in np.split(other, np.searchsorted(segment, np.arange(1, len(segments))))]
