"""Each detected face by itself: whether it is real, how far off it is, and whether it keeps what the plan claims.

From these come the reliability of a plan's confidence and the coverage of its error estimates. Not in the paper.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from asbuilt.evaluate.association import Associations
from asbuilt.evaluate.drawing import TOLERANCE, DrawingStorey
from asbuilt.evaluate.measures import ratio
from asbuilt.plan import LOA_BANDS, LOA_SIGMAS


@dataclass(frozen=True)
class FaceScore:
    """One detected face.

    Attributes
    ----------
    id : the plan's name of it.
    length, associated_length : all of it, and what associates with any truth, m.
    distance : mean distance of the associated part, m; None without one.
    truth : rows of the truth that it associates with, the longest part first.
    properties : what the plan says of it, such as `confidence`, `sigma` (m) and `loa`.
    """

    id: str
    length: float
    associated_length: float
    distance: float | None
    truth: tuple[int, ...]
    properties: dict[str, Any]

    @property
    def real(self) -> bool:
        """Whether at least half of the length associates."""
        return self.length > 0 and self.associated_length >= self.length / 2 - TOLERANCE

    @property
    def error_bound(self) -> float | None:
        """The error that the plan claims at 95 %, m: 1.96 `sigma`, else the limit of its `loa`; None without claim."""
        sigma, band = self.properties.get("sigma"), self.properties.get("loa")
        if sigma is not None:
            return LOA_SIGMAS * float(sigma)
        return None if band is None else LOA_BANDS.get(f"LOA{str(band).upper().removeprefix('LOA')}")


def score_faces(plan: DrawingStorey, associations: Associations) -> tuple[FaceScore, ...]:
    """Score each face of a storey, in the plan's order; empty for a storey without faces."""
    lines, scores = plan.lines, []
    for i, face in enumerate(plan.faces):
        rows = np.flatnonzero(associations.detected == i)
        part = associations.length[rows]
        together = float(part.sum())
        length = float(np.hypot(lines[i, 2] - lines[i, 0], lines[i, 3] - lines[i, 1]))
        distance = float((part * associations.distance[rows]).sum()) / together if together > 0 else None
        truth = tuple(dict.fromkeys(associations.truth[rows[np.argsort(-part, kind="stable")]].tolist()))
        scores.append(FaceScore(face.id, length, together, distance, truth, face.properties))
    return tuple(scores)


def reliability(faces: Iterable[FaceScore], bins: int = 10) -> list[dict[str, Any]]:
    """The reliability diagram: how many of the faces given a confidence are real.

    Parameters
    ----------
    faces : those without a `confidence` are left out.
    bins : equal bins of the confidence, 0..1.

    Returns
    -------
    One row a bin that has faces: `low`, `high`, `faces`, mean `confidence`, share `real`.
    """
    said = ((face.properties.get("confidence"), face.real) for face in faces)
    given = [(float(confidence), real) for confidence, real in said if confidence is not None]
    rows = []
    for i in range(bins):
        inside = [(c, real) for c, real in given if min(int(c * bins), bins - 1) == i]
        if inside:
            confidence, real = (float(np.mean(column)) for column in zip(*inside, strict=True))
            rows.append(
                {"low": i / bins, "high": (i + 1) / bins, "faces": len(inside), "confidence": confidence, "real": real}
            )
    return rows


def coverage(faces: Iterable[FaceScore]) -> dict[str, Any]:
    """Of the real faces with a claimed error at 95 %, the share that keeps it; None where no face has a claim."""
    kept = [
        face.distance <= face.error_bound + TOLERANCE
        for face in faces
        if face.real and face.distance is not None and face.error_bound is not None
    ]
    return {"faces": len(kept), "covered": ratio(sum(kept), len(kept))}
