"""Rows of integer indices: of voxels, or of cells in the plane."""

from __future__ import annotations

import math

import numpy as np

from asbuilt import _core
from asbuilt.grid import BoolArray, IntArray

_EMPTY = 10
"""Tables have room for so many times what is looked up in them; wider spread, it is sorted."""


def unique_rows(index: IntArray) -> IntArray:
    """The different rows of (n, k) integer indices, sorted by their columns."""
    order, new = _sorted(index)
    return index[order[new]].astype(np.int64)


def count_rows(index: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """The different rows (m, k) of (n, k) integer indices, sorted; which of them each row is (n,); how often (m,)."""
    order, new = _sorted(index)
    inverse = np.empty(len(order), dtype=np.int64)
    inverse[order] = np.cumsum(new) - 1
    return index[order[new]].astype(np.int64), inverse, np.diff(np.flatnonzero(new), append=len(new))


def in_company(index: IntArray, factor: int = 1, least: int = 8) -> BoolArray:
    """Which voxels (n, 3) do not stand alone: `least` or more, each `factor` times the size, are in the cube of four a
    side that holds it, and in the 26 cubes around.
    """
    return _core.in_company(index.astype(np.int32, copy=False), factor, least)


def squeezed(cells: IntArray, gap: int) -> IntArray:
    """Cells (n, k) counted from 0 on, empty strips between them cut down so that `gap` empty ones remain.

    Cells no further apart than `gap` along an axis stay so far apart: for pictures in which only what is near counts,
    two buildings a kilometre apart are no larger than side by side.
    """
    columns = []
    for column in cells.T:
        if len(column) and int(np.ptp(column)) < _EMPTY * len(column):
            place = column - column.min()
            values = np.flatnonzero(np.bincount(place))
            place = np.cumsum(np.bincount(values))[place] - 1
        else:
            values, place = np.unique(column, return_inverse=True)
        steps = np.minimum(np.diff(values.astype(np.int64), prepend=values[:1]), gap + 1)
        columns.append(np.cumsum(steps)[place])
    return np.column_stack(columns)


def rows_in(index: IntArray, among: IntArray) -> BoolArray:
    """Which rows of (n, k) integer indices are also rows of `among` (m, k)."""
    if len(index) == 0 or len(among) == 0:
        return np.zeros(len(index), dtype=np.bool_)
    (low, high), (other_low, other_high) = _extent(index), _extent(among)
    low, high = np.minimum(low, other_low), np.maximum(high, other_high)
    keys, known = _keys(index, low, high), _keys(among, low, high)
    places = math.prod((high - low + 1).tolist())
    if places < _EMPTY * (len(keys) + len(known)):
        is_known = np.zeros(places, dtype=np.bool_)
        is_known[known] = True
        return is_known[keys]
    known = np.sort(known, kind="stable")
    found: BoolArray = known[np.minimum(np.searchsorted(known, keys), len(known) - 1)] == keys
    return found


def _sorted(index: IntArray) -> tuple[IntArray, BoolArray]:
    """The order that sorts rows (n, k), and which of them, in that order, differ from the one before."""
    if len(index) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.bool_)
    keys = _keys(index, *_extent(index))
    order = np.argsort(keys, kind="stable")  # voxels come nearly in order, which such a sort makes use of
    keys = keys[order]
    new = np.ones(len(keys), dtype=np.bool_)
    np.not_equal(keys[1:], keys[:-1], out=new[1:])
    return order, new


def _extent(index: IntArray) -> tuple[IntArray, IntArray]:
    """The least and the greatest of each column of (n, k) indices."""
    low, high = (np.array([end(column) for column in index.T], dtype=np.int64) for end in (np.min, np.max))
    return low, high


def _keys(index: IntArray, low: IntArray, high: IntArray) -> IntArray:
    """One integer for each row. Indices fit: a kilometre of strays each way, at 1 cm, takes 51 of 63 bits."""
    keys: IntArray = index[:, 0] - low[0]
    for axis in range(1, index.shape[1]):
        keys *= high[axis] - low[axis] + 1
        keys += index[:, axis] - low[axis]
    return keys
