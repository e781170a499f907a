"""Lines on whose planes too little stands for a wall are left out before elevations are drawn (not in the paper).

Lines are traced through furniture, too; most bear no wall. What their planes hold tells that of the greater part, at a
tenth of what an elevation costs, most of which lies beyond the ends of its line.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from asbuilt.elevations import (
    ON_PLANE,
    ceiling_heights,
    filled_below,
    filled_on_plane,
    instead_of_ceilings,
    share_filled,
    step_of,
)
from asbuilt.faces import closed_shares, maximal_runs, score_filling, usual_filling
from asbuilt.grid import FloatArray
from asbuilt.params import WallParameters
from asbuilt.profiles import StoreyVoxels

_UPPER = ((0.45, 0.1), (0.85, 0.5))
"""The upper zone of a wall, from and to this far below the ceiling, and below a cornice, m."""
_LEAST = 0.15
"""Share of a wall's least score with which a line stays: an elevation may show more than the filling of its plane."""
_FEW = 6
"""A ceiling does not change from step to step: it is looked up at one of so many."""


def drop_bare(lines: FloatArray, voxels: StoreyVoxels, parameters: WallParameters) -> FloatArray:
    """Of lines (n, 4), m from the storey's origin, those that may bear a wall; none of none.

    A line stays where the filling of its plane alone, under whichever ceiling speaks for it most, scores as a wall.
    """
    if len(lines) == 0:
        return lines
    step = step_of(voxels)
    length = np.hypot(lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1])
    first = np.concatenate([[0], np.cumsum(np.ceil(length / step).astype(np.int64))])
    total = int(first[-1])
    filled = filled_on_plane(voxels.hits(lines, ON_PLANE, 0.0, step, first), first, step)
    below = filled_below(filled)

    few = np.arange(0, total, _FEW)
    line_of = np.searchsorted(first, few, side="right") - 1
    along = ((lines[:, 2:] - lines[:, :2]) / length[:, None])[line_of]
    place = lines[line_of, :2] + ((few - first[line_of] + 0.5) * step)[:, None] * along
    normal = np.column_stack([-along[:, 1], along[:, 0]])
    sampled = np.stack([ceiling_heights(place, along, side * normal, voxels) for side in (1, -1)])
    ceilings = instead_of_ceilings(np.repeat(sampled, _FEW, axis=1)[:, :total], filled, first, step, voxels)

    lower = share_filled(below, np.full(total, 0.15), np.full(total, 1.9), step)
    whole = share_filled(below, np.full(total, 0.15), np.full(total, voxels.height - _UPPER[0][1]), step)
    zones = [share_filled(below, ceiling - a, ceiling - b, step) for ceiling in ceilings for a, b in _UPPER]
    full = usual_filling(whole)
    upper, lower, whole = (
        closed_shares(part, full, first, step, parameters) for part in (np.max(zones, axis=0), lower, whole)
    )
    scores = score_filling(upper, lower, whole, hidden=True) * step
    runs = (
        maximal_runs(scores[low:high], _LEAST * parameters.min_score, parameters.drop) for low, high in pairwise(first)
    )
    return lines[[bool(found) for found in runs]]
