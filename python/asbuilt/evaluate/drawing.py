"""What is scored: a plan or a truth, from whatever file it came, reduced to what the measures need.

A `Drawing` knows nothing about formats. The readers of this package make one from a `FloorPlan`, from GeoJSON, from
a `truth.json`, from DXF, IFC or the Scan-to-BIM challenge's JSON; the measures take two of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]

#: What rounding may move and no rule should notice, m (and degrees). Not in the paper.
TOLERANCE = 1e-9

TruthSet = Literal["observed", "all"]
TRUTH_SETS: tuple[TruthSet, TruthSet] = ("observed", "all")


@dataclass(frozen=True)
class Face:
    """One wall face as it is scored.

    Attributes
    ----------
    line : x1, y1, x2, y2, m.
    id : name within the plan, "" where it has none.
    side : "interior" (faces a room) or "exterior".
    observed : share of the length that any scan hit, 0..1.
    curve : id shared by the faces of one curved wall, else None; a truth's curved walls are found from its geometry.
    properties : what else the file says of it, such as `confidence` or `sigma`.
    """

    line: tuple[float, float, float, float]
    id: str = ""
    side: str = "interior"
    observed: float = 1.0
    curve: int | str | None = None
    properties: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Opening:
    """A door or a window: x1, y1, x2, y2 across the opening (m), its width (m) and what else the file says of it."""

    line: tuple[float, float, float, float]
    width: float
    properties: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Room:
    """A room: its ring (x, y; closed or not, m), its area without holes (m2), and the rings of its holes."""

    ring: tuple[tuple[float, float], ...]
    area: float
    properties: dict[str, Any] = field(default_factory=dict)
    holes: tuple[tuple[tuple[float, float], ...], ...] = ()


@dataclass(frozen=True)
class Wall:
    """A wall of two faces: their ids and the thickness (m), None where it was not observed."""

    faces: tuple[str, ...]
    thickness: float | None


@dataclass(frozen=True)
class DrawingStorey:
    """One level of a drawing.

    Attributes
    ----------
    index : number of the storey, 0 the lowest of the building.
    floor : height of the floor, z in m; None where the format does not tell.
    faces, doors, windows, rooms, walls : what stands on it.
    jambs : reveals of door openings, x1, y1, x2, y2 in m; of truths only.
    """

    index: int
    floor: float | None
    faces: tuple[Face, ...] = ()
    jambs: tuple[tuple[float, float, float, float], ...] = ()
    doors: tuple[Opening, ...] = ()
    windows: tuple[Opening, ...] = ()
    rooms: tuple[Room, ...] = ()
    walls: tuple[Wall, ...] = ()

    @property
    def lines(self) -> Floats:
        """The wall faces' segments, shape (n, 4): x1, y1, x2, y2 in m; (0, 4) if there are none."""
        return np.array([face.line for face in self.faces], dtype=float).reshape(-1, 4)

    @property
    def truth_lines(self) -> Floats:
        """Wall faces, then jambs, shape (n + j, 4): the truth's order, in which ties are broken."""
        jambs = np.array(self.jambs, dtype=float).reshape(-1, 4)
        return np.concatenate([self.lines, jambs])

    def in_use(self, which: TruthSet, min_observed: float = 0.3, min_length: float = 0.1) -> Flags:
        """Which of `truth_lines` count, shape (n + j,); the others are *ignore*.

        Parameters
        ----------
        which : "observed" takes the faces that a scanner in the rooms could see; "all" takes every face, as the paper.
        min_observed : share of the length that a scan hit from which a face counts as observed, 0..1.
        min_length : length from which an observed face counts, m.
        """
        used = np.zeros(len(self.faces) + len(self.jambs), dtype=bool)
        lines = self.lines
        length = np.hypot(lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1])
        for i, face in enumerate(self.faces):
            used[i] = which == "all" or (
                face.side == "interior" and face.observed >= min_observed and length[i] >= min_length - TOLERANCE
            )
        return used


@dataclass(frozen=True)
class Drawing:
    """A plan or a truth: its storeys, lowest first, and which kinds of thing it can hold.

    Attributes
    ----------
    storeys : the levels.
    holds : of "doors", "windows" and "rooms", those that this drawing speaks about. A plan that could hold doors and
        has none has missed them all; line work without a layer of doors says nothing about doors.
    name : where it comes from, for messages and titles.
    """

    storeys: tuple[DrawingStorey, ...] = ()
    holds: frozenset[str] = frozenset({"doors", "windows", "rooms"})
    name: str = ""

    def __iter__(self) -> Iterator[DrawingStorey]:
        return iter(self.storeys)
