"""Which suffix is written by which module, and the one function that writes them all.

A writer is a module of this package with one function ``write``. A format that holds the whole plan gets
``write(plan, path, evidence=None, **options)``. A format that shows one storey a file gets
``write(plan, storey, path, evidence=None, **options)`` once for each; `storey` is None where the plan has none. A
format that takes several files gets ``write(plan, part, path, evidence=None, **options)`` once for each of its `parts`.
The path is a temporary file; making it whole and putting it in place is done here, for all of them alike.
A new format is such a module and one line in `_FORMATS`. It is imported when it is first written.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asbuilt.errors import OutputError
from asbuilt.export.atomic import check_place, replacing

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence
    from asbuilt.plan import FloorPlan


@dataclass(frozen=True)
class _Format:
    """One line of the registry."""

    name: str
    module: str
    per_storey: bool = False
    to_scale: bool = False
    shows_points: bool = False
    parts: tuple[str, ...] = ()

    @property
    def write(self) -> Callable[..., None]:
        writer: Callable[..., None] = importlib.import_module(self.module).write
        return writer


_FORMATS = {
    ".geojson": _Format("the native plan file", "asbuilt.export.geojson"),
    ".dxf": _Format("AutoCAD DXF R2018", "asbuilt.export.dxf", to_scale=True),
    ".pdf": _Format("drawing to scale, a page a storey", "asbuilt.export.pdf", to_scale=True),
    ".svg": _Format("drawing to scale, one file a storey", "asbuilt.export.svg", per_storey=True, to_scale=True),
    ".ifc": _Format("IFC4 building model", "asbuilt.export.ifc"),
    ".gpkg": _Format("GeoPackage for QGIS, one layer a kind", "asbuilt.export.geopackage"),
    ".csv": _Format(
        "schedules, three files: rooms, doors, windows", "asbuilt.export.csv", parts=("rooms", "doors", "windows")
    ),
    ".xlsx": _Format("schedules: rooms, doors, windows, walls", "asbuilt.export.xlsx"),
    ".2d.json": _Format(
        "Scan-to-BIM challenge, floor plan, one file a storey", "asbuilt.export.challenge_2d", per_storey=True
    ),
    ".3d.json": _Format("Scan-to-BIM challenge, building model", "asbuilt.export.challenge_3d"),
    ".html": _Format("report: plan, schedules, registration, in one file", "asbuilt.report.html", shows_points=True),
    ".png": _Format(
        "picture over the density of the points, one file a storey",
        "asbuilt.export.png",
        per_storey=True,
        shows_points=True,
    ),
}
_LABEL = "asbuilt label writes points with their classes"
_INSTEAD = {
    ".las": _LABEL,
    ".laz": _LABEL,
    ".e57": _LABEL,
    ".evidence": "asbuilt evidence writes evidence",
    ".dwg": "take .dxf, which programs that write .dwg open",
    ".rvt": "take .ifc, which Revit opens",
    ".shp": "take .gpkg",
    ".json": "take .geojson for the plan file",
    ".jpg": "take .png",
}
"""What is asked for and not written here, and what to do instead."""


def known_suffixes() -> dict[str, str]:
    """The suffixes that `export` knows, each with what it writes."""
    return {suffix: known.name for suffix, known in _FORMATS.items()}


def drawn_to_scale(path: str | os.PathLike[str]) -> bool:
    """Whether the format that the suffix of `path` names takes the options of `asbuilt.export.sheet.SheetOptions`."""
    return _format(Path(path)).to_scale


def shows_points(path: str | os.PathLike[str]) -> bool:
    """Whether the format that the suffix of `path` names shows the points as well, where there is evidence of them."""
    return _format(Path(path)).shows_points


def check_output(path: str | os.PathLike[str]) -> None:
    """Find out before any work whether `export` could write to `path`.

    Raises
    ------
    OutputError : no exporter knows the suffix, the folder is missing or may not be written to, or `path` is a folder.
    MissingExtraError : the format needs a library that is not installed.
    """
    path = Path(path)
    _ = _format(path).write  # imported now, for what it lacks must be told before hours of reading
    check_place(path)


def export(
    plan: FloorPlan, path: str | os.PathLike[str], evidence: Evidence | None = None, **options: Any
) -> tuple[Path, ...]:
    """Write a plan in the format that the suffix of `path` names.

    Each file is written whole under a temporary name and then renamed: an old file of that name stays as it was
    until the new one is complete. The same plan gives the same bytes.

    Parameters
    ----------
    plan : the plan.
    path : the file to write. A format with one file a storey writes ``name_s0.svg``, ``name_s1.svg``... when the plan
        has several storeys; the schedules of .csv are ``name_rooms.csv``, ``name_doors.csv`` and ``name_windows.csv``.
    evidence : what the plan was made from; the picture (.png) draws the plan over it.
    **options : passed on to the writer; see its module. Drawings to scale (.dxf, .svg, .pdf) take those of
        `asbuilt.export.sheet.SheetOptions`, such as ``scale="1:50", sheet="A3"``.

    Returns
    -------
    The paths of the files written.

    Raises
    ------
    OutputError : see `check_output`; or the disk is full.

    Examples
    --------
    >>> import asbuilt, tempfile
    >>> folder = tempfile.mkdtemp()
    >>> [path.name for path in export(asbuilt.FloorPlan(), f"{folder}/plan.geojson")]
    ['plan.geojson']
    """
    path = Path(path)
    known = _format(path)
    written = []
    for what, target in _files(known, plan, path):
        with replacing(target) as temporary:
            known.write(plan, *what, temporary, evidence, **options)
        written.append(target)
    return tuple(written)


def _files(known: _Format, plan: FloorPlan, path: Path) -> list[tuple[tuple[Any, ...], Path]]:
    """What each file of a format shows, as its writer is told, and its path."""
    if known.parts:
        return [((part,), _named(path, part)) for part in known.parts]
    if not known.per_storey:
        return [((), path)]
    if len(plan.storeys) < 2:
        return [((storey,), path) for storey in plan.storeys or (None,)]
    return [((storey,), _named(path, f"s{storey.index}")) for storey in plan.storeys]


def _named(path: Path, part: str) -> Path:
    """``plan.2d.json`` as ``plan_s0.2d.json``."""
    split = len(path.name) - len(_suffix(path) or path.suffix)
    return path.with_name(f"{path.name[:split]}_{part}{path.name[split:]}")


def _format(path: Path) -> _Format:
    suffix = _suffix(path)
    if suffix is not None:
        return _FORMATS[suffix]
    instead = _INSTEAD.get(path.suffix.lower(), f"known are {', '.join(_FORMATS)}")
    raise OutputError(f"{path}: no exporter for the suffix {path.suffix or '(none)'}; {instead}")


def _suffix(path: Path) -> str | None:
    # the longest one: .2d.json is another format than .json
    for suffix in sorted(_FORMATS, key=len, reverse=True):
        if path.name.lower().endswith(suffix) and len(path.name) > len(suffix):
            return suffix
    return None
