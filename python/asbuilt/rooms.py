"""Rooms: what the wall faces enclose (not in the paper, which names it future work).

The faces and their continuations divide the ground into cells. A cell is part of a room where faces look into it and
floor or ceiling was seen; cells join where nothing under the ceiling stands between them. So a face that is hidden in
part still closes its room, a door does not join two rooms, and a beam does not divide one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray

from asbuilt import _core
from asbuilt.elevations import ON_PLANE, Elevations, ceiling_heights
from asbuilt.faces import Face
from asbuilt.grid import BoolArray, FloatArray, IntArray
from asbuilt.indices import unique_rows
from asbuilt.neighbours import near_pairs
from asbuilt.plan import Opening, Point, Room, Wall
from asbuilt.profiles import StoreyVoxels
from asbuilt.storeys import Level
from asbuilt.wall_sides import along_circle, arcs_of

Scan: TypeAlias = tuple[str, tuple[float, float, float] | None, int]

_REACH = 6.0
"""A face goes on beyond its free ends by up to this, m."""
_DOOR = 2.8
"""What is open over more than this is one room, even under a beam, m."""
_JAMB = 0.7
"""The other face of a wall is this near, m."""
_SAME_PLANE = 0.05
"""Faces that go on from one another lie this near to one line, m."""
_UPPER = (0.45, 0.1)
"""What parts rooms shows from and to this far below the ceiling, m."""
_LOWER = (0.3, 1.9)
"""Heights at which a beam leaves the way open, m."""
_CONVERGING = (np.radians(2.0), np.radians(25.0))
"""A face at an angle between these to a continuation is not the wall that it continues, rad."""
_BEFORE = 0.01
"""A face that a continuation runs this far before is not it either, m."""
_PARTED = 0.45
"""Share of an edge over which that shows from which it parts two rooms."""
_MIN_AREA = 0.8
"""Smaller ones are no rooms, m2."""
_SLIT = 0.02
"""Cells that meet over no more than this, m, as where a line ends a hair behind another, do not join."""
_MIN_WIDTH = 0.4
"""Neither are narrower ones, m."""
_JOINING = (0.4, 0.6, 0.9, 1.4, 2.1, 3.0)
"""What is twice this far apart is of one storey, the least first that joins it, m."""
_ROW = 3.0
"""Rooms whose middles differ less in y are numbered from west to east, m."""
_FLOOR = 0.6
"""A room's floor lies this near to its storey's, m: some steps higher or lower."""
_HEADROOM = 1.7
"""Its ceiling is higher than this over it, m."""
_LEVEL = 0.01
"""Step in which heights of floors and ceilings are counted, m."""
_MIN_VOXELS = 20
"""A floor or ceiling of fewer voxels was not seen."""
_TOUCHING = 1e-3
"""A face ends on another one if it comes this near, m."""
_LATTICE = 1e-6
"""Corners of what is joined lie on a lattice of this step where they cannot stay where they are, m."""
_SAME = 1e-4
"""What lies this near is the same, m."""
_SAMPLED = 4
"""Floor and ceiling are looked for in squares of so many ground cells each way: from afar they are seen in few."""
_SEEN = 0.5
"""Share of a room over which floor or ceiling was seen at least."""
_NARROW = 0.2
"""Narrower cells are too small to tell whether floor or ceiling was seen, m."""
_TILE, _WHOLE = 3, 2
"""Voxels are told to be in a room by tiles of so many ground cells each way, as a power of two; and what marks a tile
that is in it as a whole: it is in touch with it, and within."""
_ASIDE = 0.05
"""Voxels this near to a room's walls are none of its floor or ceiling, m."""


@dataclass(frozen=True)
class _Edges:
    """Edges (n, 4) between cells: which faces they lie on, and the cells on their left and right (-1: none)."""

    ends: FloatArray
    left: IntArray
    right: IntArray
    facing: IntArray
    """+1 where a face looks to the left, -1 to the right, 0 where no face lies."""
    face: IntArray
    """Which face that is; -1 for none."""

    @property
    def length(self) -> FloatArray:
        length: FloatArray = np.hypot(*(self.ends[:, 2:] - self.ends[:, :2]).T)
        return length


