"""What an evaluation gives: measures per storey and pooled, and the parts of segments they were summed from."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from asbuilt.evaluate.association import Associations
from asbuilt.evaluate.challenge import ChallengeTotals
from asbuilt.evaluate.drawing import TRUTH_SETS, DrawingStorey, TruthSet
from asbuilt.evaluate.faces import FaceScore, coverage, reliability
from asbuilt.evaluate.loa import Offsets
from asbuilt.evaluate.measures import WallTotals, ratio
from asbuilt.evaluate.openings import OpeningTotals
from asbuilt.evaluate.rooms import RoomTotals
from asbuilt.evaluate.thickness import ThicknessTotals


@dataclass(frozen=True)
class Scores:
    """All measures of a storey, or of several added up.

    Attributes
    ----------
    walls, offsets, challenge : by truth set, "observed" and "all".
    doors, windows, rooms : None where the truth holds none anywhere, or the plan's format says nothing about them.
    thickness, faces : of the plan's walls and of its faces, against every true face.
    """

    walls: dict[TruthSet, WallTotals]
    offsets: dict[TruthSet, Offsets]
    challenge: dict[TruthSet, ChallengeTotals]
    doors: OpeningTotals | None
    windows: OpeningTotals | None
    rooms: RoomTotals | None
    thickness: ThicknessTotals
    faces: tuple[FaceScore, ...]

    def to_json(self) -> dict[str, Any]:
        """The measures as plain dicts and lists; undefined values are None."""
        kinds = {"doors": self.doors, "windows": self.windows, "rooms": self.rooms}
        return {
            **{which: self._walls_to_json(which) for which in TRUTH_SETS},
            **{kind: None if totals is None else totals.to_json() for kind, totals in kinds.items()},
            "thickness": self.thickness.to_json() if self.thickness.measured else None,
            "reliability": reliability(self.faces),
            "coverage": coverage(self.faces),
        }

    def _walls_to_json(self, which: TruthSet) -> dict[str, Any]:
        challenge = self.challenge[which].to_json()
        if (
            self.rooms is not None and self.rooms.detected
        ):  # drawn rooms say it better than the areas that the line work happens to close
            challenge["room_iou"] = ratio(self.rooms.intersection, self.rooms.union)
        return {**self.walls[which].to_json(), "loa": self.offsets[which].to_json(), "challenge": challenge}


@dataclass(frozen=True)
class StoreyEvaluation:
    """One storey: the plan's storey and the truth's that it was matched with, either None where it has no match.

    Attributes
    ----------
    plan, truth : the storeys compared.
    associations : which part of which face went to which truth: rows are `plan.faces` and `truth.truth_lines`.
    scores : the measures.
    """

    plan: DrawingStorey | None
    truth: DrawingStorey | None
    associations: Associations
    scores: Scores

    def segments(self) -> list[dict[str, Any]]:
        """The associated parts one by one, from which plots and totals can be redone; empty without any.

        Each has `detected` (the face's id), `truth` (row of `truth.truth_lines`), `start` and `end` along the
        detection and `truth_start` and `truth_end` along the truth (m), `distance` (m), `angle_deg`, and for either
        truth set whether it counts (else it associates with *ignore*).
        """
        if self.plan is None or self.truth is None:
            return []
        in_use = {which: self.truth.in_use(which) for which in TRUTH_SETS}
        found = self.associations
        return [
            {
                "detected": self.plan.faces[found.detected[i]].id,
                "truth": int(found.truth[i]),
                "start": float(found.start[i]),
                "end": float(found.end[i]),
                "truth_start": float(found.truth_start[i]),
                "truth_end": float(found.truth_end[i]),
                "distance": float(found.distance[i]),
                "angle_deg": math.degrees(found.angle[i]),
                **{which: bool(in_use[which][found.truth[i]]) for which in TRUTH_SETS},
            }
            for i in range(len(found))
        ]

    def to_json(self) -> dict[str, Any]:
        """Measures of this storey; `index` and `floor` are the truth's, `plan_index` the plan's, None without one."""
        return {
            "index": self.truth.index if self.truth else None,
            "floor": self.truth.floor if self.truth else None,
            "plan_index": self.plan.index if self.plan else None,
            "plan_floor": self.plan.floor if self.plan else None,
            **self.scores.to_json(),
        }


@dataclass(frozen=True)
class Evaluation:
    """A plan scored against a truth.

    Attributes
    ----------
    storeys : the truth's storeys, lowest first, then the plan's without truth.
    parameters : the limits that were used, and what was compared.
    """

    storeys: tuple[StoreyEvaluation, ...]
    parameters: dict[str, Any] = field(default_factory=dict)

    def pooled(self, which: TruthSet = "observed") -> WallTotals:
        """The storeys' wall totals added up; zeros for no storeys."""
        return pool([storey.scores for storey in self.storeys]).walls[which]

    @property
    def scores(self) -> Scores:
        """All measures, pooled over the storeys."""
        return pool([storey.scores for storey in self.storeys])

    def to_json(self) -> dict[str, Any]:
        """All measures as plain dicts and lists; undefined values are None."""
        return {
            "pooled": self.scores.to_json(),
            "storeys": [storey.to_json() for storey in self.storeys],
            "parameters": self.parameters,
        }


def pool(scores: list[Scores]) -> Scores:
    """Add up storeys or whole buildings: lengths and counts, never ratios. Zeros for an empty list."""
    doors = [part.doors for part in scores if part.doors is not None]
    windows = [part.windows for part in scores if part.windows is not None]
    rooms = [part.rooms for part in scores if part.rooms is not None]
    return Scores(
        walls={which: sum((part.walls[which] for part in scores), WallTotals()) for which in TRUTH_SETS},
        offsets={which: Offsets.join([part.offsets[which] for part in scores]) for which in TRUTH_SETS},
        challenge={which: sum((part.challenge[which] for part in scores), ChallengeTotals()) for which in TRUTH_SETS},
        doors=sum(doors, OpeningTotals()) if doors else None,
        windows=sum(windows, OpeningTotals()) if windows else None,
        rooms=sum(rooms, RoomTotals()) if rooms else None,
        thickness=sum((part.thickness for part in scores), ThicknessTotals()),
        faces=tuple(face for part in scores for face in part.faces),
    )
