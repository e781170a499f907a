"""SVG to scale, a file a storey, drawn as the PDF is (`asbuilt.export.page`).

One unit is a point (1/72 inch) of paper; its description tells how to get back to the plan's coordinates. Each layer
is a group that bears its name, and each element in it one that bears its id.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.backends.backend_svg import FigureCanvasSVG

from asbuilt import __version__
from asbuilt.export.drawing import Drawing, make_drawing
from asbuilt.export.page import fixed_output, page_title, storey_page
from asbuilt.export.sheet import SheetOptions
from asbuilt.plan import FloorPlan, Storey

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence


def write(plan: FloorPlan, storey: Storey | None, path: Path, evidence: Evidence | None = None, **options: Any) -> None:
    """Write one storey as SVG; the options are those of `SheetOptions`.

    Where no sheet is given the paper is as large as the drawing needs, at 1:100 unless a scale is given.
    """
    drawing = make_drawing(plan, SheetOptions(**options), fitted=True)
    about = {
        "Title": page_title(storey, drawing),
        "Description": _how_to_measure(drawing),
        "Creator": f"asbuilt {__version__}",
        "Date": None,
    }
    with fixed_output():
        FigureCanvasSVG(storey_page(drawing, storey)).print_figure(path, format="svg", metadata=about)


def _how_to_measure(drawing: Drawing) -> str:
    """The formula from the drawing's units back to metres of the plan's frame."""
    sheet = drawing.sheet
    unit = 25.4 / 72 / sheet.metre  # metres to the point
    u, v = drawing.page((0.0, 0.0))
    x0, y0 = -u / sheet.metre, (sheet.height - v) / sheet.metre
    return (
        f"Floor plan 1:{sheet.scale:g}, one unit is a point (1/72 inch) on paper. "
        f"x = {x0!r} + {unit!r} u, y = {y0!r} - {unit!r} v in metres of the plan's frame. "
        f"CRS: {drawing.plan.crs or 'none'}."
    )
