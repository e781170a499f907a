"""DXF R2018 through ezdxf: metres, the input's own coordinates, all storeys in place, each on layers of its own.

Layers have the names of the US National CAD Standard (AIA) with the storey's number. A-WALL-S0 holds the wall faces
of the lowest storey as lines, whole, and nothing else; fills, the sides of walls that nobody saw and centrelines are
on A-WALL-PATT, A-WALL-UNSN and A-WALL-CNTR. Room outlines (A-AREA), the storey's outline (A-FLOR-OTLN) and centrelines
are switched off at first: they lie on or between the faces.

Text, dimensions and dashes are sized for one scale, 1:100 unless another is given or needed. Each storey also has a
sheet (a layout) to that scale, with a frame and a title block.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import ezdxf
from ezdxf import units
from ezdxf.document import Drawing as DxfDocument

from asbuilt.export import marks
from asbuilt.export.drawing import Drawing, make_drawing
from asbuilt.export.dxf_entities import add_layer, add_marks, set_up
from asbuilt.export.marks import STOREY_LAYERS
from asbuilt.export.sheet import SheetOptions
from asbuilt.plan import FloorPlan, Storey

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence

_VIEWPORT_LAYER = "A-ANNO-NPLT"
"""Of the frames of viewports: seen on the screen, not on paper."""


def write(plan: FloorPlan, path: Path, evidence: Evidence | None = None, **options: Any) -> None:
    """Write `plan` as DXF; the options are those of `SheetOptions` and concern its sheets."""
    drawing = make_drawing(plan, SheetOptions(**options))
    with _no_timestamps():
        document = ezdxf.new("R2018", units=units.M)
        _set_header(document, drawing)
        set_up(document, drawing.sheet.metre)
        for layer in (marks.FRAME, marks.TITLE_BLOCK):
            add_layer(document, layer, layer.name)
        document.layers.add(_VIEWPORT_LAYER, color=8).dxf.plot = 0
        modelspace = document.modelspace()
        for storey, found in drawing.storeys:
            for layer in STOREY_LAYERS:
                of_layer = [mark for mark in found if mark.layer is layer and layer is not marks.BLANK]
                if of_layer or layer is marks.WALL:
                    add_layer(document, layer, layer.of(storey.index))
                    add_marks(modelspace, of_layer, drawing.sheet.metre, f"-S{storey.index}")
        for part in plan.storeys or (None,):
            _add_sheet(document, drawing, part)
        document.layouts.delete("Layout1")
        document.layouts.set_active_layout(_sheet_name(next(iter(plan), None)))
        if len(plan.storeys) > 1:
            document.header["$TILEMODE"] = 0  # open on the first sheet: in the model storeys lie over each other
        _show_all(document, drawing)
        for kind in sorted(document.entitydb.dxf_types_in_use()):
            document.classes.add_class(kind)  # ezdxf itself adds them in the order of a set
        document.saveas(path)


def _set_header(document: DxfDocument, drawing: Drawing) -> None:
    """Units and scale, and what a CAD program shows under the drawing's properties."""
    document.header["$MEASUREMENT"] = 1  # metric line types and hatches
    document.header["$LTSCALE"] = 1 / drawing.sheet.metre  # dashes are given in mm of paper
    document.header["$PSLTSCALE"] = 0  # and are not scaled once more on the sheets
    document.header["$LWDISPLAY"] = 1
    document.header["$LUPREC"] = 3
    properties = document.header.custom_vars
    properties.append("Frame", "input's own, metres")
    properties.append("CRS", drawing.plan.crs or "none")
    properties.append("Scale", f"1:{drawing.sheet.scale:g}")
    for storey in drawing.plan:
        properties.append(f"Storey {storey.index}", f"floor {storey.floor:.3f} m, ceiling {storey.ceiling:.3f} m")


def _add_sheet(document: DxfDocument, drawing: Drawing, storey: Storey | None) -> None:
    """A layout in mm with frame and title block, and a window to scale on the one storey."""
    sheet = drawing.sheet
    layout = document.layouts.new(_sheet_name(storey))
    layout.page_setup(size=(sheet.width, sheet.height), margins=(0, 0, 0, 0), units="mm", device="DWG to PDF.pc3")
    add_marks(layout, drawing.border(storey), 1.0)
    u0, v0, u1, v1 = sheet.drawing
    if storey is not None:
        viewport = layout.add_viewport(
            center=((u0 + u1) / 2, (v0 + v1) / 2),
            size=(u1 - u0, v1 - v0),
            view_center_point=drawing.centre,
            view_height=(v1 - v0) / sheet.metre,
            dxfattribs={"layer": _VIEWPORT_LAYER},
        )
        others = [other for other, _ in drawing.storeys if other is not storey]
        names = [layer.of(other.index) for other in others for layer in STOREY_LAYERS]
        viewport.frozen_layers = [name for name in names if name in document.layers]
    whole = layout.reset_main_viewport(center=(sheet.width / 2, sheet.height / 2), size=(sheet.width, sheet.height))
    whole.dxf.layer = _VIEWPORT_LAYER
    layout.reset_extents((0, 0, 0), (sheet.width, sheet.height, 0))


def _sheet_name(storey: Storey | None) -> str:
    return "Sheet" if storey is None else f"Storey {storey.index}"


def _show_all(document: DxfDocument, drawing: Drawing) -> None:
    """Open on the whole plan, not on the origin: survey coordinates are far from it."""
    x0, y0, x1, y1 = drawing.bounds
    # the header has them for programs that read no entities; the layout, for those that do
    document.header["$EXTMIN"], document.header["$EXTMAX"] = (x0, y0, 0.0), (x1, y1, 0.0)
    document.modelspace().reset_extents((x0, y0, 0.0), (x1, y1, 0.0))
    height = 1.1 * max(y1 - y0, (x1 - x0) / 1.6, 1.0)
    document.set_modelspace_vport(height=height, center=((x0 + x1) / 2, (y0 + y1) / 2))


@contextlib.contextmanager
def _no_timestamps() -> Iterator[None]:
    """The same plan gives the same bytes: ezdxf otherwise stamps the time and random GUIDs on each file."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
