"""Candidates of the association: which truth a piece of a detection overlaps, where, and how far off it lies.

All pairs are arrays: a piece's place is linear in metres along the detection, and so are its place along the truth
and its signed distance to the truth's line, which makes every overlap and every mean distance exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asbuilt.evaluate.drawing import TOLERANCE, Floats, Integers

#: A candidate must overlap by more than this, or by more than half of the piece if that is less, m.
MIN_OVERLAP = 0.01


@dataclass(frozen=True)
class Lines:
    """Bounded segments as start, unit direction and length."""

    start: Floats  # (n, 2)
    direction: Floats  # (n, 2), unit; zero for a segment without length
    length: Floats  # (n,)

    @classmethod
    def of(cls, segments: Floats) -> Lines:
        """Make them of x1, y1, x2, y2, shape (n, 4) in m."""
        step = segments[:, 2:] - segments[:, :2]
        length = np.hypot(step[:, 0], step[:, 1])
        return cls(segments[:, :2], step / np.where(length > 0, length, 1.0)[:, None], length)

    def at(self, which: Integers, along: Floats) -> Floats:
        """Points, shape (k, 2), `along` metres from the start of the segments `which`."""
        return self.start[which] + along[:, None] * self.direction[which]


@dataclass(frozen=True)
class Pieces:
    """Stretches of detected segments, by the segment's row and metres from its start."""

    detected: Integers
    start: Floats
    end: Floats

    def __len__(self) -> int:
        return len(self.detected)

    def take(self, rows: Integers) -> Pieces:
        """The pieces of the given rows."""
        return Pieces(self.detected[rows], self.start[rows], self.end[rows])

    @classmethod
    def join(cls, parts: list[Pieces]) -> Pieces:
        """All pieces of several lots in one; empty arrays for no lots."""
        return cls(
            np.concatenate([part.detected for part in parts]) if parts else np.zeros(0, dtype=np.int64),
            np.concatenate([part.start for part in parts]) if parts else np.zeros(0),
            np.concatenate([part.end for part in parts]) if parts else np.zeros(0),
        )


@dataclass(frozen=True)
class Matches:
    """Pairs of a piece (by its row) and a truth segment, with the part that overlaps; fields as in `Associations`."""

    piece: Integers
    truth: Integers
    start: Floats
    end: Floats
    truth_start: Floats
    truth_end: Floats
    start_offset: Floats
    end_offset: Floats
    distance: Floats
    angle: Floats

    def __len__(self) -> int:
        return len(self.piece)

    def take(self, rows: Integers) -> Matches:
        """The matches of the given rows."""
        return Matches(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))

    def renumbered(self, rows: Integers) -> Matches:
        """The same matches with piece i called `rows[i]`."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return Matches(**{**values, "piece": rows[self.piece]})

    @classmethod
    def join(cls, parts: list[Matches]) -> Matches:
        """All matches of several lots in one; empty arrays for no lots."""
        names = cls.__dataclass_fields__
        if not parts:
            return cls(**{name: np.zeros(0, dtype=np.int64 if name in ("piece", "truth") else float) for name in names})
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def overlaps(
    pieces: Pieces, piece: Integers, against: Integers, lines: Lines, truth: Lines, max_angle: float
) -> Matches:
    """The pairs that are candidates, each with the part that overlaps and its distance.

    Parameters
    ----------
    pieces, lines : the pieces and the detected segments they are stretches of.
    piece, against : shape (k,), the pairs to look at, as rows of `pieces` and of `truth`.
    truth : the truth segments.
    max_angle : orientation threshold, radians below pi/2.

    Returns
    -------
    Matches
        In the order of the pairs; empty if none overlaps enough.
    """
    d, e = lines.direction[pieces.detected[piece]], truth.direction[against]
    along, across = (d * e).sum(axis=1), e[:, 0] * d[:, 1] - e[:, 1] * d[:, 0]
    angle = np.arctan2(np.abs(across), np.abs(along))
    real = (truth.length[against] > 0) & (lines.length[pieces.detected[piece]] > 0)
    keep = np.flatnonzero((angle <= max_angle + TOLERANCE) & real)
    piece, against, along, across, angle = piece[keep], against[keep], along[keep], across[keep], angle[keep]
    e = e[keep]
    # where the whole detected line crosses the truth's: u along it, v to its left, both linear in t along the detection
    offset = lines.start[pieces.detected[piece]] - truth.start[against]
    u0, v0 = (offset * e).sum(axis=1), e[:, 0] * offset[:, 1] - e[:, 1] * offset[:, 0]
    start, end = pieces.start[piece], pieces.end[piece]
    ua, ub = u0 + start * along, u0 + end * along
    low = np.maximum(np.minimum(ua, ub), 0.0)
    high = np.minimum(np.maximum(ua, ub), truth.length[against])
    keep = np.flatnonzero(high - low > np.minimum(MIN_OVERLAP, (end - start) / 2) + TOLERANCE)
    piece, against, along, across, angle = piece[keep], against[keep], along[keep], across[keep], angle[keep]
    u0, v0, start, end, low, high = u0[keep], v0[keep], start[keep], end[keep], low[keep], high[keep]
    t_low, t_high = (low - u0) / along, (high - u0) / along
    first = np.clip(np.minimum(t_low, t_high), start, end)
    last = np.clip(np.maximum(t_low, t_high), start, end)
    v1, v2 = v0 + first * across, v0 + last * across
    return Matches(piece, against, first, last, low, high, v1, v2, mean_absolute(v1, v2), angle)


def mean_absolute(first: Floats, last: Floats) -> Floats:
    """Mean of the absolute value of what runs linearly from `first` to `last`, exact where it changes sign.

    Parameters
    ----------
    first, last : shape (n,), any unit.

    Returns
    -------
    shape (n,), in the same unit; empty for empty inputs.
    """
    size = np.abs(first) + np.abs(last)
    crossing = (first**2 + last**2) / (2 * np.where(size > 0, size, 1.0))
    return np.where(first * last < 0, crossing, size / 2)


def winners(matches: Matches, pieces: int) -> Matches:
    """The closest match of each piece; ties go to the truth segment that comes first."""
    closest = np.full(pieces, np.inf)
    np.minimum.at(closest, matches.piece, matches.distance)
    near = np.flatnonzero(matches.distance <= closest[matches.piece] + TOLERANCE)
    # pairs come ordered by piece and truth, so the first of each piece is the first in the truth
    _, first = np.unique(matches.piece[near], return_index=True)
    return matches.take(near[first])
