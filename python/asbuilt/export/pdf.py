"""PDF to scale: a page a storey, each of the sheet's exact size, drawn as the SVG is (`asbuilt.export.page`)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.backends.backend_pdf import PdfPages

from asbuilt import __version__
from asbuilt.export.drawing import make_drawing
from asbuilt.export.page import fixed_output, page_title, storey_page
from asbuilt.export.sheet import SheetOptions
from asbuilt.plan import FloorPlan

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence


def write(plan: FloorPlan, path: Path, evidence: Evidence | None = None, **options: Any) -> None:
    """Write all storeys as PDF; the options are those of `SheetOptions`.

    Where no sheet is given it is the smallest from A4 to A0 that all storeys fit.
    """
    drawing = make_drawing(plan, SheetOptions(**options))
    about = {"Title": page_title(None, drawing), "Creator": f"asbuilt {__version__}", "CreationDate": None}
    with fixed_output(), PdfPages(path, metadata=about) as pages:
        for storey in plan.storeys or (None,):
            pages.savefig(storey_page(drawing, storey))
