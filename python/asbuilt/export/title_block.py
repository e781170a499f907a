"""The border of a sheet: frame and title block, with scale bar and north, in millimetres of paper.

The title block says what a reader needs before trusting the drawing: what it was made from and how, how exact it is,
to which scale, and when, where that was told.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import PurePath
from typing import Any

from asbuilt.export import marks
from asbuilt.export.marks import Arc, Fill, Mark, Stroke, Text, shortened, text_width
from asbuilt.export.sheet import MARGIN, Bounds, Sheet, SheetOptions, scale_bar_length, storey_title
from asbuilt.plan import LOA_BANDS, FloorPlan, Point, Storey

_CELLS_IN_ROW = (4, 2)
"""On a wide sheet, and on a narrow one."""
_WIDEST_CELL = 100.0
_INSET = 3.0
_SMALL, _BODY, _HEADING, _TITLE = 1.5, 1.8, 2.5, 3.5
"""Heights of capitals, mm."""


def title_block(plan: FloorPlan, storey: Storey | None, sheet: Sheet, options: SheetOptions) -> Iterator[Mark]:
    """Frame and title block of one storey's sheet; `storey` is None where none was found."""
    frame = (MARGIN, MARGIN, sheet.width - MARGIN, sheet.height - MARGIN)
    top = MARGIN + sheet.title_block
    yield Stroke(_box(frame), True, layer=marks.FRAME)
    yield Stroke(((frame[0], top), (frame[2], top)), layer=marks.FRAME)
    rows = 1 if sheet.title_block < 40 else 2
    in_row = _CELLS_IN_ROW[rows - 1]
    width = min((frame[2] - frame[0]) / in_row, _WIDEST_CELL)
    height = sheet.title_block / rows
    cells = []
    for cell in range(4):
        u = frame[2] - (in_row - cell % in_row) * width
        v = top - (cell // in_row + 1) * height
        cells.append((u, v, u + width, v + height))
        if u > frame[0] + 1e-6:
            yield Stroke(((u, v), (u, v + height)), layer=marks.TITLE_BLOCK)
    if rows == 2:
        yield Stroke(((frame[0], top - height), (frame[2], top - height)), layer=marks.TITLE_BLOCK)
    yield from _lines(cells[0], _what(storey, options))
    yield from _lines(cells[1], _source(plan, options))
    yield from _lines(cells[2], _trust(plan, storey))
    yield from _scale(cells[3], sheet, options)


def _what(storey: Storey | None, options: SheetOptions) -> list[tuple[str, float]]:
    lines = [(options.title or "As-built floor plan", _TITLE)]
    if storey is None:
        return [*lines, ("No storey found", _HEADING)]
    name, *heights = storey_title(storey.index, storey.floor, storey.ceiling).split(", ")
    lines += [(name, _HEADING), (", ".join(heights), _BODY)]
    area = sum(room.area for room in storey.rooms)
    if storey.rooms:
        lines.append((f"{count(len(storey.rooms), 'room')}, {area:.2f} m² to the faces of the walls", _BODY))
    return lines


def _source(plan: FloorPlan, options: SheetOptions) -> list[tuple[str, float]]:
    """What the plan was made from, and when: that alone which is known."""
    names = [PurePath(str(entry.get("name", ""))).name for entry in plan.inputs]
    source = ", ".join(names[:2]) + (f" and {len(names) - 2} more" if len(names) > 2 else "")
    return [
        (f"Source: {source or 'not given'}", _BODY),
        (f"CRS: {plan.crs or 'none, coordinates of the input'}", _BODY),
        (f"Date: {options.date or 'not given'}", _BODY),
        ("Dimensions in metres, between wall faces that were seen", _SMALL),
    ]


def _trust(plan: FloorPlan, storey: Storey | None) -> list[tuple[str, float]]:
    """With which parameters, and how exact: the share of the wall faces' length by USIBD band."""
    from asbuilt import __version__

    changes = parameter_changes(plan.parameters)
    lines = [(f"asbuilt {__version__}, preset {plan.parameters.get('preset_name', 'not given')}", _BODY)]
    lines.append(("Changed: " + ", ".join(changes) if changes else "All parameters as in the preset", _BODY))
    lines.append((accuracy(storey), _BODY))
    if storey is not None and any(face.loa for face in storey.wall_faces):
        lines.append(("USIBD level of accuracy at 95 %, by length of wall faces", _SMALL))
    if storey is None:
        return lines
    if any(wall.thickness is None for wall in storey.walls):
        lines.append(("Dashed: side of a wall that no scan saw", _SMALL))
    if storey.unknown_openings or any(door.state == "unknown" for door in storey.doors):
        lines.append(("?: opening that no scan looked through", _SMALL))
    return lines


def parameter_changes(parameters: dict[str, Any]) -> list[str]:
    """What differs from the preset's own values, such as ``lines.sigmas=2.0``; none for a plan without parameters."""
    from asbuilt.errors import ParameterError
    from asbuilt.params import Parameters

    try:
        usual = Parameters.preset(parameters.get("preset_name", "")).as_dict()
    except ParameterError:
        return []
    return [
        f"{stage}.{name}={value}"
        for stage, values in parameters.items()
        if isinstance(values, dict)
        for name, value in values.items()
        if _plain(usual.get(stage, {}).get(name, value)) != _plain(value)
    ]


def _plain(value: Any) -> Any:
    """Tuples as the lists that they are in a saved plan."""
    return list(value) if isinstance(value, tuple) else value


def accuracy(storey: Storey | None) -> str:
    """The share of the wall faces' length in each USIBD band; what has no sigma is in none.

    >>> accuracy(None)
    'LOA not told'
    """
    faces = () if storey is None else storey.wall_faces
    total = sum(face.length for face in faces)
    shares = {band: sum(face.length for face in faces if face.loa == band) / (total or 1.0) for band in LOA_BANDS}
    told = [f"{band} {100 * share:.0f} %" for band, share in shares.items() if share >= 0.005]
    return ", ".join(told) or "LOA not told"


def _scale(cell: Bounds, sheet: Sheet, options: SheetOptions) -> Iterator[Mark]:
    """Scale, sheet, scale bar, and north, or the input's y axis where north was not given."""
    u0, v0, u1, _ = cell
    yield from _lines(cell, [(f"1:{sheet.scale:g}   {sheet.full_name}".rstrip(), _TITLE)])
    yield from scale_bar((u0 + _INSET, v0 + 6.0), (u1 - u0) - 26.0, sheet.metre)
    label = "y of the input" if options.north is None else "N"
    yield from _arrow((u1 - 13.0, v0 + 15.0), math.radians(options.north or 0.0), label)


def scale_bar(corner: Point, room: float, metre: float) -> Iterator[Mark]:
    """Five fields, black and white, over a round length that fits into `room` mm."""
    length = scale_bar_length(5 * (room - 8.0) / metre)
    field = length * metre / 5
    for i in range(5):
        ring = _box((corner[0] + i * field, corner[1], corner[0] + (i + 1) * field, corner[1] + 1.5))
        if i % 2 == 0:
            yield Fill((ring,), layer=marks.TITLE_BLOCK)
        yield Stroke(ring, True, layer=marks.TITLE_BLOCK)
    yield Text((corner[0], corner[1] - 3.0), "0", _BODY, "centre", layer=marks.TITLE_BLOCK)
    end = corner[0] + 5 * field, corner[1] - 3.0
    yield Text(end, f"{length:g} m", _BODY, "centre", layer=marks.TITLE_BLOCK)


def _arrow(centre: Point, clockwise: float, label: str) -> Iterator[Mark]:
    sin, cos = math.sin(clockwise), math.cos(clockwise)

    def at(u: float, v: float) -> Point:
        return centre[0] + u * cos + v * sin, centre[1] - u * sin + v * cos

    yield Arc(centre, 6.0, layer=marks.TITLE_BLOCK)
    yield Fill(((at(0, 8.5), at(-2.2, -4.0), at(0, -2.4)),), layer=marks.TITLE_BLOCK)
    yield Stroke((at(0, 8.5), at(2.2, -4.0), at(0, -2.4)), True, layer=marks.TITLE_BLOCK)
    height = _SMALL if text_width(label, _HEADING) > 8 else _HEADING
    yield Text((centre[0], centre[1] - 10.5), label, height, "centre", layer=marks.TITLE_BLOCK)


def _lines(cell: Bounds, lines: list[tuple[str, float]]) -> Iterator[Mark]:
    """Lines of text and their heights from the top of a cell down, each cut to the cell's width."""
    u0, _, u1, v = cell
    v -= 1.2
    for text, height in lines:
        v -= height + 1.9
        fitting = shortened(text, height, u1 - u0 - 2 * _INSET)
        yield Text((u0 + _INSET, v), fitting, height, layer=marks.TITLE_BLOCK)


def count(number: int, noun: str) -> str:
    """A number with its noun.

    >>> count(1, "room"), count(2, "room")
    ('1 room', '2 rooms')
    """
    return f"{number} {noun}" + ("" if number == 1 else "s")


def _box(bounds: Bounds) -> tuple[Point, ...]:
    u0, v0, u1, v1 = bounds
    return (u0, v0), (u1, v0), (u1, v1), (u0, v1)
