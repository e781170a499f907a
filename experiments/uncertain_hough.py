"""A Hough transform that takes uncertainty into account, as the paper's section 6 asks for in place of its threshold.

Every cell votes. How much is the caller's to say: by the share of the height that is filled, which is the probability
to hit something there at a random height; or by the probability that the cell is wall, learned from the storey's own
counts. Where: for all lines that its points may lie on, by their mean and covariance, as if every point voted for
itself. What a line explains of a cell's vote is taken from it before the next line is sought. At last each line is
fitted to the moments of its points.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import ndtr, xlogy

from asbuilt import Evidence
from asbuilt.grid import FloatArray, IntArray
from asbuilt.ground import GroundPlaneHistogram
from asbuilt.indices import rows_in

#: Steps of the accumulator: half a degree, and 2 cm.
ANGLES, STEP = 360, 0.02
#: What registration adds to the spread of a cell's points, m.
REGISTRATION = 0.005
#: A cell belongs to a line up to this many standard deviations from it.
REACH = 2.5
#: Cells with less weight do not vote; they would only cost time.
LEAST = 0.1
#: As the paper's best: gaps that are bridged and shorter segments that are dropped, m; and the weakest line, as metres
#: of certain wall (four cells of 10 cm).
FILL_GAP, MIN_LENGTH, WEAKEST = 0.7, 0.2, 0.4

CONSTANTS = {
    "angles": ANGLES,
    "step": STEP,
    "registration": REGISTRATION,
    "reach": REACH,
    "least": LEAST,
    "fill_gap": FILL_GAP,
    "min_length": MIN_LENGTH,
    "weakest": WEAKEST,
}


@dataclass(frozen=True)
class Cells:
    """Occupied ground cells with what is known of each.

    Attributes
    ----------
    mean : (n, 2) of its points, m.
    covariance : (n, 3: xx, xy, yy) of its points, m2.
    filled : (n,) occupied voxels above it, of `height` that there could be.
    side : of a cell, m.
    """

    mean: FloatArray
    covariance: FloatArray
    filled: IntArray
    height: int
    side: float

    def __len__(self) -> int:
        return len(self.mean)

    @cached_property
    def reach(self) -> float:
        """No cell belongs to a line farther than this from its mean, m."""
        xx, _, yy = self.covariance.T
        return REACH * float(np.sqrt((xx + yy).max(initial=0.0) + REGISTRATION**2)) + STEP


def cells_of_points(evidence: Evidence, among: IntArray, voxel: float) -> Cells:
    """The ground cells of an evidence's voxels that lie in the coarser voxels `among` (n, 3) of side `voxel` (m).

    Every voxel of a column weighs the same, however many points it holds, as in the paper's histograms.
    """
    kept = np.flatnonzero(rows_in(evidence.index // round(voxel / evidence.voxel), among))
    index = evidence.index[kept].astype(np.int64)
    if len(index) == 0:
        return Cells(np.zeros((0, 2)), np.zeros((0, 3)), np.zeros(0, dtype=np.int64), 1, evidence.voxel)
    _, column, filled = np.unique(index[:, :2], axis=0, return_inverse=True, return_counts=True)
    xy = index[:, :2] * evidence.voxel + evidence.mean[kept, :2]
    mean = _per_column(xy, column, filled)
    away = xy - mean[column]
    products = np.column_stack([away[:, 0] ** 2, away[:, 0] * away[:, 1], away[:, 1] ** 2]) + evidence.covariance[kept]
    return Cells(mean, _per_column(products, column, filled), filled, len(np.unique(index[:, 2])), evidence.voxel)


def cells_without_points(histogram: GroundPlaneHistogram, height: int) -> Cells:
    """The cells of a ground-plane histogram, of whose points nothing is known: they may lie anywhere in the cell."""
    index = np.argwhere(histogram.counts > 0)
    side = histogram.grid.cell
    covariance = np.tile([side**2 / 12, 0.0, side**2 / 12], (len(index), 1))
    return Cells(histogram.grid.to_metres(index), covariance, histogram.counts[tuple(index.T)], height, side)


def _per_column(values: FloatArray, column: IntArray, filled: IntArray) -> FloatArray:
    return np.column_stack([np.bincount(column, some) / filled for some in values.T])


def filled_share(cells: Cells) -> FloatArray:
    """Share of the height that is filled (n,): the weight that needs no model."""
    return cells.filled / cells.height


def above_threshold(cells: Cells, sigmas: float) -> FloatArray:
    """The paper's threshold as a weight (n,): 1 above the mean and `sigmas` deviations of all cells around, else 0."""
    everywhere = np.prod(np.ptp(np.floor(cells.mean / cells.side), axis=0) + 1)
    mean = cells.filled.sum() / everywhere
    deviation = np.sqrt((cells.filled.astype(float) ** 2).sum() / everywhere - mean**2)
    return (cells.filled > mean + sigmas * deviation).astype(float)