def find_rooms(
    faces: list[Face], openings: Sequence[Opening], elevations: Elevations, voxels: StoreyVoxels
) -> list[shapely.Polygon]:
    """Polygons of the rooms that wall faces enclose, m from the storey's origin; largest first.

    `openings` through which the floor goes on, in the input's frame, part rooms even where nothing shows above them: a
    window down to the floor parts a room from its recess. None where there are no faces.
    """
    if not faces:
        return []
    segments = np.array([np.concatenate([face.start, face.end]) for face in faces])
    closed = close_openings(openings, segments, voxels.origin)
    lines = np.concatenate([segments, _continuations(segments), continue_circles(faces), closed])
    cells = shapely.get_parts(shapely.polygonize([_union(shapely.linestrings(lines.reshape(-1, 2, 2)))]))
    if len(cells) == 0:
        return []
    cells = shapely.normalize(cells)
    edges = _edges(cells, segments)
    seen = _share_seen(cells, segments, voxels)
    # Of a free-standing partition one face may be all that was seen: a room may lie behind it.
    backed = ~elevations.partition[[face.line for face in faces]][edges.face]
    inside, outside = np.zeros(len(cells)), np.zeros(len(cells))
    for cell, sign in ((edges.left, 1), (edges.right, -1)):
        for chosen, total in ((edges.facing == sign, inside), ((edges.facing == -sign) & backed, outside)):
            chosen = chosen & (cell >= 0)
            np.add.at(total, cell[chosen], edges.length[chosen])
    # The body of a wall lies behind its faces.
    indoor = (inside >= outside) & (seen > _SEEN)
    between = (edges.left >= 0) & (edges.right >= 0) & (edges.facing == 0) & (edges.length > _SLIT)
    between[between] &= indoor[edges.left[between]] & indoor[edges.right[between]]
    open_edges = np.flatnonzero(between)
    ends = edges.ends[open_edges]
    parted = _parts(ends, _width(ends, lines[len(segments) :]), segments, voxels)
    parted |= _in_openings(ends, openings, voxels) | (_width(ends, closed) > 0)
    open_edges = open_edges[~parted]
    rooms = []
    for group in _groups(len(cells), edges.left[open_edges], edges.right[open_edges]):
        if not indoor[group].all():
            continue
        whole = _union(cells[group])
        whole = whole.buffer(-_MIN_WIDTH / 2, join_style="mitre").buffer(_MIN_WIDTH / 2, join_style="mitre")
        faced = inside[group].sum() / max(whole.length, 1e-9)
        # What hangs together by a strip too narrow for a room is two.
        parts = shapely.get_parts(whole) if faced > 0.3 else ()
        rooms += [room.simplify(0.002) for room in parts if room.area >= _MIN_AREA]
    return sorted(rooms, key=lambda room: -room.area)


def measure_rooms(
    polygons: list[shapely.Polygon], voxels: StoreyVoxels, level: Level, scans: Sequence[Scan]
) -> tuple[Room, ...]:
    """Rooms as they stand in the plan, in the input's frame, with their own floor and ceiling and the scans in them.

    They are numbered from north to south, and from west to east, after the storey: 001, 002... on the lowest.
    """
    order = sorted(polygons, key=lambda p: (-round(p.centroid.y / _ROW), p.centroid.x))
    digits = max(2, len(str(len(order))))
    bottom, top = np.zeros((2, len(voxels.z)), dtype=np.bool_)
    bottom[voxels.first[:-1]], top[voxels.first[1:] - 1] = True, True
    bottom &= np.abs(voxels.z) < _FLOOR
    top &= voxels.z > _HEADROOM
    one = voxels.voxel
    rooms = []
    for number, polygon in enumerate(order, start=1):
        inner = polygon.buffer(-_ASIDE)
        inside = _Inside(inner, voxels)
        on_floor, at_ceiling = (
            _surface(inside, voxels.in_box(inner.bounds[:2], inner.bounds[2:], between), outermost, voxels)
            for outermost, between in ((bottom, (-_FLOOR - one, _FLOOR + one)), (top, (_HEADROOM - one, np.inf)))
        )
        floor, ceiling = _level_of(voxels.z[on_floor]), _level_of(voxels.z[at_ceiling])
        here = tuple(
            key
            for key, position, _ in scans
            if position is not None
            and level.floor - 0.5 < position[2] < level.ceiling + 0.5
            and polygon.contains(shapely.Point(np.subtract(position[:2], voxels.origin)))
        )
        shell, *holes = (
            tuple((float(x), float(y)) for x, y in voxels.origin + shapely.get_coordinates(ring)[:-1])
            for ring in (polygon.exterior, *polygon.interiors)
        )
        rooms.append(
            Room(
                shell[::-1] if not polygon.exterior.is_ccw else shell,
                tuple(holes),
                f"{level.index}{number:0{digits}d}",
                None if floor is None else level.floor + floor,
                None if ceiling is None else level.floor + ceiling,
                here,
                id=f"S{level.index}-R{number}",
                voxels=len(on_floor) + len(at_ceiling),
            )
        )
    return tuple(rooms)


