"""End points under optimal assignment, the measure of the Scan-to-BIM challenge's floor-plan task (not in the paper).

Both ends of every detected and of every true segment are assigned one to one so that the sum of squared distances is
least; a pair counts if its distance is below 5, 10 or 20 cm.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from asbuilt.evaluate.drawing import Floats

#: Distances below which an assigned pair counts, m.
END_POINT_DISTANCES = (0.05, 0.10, 0.20)
#: Pairs of ends up to which the whole matrix of distances is assigned: 288 MB, a few seconds.
MAX_DENSE_PAIRS = 36_000_000


def matched_ends(detected: Floats, truth: Floats) -> tuple[int, ...]:
    """Count the assigned pairs of end points below each of `END_POINT_DISTANCES`.

    Parameters
    ----------
    detected, truth : shape (n, 4) and (m, 4), x1, y1, x2, y2 in m.

    Returns
    -------
    As many counts as `END_POINT_DISTANCES`; zeros where either is empty.

    Notes
    -----
    Above `MAX_DENSE_PAIRS` (3000 segments against 3000) an assignment of everything to everything takes too long. Then
    pairs farther than the largest distance, which count in no case, may stay unassigned at the cost of that distance;
    the optimum is otherwise the same kind, and where pairs are clear it is the same.
    """
    ends, truth_ends = detected.reshape(-1, 2), truth.reshape(-1, 2)
    if not len(ends) or not len(truth_ends):
        return (0,) * len(END_POINT_DISTANCES)
    if len(ends) * len(truth_ends) <= MAX_DENSE_PAIRS:
        squared = cdist(ends, truth_ends, "sqeuclidean")
        distance = np.sqrt(squared[linear_sum_assignment(squared)])
    else:
        distance = _near_assignment(ends, truth_ends, max(END_POINT_DISTANCES))
    return tuple(int((distance < limit).sum()) for limit in END_POINT_DISTANCES)


def _near_assignment(ends: Floats, truth_ends: Floats, limit: float) -> Floats:
    """Distances of the assigned pairs when leaving an end unassigned costs `limit` squared."""
    near = cKDTree(ends).sparse_distance_matrix(cKDTree(truth_ends), limit, output_type="coo_matrix")
    count, truth_count = len(ends), len(truth_ends)
    spare = np.arange(count)  # each detected end has a column of its own to stay unassigned
    rows = np.concatenate([near.row, spare])
    columns = np.concatenate([near.col, truth_count + spare])
    # the solver takes a zero for a missing entry; every row is assigned once, so adding one to all changes nothing
    cost = 1.0 + np.concatenate([near.data**2, np.full(count, limit**2)])
    graph = coo_array((cost, (rows, columns)), shape=(count, truth_count + count)).tocsr()
    row, column = min_weight_full_bipartite_matching(graph)
    real = column < truth_count
    distance = np.hypot(*(ends[row[real]] - truth_ends[column[real]]).T)
    return np.asarray(distance, dtype=float)
