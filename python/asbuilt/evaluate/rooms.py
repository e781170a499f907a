"""Rooms: polygons assigned one to one for the greatest sum of intersection over union (not in the paper)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from scipy.optimize import linear_sum_assignment

from asbuilt.evaluate.drawing import TOLERANCE, Room
from asbuilt.evaluate.measures import f_measure, median, ratio

#: A room is found at this intersection over union.
MIN_IOU = 0.8


@dataclass(frozen=True)
class RoomTotals:
    """Counts of rooms and, of each found one, IoU and relative area error; and the overlap of all that were assigned.

    Attributes
    ----------
    detected, true : numbers of rooms.
    ious, area_errors : of the rooms found, each 0..1 and |area - true area| / true area.
    intersection, union : areas summed over all assigned pairs, found or not, m2: the challenge's room IoU.
    """

    detected: int = 0
    true: int = 0
    ious: tuple[float, ...] = ()
    area_errors: tuple[float, ...] = ()
    intersection: float = 0.0
    union: float = 0.0

    def __add__(self, other: RoomTotals) -> RoomTotals:
        return RoomTotals(*(getattr(self, name) + getattr(other, name) for name in self.__dataclass_fields__))

    @property
    def precision(self) -> float | None:
        """Share of the drawn rooms that are true; None where none was drawn."""
        return ratio(len(self.ious), self.detected)

    @property
    def recall(self) -> float | None:
        """Share of the true rooms that were found; None where there is none."""
        return ratio(len(self.ious), self.true)

    def to_json(self) -> dict[str, Any]:
        """Precision, recall, F, and of the found rooms mean IoU and median area error; undefined values are None."""
        return {
            "precision": self.precision,
            "recall": self.recall,
            "f": f_measure(self.precision, self.recall),
            "mean_iou": float(np.mean(self.ious)) if self.ious else None,
            "median_area_error": median(self.area_errors),
            "detected": self.detected,
            "true": self.true,
            "found": len(self.ious),
        }


def assign_rooms(detected: Sequence[Room], truth: Sequence[Room]) -> list[tuple[int, int, float, float]]:
    """Assign rooms one to one so that the sum of their IoU is greatest.

    Parameters
    ----------
    detected, truth : the rooms of one storey. A ring that crosses itself stands for the area it encloses.

    Returns
    -------
    (row of `detected`, row of `truth`, area of the intersection, area of the union) of the pairs that overlap, m2.
    """
    if not detected or not truth:
        return []
    mine, other = _polygons(detected), _polygons(truth)
    intersection = np.zeros((len(mine), len(other)))
    rows, columns = shapely.STRtree(other).query(mine, predicate="intersects")
    intersection[rows, columns] = shapely.area(shapely.intersection(mine[rows], other[columns]))
    union = shapely.area(mine)[:, None] + shapely.area(other)[None, :] - intersection
    iou = intersection / np.where(union > 0, union, 1.0)
    pairs = zip(*linear_sum_assignment(iou, maximize=True), strict=True)
    return [(int(i), int(j), float(intersection[i, j]), float(union[i, j])) for i, j in pairs if intersection[i, j] > 0]


def measure_rooms(detected: Sequence[Room], truth: Sequence[Room]) -> RoomTotals:
    """Sum up one storey's rooms; zeros for empty inputs."""
    pairs = assign_rooms(detected, truth)
    found = [(i, j, inside / union) for i, j, inside, union in pairs if inside / union >= MIN_IOU - TOLERANCE]
    return RoomTotals(
        detected=len(detected),
        true=len(truth),
        ious=tuple(iou for _, _, iou in found),
        area_errors=tuple(abs(detected[i].area - truth[j].area) / truth[j].area for i, j, _ in found if truth[j].area),
        intersection=sum(inside for _, _, inside, _ in pairs),
        union=sum(union for _, _, _, union in pairs),
    )


def _polygons(rooms: Sequence[Room]) -> Any:
    polygons = [shapely.Polygon(room.ring, room.holes) if len(room.ring) > 2 else shapely.Polygon() for room in rooms]
    return shapely.make_valid(np.array(polygons))
