"""What an evaluation gives: measures per storey and pooled, and the parts of segments they were summed from."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from asbuilt.evaluate.association import Associations
from asbuilt.evaluate.drawing import TRUTH_SETS, DrawingStorey, TruthSet
from asbuilt.evaluate.measures import WallTotals


@dataclass(frozen=True)
class StoreyEvaluation:
    """One storey: the plan's storey and the truth's that it was matched with, either None where it has no match.

    Attributes
    ----------
    plan, truth : the storeys compared.
    associations : which part of which face went to which truth: rows are `plan.faces` and `truth.truth_lines`.
    walls : the totals by truth set, "observed" and "all".
    """

    plan: DrawingStorey | None
    truth: DrawingStorey | None
    associations: Associations
    walls: dict[TruthSet, WallTotals] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Measures of this storey; `index` and `floor` are the truth's, `plan_index` the plan's, None without one."""
        return {
            "index": self.truth.index if self.truth else None,
            "floor": self.truth.floor if self.truth else None,
            "plan_index": self.plan.index if self.plan else None,
            "plan_floor": self.plan.floor if self.plan else None,
            **{which: self.walls[which].to_json() for which in TRUTH_SETS},
        }


@dataclass(frozen=True)
class Evaluation:
    """A plan scored against a truth.

    Attributes
    ----------
    storeys : matched storeys lowest first, then the plan's without truth.
    parameters : the limits that were used.
    """

    storeys: tuple[StoreyEvaluation, ...]
    parameters: dict[str, Any] = field(default_factory=dict)

    def pooled(self, which: TruthSet = "observed") -> WallTotals:
        """The storeys' totals added up; zeros for no storeys."""
        return sum((storey.walls[which] for storey in self.storeys), WallTotals())

    def to_json(self) -> dict[str, Any]:
        """All measures as plain dicts and lists; undefined values are None."""
        return {
            "pooled": {which: self.pooled(which).to_json() for which in TRUTH_SETS},
            "storeys": [storey.to_json() for storey in self.storeys],
            "parameters": self.parameters,
        }
