"""Data association: which part of which detected segment goes to which truth segment (section 4 of the paper).

Each detected segment is matched with the closest truth segment whose orientation is near its own and projected onto
it along the truth's normal; the parts that overlap are associated, what overhangs is matched anew, until every piece
is associated or found to have no association.

The paper leaves open what closest means; here it is the mean absolute distance over the part that overlaps, with a
limit (`max_distance`, not in the paper; None takes it away) and a least overlap of 1 cm. All pieces of one generation
are matched at once, so that 10,000 segments take seconds. Not implemented: curves; they come as chords.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from asbuilt.errors import ParameterError
from asbuilt.evaluate.candidates import Lines, Matches, Pieces, overlaps, winners
from asbuilt.evaluate.drawing import TOLERANCE, Floats, Integers

#: Overhanging pieces shorter than this are dropped, m.
MIN_PIECE = 0.001
#: Candidates are looked for within this distance first, m; it changes the time taken, never the result.
FIRST_RADIUS = 0.5
#: Pairs of piece and truth segment that are held in memory at once.
MAX_PAIRS = 2_000_000


@dataclass(frozen=True)
class Associations:
    """The associated parts and the pieces that were left over, one row each, sorted by detection and place along it.

    Attributes
    ----------
    detected, truth : shape (n,), the rows of the two inputs.
    start, end : shape (n,), where the part lies along the detected segment, m from its start.
    truth_start, truth_end : shape (n,), where it lies along the truth segment, m from its start; start below end.
    start_offset, end_offset : shape (n,), signed distance to the truth's line at either end, m; left is positive.
    distance : shape (n,), mean absolute distance over the part, m: E_d of equation 1.
    angle : shape (n,), undirected angle between the two, radians in 0..pi/2: E_theta of equation 2.
    left_detected, left_start, left_end : shape (k,), the pieces without association.
    """

    detected: Integers
    truth: Integers
    start: Floats
    end: Floats
    truth_start: Floats
    truth_end: Floats
    start_offset: Floats
    end_offset: Floats
    distance: Floats
    angle: Floats
    left_detected: Integers
    left_start: Floats
    left_end: Floats

    def __len__(self) -> int:
        return len(self.detected)

    @property
    def length(self) -> Floats:
        """Detected length of each part, shape (n,), m."""
        return self.end - self.start


def associate(
    detected: Floats, truth: Floats, max_distance: float | None = 0.25, max_angle_deg: float = 36.0
) -> Associations:
    """Associate detected segments with truth segments.

    Parameters
    ----------
    detected : shape (n, 4), x1, y1, x2, y2 in m.
    truth : shape (m, 4), in the same frame. Of truth segments equally close the first wins.
    max_distance : a piece whose closest candidate is farther than this has no association, m; None is the paper's
        text, which states no limit. Growing it turns false positives into true ones with a large distance error.
    max_angle_deg : orientation threshold, degrees, 0 to below 90; the paper's figure is 36.

    Returns
    -------
    Associations
        Empty arrays where either input is empty; without truth every detection is a piece left over.

    Raises
    ------
    ParameterError : an array of another shape, a coordinate that is not finite, or a limit out of its range.
    """
    detected, truth = _segments(detected, "detected"), _segments(truth, "truth")
    if not 0 <= max_angle_deg < 90:
        raise ParameterError(f"max_angle_deg is {max_angle_deg}; expected 0 to below 90 degrees")
    if max_distance is not None and not max_distance >= 0:
        raise ParameterError(f"max_distance is {max_distance}; expected 0 m or more, or None for no limit")
    limit = math.inf if max_distance is None else float(max_distance)
    lines, truth_lines = Lines.of(detected), Lines.of(truth)
    tree = shapely.STRtree(shapely.linestrings(truth.reshape(-1, 2, 2)))
    queue = Pieces(np.arange(len(detected)), np.zeros(len(detected)), lines.length)
    found: list[tuple[Integers, Matches]] = []
    left: list[Pieces] = []
    while len(queue):
        best = _closest(queue, lines, truth_lines, tree, limit, math.radians(max_angle_deg))
        without = np.ones(len(queue), dtype=bool)
        without[best.piece] = False
        left.append(queue.take(np.flatnonzero(without)))
        parents = queue.take(best.piece)
        found.append((parents.detected, best))
        before = Pieces(parents.detected, parents.start, best.start)
        after = Pieces(parents.detected, best.end, parents.end)
        overhang = Pieces.join([before, after])
        queue = overhang.take(np.flatnonzero(overhang.end - overhang.start >= MIN_PIECE))
    return _sorted(found, Pieces.join(left))


def _segments(array: Floats, name: str) -> Floats:
    segments = np.asarray(array, dtype=float)
    if segments.size == 0:
        return np.zeros((0, 4))
    if segments.ndim != 2 or segments.shape[1] != 4:
        raise ParameterError(f"{name} has shape {segments.shape}; expected (n, 4): x1, y1, x2, y2")
    if not np.isfinite(segments).all():
        raise ParameterError(f"{name} has a coordinate that is not a finite number")
    return segments


def _closest(
    pieces: Pieces, lines: Lines, truth: Lines, tree: shapely.STRtree, limit: float, max_angle: float
) -> Matches:
    """The winning candidate of each piece that has one within `limit`.

    A candidate's mean distance is never below the distance between the two segments. So a winner no farther than the
    radius searched is the winner among all, and the radius grows only for pieces that have none yet.
    """
    pending = np.arange(len(pieces))
    won: list[Matches] = []
    radius = min(FIRST_RADIUS, limit)
    while len(pending):
        still: list[Integers] = []
        for rows in _chunks(pending, len(truth.length)):
            some = pieces.take(rows)
            piece, against = _neighbours(some, lines, truth, tree, radius, max_angle)
            best = winners(overlaps(some, piece, against, lines, truth, max_angle), len(some))
            sure = best.take(np.flatnonzero(best.distance <= radius + TOLERANCE))
            open_rows = np.ones(len(some), dtype=bool)
            open_rows[sure.piece] = False
            still.append(rows[open_rows])
            won.append(sure.renumbered(rows))
        if radius >= limit:
            break
        pending = np.concatenate(still)
        # beyond the third ring the tree returns most of the truth anyway
        radius = min(4 * radius, limit) if radius < 16 * FIRST_RADIUS else limit
    return Matches.join(won)


def _chunks(rows: Integers, truth_count: int) -> Iterator[Integers]:
    step = max(1, MAX_PAIRS // max(truth_count, 1))
    for first in range(0, len(rows), step):
        yield rows[first : first + step]


def _neighbours(
    pieces: Pieces, lines: Lines, truth: Lines, tree: shapely.STRtree, radius: float, max_angle: float
) -> tuple[Integers, Integers]:
    """Pairs (piece, truth) that may be candidates, ordered by piece, then truth."""
    if not len(truth.length):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    if math.isinf(radius):
        cosine = np.abs(lines.direction[pieces.detected] @ truth.direction.T)
        piece, against = np.nonzero(cosine >= math.cos(max_angle) - 1e-6)
        return piece.astype(np.int64), against.astype(np.int64)
    ends = np.stack([lines.at(pieces.detected, pieces.start), lines.at(pieces.detected, pieces.end)], axis=1)
    pairs = tree.query(shapely.linestrings(ends), predicate="dwithin", distance=radius + 1e-6)
    order = np.lexsort((pairs[1], pairs[0]))
    return pairs[0][order].astype(np.int64), pairs[1][order].astype(np.int64)


def _sorted(found: list[tuple[Integers, Matches]], left: Pieces) -> Associations:
    detected = np.concatenate([owner for owner, _ in found]) if found else np.zeros(0, dtype=np.int64)
    matches = Matches.join([match for _, match in found])
    order = np.lexsort((matches.start, detected))
    matches, detected = matches.take(order), detected[order]
    left = left.take(np.lexsort((left.start, left.detected)))
    return Associations(
        detected=detected,
        truth=matches.truth,
        start=matches.start,
        end=matches.end,
        truth_start=matches.truth_start,
        truth_end=matches.truth_end,
        start_offset=matches.start_offset,
        end_offset=matches.end_offset,
        distance=matches.distance,
        angle=matches.angle,
        left_detected=left.detected,
        left_start=left.start,
        left_end=left.end,
    )
