"""The measures of the Scan-to-BIM challenge's floor-plan task, so that a plan can stand beside its entrants.

The end points are in `end_points`. Here are the mean cosine of the walls' orientation, the rooms' intersection over
union, and the Betti-number error of the line work, after the challenge's description. Where its scorer leaves a
number to chance or to a picture's grid, this one does not: see `measure_challenge`. None of it is in the paper.

Not implemented: the warping error (Jain et al. 2010). It needs a homotopic warp of one binary picture onto another,
pixel by simple pixel; none of the well-kept libraries (scikit-image, scipy, OpenCV) has one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.optimize import linear_sum_assignment

from asbuilt.evaluate.association import Associations
from asbuilt.evaluate.drawing import Flags, Floats
from asbuilt.evaluate.measures import ratio

#: Side of a cell of the picture in which the topology is counted, m, as the challenge's.
CELL = 0.2
#: Cells from which a closed area is a room, as the challenge's: 4 m2.
MIN_ROOM_CELLS = 100
#: Side of the patches whose Betti numbers are compared, cells, as the challenge's; and the step between them.
PATCH, PATCH_STEP = 25, 12


@dataclass(frozen=True)
class ChallengeTotals:
    """Sums that add up over storeys.

    Attributes
    ----------
    cosine_sum, matched_walls, true_walls : cosine summed over the true walls matched; how many; how many there are.
    room_intersection, room_union : of the areas closed by walls and doors, assigned one to one, cells.
    patch_difference, patches : sum of the patches' Betti-number errors and their number.
    components, holes : absolute differences of the whole storeys' Betti numbers 0 and 1.
    """

    cosine_sum: float = 0.0
    matched_walls: int = 0
    true_walls: int = 0
    room_intersection: int = 0
    room_union: int = 0
    patch_difference: int = 0
    patches: int = 0
    components: int = 0
    holes: int = 0

    def __add__(self, other: ChallengeTotals) -> ChallengeTotals:
        return ChallengeTotals(*(getattr(self, name) + getattr(other, name) for name in self.__dataclass_fields__))

    def to_json(self) -> dict[str, Any]:
        """The measures; undefined values, and the warping error that is missing, are None."""
        return {
            "mean_cosine": ratio(self.cosine_sum, self.true_walls),
            "mean_cosine_matched": ratio(self.cosine_sum, self.matched_walls),
            "room_iou": ratio(self.room_intersection, self.room_union),
            "betti_error": ratio(self.patch_difference, self.patches),
            "betti_0_difference": self.components,
            "betti_1_difference": self.holes,
            "warping_error": None,
        }


def measure_challenge(
    associations: Associations,
    in_use: Flags,
    plan_lines: Floats,
    truth_lines: Floats,
) -> ChallengeTotals:
    """Sum up one storey.

    Parameters
    ----------
    associations : of the detected faces with the truth.
    in_use : shape (m,), the truth that counts.
    plan_lines, truth_lines : shape (n, 4), the line work whose topology is compared, doors' lines included, m.

    Returns
    -------
    ChallengeTotals
        A true wall is matched with the detection that associates with most of it; its cosine is that of the angle
        between them, and 0 for a wall without match, as the challenge has it.

    Notes
    -----
    The challenge's scorer draws 500 patches at random, and counts its rooms as 8-connected areas, which leak through
    oblique walls one cell wide. Here patches cover the picture evenly, and areas are 4-connected.
    """
    best = np.zeros(len(in_use))
    cosine = np.zeros(len(in_use))
    for row in np.argsort(associations.length, kind="stable"):
        j = associations.truth[row]
        best[j], cosine[j] = associations.length[row], np.cos(associations.angle[row])
    pictures = _pictures(plan_lines, truth_lines)
    difference, patches = _patch_differences(*pictures)
    inside, union = _room_overlap(*pictures)
    numbers = [betti_numbers(picture) for picture in pictures]
    return ChallengeTotals(
        cosine_sum=float(cosine[in_use].sum()),
        matched_walls=int((best[in_use] > 0).sum()),
        true_walls=int(in_use.sum()),
        room_intersection=inside,
        room_union=union,
        patch_difference=difference,
        patches=patches,
        components=abs(numbers[0][0] - numbers[1][0]),
        holes=abs(numbers[0][1] - numbers[1][1]),
    )


def betti_numbers(picture: NDArray[np.bool_]) -> tuple[int, int]:
    """Number of connected parts of a drawing, and of the areas that it encloses.

    Parameters
    ----------
    picture : shape (h, w), True where drawn. The drawing is 8-connected, and what it encloses 4-connected.
    """
    around = np.pad(picture, 1)
    parts = ndimage.label(around, structure=np.ones((3, 3)))[1]
    areas = ndimage.label(~around)[1]
    return int(parts), int(areas) - 1


def _pictures(plan_lines: Floats, truth_lines: Floats) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Both drawings on one grid that reaches a patch's side beyond them."""
    ends = np.concatenate([plan_lines, truth_lines]).reshape(-1, 2)
    if not len(ends):
        empty = np.zeros((1, 1), dtype=bool)
        return empty, empty
    low = ends.min(axis=0) - CELL
    shape = np.ceil((ends.max(axis=0) + CELL - low) / CELL).astype(int) + 1
    return _draw(plan_lines, low, shape), _draw(truth_lines, low, shape)


