"""Read the line work of a DXF's wall layers into a `Drawing`, through ezdxf.

The drawing's unit is $INSUNITS (none: metres). A layer named ...-S0, ...-S1 holds the storey of that number; any
other layer, storey 0. A storey's floor height is known only where the drawing's properties tell it, as ours do.
Layers that by the US National CAD Standard hold no faces, such as A-WALL-CNTR (centrelines), are left out, and so is
our A-WALL-UNSN (sides that no scan saw), unless the pattern names them.
"""

from __future__ import annotations

import fnmatch
import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asbuilt.errors import InputError
from asbuilt.evaluate.drawing import Drawing, DrawingStorey, Face

if TYPE_CHECKING:
    from ezdxf.document import Drawing as DxfDocument

#: Chords of an arc stay this near to it, m.
SAGITTA = 0.002
_STOREY_SUFFIX = re.compile(r"-S(\d+)$", re.IGNORECASE)
_FLOOR_PROPERTY = re.compile(r"floor (-?\d+(?:\.\d+)?) m")
_NOT_FACES = re.compile(r"-(CNTR|PATT|UNSN|IDEN|DIMS|TEXT|NPLT)\b", re.IGNORECASE)
_CURVES = frozenset({"ARC", "CIRCLE", "ELLIPSE", "SPLINE"})


def read_dxf(path: Path, layer: str = "*WALL*") -> Drawing:
    """Read lines, polylines, arcs and other curves (as chords), also those inside blocks.

    Parameters
    ----------
    path : the file.
    layer : pattern of the layers that hold walls, without regard to case; * and ? match anything.

    Returns
    -------
    Drawing
        Its storeys hold faces alone: line work does not say what is a door or a room. Of no matching line work, one
        empty storey for each matching layer.

    Raises
    ------
    InputError : the file cannot be read, is not DXF, or has no layer that matches; the message names those it has.
    """
    import ezdxf
    from ezdxf.enums import InsertUnits
    from ezdxf.units import conversion_factor

    try:
        document = ezdxf.readfile(path)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or 'expected a DXF file'}") from error
    except (ezdxf.DXFError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: expected a DXF file, found {error}") from error
    metre = conversion_factor(InsertUnits(document.units), InsertUnits.Meters) if document.units else 1
    drawn = list(_drawn(document.modelspace()))
    # a layer in use need not be in the table of layers, nor one in the table in use
    layers = {entry.dxf.name for entry in document.layers} | {name for _, name in drawn}
    faces: dict[int, list[Face]] = {_storey_of(name): [] for name in sorted(layers) if _matches(name, layer)}
    if not faces:
        raise InputError(f"{path}: no layer matches {layer!r} (--layer); it has {', '.join(sorted(layers))}")
    for entity, name in drawn:
        if _matches(name, layer):
            faces[_storey_of(name)].extend(_faces(entity, float(metre)))
    floors = _floors(document)
    storeys = (DrawingStorey(index, floors.get(index), tuple(faces[index])) for index in sorted(faces))
    return Drawing(tuple(storeys), frozenset(), str(path))


def _drawn(entities: Any, inherited: str | None = None) -> Iterator[tuple[Any, str]]:
    """Simple entities and the layer each is on; what lies on layer 0 of a block is on the layer of its insert."""
    for entity in entities:
        name = entity.dxf.layer if inherited is None or entity.dxf.layer != "0" else inherited
        kind = entity.dxftype()
        if kind in ("INSERT", "LWPOLYLINE", "POLYLINE"):
            yield from _drawn(entity.virtual_entities(), name)
        elif kind == "LINE" or kind in _CURVES:
            yield entity, name


def _faces(entity: Any, metre: float) -> Iterator[Face]:
    curved = entity.dxftype() in _CURVES
    vertices = entity.flattening(SAGITTA / metre) if curved else (entity.dxf.start, entity.dxf.end)
    points = [(point.x * metre, point.y * metre) for point in vertices]
    curve = f"{entity.dxf.handle or id(entity)}" if curved else _curve_told(entity)
    for (x1, y1), (x2, y2) in itertools.pairwise(points):
        if (x1, y1) != (x2, y2):
            yield Face((x1, y1, x2, y2), curve=curve)


def _curve_told(entity: Any) -> str | None:
    """The curved wall that a line says it is a chord of, in the extended data that our own DXF has."""
    if not entity.has_xdata("ASBUILT"):
        return None
    told = (text.partition("=") for _, text in entity.get_xdata("ASBUILT"))
    return next((value for name, _, value in told if name == "curve"), None)


def _matches(name: str, pattern: str) -> bool:
    named = set(_NOT_FACES.findall(pattern.upper()))
    other = any(part not in named for part in _NOT_FACES.findall(name.upper()))
    return not other and fnmatch.fnmatchcase(name.upper(), pattern.upper())


def _storey_of(layer: str) -> int:
    suffix = _STOREY_SUFFIX.search(layer)
    return int(suffix[1]) if suffix else 0


def _floors(document: DxfDocument) -> dict[int, float]:
    """Floor heights by storey from the drawing's own properties ("Storey 0": "floor 0.000 m, ...")."""
    floors = {}
    for name, text in document.header.custom_vars:
        found = _FLOOR_PROPERTY.search(text)
        if found and re.fullmatch(r"Storey \d+", name):
            floors[int(name.split()[1])] = float(found[1])
    return floors