def find_outline(rooms: Sequence[Room], walls: Sequence[Wall]) -> tuple[Point, ...] | None:
    """Outer ring of a storey, about its rooms and the bodies of its walls; None where there are neither."""
    shapes = [shapely.Polygon(room.ring) for room in rooms]
    shapes += [shapely.Polygon(wall.outline) for wall in walls if len(wall.outline) > 2]
    if not shapes:
        return None
    joined = _union(shapely.make_valid(np.array(shapes)))
    # Wings stand apart where what lies between them was not found: the least closing that joins them.
    closings = (joined.buffer(r, join_style="mitre").buffer(-r, join_style="mitre") for r in _JOINING)
    with np.errstate(divide="ignore", invalid="ignore"):  # mitres of sides that are nearly parallel
        joins = (_largest(shape) for shape in closings if _largest(shape).area > 0.95 * shape.area)
        whole = next(joins, _largest(joined))
    if whole.is_empty:
        return None
    ring = shapely.Polygon(whole.exterior).simplify(0.01).exterior
    points = tuple((float(x), float(y)) for x, y in list(ring.coords)[:-1])
    return points if ring.is_ccw else points[::-1]


def continue_circles(faces: Sequence[Face]) -> FloatArray:
    """Where round walls go on along their circles, from each chord to the next one (n, 4), m; empty without any."""
    curves: dict[int, list[Face]] = {}
    for face in faces:
        if face.curve is not None:
            curves.setdefault(face.curve, []).append(face)
    lines = [np.zeros((0, 4))]
    for circle, chords in arcs_of(list(curves.values())):
        # What is less than half a circle does not close.
        closes = int(sum(chord.length for chord in chords) > np.pi * abs(circle[2]))
        for last, face in pairwise([*chords, *chords[:closes]]):
            if 1e-6 < np.hypot(*(face.start - last.end)) < _DOOR:
                points = np.array([last.end, *along_circle(last.end, face.start, circle), face.start])
                lines.append(np.hstack([points[:-1], points[1:]]))
    return np.concatenate(lines)


def close_openings(openings: Sequence[Opening], segments: FloatArray, origin: FloatArray) -> FloatArray:
    """Lines (m, 4) across openings, and from either jamb to the nearest of the faces (n, 4): they part rooms.

    Openings are in the input's frame, the rest is m from `origin` (2,); empty without any.
    """
    if not openings:
        return np.zeros((0, 4))
    ends = np.array([[opening.start, opening.end] for opening in openings]) - origin
    jambs = shapely.points(ends.reshape(-1, 2))
    faces = shapely.linestrings(segments.reshape(-1, 2, 2))
    jamb, face = shapely.STRtree(faces).query_nearest(jambs, max_distance=_JAMB, all_matches=False)
    links = shapely.get_coordinates(shapely.shortest_line(jambs[jamb], faces[face])).reshape(-1, 4)
    far = np.hypot(*(links[:, 2:] - links[:, :2]).T)
    # A hair further, so that rounding leaves no slit.
    links[:, 2:] += 1e-3 * (links[:, 2:] - links[:, :2]) / np.maximum(far, 1e-9)[:, None]
    return np.concatenate([ends.reshape(-1, 4), links[far > 1e-3]])


