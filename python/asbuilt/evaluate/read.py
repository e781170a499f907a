"""Read what is to be scored: whatever the file, a `Drawing` comes out."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from asbuilt.errors import InputError
from asbuilt.evaluate.drawing import Drawing
from asbuilt.evaluate.geojson import geojson_drawing, is_geojson
from asbuilt.evaluate.truth import is_truth, truth_drawing
from asbuilt.plan import FloorPlan


def as_drawing(source: Drawing | FloorPlan | dict[str, Any] | str | os.PathLike[str]) -> Drawing:
    """Make a drawing of a plan, of parsed JSON, or of the file at a path.

    Raises
    ------
    InputError : the file is missing, unreadable or of a format that is not known; the message names it.
    """
    if isinstance(source, Drawing):
        return source
    if isinstance(source, FloorPlan):
        return geojson_drawing(source.to_geojson())
    if isinstance(source, dict):
        return _json_drawing(source, "plan")
    return read_drawing(source)


def read_drawing(path: str | os.PathLike[str], layer: str = "*WALL*", cut_height: float = 1.2) -> Drawing:
    """Read a plan or a truth from a file, whose suffix and content choose the format.

    Parameters
    ----------
    path : .geojson or .json (our GeoJSON, a case's `truth.json`, the Scan-to-BIM challenge's form), .dxf or .ifc.
    layer : pattern of the DXF layers whose line work is walls, without regard to case.
    cut_height : height above its storey's floor at which an IFC's walls are cut, m.

    Raises
    ------
    InputError : the file is missing, unreadable or of a format that is not known; the message names it.
    """
    file = Path(path)
    try:
        with file.open(encoding="utf-8") as stream:
            data = json.load(stream)
    except OSError as error:
        raise InputError(f"{file}: {error.strerror}") from error
    except ValueError as error:
        raise InputError(f"{file}: expected JSON, found {error}") from error
    return _json_drawing(data, str(file))


def _json_drawing(data: Any, name: str) -> Drawing:
    if is_geojson(data):
        return geojson_drawing(data, name)
    if is_truth(data):
        return truth_drawing(data, name)
    raise InputError(f"{name}: expected a GeoJSON plan or a truth.json, found other JSON")
