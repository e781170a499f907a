"""The report: one HTML file that opens from disk, needs no network, and prints.

The page is written whole here: tables and drawings stand in it as they are. Its script only switches layers, moves the
drawing and shows figures; without the script all of it can still be read. A content security policy lets the page load
nothing and run no script but its own.
"""

from __future__ import annotations

import base64
import hashlib
import json
import xml.etree.ElementTree as ET
from importlib import resources
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from asbuilt import __version__
from asbuilt.export.sheet import storey_title
from asbuilt.export.title_block import count
from asbuilt.plan import FloorPlan, Storey
from asbuilt.report import sections
from asbuilt.report.drawing import LAYERS, Sheet, draw_storey, plan_sheet
from asbuilt.report.figures import MEASURES
from asbuilt.report.heights import draw_heights, explain_heights
from asbuilt.report.markup import render, tag
from asbuilt.report.picture import density_picture
from asbuilt.report.registration import ScanOffset, scan_offsets
from asbuilt.report.tilt import Tilt, measure_tilt

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence


def write(plan: FloorPlan, path: Path, evidence: Evidence | None = None) -> None:
    """Write the report; density, heights, registration and tilt are in it where there is `evidence`."""
    # a name of a file may hold what UTF-8 cannot: it is shown by its code
    path.write_bytes(_page(plan, evidence).encode("utf-8", "backslashreplace"))


def _page(plan: FloorPlan, evidence: Evidence | None) -> str:
    pictures = [None if evidence is None else density_picture(evidence, storey) for storey in plan]
    with_moments = None if evidence is None or evidence.occupancy else evidence
    scans = None if with_moments is None else scan_offsets(plan, with_moments)
    tilts = None if with_moments is None else measure_tilt(plan, with_moments)
    sheet = plan_sheet(plan, pictures)
    drawings = [
        draw_storey(storey, sheet, picture, _standing(plan, storey, scans), _leans(storey, tilts))
        for storey, picture in zip(plan, pictures, strict=True)
    ]
    heights = None if evidence is None else draw_heights(plan, evidence)
    style, script = _asset("report.css"), _asset("report.js")
    fragments: dict[str, list[ET.Element]] = {
        "controls": _controls(plan, drawings),
        "drawings": [_figure(storey, drawing) for storey, drawing in zip(plan, drawings, strict=True)]
        or [tag("p", "No storey was found: there is nothing to draw.")],
        "storeys": [sections.storey_table(plan)],
        "schedules": sections.schedule_section(plan, sheet.number_of),
        "trust": [sections.trust_section(plan)],
        "registration": sections.registration_section(scans),
        "tilt": sections.tilt_section(tilts),
        "heights": [tag("p", sections.WITHOUT_EVIDENCE)]
        if heights is None
        else [tag("p", explain_heights(plan)), heights],
        "origin": sections.origin_section(plan),
        "title": [tag("h1", _title(plan))],
        "head_title": [tag("title", f"{_title(plan)} - asbuilt")],
        "version": [tag("p", _made_by(plan, evidence), class_="quiet")],
    }
    return Template(_asset("report.html")).substitute(
        {name: render(*elements) for name, elements in fragments.items()},
        style=style,
        style_hash=_hash(style),
        script=script,
        script_hash=_hash(script),
        figures=_json(sheet),
    )


def _title(plan: FloorPlan) -> str:
    names = [str(entry.get("name", "")) for entry in plan.inputs]
    if not names:
        return "Floor plan"
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"


def _made_by(plan: FloorPlan, evidence: Evidence | None) -> str:
    points = "" if evidence is None else f" from {evidence.points:,} points in {count(len(evidence.scans), 'scan')}"
    storeys = count(len(plan.storeys), "storey")
    return f"As-built plan of {storeys}, made by asbuilt {__version__}{points}. All lengths in metres."


def _standing(plan: FloorPlan, storey: Storey, scans: tuple[ScanOffset, ...] | None) -> list[ScanOffset]:
    """The scans that stand on a storey: below the next floor, and above its own unless it is the lowest."""
    floors = [other.floor for other in plan]
    return [
        scan
        for scan in scans or ()
        if scan.position is not None
        and sum(floor <= scan.position[2] for floor in floors[1:]) == plan.storeys.index(storey)
    ]


def _leans(storey: Storey, tilts: tuple[Tilt, ...] | None) -> dict[str, tuple[float, float]]:
    return next((tilt.leans for tilt in tilts or () if tilt.storey == storey.index), {})


def _controls(plan: FloorPlan, drawings: list[ET.Element]) -> list[ET.Element]:
    """Storey, colours, layers that hold something, and the view."""
    used = {group.get("data-layer") for drawing in drawings for group in drawing if len(group)}
    storeys = [
        tag("button", str(storey.index), type="button", data_storey=str(storey.index), aria_pressed="false")
        for storey in plan
    ]
    colours = [tag("option", "by layer", value="none"), *(tag("option", m.title, value=m.name) for m in MEASURES)]
    layers = [
        tag("label", tag("input", type="checkbox", checked="", data_toggle=name), f" {title}")
        for name, title in LAYERS.items()
        if name in used
    ]
    views = [("+", "in", "Zoom in"), ("-", "out", "Zoom out"), ("Fit", "fit", "Show all")]
    legends = [
        tag(
            "ul",
            *(
                tag("li", tag("span", class_=f"swatch {measure.name}-{i}"), band)
                for i, band in enumerate(measure.bands)
            ),
            tag("li", tag("span", class_="swatch"), "not known"),
            class_=f"legend of-{measure.name}",
        )
        for measure in MEASURES
    ]
    return [
        tag("div", tag("span", "Storey"), *storeys, class_="storeys", role="group", aria_label="Storey"),
        tag("label", "Colour walls ", tag("select", *colours, id="colour")),
        tag(
            "div",
            *(tag("button", text, type="button", data_view=name, aria_label=title) for text, name, title in views),
            role="group",
            aria_label="View",
        ),
        tag("fieldset", tag("legend", "Layers"), *layers),
        *legends,
    ]


def _figure(storey: Storey, drawing: ET.Element) -> ET.Element:
    caption = tag("figcaption", storey_title(storey.index, storey.floor, storey.ceiling))
    return tag("figure", caption, drawing, data_storey=str(storey.index))


def _json(sheet: Sheet) -> str:
    """The figures of everything that can be pointed at; no text in it can end the script that holds it."""
    figures = [[pointed.title, pointed.lines] for pointed in sheet.pointed]
    return json.dumps(figures, separators=(",", ":")).replace("<", "\\u003c")


def _asset(name: str) -> str:
    return resources.files("asbuilt.report").joinpath(name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")
