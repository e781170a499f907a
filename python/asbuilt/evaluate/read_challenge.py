"""Read the JSON of the Scan-to-BIM challenge into a `Drawing`.

The 2D form has a header and layers A_WALL, A_DOOR, A_COLUMN of polylines in metres. The 3D form has lists of walls by
centreline and width, and of doors and columns by place and rotation. One file is one storey, whose floor only the 3D
form tells. Columns are not wall faces and are passed over.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import shapely

from asbuilt.errors import InputError, told
from asbuilt.evaluate.drawing import Drawing, DrawingStorey, Face, Opening

#: Walls of the 3D form whose feet are farther apart than this stand on different storeys, m.
STOREY_STEP = 1.0


def is_challenge_2d(data: Any) -> bool:
    """Whether parsed JSON is the challenge's 2D form: a header that counts layers."""
    return isinstance(data, dict) and isinstance(data.get("header"), dict) and "layer number" in data["header"]


def is_challenge_3d(data: Any) -> bool:
    """Whether parsed JSON is the challenge's 3D form: walls, doors, columns, or a bare list of walls."""
    if isinstance(data, list):
        return bool(data) and all(isinstance(item, dict) and "start_pt" in item for item in data)
    return isinstance(data, dict) and isinstance(data.get("walls"), list)


def challenge_2d_drawing(data: dict[str, Any], name: str = "plan") -> Drawing:
    """Make a drawing of the parsed 2D form.

    Parameters
    ----------
    data : `header`, and `layer 0`, `layer 1`, ... each with `layer name` and `points`, a list of structures with
        `coordinates` x1 y1 x2 y2 ... in m.
    name : what to call it in messages.

    Returns
    -------
    Drawing
        One storey without floor height. A door is the long axis of its structure's smallest rectangle.

    Raises
    ------
    InputError : a member is missing or of another type.
    """
    faces: list[Face] = []
    doors: list[Opening] = []
    try:
        layers = [value for key, value in data.items() if key.startswith("layer ")]
        for layer in layers:
            for structure in layer["points"]:
                points = np.array(structure["coordinates"], dtype=float).reshape(-1, 2)
                if layer["layer name"].upper() == "A_WALL":
                    faces.extend(_faces(points))
                elif layer["layer name"].upper() == "A_DOOR":
                    doors.append(_door(points))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{name}: expected the challenge's 2D floor plan, found {told(error)}") from error
    holds = frozenset({"doors"}) if doors else frozenset[str]()
    return Drawing((DrawingStorey(0, None, tuple(faces), doors=tuple(doors)),), holds, name)


def challenge_3d_drawing(data: dict[str, Any] | list[dict[str, Any]], name: str = "plan") -> Drawing:
    """Make a drawing of the parsed 3D form.

    Parameters
    ----------
    data : lists under `walls` (`start_pt`, `end_pt`, `width`) and `doors` (`loc`, `width`, `rotation` in degrees), in
        m; or a list of walls alone.
    name : what to call it in messages.

    Returns
    -------
    Drawing
        A wall gives two faces, half its width to either side. Walls whose feet differ by more than a metre are on
        storeys of their own, with the lowest foot as the floor.

    Raises
    ------
    InputError : a member is missing or of another type.
    """
    parts = {"walls": data} if isinstance(data, list) else data
    faces: list[tuple[float, Face]] = []
    doors: list[tuple[float, Opening]] = []
    try:
        for wall in parts["walls"]:
            height = float((*wall["start_pt"], 0.0)[2])
            faces.extend((height, face) for face in _wall_faces(wall))
        for door in parts.get("doors", ()):
            x, y, height = (float(value) for value in (*door["loc"], 0.0)[:3])
            angle, half = math.radians(float(door.get("rotation", 0.0))), float(door["width"]) / 2
            step = half * math.cos(angle), half * math.sin(angle)
            doors.append((height, Opening((x - step[0], y - step[1], x + step[0], y + step[1]), 2 * half, door)))
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise InputError(f"{name}: expected the challenge's 3D floor plan, found {told(error)}") from error
    floors = _floors([height for height, _ in faces] or [height for height, _ in doors])
    storeys = tuple(
        DrawingStorey(
            index=i,
            floor=floor,
            faces=tuple(face for height, face in faces if _nearest(floors, height) == i),
            doors=tuple(door for height, door in doors if _nearest(floors, height) == i),
        )
        for i, floor in enumerate(floors)
    )
    return Drawing(storeys, frozenset({"doors"}) if doors else frozenset(), name)


def _faces(points: Any) -> Iterator[Face]:
    for (x1, y1), (x2, y2) in zip(points[:-1].tolist(), points[1:].tolist(), strict=True):
        if (x1, y1) != (x2, y2):
            yield Face((x1, y1, x2, y2))


def _door(points: Any) -> Opening:
    line = long_axis(shapely.MultiPoint(points))
    return Opening(line, math.hypot(line[2] - line[0], line[3] - line[1]))


def long_axis(shape: Any) -> tuple[float, float, float, float]:
    """The middle line, along its longer sides, of the smallest rectangle around a shape: x1, y1, x2, y2 in m."""
    box = shapely.minimum_rotated_rectangle(shape)
    corners = shapely.get_coordinates(box)
    if len(corners) < 5:  # the shape is a line or a point
        return tuple(np.concatenate([corners[0], corners[-1]]).tolist())
    middles = (corners[:4] + corners[1:5]) / 2
    axes = [np.concatenate([middles[0], middles[2]]), np.concatenate([middles[1], middles[3]])]
    longest = max(axes, key=lambda axis: float(np.hypot(axis[2] - axis[0], axis[3] - axis[1])))
    return tuple(longest.tolist())


def _wall_faces(wall: dict[str, Any]) -> Iterator[Face]:
    start, end = np.array(wall["start_pt"][:2], dtype=float), np.array(wall["end_pt"][:2], dtype=float)
    length = float(np.hypot(*(end - start)))
    width = float(wall.get("width") or 0.0)
    if length > 0:
        aside = np.array([start[1] - end[1], end[0] - start[0]]) / length * width / 2
        for offset in (aside, -aside) if width > 0 else (aside,):
            x1, y1, x2, y2 = np.concatenate([start + offset, end + offset]).tolist()
            yield Face((x1, y1, x2, y2))


def _floors(heights: list[float]) -> list[float]:
    floors: list[float] = []
    last = -math.inf
    for height in sorted(heights):
        if height - last > STOREY_STEP:
            floors.append(height)
        last = height
    return floors


def _nearest(floors: list[float], height: float) -> int:
    """The highest floor at or below a height, else the lowest."""
    return max((i for i, floor in enumerate(floors) if floor <= height + STOREY_STEP / 2), default=0)
