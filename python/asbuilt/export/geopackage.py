"""GeoPackage for QGIS through pyogrio (GDAL): a layer each of every kind of element, with all its attributes.

The attributes are those of `plan.geojson`; lists become text. Besides its centreline (`walls`) a wall has its body
(`wall_bodies`), and a stair its way up (`stair_paths`). A plan without CRS is written with the standard's "Undefined
Cartesian" one, so that no program takes its metres for degrees. Needs the extra "gis".
"""

from __future__ import annotations

import contextlib
import dataclasses
import types
import typing
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from asbuilt.errors import MissingExtraError, OutputError
from asbuilt.plan import (
    Column,
    Door,
    Element,
    FloorPlan,
    Opening,
    Room,
    Stair,
    Storey,
    UnknownOpening,
    Wall,
    WallFace,
    Window,
)

try:
    import pyogrio
    import pyogrio.raw
except ImportError as error:
    raise MissingExtraError("writing GeoPackage needs pyogrio: pip install 'asbuilt[gis]'") from error

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence

_UNDEFINED_CARTESIAN = -1  # an srs_id that the standard gives
_DAY = "2000-01-01T00:00:00.000Z"  # the same plan gives the same bytes: no day of its own


def write(plan: FloorPlan, path: Path, evidence: Evidence | None = None) -> None:
    """Write `plan` as GeoPackage; a kind of which the plan has none is an empty layer.

    Raises
    ------
    OutputError : PROJ does not know the plan's CRS.
    """
    path.unlink(missing_ok=True)  # GDAL will not write over a file that is not its own
    with _no_timestamps():
        for layer in _LAYERS:
            rows = [(storey.index, element) for storey in plan for element in layer.elements(storey)]
            fields = _fields(layer.kind)
            columns = {name: _column(fields[name], [_value(row, name) for row in rows]) for name in fields}
            shapes = [layer.geometry(element) for _, element in rows]
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", message="'crs' was not provided")  # the srs_id says it
                try:
                    pyogrio.raw.write(
                        path,
                        geometry=np.array([None if shape is None else shape.wkb for shape in shapes], dtype=object),
                        field_data=[values for values, _ in columns.values()],
                        field_mask=[missing for _, missing in columns.values()],
                        fields=list(columns),
                        geometry_type=layer.shape,
                        layer=layer.name,
                        driver="GPKG",
                        append=layer is not _LAYERS[0],
                        crs=plan.crs,
                        layer_options={} if plan.crs else {"SRID": _UNDEFINED_CARTESIAN},
                    )
                except pyogrio.errors.CRSError as error:
                    raise OutputError(f"GeoPackage: the plan's CRS {(plan.crs or '')[:60]!r} is not known") from error
                except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError) as error:
                    raise OSError(f"GDAL: {' '.join(str(error).split())}") from error


@dataclasses.dataclass(frozen=True)
class _Layer:
    """A layer: its name and geometry type, which elements it holds, and where they are."""

    name: str
    shape: str
    kind: type[Element] | type[Storey]
    elements: Callable[[Storey], Sequence[Any]]
    geometry: Callable[[Any], shapely.Geometry | None]


def _line(element: WallFace | Wall | Opening) -> shapely.Geometry:
    return shapely.LineString([element.start, element.end])


def _polygon(element: Room | Column | Stair) -> shapely.Geometry:
    return shapely.Polygon(element.ring, getattr(element, "holes", ()))


def _outline(storey: Storey) -> shapely.Geometry | None:
    return shapely.Polygon(storey.outline) if storey.outline else None


_LAYERS = (
    _Layer("storeys", "Polygon", Storey, lambda storey: (storey,), _outline),
    _Layer("rooms", "Polygon", Room, lambda storey: storey.rooms, _polygon),
    _Layer(
        "wall_bodies",
        "Polygon",
        Wall,
        lambda storey: [wall for wall in storey.walls if wall.outline],
        lambda wall: shapely.Polygon(wall.outline),
    ),
    _Layer("walls", "LineString", Wall, lambda storey: storey.walls, _line),
    _Layer("wall_faces", "LineString", WallFace, lambda storey: storey.wall_faces, _line),
    _Layer("doors", "LineString", Door, lambda storey: storey.doors, _line),
    _Layer("windows", "LineString", Window, lambda storey: storey.windows, _line),
    _Layer("unknown_openings", "LineString", UnknownOpening, lambda storey: storey.unknown_openings, _line),
    _Layer("columns", "Polygon", Column, lambda storey: storey.columns, _polygon),
    _Layer("stairs", "Polygon", Stair, lambda storey: storey.stairs, _polygon),
    _Layer(
        "stair_paths",
        "LineString",
        Stair,
        lambda storey: [stair for stair in storey.stairs if stair.path],
        lambda stair: shapely.LineString(stair.path),
    ),
)


def _fields(kind: type[Element] | type[Storey]) -> dict[str, type]:
    """Name and type of each attribute of a layer: what its elements state, and what can be worked out of it."""
    if kind is Storey:
        return {"storey": int, "floor": float, "ceiling": float}
    hints = typing.get_type_hints(kind)
    stated = {field.name: _plain_type(hints[field.name]) for field in dataclasses.fields(kind)}
    derived = {name: float for name in ("length", "width", "area", "perimeter", "height") if hasattr(kind, name)}
    types_of = {"storey": int, **stated, **derived, "loa": str}
    return {name: known for name, known in types_of.items() if known is not None}


def _plain_type(hint: Any) -> type | None:
    """The type of a column for a type hint; None where the geometry holds it."""
    if hint in (int, float, str):
        return typing.cast(type, hint)
    if typing.get_origin(hint) in (types.UnionType, typing.Union):
        return next((_plain_type(part) for part in typing.get_args(hint) if part is not types.NoneType), None)
    if typing.get_origin(hint) is typing.Literal or hint == tuple[str, ...]:
        return str
    return None


def _value(row: tuple[int, Any], name: str) -> Any:
    storey, element = row
    value = storey if name == "storey" else getattr(element, name)
    return ", ".join(value) if isinstance(value, tuple) else value


def _column(known: type, values: list[Any]) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """The values of a column, and which of them are missing."""
    missing = np.array([value is None for value in values], dtype=np.bool_)
    if known is str:
        return np.array(values, dtype=object), missing
    dtype = np.int64 if known is int else np.float64
    return np.array([0 if value is None else value for value in values], dtype=dtype), missing


@contextlib.contextmanager
def _no_timestamps() -> Iterator[None]:
    """GDAL otherwise stamps the time of writing on each layer."""
    before = pyogrio.get_gdal_config_option("OGR_CURRENT_DATE")
    pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": _DAY})
    try:
        yield
    finally:
        pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": before})
