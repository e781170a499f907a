"""Read a case's `truth.json` into a `Drawing`: faces with the side they face and how much of them was observed."""

from __future__ import annotations

from typing import Any

import numpy as np

from asbuilt.errors import InputError, told
from asbuilt.evaluate.curves import curved_walls
from asbuilt.evaluate.drawing import Drawing, DrawingStorey, Face, Opening, Room


def is_truth(data: Any) -> bool:
    """Whether parsed JSON looks like a `truth.json`: an object with storeys that have walls."""
    storeys = data.get("storeys") if isinstance(data, dict) else None
    return isinstance(storeys, list) and all(isinstance(s, dict) and "walls" in s for s in storeys)


def truth_drawing(data: dict[str, Any], name: str = "truth") -> Drawing:
    """Make a drawing of a parsed `truth.json`.

    Parameters
    ----------
    data : the parsed file; scanner positions in it are not read.
    name : what to call it in messages.

    Returns
    -------
    Drawing
        It holds of doors, windows and rooms only what at least one storey lists: an empty list in every storey means
        that this truth was not made. No storeys give an empty drawing.

    Raises
    ------
    InputError : a member is missing or of another type.
    """
    try:
        storeys = tuple(_storey(i, storey) for i, storey in enumerate(data["storeys"]))
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{name}: expected a truth.json with storeys, floors and walls, found {told(error)}"
        ) from error
    kinds = ("doors", "windows", "rooms")
    holds = frozenset(kind for kind in kinds if any(getattr(storey, kind) for storey in storeys))
    return Drawing(storeys, holds, name)


def _storey(index: int, storey: dict[str, Any]) -> DrawingStorey:
    lines = np.array([_line(wall["p"]) for wall in storey["walls"]], dtype=float).reshape(-1, 4)
    # for the case that this truth is scored as a plan: its chords are then the faces of one curved wall
    curves = [None if curve < 0 else int(curve) for curve in curved_walls(lines)]
    return DrawingStorey(
        index=index,
        floor=float(storey["floor"]),
        faces=tuple(
            Face(
                line=_line(wall["p"]),
                id=f"t{index}-{i}",
                side=wall.get("side", "interior"),
                observed=float(wall.get("observed", 1.0)),
                curve=curves[i],
            )
            for i, wall in enumerate(storey["walls"])
        ),
        jambs=tuple(_line(jamb) for jamb in storey.get("jambs", ())),
        doors=tuple(_opening(door) for door in storey.get("doors", ())),
        windows=tuple(_opening(window) for window in storey.get("windows", ())),
        rooms=tuple(
            Room(tuple((float(x), float(y)) for x, y in room["polygon"]), float(room["area"]), _rest(room, "polygon"))
            for room in storey.get("rooms", ())
        ),
    )


def _opening(opening: dict[str, Any]) -> Opening:
    return Opening(_line(opening["line"]), float(opening["width"]), _rest(opening, "line"))


def _rest(item: dict[str, Any], without: str) -> dict[str, Any]:
    return {key: value for key, value in item.items() if key != without}


def _line(values: Any) -> tuple[float, float, float, float]:
    x1, y1, x2, y2 = (float(value) for value in values)
    return x1, y1, x2, y2
