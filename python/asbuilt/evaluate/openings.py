"""Doors and windows: which of the true ones a plan found, and how wide it drew them (not in the paper)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from asbuilt.evaluate.drawing import TOLERANCE, Opening
from asbuilt.evaluate.measures import f_measure, median, ratio

#: Centres may differ by this much along the true line, and by this much across it, m. Of a wall seen from
#: one side alone nobody knows where its middle is.
MAX_ALONG, MAX_ACROSS = 0.20, 0.35
#: Widths may differ by this much, m.
MAX_WIDTH_DIFFERENCE = 0.10


@dataclass(frozen=True)
class OpeningTotals:
    """Counts of openings and the width error (m) of each found one; they add up over storeys."""

    detected: int = 0
    true: int = 0
    width_errors: tuple[float, ...] = ()

    def __add__(self, other: OpeningTotals) -> OpeningTotals:
        return OpeningTotals(
            self.detected + other.detected, self.true + other.true, self.width_errors + other.width_errors
        )

    @property
    def precision(self) -> float | None:
        """Share of the drawn openings that are true; None where none was drawn."""
        return ratio(len(self.width_errors), self.detected)

    @property
    def recall(self) -> float | None:
        """Share of the true openings that were found; None where there is none."""
        return ratio(len(self.width_errors), self.true)

    def to_json(self) -> dict[str, Any]:
        """Precision, recall, F, median width error (m) and the counts; undefined values are None."""
        return {
            "precision": self.precision,
            "recall": self.recall,
            "f": f_measure(self.precision, self.recall),
            "median_width_error": median(self.width_errors),
            "detected": self.detected,
            "true": self.true,
            "found": len(self.width_errors),
        }


def match_openings(detected: Sequence[Opening], truth: Sequence[Opening]) -> list[tuple[int, int]]:
    """Match openings one to one, nearest centres first, among the pairs near enough in place and in width.

    Parameters
    ----------
    detected, truth : doors with doors, or windows with windows, of one storey.

    Returns
    -------
    (row of `detected`, row of `truth`) pairs in the truth's order; empty where either is.
    """
    near: list[tuple[float, int, int]] = []
    for j, true in enumerate(truth):
        x1, y1, x2, y2 = true.line
        along = np.array([x2 - x1, y2 - y1])
        along = along / max(float(np.hypot(*along)), TOLERANCE)
        for i, mine in enumerate(detected):
            x, y = (mine.line[0] + mine.line[2] - x1 - x2) / 2, (mine.line[1] + mine.line[3] - y1 - y2) / 2
            fits = (
                abs(x * along[0] + y * along[1]) <= MAX_ALONG + TOLERANCE
                and abs(x * along[1] - y * along[0]) <= MAX_ACROSS + TOLERANCE
                and abs(mine.width - true.width) <= MAX_WIDTH_DIFFERENCE + TOLERANCE
            )
            if fits:
                near.append((float(np.hypot(x, y)), j, i))
    pairs: dict[int, int] = {}
    for _, j, i in sorted(near):
        if j not in pairs and i not in pairs.values():
            pairs[j] = i
    return [(pairs[j], j) for j in sorted(pairs)]


def measure_openings(detected: Sequence[Opening], truth: Sequence[Opening]) -> OpeningTotals:
    """Sum up one storey's doors or windows; zeros for empty inputs."""
    errors = tuple(abs(detected[i].width - truth[j].width) for i, j in match_openings(detected, truth))
    return OpeningTotals(len(detected), len(truth), errors)
