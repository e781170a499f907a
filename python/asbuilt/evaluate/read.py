"""Read what is to be scored: whatever the file, a `Drawing` comes out."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from asbuilt.errors import InputError, told
from asbuilt.evaluate.drawing import Drawing
from asbuilt.evaluate.read_challenge import (
    challenge_2d_drawing,
    challenge_3d_drawing,
    is_challenge_2d,
    is_challenge_3d,
)
from asbuilt.evaluate.read_geojson import geojson_drawing, is_geojson
from asbuilt.evaluate.read_truth import is_truth, truth_drawing
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


def read_drawing(path: str | os.PathLike[str], layer: str = "*WALL*", cut_height: float = 0.5) -> Drawing:
    """Read a plan or a truth from a file, whose suffix and content choose the format.

    Parameters
    ----------
    path : .dxf, .ifc, or JSON: our GeoJSON, a case's `truth.json`, the Scan-to-BIM challenge's 2D or 3D form.
    layer : pattern of the DXF layers whose line work is walls, without regard to case; * and ? match anything.
    cut_height : height above its storey's floor at which an IFC's walls are cut, m; below the windows' sills, for a
        wall runs on under a window.

    Raises
    ------
    InputError : the file is missing, unreadable or of a format that is not known; the message names it.
    MissingExtraError : the file is IFC and IfcOpenShell is not installed.
    """
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix == ".dxf":
        from asbuilt.evaluate.read_dxf import read_dxf

        return read_dxf(file, layer)
    if suffix == ".ifc":
        from asbuilt.evaluate.read_ifc import read_ifc

        return read_ifc(file, cut_height)
    try:
        with file.open(encoding="utf-8") as stream:
            data = json.load(stream)
    except OSError as error:
        raise InputError(f"{file}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file}: expected .dxf, .ifc or JSON, found {told(error)}") from error
    return _json_drawing(data, str(file))


def _json_drawing(data: Any, name: str) -> Drawing:
    forms = (
        (is_geojson, geojson_drawing),
        (is_truth, truth_drawing),
        (is_challenge_2d, challenge_2d_drawing),
        (is_challenge_3d, challenge_3d_drawing),
    )
    for fits, drawing in forms:
        if fits(data):
            return drawing(data, name)
    raise InputError(f"{name}: expected a GeoJSON plan, a truth.json or the challenge's JSON, found other JSON")
