"""The plan of a storey as SVG: layers to switch, and elements that can be pointed at.

One unit is a centimetre; x to the right, y down. What is drawn is what the drawings for paper show
(`asbuilt.export.marks`); over it lie the elements' own shapes, which bear the number of their figures and their bands
of trust.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from asbuilt.export.dimensions import dimension_line, dimension_number, dimensions
from asbuilt.export.labels import room_tags
from asbuilt.export.marks import CAP_HEIGHT, Arc, Dimension, Fill, Mark, Stroke, Tag, Text
from asbuilt.export.sheet import Bounds, storey_points, storey_title
from asbuilt.export.symbols import storey_marks
from asbuilt.plan import Column, Element, FloorPlan, Opening, Point, Room, Stair, Storey, Wall, WallFace
from asbuilt.report import figures
from asbuilt.report.markup import number, tag
from asbuilt.report.registration import ScanOffset
from asbuilt.report.tilt import Pair

#: Layers in the order in which they are drawn, by the name that the page switches them with, and what they are called.
LAYERS = {
    "density": "Density of the points",
    "rooms": "Rooms",
    "stairs": "Stairs",
    "walls": "Walls",
    "faces": "Wall faces",
    "columns": "Columns",
    "windows": "Windows",
    "openings": "Unknown openings",
    "doors": "Doors",
    "dimensions": "Dimensions",
    "scans": "Scans and their offsets",
}
#: Layers of the drawings for paper, by the beginning of their names; what is not listed is not shown.
_OF_MARKS = {
    "A-WALL-UNSN": "walls",
    "A-WALL-PATT": "walls",
    "A-AREA-IDEN": "rooms",
    "A-DOOR": "doors",
    "A-GLAZ": "windows",
    "A-OPNG-UNKN": "openings",
    "A-COLS": "columns",
    "A-FLOR-STRS": "stairs",
    "A-ANNO-DIMS": "dimensions",
}
_UNIT = 100.0
"""Units of the drawing to the metre."""
_REACH = 0.12
"""Openings are pointed at this far to each side of their line, m."""
_SCALES, _PAPER = (50.0, 100.0, 200.0), 0.3
"""The drawing has the sizes of text of the first of these scales at which it is not longer than this paper, m."""
_AROUND = 8.0
"""Paper around all that is drawn, for the numbers of the outermost dimensions, mm."""
_EMPTY: Bounds = (0.0, 0.0, 10.0, 6.0)
"""What is shown of nothing, m."""
EXAGGERATION = 200.0
"""Offsets of scans are drawn so many times larger than they are."""


#: The density of a storey's points: a data URI, and its corners x0, y0, x1, y1, m.
Picture: TypeAlias = tuple[str, Bounds]


@dataclass(frozen=True)
class Pointed:
    """What can be pointed at: its title, and its figures as labels and values."""

    title: str
    lines: list[figures.Line]


@dataclass
class Sheet:
    """The drawing of all storeys: what they share, and the figures of everything that can be pointed at.

    Attributes
    ----------
    corner : (x, y), m, where the units of the drawing begin.
    metre : what a metre takes on the paper whose sizes of text and distances of dimensions are used, mm.
    pointed : figures by the number that the shapes bear as ``data-i``.
    number_of : that number by storey and id of an element.
    """

    corner: Point
    metre: float
    pointed: list[Pointed] = field(default_factory=list)
    number_of: dict[tuple[int, str], int] = field(default_factory=dict)

    def place(self, point: Point) -> str:
        """A point (m) in the units of the drawing, to the millimetre."""
        return f"{number((point[0] - self.corner[0]) * _UNIT)} {number((self.corner[1] - point[1]) * _UNIT)}"

    def path(self, points: Iterable[Point], closed: bool = False) -> str:
        """The data of a path through points (m)."""
        return "M" + "L".join(self.place(point) for point in points) + ("Z" if closed else "")


def plan_sheet(plan: FloorPlan, pictures: Iterable[Picture | None]) -> Sheet:
    """A sheet for all storeys with their pictures of density, with sizes of text that suit the largest."""
    held = [_corners(storey, picture) for storey, picture in zip(plan, pictures, strict=True)]
    boxes = [_box(corners) for corners in held if corners] or [_EMPTY]
    longest = max(max(x1 - x0, y1 - y0) for x0, y0, x1, y1 in boxes)
    scale = next((scale for scale in _SCALES if longest < _PAPER * scale), _SCALES[-1])
    return Sheet((min(box[0] for box in boxes), max(box[3] for box in boxes)), 1000.0 / scale)


def _corners(storey: Storey, picture: Picture | None) -> list[Point]:
    """Points that hold all elements of a storey and its picture; none where there is nothing."""
    found = storey_points(storey)
    return found if picture is None else [*found, picture[1][:2], picture[1][2:]]


def _box(points: Sequence[Point]) -> Bounds:
    xs, ys = zip(*points, strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def draw_storey(
    storey: Storey,
    sheet: Sheet,
    density: Picture | None,
    scans: Sequence[ScanOffset],
    leans: dict[str, Pair],
) -> ET.Element:
    """One storey, with the `scans` that stand on it and the `leans` of its faces; fills in the sheet's figures."""
    groups = {name: tag("g", data_layer=name) for name in LAYERS}
    if density is not None:
        groups["density"].append(_image(sheet, *density))
    for room in storey.rooms:
        groups["rooms"].append(_element(sheet, storey, room))
    measures = list(dimensions(storey, sheet.metre))
    for mark in (*storey_marks(storey), *room_tags(storey, sheet.metre), *measures):
        layer = next((known for begin, known in _OF_MARKS.items() if mark.layer.name.startswith(begin)), None)
        if layer is not None:
            groups[layer].extend(_ink(mark, sheet))
    elements = {
        "stairs": storey.stairs,
        "walls": storey.walls,
        "faces": storey.wall_faces,
        "columns": storey.columns,
        "windows": storey.windows,
        "openings": storey.unknown_openings,
        "doors": storey.doors,
    }
    for name, shown in elements.items():
        groups[name].extend(_element(sheet, storey, element, leans.get(element.id)) for element in shown)
    groups["scans"].extend(_scan(sheet, scan, scan.position) for scan in scans if scan.position is not None)
    corners = _corners(storey, density) + [end for mark in measures for end in dimension_line(mark)]
    label = f"Plan of {storey_title(storey.index, storey.floor, storey.ceiling).lower()}"
    return tag(
        "svg",
        *groups.values(),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=_view(sheet, _box(corners) if corners else _EMPTY),
        class_="plan",
        tabindex="0",
        role="group",
        aria_label=f"{label}. Keys: arrows move, plus and minus zoom, 0 shows all, n and p go through the elements.",
    )