def wall_probability(cells: Cells, rounds: int = 200) -> FloatArray:
    """Probability (n,) that a cell is wall: that its count comes from the fuller part of a mixture of two binomials.

    Expectation maximization, from a third and two thirds of the height.
    """
    height = cells.height
    counts = np.bincount(cells.filled, minlength=height + 1).astype(float)
    c = np.arange(height + 1)
    share, p = 0.5, np.array([1 / 3, 2 / 3])
    wall = np.zeros(height + 1)
    for _ in range(rounds):
        clutter, full = (xlogy(c, q) + xlogy(height - c, 1 - q) for q in p)
        wall = 1 / (1 + (1 - share) / share * np.exp(np.clip(clutter - full, -700, 700)))
        weights = np.stack([counts * (1 - wall), counts * wall])
        share = float(weights[1].sum() / max(counts.sum(), 1.0))
        p = (weights @ c) / np.maximum(weights.sum(axis=1), 1e-9) / height
    return np.asarray(wall[cells.filled])


def detect_lines(cells: Cells, weight: FloatArray) -> FloatArray:
    """Line segments (n, 4), m, strongest first, of cells that vote with a weight (n,) from 0 to 1.

    The incremental search of the paper's section 3.3, stopped by strength; without cells there is none.
    """
    cells = _some(cells, weight >= LEAST)
    weight = weight[weight >= LEAST].copy()
    weakest = WEAKEST / cells.side
    if weight.sum() < weakest:
        return np.zeros((0, 4))
    accumulator = _Accumulator(cells)
    accumulator.vote(np.arange(len(cells)), weight)
    found = []
    while (peak := accumulator.strongest())[2] >= weakest:
        wall = _grow(cells, weight, *accumulator.line(*peak[:2]))
        if wall is None:
            accumulator.close(*peak[:2])
            continue
        segment, rows, explained = wall
        found.append(segment)
        accumulator.vote(rows, -weight[rows] * explained)
        weight[rows] *= 1 - explained
    return np.array(found).reshape(-1, 4)


def fit_to_points(segments: FloatArray, cells: Cells, weight: FloatArray) -> FloatArray:
    """Each segment (n, 4), m, on the total least squares line of the points along it, by their cells' moments."""
    fitted = segments.copy()
    for i, segment in enumerate(segments):
        ends = segment.reshape(2, 2)
        length = float(np.hypot(*(ends[1] - ends[0])))
        near, position, _ = _beside(cells, ends[0], (ends[1] - ends[0]) / max(length, 1e-9), STEP / 4)
        near = near[(position >= 0) & (position <= length)]
        if weight[near].sum() > 1:
            centre, along = _fit(_some(cells, near), weight[near])
            fitted[i] = (centre + np.outer((ends - centre) @ along, along)).ravel()
    return fitted


