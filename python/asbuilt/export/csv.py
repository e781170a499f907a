"""Schedules as CSV: ``plan_rooms.csv``, ``plan_doors.csv``, ``plan_windows.csv``, in UTF-8, as RFC 4180 has it.

Decimal points and commas, whatever the country of the machine: the same plan gives the same bytes.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

from asbuilt.export.schedules import schedule
from asbuilt.plan import FloorPlan

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence


def write(plan: FloorPlan, part: str, path: Path, evidence: Evidence | None = None) -> None:
    """Write the schedule called `part` ("rooms", "doors" or "windows")."""
    found = schedule(plan, part)
    with path.open("w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream)
        table.writerow(found.headers)
        table.writerows(found.rows)