def _view(sheet: Sheet, box: Bounds) -> str:
    """The part of the drawing that shows a box (m) and what stands around it."""
    pad = _AROUND / sheet.metre
    x0, y0, x1, y1 = box
    across, down = x1 - x0 + 2 * pad, y1 - y0 + 2 * pad
    return f"{sheet.place((x0 - pad, y1 + pad))} {number(across * _UNIT)} {number(down * _UNIT)}"


def _image(sheet: Sheet, uri: str, corners: Bounds) -> ET.Element:
    x0, y0, x1, y1 = corners
    u, v = sheet.place((x0, y1)).split()
    size = {"width": number((x1 - x0) * _UNIT), "height": number((y1 - y0) * _UNIT)}
    return tag("image", href=uri, x=u, y=v, **size, preserveAspectRatio="none")


def _element(sheet: Sheet, storey: Storey, element: Element, lean: Pair | None = None) -> ET.Element:
    """The shape of an element, with the number of its figures and its bands of trust."""
    index = len(sheet.pointed)
    sheet.pointed.append(Pointed(figures.title(element), figures.lines(element, storey, lean)))
    if element.id:
        sheet.number_of[storey.index, element.id] = index
    known = [f"{name}-{band}" for name, band in figures.bands(element).items() if band is not None]
    kind = type(element).__name__.lower()
    shapes = [tag("path", d=sheet.path(*_shape(element)), class_="shape")]
    if isinstance(element, WallFace):
        shapes.append(tag("path", d=shapes[0].get("d"), class_="reach"))
    return tag("g", *shapes, class_=" ".join(["element", kind, *known]), data_i=str(index))


