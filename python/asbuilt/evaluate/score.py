"""Score a plan against a truth: the one function the command line calls."""

from __future__ import annotations

import os
from collections.abc import Collection
from typing import Any

import numpy as np

from asbuilt.errors import ParameterError
from asbuilt.evaluate.association import Associations, associate
from asbuilt.evaluate.challenge import ChallengeTotals, measure_challenge
from asbuilt.evaluate.drawing import TRUTH_SETS, Drawing, DrawingStorey, Face, Flags, Floats, Integers, Opening
from asbuilt.evaluate.faces import score_faces
from asbuilt.evaluate.loa import Offsets
from asbuilt.evaluate.measures import measure_walls, only_ignored
from asbuilt.evaluate.openings import measure_openings
from asbuilt.evaluate.read import as_drawing
from asbuilt.evaluate.result import Evaluation, Scores, StoreyEvaluation
from asbuilt.evaluate.rooms import measure_rooms
from asbuilt.evaluate.storeys import match_storeys
from asbuilt.evaluate.thickness import measure_thickness
from asbuilt.plan import FloorPlan

Source = Drawing | FloorPlan | dict[str, Any] | str | os.PathLike[str]


def evaluate(
    plan: Source,
    truth: Source,
    max_distance: float | None = 0.25,
    max_angle_deg: float = 36.0,
    storeys: Collection[int] | None = None,
) -> Evaluation:
    """Score a plan by the measures of section 4 of the paper.

    Parameters
    ----------
    plan, truth : a `FloorPlan`, parsed GeoJSON or `truth.json`, a path to a file, or a `Drawing`.
    max_distance : farther than this a detection has no association, m; None is the paper's text, which has no limit.
    max_angle_deg : orientation threshold of the association, degrees; the paper's figure is 36.
    storeys : the truth's storeys to score, 0 the lowest; None scores all.

    Returns
    -------
    Evaluation
        Measures per storey and pooled, for the *observed* and for *all* truth, and the associations they come from.
        A plan without faces has undefined precision (None), recall 0 and F 0.

    Raises
    ------
    InputError : a file cannot be read as what it claims to be.
    ParameterError : a limit out of its range, or a storey that the truth does not have.
    """
    plan, truth = as_drawing(plan), as_drawing(truth)
    matches = match_storeys(plan.storeys, truth.storeys)
    if storeys is not None:
        known = [storey.index for storey in truth]
        unknown = sorted(set(storeys) - set(known))
        if unknown:
            raise ParameterError(f"storey {unknown[0]} is not in the truth; it has {known}")
        matches = [(mine, other) for mine, other in matches if other is not None and other.index in storeys]
    # an empty list in every storey means that this truth was not made
    made = {kind for kind in truth.holds if any(getattr(storey, kind) for storey in truth)}
    scored = plan.holds & made
    return Evaluation(
        tuple(_evaluate_storey(mine, other, scored, max_distance, max_angle_deg) for mine, other in matches),
        parameters={
            "max_distance": max_distance,
            "max_angle_deg": max_angle_deg,
            "plan": plan.name,
            "truth": truth.name,
        },
    )


def _evaluate_storey(
    plan: DrawingStorey | None,
    truth: DrawingStorey | None,
    scored: frozenset[str],
    max_distance: float | None,
    max_angle_deg: float,
) -> StoreyEvaluation:
    mine, other = plan or DrawingStorey(0, None), truth or DrawingStorey(0, None)
    detected, lines = mine.lines, other.truth_lines
    associations = associate(detected, lines, max_distance, max_angle_deg)
    curves = _curve_numbers(mine.faces)
    in_use = {which: other.in_use(which) for which in TRUTH_SETS}
    scores = Scores(
        walls={which: measure_walls(associations, detected, lines, in_use[which], curves) for which in TRUTH_SETS},
        offsets={which: _offsets(associations, in_use[which]) for which in TRUTH_SETS},
        challenge={which: _challenge(mine, other, associations, in_use[which]) for which in TRUTH_SETS},
        doors=measure_openings(mine.doors, other.doors) if "doors" in scored else None,
        windows=measure_openings(mine.windows, other.windows) if "windows" in scored else None,
        rooms=measure_rooms(mine.rooms, other.rooms) if "rooms" in scored else None,
        thickness=measure_thickness(mine, other, associations),
        faces=score_faces(mine, associations),
    )
    return StoreyEvaluation(plan, truth, associations, scores)


def _offsets(associations: Associations, in_use: Flags) -> Offsets:
    counted = in_use[associations.truth]
    return Offsets(associations.length[counted], associations.start_offset[counted], associations.end_offset[counted])


def _challenge(plan: DrawingStorey, truth: DrawingStorey, associations: Associations, in_use: Flags) -> ChallengeTotals:
    """The line work is the walls that count and the doors, the reveals of the truth's doors included."""
    drawn = ~only_ignored(associations, in_use[associations.truth], len(plan.faces))
    shown = in_use.copy()
    shown[len(truth.faces) :] = True
    plan_lines = np.concatenate([plan.lines[drawn], _opening_lines(plan.doors)])
    truth_lines = np.concatenate([truth.truth_lines[shown], _opening_lines(truth.doors)])
    return measure_challenge(associations, in_use, plan_lines, truth_lines)


def _opening_lines(openings: tuple[Opening, ...]) -> Floats:
    return np.array([opening.line for opening in openings], dtype=float).reshape(-1, 4)


def _curve_numbers(faces: tuple[Face, ...]) -> Integers:
    names = {curve: i for i, curve in enumerate(dict.fromkeys(face.curve for face in faces if face.curve is not None))}
    return np.array([-1 if face.curve is None else names[face.curve] for face in faces], dtype=np.int64)
