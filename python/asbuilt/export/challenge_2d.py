"""The Scan-to-BIM challenge's 2D floor plan as JSON: layers of polylines in metres, one file a storey.

The form is that of the challenge's own programs: `header` counts the layers and the structures of each; ``layer 0``,
``layer 1`` and so on have a name and their structures, each with its number of points and their coordinates x1 y1 x2
y2 ... Its measures compare every point of a structure, so wall faces and doors are written by their two ends alone.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asbuilt.plan import FloorPlan, Point, Storey

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence

_DECIMALS = 6  # of a metre


def write(plan: FloorPlan, storey: Storey | None, path: Path, evidence: Evidence | None = None) -> None:
    """Write one storey: its wall faces, its doors but those without a leaf, which the challenge knows not, its columns.

    Without a storey the three layers are empty.
    """
    layers: dict[str, list[tuple[Point, ...]]] = {"A_WALL": [], "A_DOOR": [], "A_COLUMN": []}
    if storey is not None:
        layers["A_WALL"] = [(face.start, face.end) for face in storey.wall_faces]
        layers["A_DOOR"] = [(door.start, door.end) for door in storey.doors if door.state != "cased"]
        layers["A_COLUMN"] = [(*column.ring, column.ring[0]) for column in storey.columns]
    data: dict[str, Any] = {
        "header": {"layer number": len(layers), "structure number": [len(lines) for lines in layers.values()]}
    }
    for i, (name, lines) in enumerate(layers.items()):
        data[f"layer {i}"] = {"layer name": name, "points": [_structure(line) for line in lines]}
    path.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def _structure(points: Iterable[Point]) -> dict[str, Any]:
    coordinates = [round(float(value), _DECIMALS) for point in points for value in point]
    return {"point number": len(coordinates) // 2, "coordinates": coordinates}
