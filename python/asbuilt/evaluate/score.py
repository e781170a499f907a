"""Score a plan against a truth: the one function the command line calls."""

from __future__ import annotations

import os
from collections.abc import Collection
from typing import Any

import numpy as np

from asbuilt.errors import ParameterError
from asbuilt.evaluate.association import associate
from asbuilt.evaluate.drawing import TRUTH_SETS, Drawing, DrawingStorey, Face, Integers
from asbuilt.evaluate.measures import measure_walls
from asbuilt.evaluate.read import as_drawing
from asbuilt.evaluate.result import Evaluation, StoreyEvaluation
from asbuilt.evaluate.storeys import match_storeys
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
    return Evaluation(
        tuple(_evaluate_storey(mine, other, max_distance, max_angle_deg) for mine, other in matches),
        parameters={
            "max_distance": max_distance,
            "max_angle_deg": max_angle_deg,
            "plan": plan.name,
            "truth": truth.name,
        },
    )


def _evaluate_storey(
    plan: DrawingStorey | None, truth: DrawingStorey | None, max_distance: float | None, max_angle_deg: float
) -> StoreyEvaluation:
    mine, other = plan or DrawingStorey(0, None), truth or DrawingStorey(0, None)
    detected, lines = mine.lines, other.truth_lines
    associations = associate(detected, lines, max_distance, max_angle_deg)
    curves = _curve_numbers(mine.faces)
    walls = {which: measure_walls(associations, detected, lines, other.in_use(which), curves) for which in TRUTH_SETS}
    return StoreyEvaluation(plan, truth, associations, walls)


def _curve_numbers(faces: tuple[Face, ...]) -> Integers:
    names = {curve: i for i, curve in enumerate(dict.fromkeys(face.curve for face in faces if face.curve is not None))}
    return np.array([-1 if face.curve is None else names[face.curve] for face in faces], dtype=np.int64)