def _surface(inside: _Inside, near: IntArray, outermost: BoolArray, voxels: StoreyVoxels) -> IntArray:
    """Those of the voxels near a polygon that are on the surface in it which most of the outermost ones (n,) are of."""
    height = _level_of(voxels.z[inside.of(near[outermost[near]])])
    if height is None:
        return np.zeros(0, dtype=np.int64)
    return inside.of(near[np.abs(voxels.z[near] - height) < voxels.voxel])


def _level_of(z: FloatArray) -> float | None:
    """Height at which most of a horizontal surface's voxels lie, m; None for too few."""
    if len(z) < _MIN_VOXELS:
        return None
    steps = np.round(z / _LEVEL).astype(np.int64)
    counts = np.bincount(steps - steps.min())
    most = (int(np.argmax(np.convolve(counts, np.ones(3), "same"))) + int(steps.min())) * _LEVEL
    return float(z[np.abs(z - most) <= 1.5 * _LEVEL].mean())


class _Inside:
    """Which voxels are within a polygon: asked for its tiles first, then for voxels on its edges alone."""

    def __init__(self, polygon: shapely.Polygon, voxels: StoreyVoxels) -> None:
        self.polygon, self.voxels = polygon, voxels
        shapely.prepare(polygon)
        size = voxels.voxel * 2**_TILE
        x1, y1, x2, y2 = np.nan_to_num(np.floor(np.divide(polygon.bounds, size))).astype(np.int32)
        # A tile more on all sides, and tiles a hair larger: rounding may put a voxel's mean beyond its cell.
        x, y = np.mgrid[x1 - 1 : x2 + 2, y1 - 1 : y2 + 2]
        self.wide, self.first = np.int32(y.shape[1]), (x1 - 1) * y.shape[1] + y1 - 1
        ends = (side * size + end for end in (-_SAME, size + _SAME) for side in (x.ravel(), y.ravel()))
        tiles = shapely.box(*ends)
        self.touched = shapely.intersects(polygon, tiles).astype(np.int8) + shapely.contains_properly(polygon, tiles)

    def of(self, chosen: IntArray) -> IntArray:
        """Those of the chosen voxels, near the polygon, that are in it."""
        x, y = (self.voxels.index.take(chosen, axis=0) >> _TILE).T
        touched = self.touched.take(x * self.wide + y - self.first)
        within = touched == _WHOLE
        asked = np.flatnonzero(touched == _WHOLE - 1)
        within[asked] = shapely.contains_xy(self.polygon, self.voxels.xy.take(chosen.take(asked), axis=0))
        found: IntArray = chosen[within]
        return found


