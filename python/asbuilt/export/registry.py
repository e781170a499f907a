"""Which suffix is written by which module, and the one function that writes them all.

A writer is a module of this package with one function ``write``. A format that holds the whole plan gets
``write(plan, path, evidence=None, **options)``. A format that shows one storey a file gets
``write(plan, storey, path, evidence=None, **options)`` once for each; `storey` is None where the plan has none.
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
from asbuilt.export.atomic import replacing
from asbuilt.plan import FloorPlan, Storey

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence


@dataclass(frozen=True)
class _Format:
    """One line of the registry."""

    name: str
    module: str
    per_storey: bool = False

    @property
    def write(self) -> Callable[..., None]:
        writer: Callable[..., None] = importlib.import_module(self.module).write
        return writer


_FORMATS = {
    ".geojson": _Format("the native plan file", "asbuilt.export.geojson"),
    ".dxf": _Format("AutoCAD DXF R2018", "asbuilt.export.dxf"),
    ".svg": _Format("drawing to scale, one file a storey", "asbuilt.export.svg", per_storey=True),
    ".ifc": _Format("IFC4 building model", "asbuilt.export.ifc"),
    ".2d.json": _Format(
        "Scan-to-BIM challenge, floor plan, one file a storey", "asbuilt.export.challenge_2d", per_storey=True
    ),
    ".3d.json": _Format("Scan-to-BIM challenge, building model", "asbuilt.export.challenge_3d"),
    ".png": _Format("picture over the density of the points, one file a storey", "asbuilt.export.png", per_storey=True),
}


def known_suffixes() -> dict[str, str]:
    """The suffixes that `export` knows, each with what it writes."""
    return {suffix: known.name for suffix, known in _FORMATS.items()}


def check_output(path: str | os.PathLike[str]) -> None:
    """Find out before any work whether `export` could write to `path`.

    Raises
    ------
    OutputError : no exporter knows the suffix, the folder is missing or may not be written to, or `path` is a folder.
    MissingExtraError : the format needs a library that is not installed.
    """
    path = Path(path)
    _ = _format(path).write  # imported now, for what it lacks must be told before hours of reading
    if path.is_dir():
        raise OutputError(f"{path}: is a folder, expected a file to write to")
    if not path.parent.is_dir():
        raise OutputError(f"{path}: the folder {path.parent} does not exist; create it first")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise OutputError(f"{path}: no permission to write in the folder {path.parent}")


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
        has several storeys.
    evidence : what the plan was made from; the picture (.png) draws the plan over it.
    **options : passed on to the writer; see its module.

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
    if not known.per_storey:
        with replacing(path) as temporary:
            known.write(plan, temporary, evidence, **options)
        return (path,)
    written = []
    for storey in plan.storeys or (None,):
        target = path if len(plan.storeys) < 2 else _numbered(path, storey)
        with replacing(target) as temporary:
            known.write(plan, storey, temporary, evidence, **options)
        written.append(target)
    return tuple(written)


def _format(path: Path) -> _Format:
    suffix = _suffix(path)
    if suffix is not None:
        return _FORMATS[suffix]
    listed = ", ".join(_FORMATS)
    raise OutputError(f"{path}: no exporter for the suffix {path.suffix or '(none)'}; known are {listed}")


def _suffix(path: Path) -> str | None:
    # the longest one: .2d.json is another format than .json
    for suffix in sorted(_FORMATS, key=len, reverse=True):
        if path.name.lower().endswith(suffix) and len(path.name) > len(suffix):
            return suffix
    return None


def _numbered(path: Path, storey: Storey | None) -> Path:
    if storey is None:
        return path
    stem = len(path.name) - len(_suffix(path) or path.suffix)
    return path.with_name(f"{path.name[:stem]}_s{storey.index}{path.name[stem:]}")
