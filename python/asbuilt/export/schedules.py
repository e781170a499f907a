"""The schedules of an architect: a table each of the rooms, the doors, the windows and the walls of a plan.

Every column names its unit. A cell is empty where nothing was seen: an outer wall seen from one side has no thickness,
a window whose sill was hidden has no sill.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias

import shapely

from asbuilt.plan import Door, Element, FloorPlan, Opening, Room, Storey, Wall

Cell: TypeAlias = str | float | int | None
_Columns: TypeAlias = dict[str, Callable[[Storey, Any], Cell]]
_REACH = 0.3  # m beyond the wall's face, where a room is looked for beside an opening


@dataclass(frozen=True)
class Schedule:
    """A table: its name, its headers with units, and a row for each element, storey by storey."""

    name: str
    headers: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


def schedules(plan: FloorPlan) -> dict[str, Schedule]:
    """The schedules of a plan by name: rooms, doors, windows, walls; without rows where the plan has none."""
    return {name: schedule(plan, name) for name in _TABLES}


def schedule(plan: FloorPlan, name: str) -> Schedule:
    """One of them."""
    columns = _TABLES[name]
    rows = (
        tuple(_rounded(column(storey, element)) for column in columns.values())
        for storey in plan
        for element in getattr(storey, name)
    )
    return Schedule(name, tuple(columns), tuple(rows))


def _rounded(cell: Cell) -> Cell:
    # tenths of a millimetre: more digits than that say nothing, and 0.30000000000000004 says it badly
    return round(float(cell), 4) + 0.0 if isinstance(cell, float) else cell


def _wall(storey: Storey, opening: Opening) -> Wall | None:
    return next((wall for wall in storey.walls if wall.id and wall.id == opening.wall), None)


def _wall_thickness(storey: Storey, opening: Opening) -> float | None:
    wall = _wall(storey, opening)
    return None if wall is None else wall.thickness


def _rooms_beside(storey: Storey, opening: Opening) -> tuple[str, str]:
    """Numbers of the rooms on the left and on the right of the line from `start` to `end`; "" where there is none."""
    wall = _wall(storey, opening)
    reach = _REACH + (0.0 if wall is None else wall.drawn_thickness / 2)
    (x0, y0), (x1, y1) = opening.start, opening.end
    if opening.length == 0.0:
        return "", ""
    across = (-(y1 - y0) / opening.length * reach, (x1 - x0) / opening.length * reach)
    centre = ((x0 + x1) / 2, (y0 + y1) / 2)
    sides = [shapely.Point(centre[0] + sign * across[0], centre[1] + sign * across[1]) for sign in (1, -1)]
    left, right = (_names(room for room in storey.rooms if shapely.covers(_area(room), side)) for side in sides)
    return left, right


def _names(rooms: Iterable[Room]) -> str:
    return ", ".join(room.number or room.id for room in rooms)


@functools.lru_cache(maxsize=1024)  # asked for by every opening of the storey
def _area(room: Room) -> shapely.Polygon:
    return shapely.Polygon(room.ring, room.holes)


def _handing(door: Door) -> str | None:
    """The hinges' side as seen by who pulls the door open (DIN 107)."""
    if door.hinge is None or door.swing is None:
        return None
    return "left" if (door.hinge == "end") == (door.swing == "left") else "right"


def _height(window: Opening) -> float | None:
    return None if window.sill is None or window.head is None else window.head - window.sill


def _trust() -> _Columns:
    return {
        "seen (share)": lambda _, element: element.seen,
        "sigma (m)": lambda _, element: element.sigma,
        "LOA at 95 %": lambda _, element: element.loa,
        "confidence (0-1)": lambda _, element: element.confidence,
    }


def _middle(axis: int) -> Callable[[Storey, Any], Cell]:
    return lambda _, line: (line.start[axis] + line.end[axis]) / 2


def _identity(_: Storey, element: Element) -> Cell:
    return element.id


def _storey(storey: Storey, _: Element) -> Cell:
    return storey.index


_ROOMS: _Columns = {
    "number": lambda _, room: room.number,
    "id": _identity,
    "storey": _storey,
    "area (m2)": lambda _, room: room.area,
    "perimeter (m)": lambda _, room: room.perimeter,
    "clear height (m)": lambda _, room: room.height,
    "finished floor level z (m)": lambda _, room: room.floor,
    "ceiling level z (m)": lambda _, room: room.ceiling,
    "scans": lambda storey, room: len(room.scans) if any(other.scans for other in storey.rooms) else None,
    **_trust(),
}
_OPENING: _Columns = {
    "number": _identity,
    "storey": _storey,
    "wall": lambda _, opening: opening.wall,
    "width (m)": lambda _, opening: opening.width,
}
_PLACE: _Columns = {
    "wall thickness (m)": _wall_thickness,
    "room on the left": lambda storey, opening: _rooms_beside(storey, opening)[0],
    "room on the right": lambda storey, opening: _rooms_beside(storey, opening)[1],
    "middle x (m)": _middle(0),
    "middle y (m)": _middle(1),
    **_trust(),
}
_DOORS: _Columns = {
    **_OPENING,
    "head above floor (m)": lambda _, door: door.head,
    "sill above floor (m)": lambda _, door: door.sill,
    "state": lambda _, door: door.state,
    "hinge at": lambda _, door: door.hinge,
    "swings to": lambda _, door: door.swing,
    "handing (DIN 107)": lambda _, door: _handing(door),
    **_PLACE,
}
_WINDOWS: _Columns = {
    **_OPENING,
    "height (m)": lambda _, window: _height(window),
    "sill above floor (m)": lambda _, window: window.sill,
    "head above floor (m)": lambda _, window: window.head,
    **_PLACE,
}
_WALLS: _Columns = {
    "number": _identity,
    "storey": _storey,
    "length (m)": lambda _, wall: wall.length,
    "thickness (m)": lambda _, wall: wall.thickness,
    "thickness observed": lambda _, wall: "no" if wall.thickness is None else "yes",
    "height (m)": lambda storey, wall: storey.ceiling - storey.floor if wall.height is None else wall.height,
    "reaches the ceiling": lambda _, wall: "yes" if wall.height is None else "no",
    "faces": lambda _, wall: " ".join(wall.faces),
    "rms residual (m)": lambda _, wall: wall.rms,
    **_trust(),
}
_TABLES: dict[str, _Columns] = {"rooms": _ROOMS, "doors": _DOORS, "windows": _WINDOWS, "walls": _WALLS}
