"""The tables of the report: schedules, registration, tilt, trust, where the plan comes from."""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from asbuilt.export.schedules import schedules
from asbuilt.plan import LOA_BANDS, FloorPlan, Storey
from asbuilt.report import figures
from asbuilt.report.drawing import EXAGGERATION
from asbuilt.report.figures import metres, signed_mm
from asbuilt.report.markup import Content, table, tag
from asbuilt.report.registration import ScanOffset
from asbuilt.report.tilt import Pair, Tilt

WITHOUT_EVIDENCE = "Not measured: this report was written without the evidence of the points, or with occupancy alone."


def schedule_section(plan: FloorPlan, number_of: Mapping[tuple[int, str], int]) -> list[ET.Element]:
    """The schedules of rooms, doors, windows and walls; `number_of` finds an element's figures."""
    parts = []
    for name, schedule in schedules(plan).items():
        elements = [(storey, element) for storey in plan for element in getattr(storey, name)]
        title = f"{name.capitalize()} ({len(schedule.rows)})"
        if not elements:
            parts.append(tag("details", tag("summary", title), tag("p", "None found.")))
            continue
        rows = [
            (_button(figures.title(element), number_of.get((storey.index, element.id))), *map(_text, row))
            for (storey, element), row in zip(elements, schedule.rows, strict=True)
        ]
        rows_shown = table(("show", *schedule.headers), rows)
        parts.append(tag("details", tag("summary", title), rows_shown, open="" if name == "rooms" else None))
    return parts


def _button(title: str, number: int | None) -> Content:
    """Shows an element in the plan."""
    if number is None:
        return ""
    return tag("button", "◎", type="button", data_show=str(number), aria_label=f"Show {title} in the plan")


def _text(cell: str | float | int | None) -> str:
    if cell is None:
        return ""
    return f"{cell:.3f}" if isinstance(cell, float) else str(cell)


def trust_section(plan: FloorPlan) -> ET.Element:
    """Length of the wall faces in each band of accuracy, by storey."""

    def row(storey: Storey) -> Iterator[str]:
        lengths: dict[str | None, float] = {}
        for face in storey.wall_faces:
            lengths[face.loa] = lengths.get(face.loa, 0.0) + face.length
        yield str(storey.index)
        yield str(len(storey.wall_faces))
        for band in (*LOA_BANDS, None):
            yield f"{lengths.get(band, 0.0):.1f}"
        for name in ("seen", "confidence"):
            known = [
                (getattr(face, name), face.length) for face in storey.wall_faces if getattr(face, name) is not None
            ]
            length = sum(part for _, part in known)
            yield f"{sum(value * part for value, part in known) / length:.2f}" if length else ""

    headers = ("Storey", "Wall faces", *(f"{band} (m)" for band in LOA_BANDS), "LOA not known (m)")
    return table((*headers, "Mean seen", "Mean confidence"), [tuple(row(storey)) for storey in plan])


def registration_section(scans: Sequence[ScanOffset] | None) -> list[ET.Element]:
    """Each scan's offset to the walls that it shares with others, the largest first; None: not measured."""
    if scans is None:
        return [tag("p", WITHOUT_EVIDENCE)]
    told = [scan for scan in scans if scan.offset is not None]
    remarks = sorted({scan.remark for scan in scans if scan.remark})
    parts = []
    if told:
        largest = max(math.hypot(*scan.offset) for scan in told if scan.offset)
        parts.append(
            tag(
                "p",
                f"{len(told)} of {len(scans)} scans could be compared; the largest offset is {1000 * largest:.1f} mm. "
                "An offset is how far a scan shows its walls off the place where the other scans show them, in the "
                f"ground plane. The plan shows them {EXAGGERATION:g} times larger.",
            )
        )
    else:
        parts.append(tag("p", f"No scan could be compared with others: {'; '.join(remarks) or 'there is none'}."))
    rows = [
        (scan.key, _place(scan.position), f"{scan.points:,}", str(scan.faces), *_offset(scan), scan.remark)
        for scan in sorted(scans, key=lambda scan: -math.hypot(*(scan.offset or (0.0, 0.0))))
    ]
    headers = (
        "Scan",
        "Scanner at (m)",
        "Points",
        "Shared faces",
        "dx (mm)",
        "±",
        "dy (mm)",
        "± ",
        "Offset (mm)",
        "Remark",
    )
    if rows:
        listed = tag("summary", f"All scans ({len(rows)})")
        parts.append(tag("details", listed, table(headers, rows), open="" if told else None))
    return parts


