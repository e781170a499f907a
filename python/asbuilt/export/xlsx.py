"""Schedules as one workbook through XlsxWriter: the sheets rooms, doors, windows and walls."""

from __future__ import annotations

import io
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import xlsxwriter

from asbuilt.export.schedules import Schedule, schedules
from asbuilt.plan import FloorPlan

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence

_DAY = datetime(2000, 1, 1)  # the same plan gives the same bytes: no day of its own


def write(plan: FloorPlan, path: Path, evidence: Evidence | None = None) -> None:
    """Write the workbook; a sheet without elements holds its headers."""
    content = io.BytesIO()  # else a full disk is told by an exception of XlsxWriter's own
    literal = {"in_memory": True, "strings_to_formulas": False, "strings_to_urls": False}
    with xlsxwriter.Workbook(content, literal) as book:
        book.set_properties({"title": "Schedules of an as-built plan", "created": _DAY})
        for schedule in schedules(plan).values():
            _write_sheet(book, schedule)
    path.write_bytes(content.getvalue())


def _write_sheet(book: xlsxwriter.Workbook, schedule: Schedule) -> None:
    sheet = book.add_worksheet(schedule.name)
    bold, metres = book.add_format({"bold": True, "bottom": 1}), book.add_format({"num_format": "0.000"})
    sheet.write_row(0, 0, schedule.headers, bold)
    for number, row in enumerate(schedule.rows, 1):
        for column, cell in enumerate(row):
            if cell is not None:
                sheet.write(number, column, cell, metres if isinstance(cell, float) else None)
    sheet.freeze_panes(1, 0)
    sheet.autofilter(0, 0, max(len(schedule.rows), 1), len(schedule.headers) - 1)
    sheet.autofit()
