"""SVG to scale: one unit is one millimetre on paper, 1:100 unless said otherwise.

Plain elements written with the standard library: an SVG needs no drawing library, and a person can read the file.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from asbuilt.errors import ParameterError
from asbuilt.export.sheet import plan_bounds, scale_bar_length, storey_title
from asbuilt.plan import FloorPlan, Point, Storey

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence

_MARGIN = 10.0  # mm of paper around the plan
_FOOT = 14.0  # mm below it, for the scale bar and the title
_WALL_WIDTH = 0.35  # mm
_FONT_SIZE = 3.5  # mm


def write(
    plan: FloorPlan, storey: Storey | None, path: Path, evidence: Evidence | None = None, scale: float = 100.0
) -> None:
    """Write one storey as SVG.

    Parameters
    ----------
    scale : 100 for 1:100. Must be positive.
    """
    if not scale > 0:
        raise ParameterError(f"scale is {scale:g}, expected a positive number such as 100 for 1:100")
    x0, y0, x1, y1 = plan_bounds(plan) or (0.0, 0.0, 1.0, 1.0)
    millimetres = 1000.0 / scale  # of paper to a metre of building
    width = max((x1 - x0) * millimetres, 80.0) + 2 * _MARGIN
    height = (y1 - y0) * millimetres + 2 * _MARGIN + _FOOT

    def paper(point: Point) -> Point:
        return _MARGIN + (point[0] - x0) * millimetres, _MARGIN + (y1 - point[1]) * millimetres  # y points down

    size = {"width": f"{_number(width)}mm", "height": f"{_number(height)}mm"}
    box = f"0 0 {_number(width)} {_number(height)}"
    root = ET.Element("svg", {"xmlns": "http://www.w3.org/2000/svg", "version": "1.1", **size, "viewBox": box})
    title = "No storey found" if storey is None else storey_title(storey.index, storey.floor, storey.ceiling)
    ET.SubElement(root, "title").text = title
    ET.SubElement(root, "desc").text = (
        f"Floor plan 1:{scale:g}, one unit is 1 mm on paper. "
        f"x = {x0!r} + {scale / 1000:g} (u - {_MARGIN:g}), y = {y1!r} - {scale / 1000:g} (v - {_MARGIN:g}) "
        f"in metres of the input's frame. CRS: {plan.crs or 'none'}."
    )
    ET.SubElement(root, "rect", {"width": "100%", "height": "100%", "fill": "white"})
    if storey is not None:
        _draw_walls(root, storey, paper)
    _draw_foot(root, f"{title}, 1:{scale:g}", scale_bar_length(max(x1 - x0, 1.0)), millimetres, height)
    ET.indent(root, " ")
    ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def _draw_walls(root: ET.Element, storey: Storey, paper: Callable[[Point], Point]) -> None:
    style = {"stroke": "black", "stroke-width": _number(_WALL_WIDTH), "stroke-linecap": "round"}
    group = ET.SubElement(root, "g", {"id": f"A-WALL-S{storey.index}", **style})
    for face in storey.wall_faces:
        (u1, v1), (u2, v2) = paper(face.start), paper(face.end)
        ends = {"x1": _number(u1), "y1": _number(v1), "x2": _number(u2), "y2": _number(v2)}
        ET.SubElement(group, "line", {**({"id": face.id} if face.id else {}), **ends})


def _draw_foot(root: ET.Element, title: str, bar: float, millimetres: float, height: float) -> None:
    """A scale bar in five alternating fields, its length beside it, and the title below."""
    top = height - _MARGIN - 8.0
    group = ET.SubElement(root, "g", {"id": "scale-bar", "stroke": "black", "stroke-width": "0.2"})
    field = bar * millimetres / 5
    for i in range(5):
        where = {"x": _number(_MARGIN + i * field), "y": _number(top), "width": _number(field), "height": "1.5"}
        ET.SubElement(group, "rect", {**where, "fill": "white" if i % 2 else "black"})
    text = {"font-family": "sans-serif", "font-size": _number(_FONT_SIZE)}
    beside = {"x": _number(_MARGIN + 5 * field + 2), "y": _number(top + 1.9)}
    ET.SubElement(root, "text", {**beside, **text}).text = f"{bar:g} m"
    ET.SubElement(root, "text", {"x": _number(_MARGIN), "y": _number(top + 8), **text}).text = title


def _number(value: float) -> str:
    """Millimetres to a thousandth; shorter without the zeros that say nothing."""
    return f"{value:.3f}".rstrip("0").rstrip(".")
