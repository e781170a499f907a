"""What a baseline is given: the points of one storey, which scan each came from, and where the scanners stood."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from asbuilt.grid import FloatArray, IntArray
from asbuilt.params import RefineParameters
from asbuilt.refine import merge_collinear


@dataclass(frozen=True)
class StoreyCloud:
    """Points between a storey's floor and ceiling.

    Attributes
    ----------
    points : (n, 3), m.
    scan : (n,) row of `positions` that each point was taken from.
    positions : (m, 3) of all scanners, m.
    floor, ceiling : heights, m.
    """

    points: FloatArray
    scan: IntArray
    positions: FloatArray
    floor: float
    ceiling: float

    def thinned(self, voxel: float) -> FloatArray:
        """One point, the mean, for each occupied voxel (n, 3), floor and ceiling left out."""
        z = self.points[:, 2]
        inside = self.points[(z > self.floor + 0.1) & (z < self.ceiling - 0.1)]
        index = np.floor(inside / voxel).astype(np.int64)
        index -= index.min(axis=0)
        span = index.max(axis=0) + 1
        _, inverse, counts = np.unique(
            (index[:, 0] * span[1] + index[:, 1]) * span[2] + index[:, 2], return_inverse=True, return_counts=True
        )
        return np.column_stack([np.bincount(inverse, weights=column) / counts for column in inside.T.astype(float)])

    def scanner_lines(self, height: float, step_deg: float = 0.25) -> Iterator[FloatArray]:
        """What a line scanner at each position would see at a height above the floor: (k, 2), m, in order of azimuth.

        Of the points within 5 cm of the height, the nearest to it in each step of azimuth.
        """
        off = np.abs(self.points[:, 2] - self.floor - height)
        near = np.flatnonzero(off <= 0.05)
        near = near[np.argsort(off[near], kind="stable")]
        for scan, rows in _by_scan(self.scan, near):
            yield self._one_per_azimuth(scan, rows, step_deg)

    def farthest_points(self, step_deg: float) -> Iterator[FloatArray]:
        """The point farthest from the scanner in each vertical scan line: (k, 2), m, in order of azimuth."""
        apart = self.points[:, :2] - self.positions[self.scan, :2]
        order = np.argsort(-np.hypot(apart[:, 0], apart[:, 1]), kind="stable")
        for scan, rows in _by_scan(self.scan, order):
            yield self._one_per_azimuth(scan, rows, step_deg)

    def _one_per_azimuth(self, scan: int, rows: IntArray, step_deg: float) -> FloatArray:
        ground = self.points[rows, :2].astype(float)
        x, y = (ground - self.positions[scan, :2]).T
        _, first = np.unique(np.floor(np.degrees(np.arctan2(y, x)) / step_deg), return_index=True)
        return ground[first]


def _by_scan(scan: IntArray, rows: IntArray) -> Iterator[tuple[int, IntArray]]:
    """Rows of each scan, in the order given."""
    rows = rows[np.argsort(scan[rows], kind="stable")]
    for part in np.split(rows, np.flatnonzero(np.diff(scan[rows])) + 1):
        if len(part):
            yield int(scan[part[0]]), part


def split_at_jumps(points: FloatArray, jump: float) -> list[FloatArray]:
    """Ordered points (n, 2) cut wherever the next is farther than `jump`, m."""
    far = np.hypot(*np.diff(points, axis=0).T) > jump
    return np.split(points, np.flatnonzero(far) + 1)


def fit_line(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centre and unit direction of the total least squares line of points (n, 2)."""
    centre = points.mean(axis=0)
    (xx, xy), (_, yy) = np.cov((points - centre).T, bias=True)
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    return centre, np.array([np.cos(angle), np.sin(angle)])


def runs(
    points: FloatArray, centre: FloatArray, along: FloatArray, gap: float, length: float, least: int
) -> FloatArray:
    """Where points (n, 2) lie along a line: segments (k, 4) without gaps over `gap` (m), as long as `length` (m)."""
    place = np.sort((points - centre) @ along)
    segments = [
        np.concatenate([centre + run[0] * along, centre + run[-1] * along])
        for run in np.split(place, np.flatnonzero(np.diff(place) > gap) + 1)
        if len(run) >= least and run[-1] - run[0] >= length
    ]
    return np.array(segments).reshape(-1, 4)


def wall_of_plane(points: FloatArray, normal: FloatArray, gap: float = 0.3, length: float = 0.3) -> FloatArray:
    """The trace of a plane's points (n, 3) on the ground, if it stands upright within 10 degrees: segments (k, 4)."""
    across = normal[:2] / max(float(np.hypot(*normal[:2])), 1e-12)
    if len(points) < 3 or abs(normal[2]) > np.sin(np.radians(10)):
        return np.zeros((0, 4))
    return runs(points[:, :2], points[:, :2].mean(axis=0), np.array([-across[1], across[0]]), gap, length, 10)


def merge(segments: list[FloatArray], distance: float = 0.05, gap: float = 0.3) -> FloatArray:
    """The segments of all scans or planes as one map: collinear ones joined, as every one of these systems does."""
    found = np.concatenate([np.zeros((0, 4)), *segments])
    return merge_collinear(found, RefineParameters(merge_angle=np.radians(5), merge_distance=distance, merge_gap=gap))
