"""Wall thickness: what a plan measured between two faces against the distance of the true faces (not in the paper)."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from asbuilt.evaluate.association import Associations
from asbuilt.evaluate.drawing import DrawingStorey, Floats
from asbuilt.evaluate.measures import median

#: Faces that lie beside each other by less than this only meet at a corner, m.
MIN_BESIDE = 0.05


@dataclass(frozen=True)
class ThicknessTotals:
    """Walls with a measured thickness, and the error (m) of those whose two faces have a true face each."""

    measured: int = 0
    errors: tuple[float, ...] = ()

    def __add__(self, other: ThicknessTotals) -> ThicknessTotals:
        return ThicknessTotals(self.measured + other.measured, self.errors + other.errors)

    def to_json(self) -> dict[str, Any]:
        """Median error (m; None without any) and the counts."""
        return {"median_error": median(self.errors), "measured": self.measured, "scored": len(self.errors)}


def measure_thickness(plan: DrawingStorey, truth: DrawingStorey, associations: Associations) -> ThicknessTotals:
    """Compare the measured thickness of each wall with that of the true wall its faces associate with.

    Parameters
    ----------
    plan, truth : the matched storeys.
    associations : of `plan.lines` with `truth.truth_lines`.

    Returns
    -------
    ThicknessTotals
        A wall without a measured thickness is not counted. One whose faces associate with nothing, or with one side of
        a true wall only, is counted but not scored.
    """
    main = _main_truth(associations, len(plan.faces), len(truth.faces))
    rows = {face.id: i for i, face in enumerate(plan.faces)}
    measured, errors = 0, []
    for wall in plan.walls:
        if wall.thickness is None:
            continue
        measured += 1
        sides = sorted({main[rows[face]] for face in wall.faces if face in rows and main[rows[face]] >= 0})
        true = true_thickness(truth.lines[sides])
        if true is not None:
            errors.append(abs(wall.thickness - true))
    return ThicknessTotals(measured, tuple(errors))


def true_thickness(faces: Floats) -> float | None:
    """Distance, m, between the two sides of a wall, whose faces (n, 4) stop at its doors; None of one side alone.

    Faces that lie beside each other are of different sides, those behind each other of the same. The mean over the
    pairs, weighted by the length that they lie beside each other.
    """
    pairs = [(face_distance(a, b), _length_beside(a, b)) for a, b in itertools.combinations(faces, 2)]
    beside = sum(length for _, length in pairs if length > MIN_BESIDE)
    if beside == 0:
        return None
    return sum(distance * length for distance, length in pairs if length > MIN_BESIDE) / beside


def face_distance(one: Floats, other: Floats) -> float:
    """Distance between two roughly parallel faces, shape (4,) each, m: from each one's middle to the other's line."""
    return (_to_line(one, other) + _to_line(other, one)) / 2


def _length_beside(one: Floats, other: Floats) -> float:
    """Length of `one` that `other` lies beside, m."""
    step = one[2:] - one[:2]
    length = float(np.hypot(*step))
    low, high = np.sort((other.reshape(2, 2) - one[:2]) @ step / length)
    return max(min(float(high), length) - max(float(low), 0.0), 0.0)


def _to_line(segment: Floats, line: Floats) -> float:
    step = line[2:] - line[:2]
    middle = (segment[:2] + segment[2:]) / 2 - line[:2]
    return abs(float(step[0] * middle[1] - step[1] * middle[0])) / float(np.hypot(*step))


def _main_truth(associations: Associations, detected_count: int, face_count: int) -> list[int]:
    """The true face that most of each detected face associates with, -1 for none; jambs are no faces of walls."""
    faces = associations.truth < face_count
    both = np.stack([associations.detected[faces], associations.truth[faces]], axis=1)
    pairs, row = np.unique(both, axis=0, return_inverse=True)
    length = np.bincount(row.ravel(), associations.length[faces], minlength=len(pairs))
    # written shortest first, so that the longest stays; of equals the first true face
    order = np.lexsort((-pairs[:, 1], length))
    main = np.full(detected_count, -1, dtype=np.int64)
    main[pairs[order, 0]] = pairs[order, 1]
    return main.tolist()
