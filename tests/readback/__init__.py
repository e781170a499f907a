"""Exports read back by programs that are not ours, and compared with the plan that they were made of.

`CHECKS` has a function for each suffix of the registry: it gets the plan and the paths that `export` wrote of it, and
raises where they do not agree.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from asbuilt import FloorPlan
from readback.drawings import check_dxf, check_pdf, check_png, check_svg
from readback.models import check_2d, check_3d, check_ifc
from readback.report import check_html
from readback.tables import check_csv, check_geojson, check_gpkg, check_xlsx

__all__ = ["CHECKS"]

CHECKS: dict[str, Callable[[FloorPlan, tuple[Path, ...]], None]] = {
    ".geojson": check_geojson,
    ".dxf": check_dxf,
    ".pdf": check_pdf,
    ".svg": check_svg,
    ".ifc": check_ifc,
    ".gpkg": check_gpkg,
    ".csv": check_csv,
    ".xlsx": check_xlsx,
    ".2d.json": check_2d,
    ".3d.json": check_3d,
    ".html": check_html,
    ".png": check_png,
}
