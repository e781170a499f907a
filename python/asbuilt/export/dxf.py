"""DXF R2018 through ezdxf: metres, the input's own coordinates, one layer a storey and kind, storeys in place.

Layers have the names of the AIA CAD layer guidelines with the storey's number: A-WALL-S0 holds the wall faces of the
lowest storey, A-FLOR-OTLN-S0 its outline (switched off at first: it lies on the outer walls).
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import ezdxf
from ezdxf import units
from ezdxf.document import Drawing

from asbuilt.export.sheet import plan_bounds
from asbuilt.plan import FloorPlan, Storey

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence

# AutoCAD colour indices that are told apart on black and on white, one storey after the other
_STOREY_COLOURS = (1, 5, 3, 6, 30, 4)
_OUTLINE_COLOUR = 8
_WALL_LINEWEIGHT = 35  # hundredths of a millimetre on paper


def write(plan: FloorPlan, path: Path, evidence: Evidence | None = None) -> None:
    """Write `plan` as DXF."""
    with _no_timestamps():
        drawing = ezdxf.new("R2018", units=units.M)
        drawing.header["$MEASUREMENT"] = 1  # metric line types and hatches
        _describe(drawing, plan)
        for storey in plan:
            _draw(drawing, storey)
        _show_all(drawing, plan)
        drawing.saveas(path)


def _draw(drawing: Drawing, storey: Storey) -> None:
    modelspace = drawing.modelspace()
    walls, outline = f"A-WALL-S{storey.index}", f"A-FLOR-OTLN-S{storey.index}"
    colour = _STOREY_COLOURS[storey.index % len(_STOREY_COLOURS)]
    drawing.layers.add(walls, color=colour, lineweight=_WALL_LINEWEIGHT)
    drawing.layers.add(outline, color=_OUTLINE_COLOUR).off()
    for face in storey.wall_faces:
        modelspace.add_line(face.start, face.end, dxfattribs={"layer": walls})
    if storey.outline:
        modelspace.add_lwpolyline(storey.outline, close=True, dxfattribs={"layer": outline})


def _describe(drawing: Drawing, plan: FloorPlan) -> None:
    """What a CAD program shows under the drawing's properties."""
    properties = drawing.header.custom_vars
    properties.append("Frame", "input's own, metres")
    properties.append("CRS", plan.crs or "none")
    for storey in plan:
        properties.append(f"Storey {storey.index}", f"floor {storey.floor:.3f} m, ceiling {storey.ceiling:.3f} m")


def _show_all(drawing: Drawing, plan: FloorPlan) -> None:
    """Open on the whole plan, not on the origin: survey coordinates are far from it."""
    bounds = plan_bounds(plan)
    if bounds is None:
        return
    x0, y0, x1, y1 = bounds
    # the header has them for programs that read no entities; the layout, for those that do
    drawing.header["$EXTMIN"], drawing.header["$EXTMAX"] = (x0, y0, 0.0), (x1, y1, 0.0)
    layout = drawing.modelspace().dxf_layout.dxf
    layout.extmin, layout.extmax = (x0, y0, 0.0), (x1, y1, 0.0)
    drawing.set_modelspace_vport(height=1.1 * max(y1 - y0, (x1 - x0) / 1.6, 1.0), center=((x0 + x1) / 2, (y0 + y1) / 2))


@contextlib.contextmanager
def _no_timestamps() -> Iterator[None]:
    """The same plan gives the same bytes: ezdxf otherwise stamps the time and random GUIDs on each file."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