def _place(position: tuple[float, float, float] | None) -> str:
    return "not known" if position is None else ", ".join(f"{value:.3f}" for value in position)


def _offset(scan: ScanOffset) -> tuple[str, ...]:
    if scan.offset is None or scan.error is None:
        return ("",) * 5
    (dx, dy), (ex, ey) = scan.offset, scan.error
    length = f"{1000 * math.hypot(dx, dy):.1f}"
    return signed_mm(dx), f"{1000 * ex:.1f}", signed_mm(dy), f"{1000 * ey:.1f}", length


def tilt_section(tilts: Sequence[Tilt] | None) -> list[ET.Element]:
    """The tilt of each storey's floor and walls; None where they were not measured."""
    if tilts is None:
        return [tag("p", WITHOUT_EVIDENCE)]
    about = tag(
        "p",
        "How far the top lies off the foot for each metre of height, as a plumb line would show it. A cloud that was "
        "levelled badly tilts floor and walls alike; where only one of the two is off, the building is.",
    )
    headers = ("Storey", "Floor x (mm/m)", "Floor y (mm/m)", "Floor off its plane (mm rms)")
    rows = [
        (
            str(tilt.storey),
            *_slopes(tilt.floor, tilt.floor_error),
            f"{1000 * tilt.floor_rms:.1f}" if tilt.floor else "",
            *_slopes(tilt.walls, tilt.walls_error),
            str(len(tilt.leans)),
        )
        for tilt in tilts
    ]
    return [about, table((*headers, "Walls x (mm/m)", "Walls y (mm/m)", "Faces measured"), rows)]


def _slopes(tilt: Pair | None, error: Pair | None) -> tuple[str, str]:
    if tilt is None or error is None:
        return "not known", "not known"
    x, y = (f"{1000 * value:+.2f} ± {1000 * off:.2f}" for value, off in zip(tilt, error, strict=True))
    return x, y


def origin_section(plan: FloorPlan) -> list[ET.Element]:
    """Notes, inputs, parameters and coordinate reference system."""
    keys = sorted({key for entry in plan.inputs for key in entry}, key=lambda key: (key != "name", key))
    inputs = [tuple(f"{entry.get(key, '')}" for key in keys) for entry in plan.inputs]
    parameters = [(name, _value(value)) for name, value in _flat(plan.parameters)]
    notes = [tag("li", note) for note in plan.notes]
    return [
        tag("h3", "Notes"),
        tag("ul", *notes) if notes else tag("p", "None."),
        tag("h3", f"Inputs ({len(inputs)})"),
        table(keys, inputs) if inputs else tag("p", "Not said."),
        tag("h3", "Coordinates"),
        tag("p", f"Metres in the input's own frame. Coordinate reference system: {plan.crs or 'not said'}."),
        tag("details", tag("summary", f"Parameters ({len(parameters)})"), table(("Parameter", "Value"), parameters)),
    ]


def _flat(values: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", value


def _value(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, default=str)


def storey_table(plan: FloorPlan) -> ET.Element:
    """The storeys and how many of each thing stand on them."""
    kinds = ("rooms", "walls", "wall_faces", "doors", "windows", "columns", "stairs")
    rows = [
        (
            str(storey.index),
            metres(storey.floor, 2),
            metres(storey.ceiling, 2),
            f"{sum(room.area for room in storey.rooms):.1f}",
            *(str(len(getattr(storey, kind))) for kind in kinds),
        )
        for storey in plan
    ]
    names = (kind.replace("_", " ").capitalize() for kind in kinds)
    return table(("Storey", "Floor z", "Ceiling z", "Area of rooms (m²)", *names), rows)
