"""Curved walls in a truth that knows only straight chords.

Three or more faces joined end to end, each turning a little in the same sense, are one curved wall: the paper's
over-segmentation counts it once, and it stays out of the orientation error, which a chord cut elsewhere would spoil.
Not in the paper, whose school has no curved wall.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from asbuilt.evaluate.drawing import TOLERANCE, Floats, Integers

#: Ends nearer than this are joined, m.
JOINT = 0.001
#: A joint of a curved wall turns by more than the first and by less than the second, degrees.
MIN_TURN_DEG, MAX_TURN_DEG = 0.2, 15.0
#: Chords from which a chain is a curved wall.
MIN_CHORDS = 3


def curved_walls(segments: Floats) -> Integers:
    """Find the curved walls among straight segments.

    Parameters
    ----------
    segments : shape (n, 4), x1, y1, x2, y2 in m; each may run either way.

    Returns
    -------
    shape (n,), the number of the curved wall that a segment is a chord of, from 0, or -1; empty for no segments.

    Notes
    -----
    Where the curvature of a chain changes its sense, the chord at the change belongs to the longer of the two.
    """
    count = len(segments)
    curve = np.full(count, -1, dtype=np.int64)
    if count < MIN_CHORDS:
        return curve
    # a face bends to its left or to its right: node 2 i is face i as part of a chain that keeps its centre to the left
    here, there = _joints(segments)
    graph = coo_array((np.ones(len(here), dtype=bool), (here, there)), shape=(2 * count, 2 * count))
    _, chain = connected_components(graph, directed=False)
    members: dict[int, list[int]] = {}
    for node in range(2 * count):
        members.setdefault(int(chain[node]), []).append(node // 2)
    found = 0
    for faces in sorted(members.values(), key=lambda faces: (-len(set(faces)), faces)):
        free = sorted({face for face in faces if curve[face] < 0})
        if len(free) >= MIN_CHORDS:
            curve[free] = found
            found += 1
    return curve


def _joints(segments: Floats) -> tuple[Integers, Integers]:
    """Pairs of nodes (2 * face, plus one where the centre lies to the face's right) whose faces are joined."""
    count = len(segments)
    ends = segments.reshape(-1, 2)  # row 2 i is the start of face i, row 2 i + 1 its end
    pairs = cKDTree(ends).query_pairs(JOINT + TOLERANCE, output_type="ndarray").reshape(-1, 2)
    pairs = pairs[pairs[:, 0] // 2 != pairs[:, 1] // 2]
    step = segments[:, 2:] - segments[:, :2]
    length = np.hypot(step[:, 0], step[:, 1])
    direction = step / np.where(length > 0, length, 1.0)[:, None]
    first, second = pairs[:, 0] // 2, pairs[:, 1] // 2
    # walk the first face towards the joint and the second away from it
    first_reversed, second_reversed = pairs[:, 0] % 2 == 0, pairs[:, 1] % 2 == 1
    before = direction[first] * np.where(first_reversed, -1.0, 1.0)[:, None]
    after = direction[second] * np.where(second_reversed, -1.0, 1.0)[:, None]
    turn_deg = np.degrees(
        np.arctan2(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], (before * after).sum(axis=1))
    )
    size = np.abs(turn_deg)
    real = (length[first] > 0) & (length[second] > 0)
    bends = np.flatnonzero((size > MIN_TURN_DEG) & (size < MAX_TURN_DEG) & real)
    right = turn_deg[bends] < 0
    here = 2 * first[bends] + (right != first_reversed[bends])
    there = 2 * second[bends] + (right != second_reversed[bends])
    assert not len(here) or max(here.max(), there.max()) < 2 * count
    return here.astype(np.int64), there.astype(np.int64)