def _draw(lines: Floats, low: Floats, shape: NDArray[np.int64]) -> NDArray[np.bool_]:
    picture = np.zeros((int(shape[1]), int(shape[0])), dtype=bool)
    for x1, y1, x2, y2 in lines:
        steps = int(np.hypot(x2 - x1, y2 - y1) / CELL * 8) + 2  # eight to a cell: no cell is jumped over
        ix = ((np.linspace(x1, x2, steps) - low[0]) / CELL).astype(int)
        iy = ((np.linspace(y1, y2, steps) - low[1]) / CELL).astype(int)
        picture[iy, ix] = True
    return picture


def _room_overlap(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> tuple[int, int]:
    """Cells in the intersections and in the unions of the rooms of both, assigned one to one by IoU."""
    mine, theirs = _rooms(one), _rooms(other)
    if not mine.any() or not theirs.any():
        return 0, 0
    together = np.zeros((int(mine.max()) + 1, int(theirs.max()) + 1), dtype=np.int64)
    np.add.at(together, (mine.ravel(), theirs.ravel()), 1)
    inside = together[1:, 1:]
    union = together.sum(axis=1)[1:, None] + together.sum(axis=0)[None, 1:] - inside
    pairs = linear_sum_assignment(inside / union, maximize=True)
    return int(inside[pairs].sum()), int(union[pairs].sum())


def _rooms(picture: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Each cell's room, from 1, or 0: areas that the drawing closes off and that are large enough."""
    around = np.pad(~picture, 1, constant_values=True)
    label = ndimage.label(around)[0][1:-1, 1:-1]
    size = np.bincount(label.ravel())
    outside = ndimage.label(around)[0][0, 0]
    kept = np.flatnonzero((size >= MIN_ROOM_CELLS) & (np.arange(len(size)) != outside) & (np.arange(len(size)) > 0))
    number = np.zeros(len(size), dtype=np.int64)
    number[kept] = np.arange(1, len(kept) + 1)
    return np.asarray(number[label])


def _patch_differences(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> tuple[int, int]:
    """Sum over the patches of the difference in the number of areas, and the number of patches that hold anything."""
    difference = patches = 0
    for row in range(0, max(one.shape[0] - PATCH, 0) + PATCH_STEP, PATCH_STEP):
        for column in range(0, max(one.shape[1] - PATCH, 0) + PATCH_STEP, PATCH_STEP):
            window = np.s_[row : row + PATCH, column : column + PATCH]
            if one[window].any() or other[window].any():
                patches += 1
                difference += abs(ndimage.label(~one[window])[1] - ndimage.label(~other[window])[1])
    return difference, patches
