"""The measures of section 4 of the paper, kept as totals that add up.

`measure_walls` turns associations into `WallTotals`; storeys and buildings are pooled by adding totals, never by
averaging ratios. A ratio without a denominator is None.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from asbuilt.evaluate.association import Associations
from asbuilt.evaluate.curves import curved_walls
from asbuilt.evaluate.drawing import TOLERANCE, Flags, Floats, Integers
from asbuilt.evaluate.end_points import END_POINT_DISTANCES, matched_ends

#: The share of the associated length within this distance is reported, m.
CLOSE = 0.015
#: A detected and a true segment are a pair for over-segmentation from this associated length, or half the truth's, m.
MIN_PAIR = 0.05


def ratio(part: float, whole: float) -> float | None:
    """`part` / `whole`, or None where the whole is nothing."""
    return part / whole if whole > 0 else None


def share(part: float, whole: float) -> float | None:
    """`ratio` of a part that rounding alone can make larger than the whole."""
    return min(1.0, part / whole) if whole > 0 else None


def median(values: Sequence[float]) -> float | None:
    """The median, or None of nothing."""
    return float(np.median(values)) if len(values) else None


def f_measure(precision: float | None, recall: float | None) -> float | None:
    """F = 2PR / (P + R) of section 5.1; None without a truth, 0 where nothing was detected or nothing fits."""
    if recall is None:
        return None
    if precision is None or precision + recall == 0:
        return 0.0
    return 2 * precision * recall / (precision + recall)


@dataclass(frozen=True)
class WallTotals:
    """Sums over wall segments, from which every measure of section 4 follows.

    Attributes
    ----------
    detected_length, associated_length : without what associates with *ignore*, m.
    truth_length : of the truth in use, m.
    covered_length, overlapped_length : of that, under at least one association and under two or more, m.
    distance_sum : detected length times distance error, m2: the numerator of equation 1.
    straight_length : associated length on straight truth, m.
    orientation_sum : that length times the angle, m deg: the numerator of equation 2.
    pairs, paired_truth : (detected, true) segment pairs, and true segments in such a pair.
    close_length : associated length that lies within 15 mm, m.
    detected_ends, truth_ends, matched_ends : end points, and those assigned within 5, 10 and 20 cm.
    """

    detected_length: float = 0.0
    associated_length: float = 0.0
    truth_length: float = 0.0
    covered_length: float = 0.0
    overlapped_length: float = 0.0
    distance_sum: float = 0.0
    straight_length: float = 0.0
    orientation_sum: float = 0.0
    pairs: int = 0
    paired_truth: int = 0
    close_length: float = 0.0
    detected_ends: int = 0
    truth_ends: int = 0
    matched_ends: tuple[int, ...] = (0,) * len(END_POINT_DISTANCES)

    def __add__(self, other: WallTotals) -> WallTotals:
        added = {
            name: getattr(self, name) + getattr(other, name)
            for name in self.__dataclass_fields__
            if name != "matched_ends"
        }
        ends = tuple(a + b for a, b in zip(self.matched_ends, other.matched_ends, strict=True))
        return WallTotals(**added, matched_ends=ends)

    @property
    def precision(self) -> float | None:
        """P = tp / (tp + fp), by length; None where nothing was detected."""
        return share(self.associated_length, self.detected_length)

    @property
    def recall(self) -> float | None:
        """R = tp / (tp + fn), by length of truth; None without truth."""
        return share(self.covered_length, self.truth_length)

    @property
    def f(self) -> float | None:
        """F = 2PR / (P + R); 0 where nothing was detected, None without truth."""
        return f_measure(self.precision, self.recall)

    @property
    def distance_error(self) -> float | None:
        """E_D of equation 1, m; None where nothing is associated."""
        return ratio(self.distance_sum, self.associated_length)  # equation 1

    @property
    def orientation_error_deg(self) -> float | None:
        """E_Theta of equation 2, degrees, over straight truth; None where nothing is associated with any."""
        return ratio(self.orientation_sum, self.straight_length)  # equation 2

    @property
    def over_segmentation(self) -> float | None:
        """E_OS: detected segments per true one, less one, so that 0 is perfect; None without a pair."""
        segments = ratio(self.pairs, self.paired_truth)
        return None if segments is None else segments - 1

    @property
    def overlap(self) -> float | None:
        """E_OL: truth length under two or more associations per detected length; None where nothing was detected."""
        return ratio(self.overlapped_length, self.detected_length)

    @property
    def within_15mm(self) -> float | None:
        """Share of the associated length that lies within 15 mm, taken pointwise; None where nothing is associated."""
        return share(self.close_length, self.associated_length)

    def end_points(self) -> dict[str, dict[str, float | None]]:
        """Precision, recall and F of the end points within 5, 10 and 20 cm, by "5cm", "10cm" and "20cm"."""
        table: dict[str, dict[str, float | None]] = {}
        for limit, matched in zip(END_POINT_DISTANCES, self.matched_ends, strict=True):
            precision, recall = ratio(matched, self.detected_ends), ratio(matched, self.truth_ends)
            figures = {"precision": precision, "recall": recall, "f": f_measure(precision, recall)}
            table[f"{round(100 * limit)}cm"] = figures
        return table

    def to_json(self) -> dict[str, Any]:
        """The measures and, under "totals", the sums they follow from; undefined values are None."""
        return {
            "precision": self.precision,
            "recall": self.recall,
            "f": self.f,
            "distance_error": self.distance_error,
            "orientation_error_deg": self.orientation_error_deg,
            "over_segmentation": self.over_segmentation,
            "overlap": self.overlap,
            "within_15mm": self.within_15mm,
            "endpoints": self.end_points(),
            "totals": dataclasses.asdict(self),
        }


def measure_walls(
    associations: Associations,
    detected: Floats,
    truth: Floats,
    in_use: Flags | None = None,
    detected_curves: Integers | None = None,
) -> WallTotals:
    """Sum up one storey's associations.

    Parameters
    ----------
    associations : what `associate(detected, truth)` gave.
    detected, truth : shape (n, 4) and (m, 4), the segments that were associated, m.
    in_use : shape (m,), the truth that counts; the rest is *ignore*. None: all of it.
    detected_curves : shape (n,), number of the curved wall that a detection is part of, -1 for none. None: no curves.

    Returns
    -------
    WallTotals
        Zeros for empty inputs.
    """
    used = np.ones(len(truth), dtype=bool) if in_use is None else np.asarray(in_use, dtype=bool)
    length, truth_length = _lengths(detected), _lengths(truth)
    counted = used[associations.truth]
    part = associations.length
    ignored_length = float(part[~counted].sum())
    detected_length = float(length.sum()) - ignored_length
    once, twice = covered_lengths(associations, counted, len(truth))
    curve = np.full(len(truth), -1, dtype=np.int64)
    curve[used] = curved_walls(truth[used])
    straight = counted & (curve[associations.truth] < 0)
    pairs, paired = _pairs(associations, counted, truth_length, curve, detected_curves)
    close = length_within(part, associations.start_offset, associations.end_offset, CLOSE)
    left_out = only_ignored(associations, counted, len(detected))
    return WallTotals(
        detected_length=detected_length if detected_length > TOLERANCE else 0.0,
        associated_length=float(part[counted].sum()),
        truth_length=float(truth_length[used].sum()),
        covered_length=float(once[used].sum()),
        overlapped_length=float(twice[used].sum()),
        distance_sum=float((part * associations.distance)[counted].sum()),
        straight_length=float(part[straight].sum()),
        orientation_sum=float((part * np.degrees(associations.angle))[straight].sum()),
        pairs=pairs,
        paired_truth=paired,
        close_length=float(close[counted].sum()),
        detected_ends=2 * int((~left_out).sum()),
        truth_ends=2 * int(used.sum()),
        matched_ends=matched_ends(detected[~left_out], truth[used]),
    )


def covered_lengths(associations: Associations, counted: Flags, truth_count: int) -> tuple[Floats, Floats]:
    """Length of each truth segment under at least one and under at least two of the counted associations.

    Returns
    -------
    two arrays, shape (truth_count,), m.
    """
    owner = associations.truth[counted]
    owners = np.concatenate([owner, owner])
    place = np.concatenate([associations.truth_start[counted], associations.truth_end[counted]])
    step = np.repeat([1, -1], len(owner))
    order = np.lexsort((place, owners))
    # each truth's steps sum to zero, so the depth starts anew at the next one
    depth, gap = np.cumsum(step[order])[:-1], np.diff(place[order])
    where = owners[order][:-1]
    once, twice = (
        np.bincount(where, np.where(depth >= least, gap, 0.0), minlength=truth_count).astype(float) for least in (1, 2)
    )
    return once, twice


def length_within(length: Floats, start_offset: Floats, end_offset: Floats, limit: float) -> Floats:
    """Length of each part, shape (n,) in m, on which the linearly running offset is at most `limit` either way."""
    slope = end_offset - start_offset
    level = np.abs(slope) < TOLERANCE
    safe = np.where(level, 1.0, slope)
    one, other = (-limit - start_offset) / safe, (limit - start_offset) / safe
    share = np.clip(np.maximum(one, other), 0, 1) - np.clip(np.minimum(one, other), 0, 1)
    share = np.where(level, (np.abs(start_offset) <= limit + TOLERANCE) * 1.0, share)
    return np.asarray(length * share, dtype=float)


def _lengths(segments: Floats) -> Floats:
    return np.asarray(np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1]), dtype=float)


def only_ignored(associations: Associations, counted: Flags, detected_count: int) -> Flags:
    """Which detections, shape (detected_count,), associate with *ignore* alone; `counted` says which parts do not."""
    any_part = np.bincount(associations.detected, minlength=detected_count) > 0
    counted_part = np.bincount(associations.detected[counted], minlength=detected_count) > 0
    return np.asarray(any_part & ~counted_part, dtype=bool)


def _pairs(
    associations: Associations, counted: Flags, truth_length: Floats, curve: Integers, detected_curves: Integers | None
) -> tuple[int, int]:
    """Numbers of (detected, true) pairs and of true segments in one, curved walls taken as one segment each."""
    truth_segment = np.where(curve >= 0, len(curve) + curve, np.arange(len(curve)))
    detected = associations.detected[counted]
    if detected_curves is not None and len(detected_curves):
        whole = len(detected_curves) + detected_curves
        detected = np.where(detected_curves >= 0, whole, np.arange(len(whole)))[detected]
    truth = truth_segment[associations.truth[counted]]
    if not len(truth):
        return 0, 0
    pair, row = np.unique(np.stack([detected, truth], axis=1), axis=0, return_inverse=True)
    together = np.bincount(row.ravel(), associations.length[counted])
    segment_length = np.bincount(truth_segment, truth_length)
    enough = together >= np.minimum(MIN_PAIR, segment_length[pair[:, 1]] / 2) - TOLERANCE
    return int(enough.sum()), len(np.unique(pair[enough, 1]))