def _continuations(segments: FloatArray) -> FloatArray:
    """Where faces (n, 4) go on beyond their ends (m, 4): to the next face of the same plane, else to what stands ahead.

    An end from which neither is near is linked to the nearest start from which a room could go on.
    """
    count = len(segments)
    tips = np.concatenate([segments[:, 2:], segments[:, :2]])
    along = segments[:, 2:] - segments[:, :2]
    along /= np.maximum(np.hypot(*along.T), 1e-12)[:, None]
    ways = np.concatenate([along, -along])
    own = np.tile(np.arange(count), 2)
    faces = shapely.STRtree(shapely.linestrings(segments.reshape(-1, 2, 2)))
    free = np.ones(len(tips), dtype=np.bool_)
    tip, other = faces.query(shapely.points(tips), predicate="dwithin", distance=_TOUCHING)
    tip = np.unique(tip[own[tip] != other])
    free[tip] = False  # another face starts or passes here
    touching = np.hstack([tips[tip], tips[tip] + 2 * _TOUCHING * ways[tip]])

    first, second = near_pairs(tips, tips, _REACH + _SAME_PLANE)
    apart, way, back = tips[second] - tips[first], ways[first], ways[second]
    far = np.hypot(*apart.T)
    ahead, behind = (apart * way).sum(axis=1), -(apart * back).sum(axis=1)
    aside = apart[:, 1] * way[:, 0] - apart[:, 0] * way[:, 1]
    facing = (way * back).sum(axis=1) < -0.999
    same = np.flatnonzero(facing & (np.abs(aside) < _SAME_PLANE) & (ahead > 1e-3) & (ahead < _REACH))
    same = same[np.lexsort((ahead[same], first[same]))]
    same = same[np.diff(first[same], prepend=-1) != 0]  # the nearest of each
    closing = np.hstack([tips[first[same]], tips[second[same]]])
    # What ends on the plane does not part what goes on along it.
    inner = shapely.STRtree(shapely.linestrings(_inner(segments).reshape(-1, 2, 2)))
    closing = closing[~_crossed(closing, inner) & ~_beside(closing, inner)]

    tree = shapely.STRtree(shapely.linestrings(np.concatenate([segments, closing]).reshape(-1, 2, 2)))
    closed = np.zeros(len(tips), dtype=np.bool_)
    at_closing, _ = shapely.STRtree(shapely.points(closing.reshape(-1, 2))).query(
        shapely.points(tips), predicate="dwithin", distance=1e-6
    )
    closed[at_closing] = True
    rest = np.flatnonzero(free & ~closed)
    onward = _cut_at_first(np.hstack([tips[rest], tips[rest] + _REACH * ways[rest]]), own[rest], tree)

    # Where an opening begins, its jamb parts it from the wall's body.
    loose = np.flatnonzero(free)
    right = np.tile(np.column_stack([along[:, 1], -along[:, 0]]), (2, 1))[loose]
    jambs = np.hstack([tips[loose], tips[loose] + _JAMB * right])
    jambs = _cut_at_first(jambs, own[loose], tree)

    # The room stays on the left: no link turns back.
    links = (np.minimum(ahead, behind) > -0.2 * far) & (far > 1e-3) & (far < _DOOR) & free[first] & free[second]
    links &= (first < count) & (second >= count)
    link = np.hstack([tips[first[links]], tips[second[links]]])
    return np.concatenate([touching, closing, onward, jambs, link[~_crossed(link, faces)]])


def _cut_at_first(rays: FloatArray, own: IntArray, tree: shapely.STRtree) -> FloatArray:
    """Rays (n, 4) that meet a line of `tree` other than their `own`, up to the first one (m, 4)."""
    way = rays[:, 2:] - rays[:, :2]
    length = np.maximum(np.hypot(*way.T), 1e-12)
    way = way / length[:, None]
    lines = shapely.linestrings(np.stack([rays[:, :2] + 1e-6 * way, rays[:, 2:]], axis=1))
    ray, other = tree.query(lines, predicate="intersects")
    kept = own[ray] != other
    ray, other = ray[kept], other[kept]
    hit = np.full(len(rays), np.inf)
    met = shapely.intersection(lines[ray], tree.geometries[other])
    np.minimum.at(hit, ray, shapely.distance(shapely.points(rays[ray, :2]), met))
    found = np.isfinite(hit)
    cut: FloatArray = np.hstack([rays[found, :2], rays[found, :2] + (hit[found, None] + 1e-3) * way[found]])
    return cut


def _crossed(links: FloatArray, faces: shapely.STRtree) -> BoolArray:
    """Whether links (n, 4) cross a face other than at their own ends (n,)."""
    crossed = np.zeros(len(links), dtype=np.bool_)
    crossed[faces.query(shapely.linestrings(_inner(links).reshape(-1, 2, 2)), predicate="intersects")[0]] = True
    return crossed


def _beside(links: FloatArray, faces: shapely.STRtree) -> BoolArray:
    """Whether links (n, 4) have a face close beside their quarters (n,)."""
    way = (links[:, 2:] - links[:, :2])[:, None]
    quarters = links[:, None, :2] + np.array([[0.25], [0.5], [0.75]]) * way
    beside = np.zeros(len(links), dtype=np.bool_)
    beside[faces.query(shapely.points(quarters.reshape(-1, 2)), predicate="dwithin", distance=_SAME_PLANE)[0] // 3] = (
        True
    )
    return beside


def _inner(segments: FloatArray) -> FloatArray:
    """Segments (n, 4) without their ends."""
    way = segments[:, 2:] - segments[:, :2]
    shift = way * np.minimum(_SAME_PLANE / np.maximum(np.hypot(*way.T), 1e-9), 0.1)[:, None]
    return np.hstack([segments[:, :2] + shift, segments[:, 2:] - shift])


