"""Read an IFC model into a `Drawing` through IfcOpenShell: its walls are cut at a height, their outlines are faces.

All walls of a storey are joined before they give faces, so that where two walls meet there is none. Doors and windows
come from the openings they fill, and doorways from those that nothing fills; rooms from spaces cut at the same height.
A side of a wall that nobody saw, as our own files say, is drawn and not detected: it gives no face. Needs the extra
`ifc`.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from asbuilt.errors import InputError, MissingExtraError
from asbuilt.evaluate.drawing import Drawing, DrawingStorey, Face, Floats, Opening, Room
from asbuilt.evaluate.read_challenge import long_axis

#: Gaps between walls up to twice this are closed before they give faces, m; it is modelling noise.
JOIN = 0.0005


def read_ifc(path: Path, cut_height: float = 0.5) -> Drawing:
    """Read the storeys of a model.

    Parameters
    ----------
    path : the file.
    cut_height : height above the storey's floor at which walls and spaces are cut, m: below the sills of windows, for
        a wall runs on under a window, and through the doors.

    Returns
    -------
    Drawing
        Storeys lowest first, in map coordinates where the model is georeferenced. A model without storeys is empty.

    Raises
    ------
    InputError : the file cannot be read or is not IFC.
    MissingExtraError : IfcOpenShell is not installed.
    """
    try:
        import ifcopenshell
        import ifcopenshell.util.element
    except ImportError as error:
        raise MissingExtraError("reading IFC needs IfcOpenShell: pip install 'asbuilt[ifc]'") from error
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        model = ifcopenshell.open(str(path))
    except Exception as error:  # IfcOpenShell raises its own, RuntimeError and OSError, depending on the damage
        raise InputError(f"{path}: expected an IFC file, found {error}") from error
    floors = sorted(((_floor(model, storey), storey) for storey in model.by_type("IfcBuildingStorey")), key=_first)
    storeys = tuple(_storey(model, i, storey, floor, cut_height) for i, (floor, storey) in enumerate(floors))
    kinds = (("doors", "IfcDoor"), ("windows", "IfcWindow"), ("rooms", "IfcSpace"))
    return Drawing(storeys, frozenset(kind for kind, name in kinds if model.by_type(name)), str(path))


def _first(pair: tuple[float, Any]) -> float:
    return pair[0]


def _floor(model: Any, storey: Any) -> float:
    """Height of a storey's floor in model coordinates, m."""
    import ifcopenshell.util.placement
    import ifcopenshell.util.unit

    metre = float(ifcopenshell.util.unit.calculate_unit_scale(model))
    if storey.ObjectPlacement is not None:
        return metre * float(ifcopenshell.util.placement.get_local_placement(storey.ObjectPlacement)[2][3])
    return metre * float(storey.Elevation or 0.0)


def _storey(model: Any, index: int, storey: Any, floor: float, cut_height: float) -> DrawingStorey:
    import ifcopenshell.util.element

    parts: Any = ifcopenshell.util.element.get_decomposition(storey)
    height = floor + cut_height
    to_map = _map_conversion(model)
    sections = [(part, _section(part, height)) for part in parts if part.is_a("IfcWall")]
    walls = shapely.union_all([section for _, section in sections])
    joined = shapely.buffer(shapely.buffer(walls, JOIN, join_style="mitre"), -JOIN, join_style="mitre")
    unseen = shapely.MultiLineString([edge for part, section in sections for edge in _unseen_edges(part, section)])
    spaces = [_section(part, height) for part in parts if part.is_a("IfcSpace")]
    return DrawingStorey(
        index=index,
        floor=floor + to_map[2],
        faces=tuple(_faces(joined, unseen, to_map)),
        doors=tuple(_openings((part for part in parts if part.is_a("IfcDoor") or _is_doorway(part, height)), to_map)),
        windows=tuple(_openings((part for part in parts if part.is_a("IfcWindow")), to_map)),
        rooms=tuple(
            Room(tuple(map(tuple, _moved(shapely.get_coordinates(space.exterior), to_map).tolist())), space.area)
            for space in spaces
            if space.geom_type == "Polygon" and not space.is_empty
        ),
    )


def _shape(element: Any) -> tuple[Floats, Any] | None:
    """Vertices (n, 3) in m and triangles (k, 3) of an element; None where it has no body."""
    # through importlib, for IfcOpenShell's own types know neither its settings nor its shapes
    geom: Any = importlib.import_module("ifcopenshell.geom")
    settings = geom.settings()
    settings.set("use-world-coords", True)
    try:
        shape = geom.create_shape(settings, element)
    except RuntimeError:  # an element without a representation of its own
        return None
    vertices = np.array(shape.geometry.verts, dtype=float).reshape(-1, 3)
    return vertices, np.array(shape.geometry.faces, dtype=np.int64).reshape(-1, 3)


def _section(element: Any, height: float) -> Any:
    """The area that a horizontal plane cuts from an element."""
    shape = _shape(element)
    if shape is None:
        return shapely.Polygon()
    vertices, triangles = shape
    above = vertices[:, 2] > height
    lines = []
    for triangle in triangles[(above[triangles].sum(axis=1) % 3) > 0]:
        cut = [
            _crossing(vertices[i], vertices[j], height)
            for i, j in zip(triangle, np.roll(triangle, -1), strict=True)
            if above[i] != above[j]
        ]
        lines.append(shapely.LineString(cut))
    # to a micrometre, for the ends of neighbouring triangles' cuts to meet
    noded = shapely.union_all(lines, grid_size=1e-6)
    return shapely.simplify(shapely.build_area(noded), 1e-5)


