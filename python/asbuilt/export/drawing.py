"""The drawings of a plan: the marks of each storey, on a sheet and at a scale that hold them all."""

from __future__ import annotations

from dataclasses import dataclass

from asbuilt.errors import ParameterError
from asbuilt.export.dimensions import RAISED, dimension_line, dimensions
from asbuilt.export.labels import room_tags
from asbuilt.export.marks import DIMENSION_TEXT, Arc, Dimension, Fill, Mark, Stroke
from asbuilt.export.sheet import (
    USUAL_SCALE,
    Bounds,
    Sheet,
    SheetOptions,
    Size,
    fitted_sheet,
    parse_scale,
    sheets_to_try,
    what_would_fit,
)
from asbuilt.export.symbols import storey_marks
from asbuilt.export.title_block import title_block
from asbuilt.plan import FloorPlan, Point, Storey

_AROUND_DIMENSIONS = 4.0
"""What the numbers and ticks of a dimension take beside its line, mm."""


@dataclass(frozen=True)
class Drawing:
    """All storeys of a plan at one scale on one size of sheet, so that they lie over each other.

    Attributes
    ----------
    plan, options : what is drawn, and what was said about it.
    sheet : the paper and the scale.
    bounds : of everything that is drawn, m; their centre lies in the middle of the sheet's drawing area.
    storeys : the marks of each storey, m.
    """

    plan: FloorPlan
    options: SheetOptions
    sheet: Sheet
    bounds: Bounds
    storeys: tuple[tuple[Storey, tuple[Mark, ...]], ...]

    @property
    def centre(self) -> Point:
        """(x, y) of the plan's frame that lies in the middle of the sheet's drawing area, m."""
        x0, y0, x1, y1 = self.bounds
        return (x0 + x1) / 2, (y0 + y1) / 2

    def page(self, point: Point) -> Point:
        """Where a point of the plan (m) lies on the paper: mm from its lower left corner."""
        u0, v0, u1, v1 = self.sheet.drawing
        return (
            (u0 + u1) / 2 + (point[0] - self.centre[0]) * self.sheet.metre,
            (v0 + v1) / 2 + (point[1] - self.centre[1]) * self.sheet.metre,
        )

    def border(self, storey: Storey | None) -> tuple[Mark, ...]:
        """Frame and title block of a storey's sheet, in mm of paper; of None, that nothing was found."""
        return tuple(title_block(self.plan, storey, self.sheet, self.options))


def make_drawing(plan: FloorPlan, options: SheetOptions, fitted: bool = False) -> Drawing:
    """Draw all storeys of a plan.

    Parameters
    ----------
    plan : without storeys, or with empty ones, it gives a sheet with a title block alone.
    options : scale and sheet; what is not given is chosen.
    fitted : where no sheet is given, make one as large as the drawing needs. Otherwise that is done only where no
        sheet that has a name is large enough.

    Raises
    ------
    ParameterError : the drawing does not fit the sheet; the message says which scale or which sheet would.
    """
    plain = [tuple(storey_marks(storey)) for storey in plan]
    found: dict[float, tuple[tuple[Storey, tuple[Mark, ...]], ...]] = {}

    def bounds(scale: float) -> Bounds:
        if scale not in found:  # tags and dimensions depend on the scale: text has its height on paper
            metre = 1000.0 / scale
            found[scale] = tuple(
                (storey, (*drawn, *room_tags(storey, metre), *dimensions(storey, metre)))
                for storey, drawn in zip(plan, plain, strict=True)
            )
        return _bounds([mark for _, of_storey in found[scale] for mark in of_storey], scale)

    def extent(scale: float) -> Size:
        x0, y0, x1, y1 = bounds(scale)
        return (x1 - x0) * 1000 / scale, (y1 - y0) * 1000 / scale

    sheets = [] if fitted and options.sheet is None else sheets_to_try(options)
    sheet = next((tried for tried in sheets if tried.holds(extent(tried.scale))), None)
    if sheet is None:
        if options.sheet is not None:
            raise ParameterError(what_would_fit(extent, options))
        scale = parse_scale(options.scale) or (sheets[-1].scale if sheets else USUAL_SCALE)
        sheet = fitted_sheet(extent(scale), scale)
    return Drawing(plan, options, sheet, bounds(sheet.scale), found[sheet.scale])


def _bounds(found: list[Mark], scale: float) -> Bounds:
    """What marks cover, m; a metre square about the origin for none."""
    points: list[Point] = []
    for mark in found:
        if isinstance(mark, Stroke | Arc) and mark.layer.shown:
            points += mark.points
        elif isinstance(mark, Fill):
            points += mark.rings[0]
        elif isinstance(mark, Dimension):
            around = (_AROUND_DIMENSIONS + RAISED * DIMENSION_TEXT * mark.level) * scale / 1000
            points += [
                (x + dx, y + dy)
                for x, y in dimension_line(mark)
                for dx in (-around, around)
                for dy in (-around, around)
            ]
    xs, ys = zip(*(points or [(-0.5, -0.5), (0.5, 0.5)]), strict=True)
    return min(xs), min(ys), max(xs), max(ys)