def _edges(cells: NDArray[np.object_], segments: FloatArray) -> _Edges:
    """The edges between cells, which run clockwise (as `shapely.normalize` leaves them)."""
    rings, cell_of = shapely.get_rings(cells, return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    same = ring[1:] == ring[:-1]
    cell = cell_of[ring[1:][same]]
    keys = np.round(np.stack([points[:-1][same], points[1:][same]], axis=1), 7)
    x, y = keys[:, :, 0], keys[:, :, 1]
    flip = (x[:, 0] > x[:, 1]) | ((x[:, 0] == x[:, 1]) & (y[:, 0] > y[:, 1]))
    keys[flip] = keys[flip][:, ::-1]
    ends, row = np.unique(keys.reshape(-1, 4), axis=0, return_inverse=True)
    left, right = np.full(len(ends), -1), np.full(len(ends), -1)
    left[row[flip]] = cell[flip]
    right[row[~flip]] = cell[~flip]
    tree = shapely.STRtree(shapely.linestrings(segments.reshape(-1, 2, 2)))
    middles = shapely.points((ends[:, :2] + ends[:, 2:]) / 2)
    edge, face = tree.query(middles, predicate="dwithin", distance=_SAME)
    facing = np.zeros(len(ends), dtype=np.int64)
    way = ((ends[edge, 2:] - ends[edge, :2]) * (segments[face, 2:] - segments[face, :2])).sum(axis=1)
    facing[edge] = np.sign(way).astype(np.int64)
    on = np.full(len(ends), -1)
    on[edge] = face
    return _Edges(ends, left, right, facing, on)


def _share_seen(cells: NDArray[np.object_], segments: FloatArray, voxels: StoreyVoxels) -> FloatArray:
    """Share of each cell over or under which floor or ceiling was seen (n,); the feet of faces (m, 4) are neither."""
    low, top = voxels.first[:-1], voxels.first[1:] - 1
    off_faces = np.ones(len(voxels.z), dtype=np.bool_)
    off_faces[voxels.strips(segments, 2 * ON_PLANE, 2 * ON_PLANE)[1]] = False
    level = off_faces[low] & (np.abs(voxels.z[low]) < _FLOOR)
    level |= off_faces[top] & (voxels.z[top] > voxels.height - 0.6)
    size = _SAMPLED * voxels.voxel
    places = shapely.points((unique_rows(voxels.index[low[level]] // _SAMPLED) + 0.5) * size)
    cell, _ = shapely.STRtree(places).query(cells, predicate="contains")
    share: FloatArray = np.bincount(cell, minlength=len(cells)) * size**2 / np.maximum(shapely.area(cells), 1e-6)
    # A strip may pass between the cells that are looked at.
    narrow = 2 * shapely.area(cells) < _NARROW * shapely.length(cells)
    share[narrow] = 1.0
    return share


def _width(ends: FloatArray, continuations: FloatArray) -> FloatArray:
    """Length of the continuation (m, 4) that each edge (n, 4) is a piece of, m."""
    tree = shapely.STRtree(shapely.linestrings(continuations.reshape(-1, 2, 2)))
    edge, line = tree.query(shapely.points((ends[:, :2] + ends[:, 2:]) / 2), predicate="dwithin", distance=_SAME)
    width = np.zeros(len(ends))
    np.maximum.at(width, edge, np.hypot(*(continuations[line, 2:] - continuations[line, :2]).T))
    return width


def _parts(ends: FloatArray, width: FloatArray, segments: FloatArray, voxels: StoreyVoxels) -> BoolArray:
    """Whether something parts the cells on both sides of edges (n, 4), pieces of continuations of a `width` (n,), m.

    It shows under the ceiling: as a wall, or as what stands over a door. Over a wide opening it is a beam.
    """
    if len(ends) == 0:
        return np.zeros(0, dtype=np.bool_)
    length = np.maximum(np.hypot(*(ends[:, 2:] - ends[:, :2]).T), 1e-9)
    along = (ends[:, 2:] - ends[:, :2]) / length[:, None]
    normal = np.column_stack([-along[:, 1], along[:, 0]])
    middle = (ends[:, :2] + ends[:, 2:]) / 2
    heights = np.stack([ceiling_heights(middle, along, sign * normal, voxels) for sign in (1, -1)])
    ceiling = np.where(np.isfinite(heights), heights, voxels.height).min(axis=0)
    edge, voxel, place, _ = voxels.strips(ends, 0.06, 0.0)
    apart = ~_on_other_face(voxel, middle[edge], along[edge], segments, voxels)
    edge, voxel, place = edge[apart], voxel[apart], place[apart]
    z = voxels.z[voxel]
    counts = np.ceil(length / voxels.voxel).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(counts)])
    at = first[edge] + np.minimum((place / voxels.voxel).astype(np.int64), counts[edge] - 1)

    def share(chosen: BoolArray) -> FloatArray:
        filled = np.bincount(at[chosen], minlength=first[-1]) >= 2
        shares: FloatArray = np.add.reduceat(filled.astype(np.float64), first[:-1]) / counts
        return shares

    above = share((z > ceiling[edge] - _UPPER[0]) & (z < ceiling[edge] - _UPPER[1]))
    below = share((z > _LOWER[0]) & (z < _LOWER[1]))
    return (above > _PARTED) & ((width < _DOOR) | (below > _PARTED))


def _in_openings(ends: FloatArray, openings: Sequence[Opening], voxels: StoreyVoxels) -> BoolArray:
    """Which edges (n, 4) close an opening on one of the sides of its wall (n,)."""
    middle = (ends[:, :2] + ends[:, 2:]) / 2
    way = ends[:, 2:] - ends[:, :2]
    way = way / np.maximum(np.hypot(*way.T), 1e-9)[:, None]
    within = np.zeros(len(ends), dtype=np.bool_)
    for opening in openings:
        along = np.subtract(opening.end, opening.start) / max(opening.length, 1e-9)
        apart = middle - (opening.start - voxels.origin)
        place, aside = apart @ along, apart @ np.array([-along[1], along[0]])
        parallel = np.abs(way @ along) > 0.98
        within |= parallel & (place > 0) & (place < opening.length) & (np.abs(aside) < _JAMB)
    return within


def _on_other_face(
    voxel: IntArray, middle: FloatArray, along: FloatArray, segments: FloatArray, voxels: StoreyVoxels
) -> BoolArray:
    """Which voxels (h,) lie on a face (n, 4) beside the edge they are near, of this `middle` and direction (h, 2).

    A face at a small angle to the edge, or one that looks at it, parts what is beside the edge; only a parallel one
    that looks away can be the wall that parts it.
    """
    face, point, _, _ = voxels.strips(segments, ON_PLANE, 0.0)
    face_of = np.full(len(voxels.z), -1)
    face_of[point] = face
    way = segments[:, 2:] - segments[:, :2]
    way = way / np.maximum(np.hypot(*way.T), 1e-9)[:, None]
    on = face_of[voxel]
    apart = middle - segments[on, :2]
    before = apart[:, 1] * way[on, 0] - apart[:, 0] * way[on, 1] > _BEFORE
    aligned = np.abs((along * way[on]).sum(axis=1))
    converging = aligned < np.cos(_CONVERGING[0])
    beside: BoolArray = (on >= 0) & (aligned > np.cos(_CONVERGING[1])) & (converging | before)
    return beside


def _groups(count: int, first: IntArray, second: IntArray) -> list[IntArray]:
    """Things that hang together, by pairs of them; each group in order."""
    group = _core.groups(count, first, second)
    order = np.argsort(group, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(group[order])) + 1)


def _union(shapes: NDArray[np.object_]) -> shapely.Geometry:
    """All shapes as one. Of very many, rounding may keep the exact union from an end: then it is that on a lattice."""
    try:
        return shapely.union_all(shapes)
    except shapely.GEOSException:
        return shapely.union_all(shapes, grid_size=_LATTICE)


def _largest(shape: shapely.Geometry) -> shapely.Polygon:
    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
    return max(parts, key=lambda part: part.area, default=shapely.Polygon())
