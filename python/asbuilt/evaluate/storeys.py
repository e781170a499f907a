"""Match the storeys of a plan with those of a truth, one to one by nearest floor (not in the paper)."""

from __future__ import annotations

from collections.abc import Sequence

from asbuilt.evaluate.drawing import TOLERANCE, DrawingStorey

#: Floors farther apart than this are not the same storey, m.
MAX_FLOOR_DISTANCE = 1.0


def match_storeys(
    plan: Sequence[DrawingStorey], truth: Sequence[DrawingStorey]
) -> list[tuple[DrawingStorey | None, DrawingStorey | None]]:
    """Pair storeys, nearest floors first.

    Parameters
    ----------
    plan, truth : the storeys of either side. Where a storey's floor height is not known, as in a DXF, it goes with
        the truth's storey of the same index, or, if both sides have one storey, with that one.

    Returns
    -------
    (plan, truth) pairs in the truth's order, then the plan's storeys without a match; None stands for no match.
    """
    distances: list[tuple[float, int, int]] = []
    for i, mine in enumerate(plan):
        for j, other in enumerate(truth):
            distance = _floor_distance(mine, other, len(plan) == len(truth) == 1)
            if distance <= MAX_FLOOR_DISTANCE + TOLERANCE:
                distances.append((distance, j, i))
    partner: dict[int, int] = {}
    for _, j, i in sorted(distances):
        if j not in partner and i not in partner.values():
            partner[j] = i
    pairs: list[tuple[DrawingStorey | None, DrawingStorey | None]] = []
    for j, other in enumerate(truth):
        pairs.append((plan[partner[j]] if j in partner else None, other))
    pairs.extend((mine, None) for i, mine in enumerate(plan) if i not in partner.values())
    return pairs


def _floor_distance(mine: DrawingStorey, other: DrawingStorey, alone: bool) -> float:
    if mine.floor is not None and other.floor is not None:
        return abs(mine.floor - other.floor)
    return 0.0 if alone or mine.index == other.index else float("inf")
