"""Marks as DXF entities, through ezdxf: lines, arcs, hatches, texts, dimensions, and room tags with attributes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from ezdxf.document import Drawing as DxfDocument
from ezdxf.enums import TextEntityAlignment
from ezdxf.layouts.base import BaseLayout

from asbuilt.export import marks
from asbuilt.export.dimensions import RAISED, dimension_line
from asbuilt.export.marks import DIMENSION_TEXT, Arc, Dimension, Fill, Layer, Mark, Stroke, Tag, Text

APPLICATION = "ASBUILT"
"""Name under which an entity's extended data tells its element's id and curve."""
TEXT_STYLE = "ASBUILT"
DIMENSION_STYLE = "ASBUILT"
_TAG_BLOCK = "ROOM-TAG"
_UNSEEN_TRANSPARENCY = 0.75
"""Of the fill of walls that were seen from one side: lighter than others on white and darker on black."""
_ALIGN = {
    "left": TextEntityAlignment.LEFT,
    "centre": TextEntityAlignment.CENTER,
    "right": TextEntityAlignment.RIGHT,
}


def set_up(document: DxfDocument, metre: float) -> None:
    """Text style, dimension style and the block of room tags, for marks on paper where a metre takes `metre` mm."""
    document.appids.add(APPLICATION)
    document.styles.add(TEXT_STYLE, font="arial.ttf")
    sizes = {
        "dimscale": 1 / metre,  # all other sizes are mm of paper
        "dimtxt": DIMENSION_TEXT,
        "dimtxsty": TEXT_STYLE,
        "dimtsz": 0.7,  # slanted ticks of this size, no arrows
        "dimgap": 0.7,
        "dimexe": 1.5,
        "dimexo": 0.0,
        "dimfxlon": 1,
        "dimfxl": 3.0,
        "dimclrd": marks.DIMENSION.aci,
        "dimclre": marks.DIMENSION.aci,
        "dimclrt": 7,
    }
    text = {"dimdec": 2, "dimzin": 0, "dimdsep": ord("."), "dimtad": 1, "dimtih": 0, "dimtoh": 0, "dimtix": 1}
    document.dimstyles.new(DIMENSION_STYLE, dxfattribs={**sizes, **text})
    block = document.blocks.new(_TAG_BLOCK)
    for name, v in (("NUMBER", 2.0), ("AREA", -2.0), ("HEIGHT", -5.0)):
        attributes = {"height": 2.0, "style": TEXT_STYLE, "prompt": name.capitalize()}
        block.add_attdef(name, dxfattribs=attributes).set_placement((0, v), align=TextEntityAlignment.CENTER)


def add_layer(document: DxfDocument, layer: Layer, name: str) -> None:
    """Put a layer into the table of layers: colour, line weight, dashes, whether it is on."""
    if name in document.layers:
        return
    linetype = "CONTINUOUS"
    if layer.dashes:
        linetype = f"{layer.name}-DASH"
        pattern = [length * sign for length, sign in zip(layer.dashes, (1, -1) * len(layer.dashes), strict=False)]
        if linetype not in document.linetypes:
            document.linetypes.add(linetype, [sum(layer.dashes), *pattern], description="dashed, mm of paper")
    weight = round(layer.pen * 100) or 13  # hundredths of a millimetre; fills have no line
    added = document.layers.add(name, color=layer.aci, linetype=linetype, lineweight=weight)
    if layer in (marks.WALL_PATTERN, marks.WALL_UNSEEN_PATTERN, marks.COLUMN_PATTERN):
        # a true colour: black-and-white plot styles leave it grey
        added.rgb = (round(255 * marks.WALL_PATTERN.grey),) * 3
    if layer is marks.WALL_UNSEEN_PATTERN:
        added.transparency = _UNSEEN_TRANSPARENCY
    if not layer.shown:
        added.off()


def add_marks(layout: BaseLayout, found: Iterable[Mark], metre: float, suffix: str = "") -> None:
    """Draw marks into a layout.

    Parameters
    ----------
    layout : the model space, or a sheet.
    metre : what one unit of the layout takes on paper, mm.
    suffix : of the storey, for the names of the layers; they must be there.
    """
    for mark in found:
        attributes: dict[str, Any] = {"layer": mark.layer.name + suffix}
        if isinstance(mark, Stroke):
            _add_stroke(layout, mark, attributes)
        elif isinstance(mark, Arc) and mark.end is None:
            layout.add_circle(mark.centre, mark.radius, dxfattribs=attributes)
        elif isinstance(mark, Arc):
            angles = math.degrees(mark.start), math.degrees(mark.end or 0.0)
            layout.add_arc(mark.centre, mark.radius, *angles, dxfattribs=attributes)
        elif isinstance(mark, Fill):
            hatch = layout.add_hatch(color=256, dxfattribs=attributes)  # by layer
            for i, ring in enumerate(mark.rings):
                hatch.paths.add_polyline_path(ring, is_closed=True, flags=16 if i else 1)
        elif isinstance(mark, Text):
            _add_text(layout, mark, metre, attributes)
        elif isinstance(mark, Tag):
            _add_tag(layout, mark, metre, attributes)
        elif isinstance(mark, Dimension):
            _add_dimension(layout, mark, metre, attributes)


def _add_stroke(layout: BaseLayout, stroke: Stroke, attributes: dict[str, Any]) -> None:
    if len(stroke.points) > 2:
        layout.add_lwpolyline(stroke.points, close=stroke.closed, dxfattribs=attributes)
        return
    start, end = stroke.points
    line = layout.add_line(start, end, dxfattribs=attributes)
    told = [(1000, f"id={stroke.id}")] if stroke.id else []
    told += [(1000, f"curve={stroke.curve}")] if stroke.curve is not None else []
    if told:
        line.set_xdata(APPLICATION, told)


def _add_text(layout: BaseLayout, text: Text, metre: float, attributes: dict[str, Any]) -> None:
    shape = {"height": text.height / metre, "rotation": math.degrees(text.rotation), "style": TEXT_STYLE}
    added = layout.add_text(_plain(text.text), dxfattribs={**attributes, **shape})
    added.set_placement(text.at, align=_ALIGN[text.align])


def _plain(text: str) -> str:
    """Without the signs of ours that are not ASCII: GDAL, hence QGIS, reads the UTF-8 of a DXF by its code page."""
    return text.replace("²", "2").replace("…", "...")


def _add_tag(layout: BaseLayout, tag: Tag, metre: float, attributes: dict[str, Any]) -> None:
    shape = {"xscale": 1 / metre, "yscale": 1 / metre, "zscale": 1 / metre, "rotation": math.degrees(tag.rotation)}
    insert = layout.add_blockref(_TAG_BLOCK, tag.at, dxfattribs={**attributes, **shape})
    for line, text in zip(tag.lines, tag.texts(metre), strict=True):
        own = {"height": text.height / metre, "rotation": math.degrees(text.rotation), "style": TEXT_STYLE}
        attribute = insert.add_attrib(line.name, _plain(line.text), dxfattribs={**attributes, **own})
        attribute.set_placement(text.at, align=TextEntityAlignment.CENTER)


def _add_dimension(layout: BaseLayout, dimension: Dimension, metre: float, attributes: dict[str, Any]) -> None:
    """A real DIMENSION; where its number was raised it has a place of its own, as on paper."""
    (x1, y1), (x2, y2) = dimension_line(dimension)
    angle = math.atan2(y2 - y1, x2 - x1)
    override = layout.add_linear_dim(
        base=dimension.base,
        p1=dimension.start,
        p2=dimension.end,
        angle=math.degrees(angle),
        dimstyle=DIMENSION_STYLE,
        dxfattribs=attributes,
    )
    if dimension.level:
        up = (0.7 + DIMENSION_TEXT * (0.5 + RAISED * dimension.level)) / metre
        override.set_location(((x1 + x2) / 2 - math.sin(angle) * up, (y1 + y2) / 2 + math.cos(angle) * up))
    override.render()