def _shape(element: Element) -> tuple[Sequence[Point], bool]:
    """Points of the shape by which an element is pointed at, and whether it is closed."""
    if isinstance(element, WallFace):
        return (element.start, element.end), False
    if isinstance(element, Room | Column | Stair):
        return element.ring, True
    if isinstance(element, Wall) and element.outline:
        return element.outline, True
    if isinstance(element, Wall | Opening):
        return _around(element.start, element.end, element.length), True
    raise TypeError(f"{type(element).__name__} has no shape")


def _around(start: Point, end: Point, length: float) -> Sequence[Point]:
    """A box about a line."""
    nx, ny = -(end[1] - start[1]) / (length or 1.0) * _REACH, (end[0] - start[0]) / (length or 1.0) * _REACH
    (x1, y1), (x2, y2) = start, end
    return (x1 + nx, y1 + ny), (x2 + nx, y2 + ny), (x2 - nx, y2 - ny), (x1 - nx, y1 - ny)


def _scan(sheet: Sheet, scan: ScanOffset, position: tuple[float, float, float]) -> ET.Element:
    """Where a scanner stood, and which way its walls lie off those of the others."""
    index = len(sheet.pointed)
    sheet.pointed.append(Pointed(f"Scan {scan.key}", figures.scan_lines(scan)))
    x, y, _ = position
    u, v = sheet.place((x, y)).split()
    shapes = [tag("circle", cx=u, cy=v, r="9", class_="shape")]
    if scan.offset is not None:
        tip = (x + EXAGGERATION * scan.offset[0], y + EXAGGERATION * scan.offset[1])
        shapes.append(tag("path", d=sheet.path([(x, y), tip]), class_="offset"))
    return tag("g", *shapes, class_="element scan", data_i=str(index))


def _ink(mark: Mark, sheet: Sheet) -> Iterable[ET.Element]:
    """A mark of the drawings for paper as SVG."""
    dashed = " dashed" if mark.layer.dashes else ""
    if isinstance(mark, Fill):
        data = "".join(sheet.path(ring, True) for ring in mark.rings)
        fill = "unseen" if "UNSN" in mark.layer.name else "solid"
        yield tag("path", d=data, class_=f"ink {fill}", fill_rule="evenodd")
    elif isinstance(mark, Stroke):
        yield tag("path", d=sheet.path(mark.points, mark.closed), class_=f"ink line{dashed}")
    elif isinstance(mark, Arc):
        yield tag("path", d=sheet.path(mark.points, mark.end is None), class_=f"ink line{dashed}")
    elif isinstance(mark, Tag):
        for text in mark.texts(sheet.metre):
            yield _text(text, sheet)
    elif isinstance(mark, Text):
        yield _text(mark, sheet)
    elif isinstance(mark, Dimension):
        yield from _dimension(mark, sheet)


def _text(text: Text, sheet: Sheet) -> ET.Element:
    u, v = sheet.place(text.at).split()
    turn = f"rotate({number(-math.degrees(text.rotation), 2)} {u} {v})" if text.rotation else None
    size = number(text.height / sheet.metre * _UNIT / CAP_HEIGHT)
    anchor = {"left": "start", "centre": "middle", "right": "end"}[text.align]
    weight = "bold" if text.bold else None
    return tag(
        "text",
        text.text,
        x=u,
        y=v,
        font_size=size,
        text_anchor=anchor,
        font_weight=weight,
        transform=turn,
        class_="ink",
    )


def _dimension(mark: Dimension, sheet: Sheet) -> Iterable[ET.Element]:
    """The line with a tick at each end, and the number over it."""
    start, end = dimension_line(mark)
    (x1, y1), (x2, y2) = start, end
    length = math.hypot(x2 - x1, y2 - y1)
    ux, uy = (x2 - x1) / length, (y2 - y1) / length
    yield tag("path", d=sheet.path([start, end]), class_="ink line")
    tick = 1.0 / sheet.metre
    for x, y in (start, end):
        slant = ((ux - uy) * tick, (uy + ux) * tick)
        ends = [(x - slant[0], y - slant[1]), (x + slant[0], y + slant[1])]
        yield tag("path", d=sheet.path(ends), class_="ink line")
    yield _text(dimension_number(mark, sheet.metre), sheet)