class _Accumulator:
    """Votes over orientation and distance from the middle of the cells, which may change their weight."""

    def __init__(self, cells: Cells) -> None:
        turn = np.arange(ANGLES) * np.pi / ANGLES
        self.normals = np.column_stack([np.cos(turn), np.sin(turn)])
        self.middle = cells.mean.mean(axis=0)
        self.xy, self.covariance = cells.mean - self.middle, cells.covariance
        self.reach = float(np.hypot(*self.xy.T).max()) + 0.3
        self.bins = int(2 * self.reach / STEP) + 1
        self.votes = np.zeros((ANGLES, self.bins))
        self.highest = np.zeros(ANGLES)

    def vote(self, rows: IntArray, weight: FloatArray) -> None:
        """Each cell's weight, spread over the distances that its points have at each orientation."""
        for some in np.array_split(np.arange(len(rows)), len(rows) // 2000 + 1):
            place = (self.xy[rows[some]] @ self.normals.T + self.reach) / STEP
            sigma = _sigma(self.covariance[rows[some]], self.normals) / STEP
            half = int(np.ceil(REACH * float(sigma.max(initial=0)))) + 1
            first = place.astype(np.int64) - half
            edges = first[..., None] + np.arange(2 * half + 2)
            share = np.diff(ndtr((edges - place[..., None]) / sigma[..., None]), axis=2)
            bins = np.clip(edges[..., :-1], 0, self.bins - 1) + np.arange(ANGLES)[:, None] * self.bins
            votes = np.bincount(bins.ravel(), (share * weight[some, None, None]).ravel(), self.votes.size)
            self.votes += votes.reshape(self.votes.shape)
        self.highest = self.votes.max(axis=1)

    def strongest(self) -> tuple[int, int, float]:
        """Bin of the strongest line, by orientation and distance, and its votes."""
        angle = int(self.highest.argmax())
        return angle, int(self.votes[angle].argmax()), float(self.highest[angle])

    def line(self, angle: int, place: int) -> tuple[FloatArray, FloatArray]:
        """A point of a bin's line, m, and its unit normal."""
        normal = self.normals[angle]
        return self.middle + ((place + 0.5) * STEP - self.reach) * normal, normal

    def close(self, angle: int, place: int) -> None:
        """No line is to be found there any more."""
        self.votes[angle, place] = -np.inf
        self.highest[angle] = self.votes[angle].max()


def _grow(
    cells: Cells, weight: FloatArray, centre: FloatArray, normal: FloatArray
) -> tuple[FloatArray, IntArray, FloatArray] | None:
    """The strongest run of wall along a line, fitted to its points: segment (4,), its cells, how far it explains each.

    The line of the accumulator is a little off; along the fitted one the run is longer, so it is fitted three times.
    """
    along, slack = np.array([-normal[1], normal[0]]), STEP
    for _ in range(3):
        near, position, off = _beside(cells, centre, along, slack)
        explained = np.exp(-0.5 * off**2)
        bounds = _strongest_run(position, weight[near] * explained, cells.side)
        if bounds is None:
            return None
        inside = (position >= bounds[0]) & (position <= bounds[1])
        run, explained, at, before = near[inside], explained[inside], position[inside], centre
        centre, along = _fit(_some(cells, run), weight[run] * explained)
        slack = STEP / 4
    low, high = ((before + t * along - centre) @ along for t in (at.min(), at.max()))
    half = cells.side / 2
    return np.concatenate([centre + (low - half) * along, centre + (high + half) * along]), run, explained


def _strongest_run(position: FloatArray, vote: FloatArray, side: float) -> tuple[float, float] | None:
    """From where to where along a line wall stands: the run of most votes; None if there is none that counts.

    A step as long as a cell is wall if that is likelier than not.
    """
    steps, row = np.unique(np.floor(position / side).astype(np.int64), return_inverse=True)
    without = np.bincount(row, np.log1p(-np.minimum(vote, 0.999)))
    is_wall = without < np.log(0.5)
    steps, votes = steps[is_wall], np.bincount(row, vote)[is_wall]
    if len(steps) == 0:
        return None
    first = np.concatenate([[0], np.flatnonzero(np.diff(steps) * side > FILL_GAP) + 1])
    totals = np.add.reduceat(votes, first)
    best = int(totals.argmax())
    last = np.append(first[1:], len(steps))[best] - 1
    low, high = steps[first[best]] * side, (steps[last] + 1) * side
    if totals[best] * side < WEAKEST or high - low < MIN_LENGTH:
        return None
    return float(low), float(high)


def _some(cells: Cells, rows: object) -> Cells:
    return Cells(cells.mean[rows], cells.covariance[rows], cells.filled[rows], cells.height, cells.side)


def _sigma(covariance: FloatArray, normals: FloatArray) -> FloatArray:
    """Spread of each cell's points (n, 3) across lines of the given normals (m, 2): (n, m), m."""
    nx, ny = normals.T
    variance = covariance @ np.stack([nx * nx, 2 * nx * ny, ny * ny])
    return np.sqrt(np.maximum(variance, 0) + REGISTRATION**2)


def _beside(
    cells: Cells, centre: FloatArray, along: FloatArray, slack: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """The cells of a line that may be off by `slack` (m), where they lie along it, and how many sigmas beside it."""
    away = cells.mean - centre
    normal = np.array([-along[1], along[0]])
    offset = np.abs(away @ normal)
    rows = np.flatnonzero(offset <= cells.reach)
    off = np.maximum(offset[rows] - slack, 0) / _sigma(cells.covariance[rows], normal[None])[:, 0]
    near = off <= REACH
    return rows[near], away[rows[near]] @ along, off[near]


def _fit(cells: Cells, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centre and unit direction of the total least squares line of all points of weighted cells."""
    centre = np.average(cells.mean, axis=0, weights=weight)
    away = cells.mean - centre
    products = np.column_stack([away[:, 0] ** 2, away[:, 0] * away[:, 1], away[:, 1] ** 2]) + cells.covariance
    xx, xy, yy = np.average(products, axis=0, weights=weight)
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    return centre, np.array([np.cos(angle), np.sin(angle)])