def _crossing(a: Floats, b: Floats, height: float) -> Floats:
    # always from the lower end, so that both triangles at an edge get the same point
    low, high = (a, b) if a[2] < b[2] else (b, a)
    return np.asarray(low[:2] + (height - low[2]) / (high[2] - low[2]) * (high[:2] - low[:2]))


def _unseen_edges(wall: Any, section: Any) -> Iterator[Floats]:
    """The edges of a wall's section on the side of its axis that was not seen, shape (2, 2) each, m."""
    import ifcopenshell.util.element
    import ifcopenshell.util.placement
    import ifcopenshell.util.representation
    import ifcopenshell.util.unit

    seen = (ifcopenshell.util.element.get_pset(wall, "Asbuilt_Trust") or {}).get("SeenSide")
    axis: Any = ifcopenshell.util.representation.get_representation(wall, "Model", "Axis")
    if seen not in ("LEFT", "RIGHT") or axis is None or not axis.Items[0].is_a("IfcPolyline"):
        return
    place = ifcopenshell.util.placement.get_local_placement(wall.ObjectPlacement)
    points = np.array([point.Coordinates[:2] for point in axis.Items[0].Points]) @ place[:2, :2].T + place[:2, 3]
    points *= float(ifcopenshell.util.unit.calculate_unit_scale(wall.file))
    moves = np.diff(points, axis=0).any(axis=1)
    starts, steps = points[:-1][moves], np.diff(points, axis=0)[moves]
    if len(steps) == 0:
        return
    for ring in shapely.get_rings(section):
        corners = shapely.get_coordinates(ring)
        for edge in np.stack([corners[:-1], corners[1:]], axis=1):
            away = edge.mean(axis=0) - starts
            along = np.clip((away * steps).sum(axis=1) / (steps**2).sum(axis=1), 0.0, 1.0)
            nearest = int(np.argmin(np.hypot(*(away - along[:, None] * steps).T)))
            (x, y), (dx, dy) = away[nearest], steps[nearest]
            left = float(dx * y - dy * x) / float(np.hypot(dx, dy))
            if (-left if seen == "LEFT" else left) > 2 * JOIN:
                yield edge


def _faces(area: Any, unseen: Any, to_map: tuple[float, ...]) -> Iterator[Face]:
    hidden = shapely.buffer(unseen, 2 * JOIN, cap_style="flat")
    for polygon in shapely.get_parts(area):
        for ring in (polygon.exterior, *polygon.interiors):
            corners = shapely.get_coordinates(shapely.simplify(ring, 1e-5))
            for edge in shapely.linestrings(np.stack([corners[:-1], corners[1:]], axis=1)):
                for part in shapely.get_parts(shapely.difference(edge, hidden)):
                    # where an edge was cut, what is left at the corners is modelling noise as well
                    if part.length > 4 * JOIN or part.length == edge.length:
                        (x1, y1), (x2, y2) = _moved(shapely.get_coordinates(part), to_map).tolist()
                        yield Face((x1, y1, x2, y2))


def _openings(elements: Iterable[Any], to_map: tuple[float, ...]) -> Iterator[Opening]:
    for element in elements:
        hole = element.FillsVoids[0].RelatingOpeningElement if element.FillsVoids else element
        shape = _shape(hole)
        if shape is not None:
            x1, y1, x2, y2 = long_axis(shapely.MultiPoint(shape[0][:, :2]))
            (x1, y1), (x2, y2) = _moved(np.array([[x1, y1], [x2, y2]]), to_map).tolist()
            yield Opening((x1, y1, x2, y2), float(np.hypot(x2 - x1, y2 - y1)))


def _is_doorway(part: Any, height: float) -> bool:
    """Whether a part is an opening without a leaf that one can walk through: nothing fills it, and the cut meets it."""
    if not part.is_a("IfcOpeningElement") or part.HasFillings or part.PredefinedType == "RECESS":
        return False
    shape = _shape(part)
    return shape is not None and bool(shape[0][:, 2].min() < height < shape[0][:, 2].max())


def _map_conversion(model: Any) -> tuple[float, float, float, float]:
    """Easting, northing and height of the model's origin, m, and the angle of its x axis, radians; zeros without."""
    import ifcopenshell.util.geolocation
    import ifcopenshell.util.unit

    found = ifcopenshell.util.geolocation.get_helmert_transformation_parameters(model)
    if found is None:
        return 0.0, 0.0, 0.0, 0.0
    # the scale turns the model's unit into the map's; near 1 m it is the projection's, which a building does not show
    map_metre = float(ifcopenshell.util.unit.calculate_unit_scale(model)) / float(found.scale or 1.0)
    if abs(map_metre - 1.0) < 0.01:
        map_metre = 1.0
    angle = float(np.arctan2(found.xao, found.xaa))
    return map_metre * float(found.e), map_metre * float(found.n), map_metre * float(found.h), angle


def _moved(points: Floats, to_map: tuple[float, ...]) -> Floats:
    east, north, _, angle = to_map
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return np.asarray(points @ turn + [east, north])
