"""The class of any point of a building, from its plan alone (the paper's figure 12).

For each storey, cells of 2 cm say which element of the plan is nearest and which room they are in; for each pair of
these a table says by height what stands there. A point is then two lookups, without any geometry.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from asbuilt.errors import ParameterError
from asbuilt.grid import FloatArray, IntArray
from asbuilt.label.classes import PointClass
from asbuilt.label.heights import Layer, Levels, element_layers, room_layers
from asbuilt.label.raster import Frame, Raster, distances
from asbuilt.plan import Element, FloorPlan, Opening, Stair, Storey, Wall, WallFace

TOLERANCE = 0.05
"""How far from a surface of the plan a point may lie to be on it, m."""
_ABOVE = 0.5  # m above the highest storey's ceiling that are still ceiling
_STEP = 0.005  # m of height between the rows of a table
_BLOCK = 2**15  # points at a time: what is worked out of them stays in the processor's cache
_UNKNOWN_THICKNESS = 0.1  # m across an opening whose wall is not known


@dataclass(frozen=True)
class Labels:
    """What points (n,) lie on.

    Attributes
    ----------
    classes : of `PointClass`, (n,) uint8.
    walls : number of the wall, (n,) uint16: the first of `PlanLookup.walls` is 1; 0 where the point is on none.
    rooms : number of the room it is in, likewise among `PlanLookup.rooms`.
    """

    classes: NDArray[np.uint8]
    walls: NDArray[np.uint16]
    rooms: NDArray[np.uint16]


class PlanLookup:
    """Tells points by a plan.

    A point on a wall, a door, a window or a column is within `tolerance` of its body, at a height where it stands; one
    of the floor within `tolerance` of its room's height, and one of the ceiling that near to its own or above it. What
    else is inside is clutter. A wall goes up to the highest ceiling beside it. Wall faces that belong to no wall count
    as walls of their own. A storey takes the points from halfway between its floor and the ceiling below to halfway
    between its ceiling and the floor above, and what it knows nothing of is asked of its neighbours: halls go through
    storeys.

    Parameters
    ----------
    plan : what `asbuilt plan` made of the cloud.
    tolerance : m. When it grows, less along walls is clutter, and more clutter is wall.

    Attributes
    ----------
    walls, rooms : ids of the walls (and faces) and of the rooms; a label n means the n-th of them, counted from 1.
    """

    def __init__(self, plan: FloorPlan, tolerance: float = TOLERANCE) -> None:
        if not 0.0 < tolerance <= 1.0:
            raise ParameterError(f"tolerance is {tolerance:g} m, expected more than 0 and at most 1")
        self.walls = tuple(wall.id for storey in plan for wall in _walls(storey))
        self.rooms = tuple(room.id for storey in plan for room in storey.rooms)
        for what, names in (("walls", self.walls), ("rooms", self.rooms)):
            if len(names) >= 2**16:
                raise ParameterError(f"the plan has {len(names)} {what}, expected less than 65,536")
        self._splits = np.array([_split(a, b) for a, b in zip(plan.storeys, plan.storeys[1:], strict=False)])
        tops = [*self._splits, *(storey.ceiling + _ABOVE for storey in plan.storeys[-1:])]
        self._known = _Known()
        self._storeys = []
        walls = rooms = 0
        for storey, top in zip(plan, tops, strict=True):
            self._storeys.append(_StoreyTable(storey, float(top), tolerance, walls, rooms, self._known))
            walls, rooms = walls + len(_walls(storey)), rooms + len(storey.rooms)
        self._labels = np.array(list(self._known), dtype=np.int64).reshape(-1, 3)

    def labels(self, x: FloatArray, y: FloatArray, z: FloatArray) -> Labels:
        """The labels of points, given their coordinates (n,), m, in the plan's frame."""
        found = np.zeros(len(x), dtype=np.int64)
        for start in range(0, len(x), _BLOCK):
            block = slice(start, start + _BLOCK)
            found[block] = self._block(x[block], y[block], z[block])
        classes, walls, rooms = self._labels.T
        return Labels(
            classes.astype(np.uint8).take(found),
            walls.astype(np.uint16).take(found),
            rooms.astype(np.uint16).take(found),
        )

    def _block(self, x: FloatArray, y: FloatArray, z: FloatArray) -> IntArray:
        found: IntArray = np.zeros(len(x), dtype=np.int64)
        level = np.zeros(len(x), dtype=np.int64)
        for split in self._splits:
            level += z >= split
        for step in (0, -1, 1):
            for number, storey in enumerate(self._storeys):
                mine = np.flatnonzero((found == 0) & (level + step == number))
                if len(mine) == len(x):
                    found = storey.at(x, y, z)
                elif len(mine):
                    found[mine] = storey.at(x[mine], y[mine], z[mine])
        return found


class _Known:
    """Gives each different label (class, wall, room) a number; 0 is outside."""

    def __init__(self) -> None:
        self._numbers = {(int(PointClass.OUTSIDE), 0, 0): 0}

    def __iter__(self) -> Iterator[tuple[int, int, int]]:
        return iter(self._numbers)

    def number(self, kind: PointClass, wall: int, room: int) -> int:
        label = (int(kind), 0, 0) if kind is PointClass.OUTSIDE else (int(kind), wall, room)
        return self._numbers.setdefault(label, len(self._numbers))


class _StoreyTable:
    """One storey's cells, and for each of their regions the labels from bottom to top."""

    def __init__(self, storey: Storey, top: float, tolerance: float, walls: int, rooms: int, known: _Known) -> None:
        self._storey, self._top, self._tolerance, self._known = storey, top, tolerance, known
        self._first_room = rooms
        elements = _elements(storey)
        self._elements = [element for element, _ in elements]
        self._wall_numbers = _wall_numbers(storey, self._elements, walls)
        self._areas = [shapely.Polygon(room.ring, room.holes) for room in storey.rooms]
        shapes = [shape for _, shape in elements]
        self._raster, regions = _rasterise(elements, _grounds(storey, self._areas), tolerance)
        beside = _beside(shapes, self._areas, tolerance)
        stacks = [self._stack(element, ground, beside) for element, ground in regions]
        heights = [z for stack in stacks for z, _ in stack]
        self._z0 = min(heights, default=0.0) - 2 * _STEP
        span = max(heights, default=0.0) - self._z0 + 2 * _STEP
        self._step = max(_STEP, span / 2**15)
        self._rows = int(span / self._step) + 2
        table = np.zeros((len(stacks), self._rows), dtype=np.int64)
        for line, stack in zip(table, stacks, strict=True):
            for z, label in stack:
                line[round((z - self._z0) / self._step) :] = label
        self._table = table.astype(np.min_scalar_type(int(table.max(initial=0)))).ravel()

    def at(self, x: FloatArray, y: FloatArray, z: FloatArray) -> IntArray:
        """Number of the label of each point (n,)."""
        row = np.clip((z - self._z0) / self._step, 0, self._rows - 1).astype(np.int64)
        labels: IntArray = self._table.take(self._raster.at(x, y).astype(np.int64) * self._rows + row)
        return labels

    def _stack(self, element: int, ground: int, beside: list[list[int]]) -> list[tuple[float, int]]:
        """Labels from bottom to top, each with the z (m) at which it starts, of an element and a ground (0: none)."""
        rooms = self._storey.rooms
        here = [rooms[ground - 1]] if 0 < ground <= len(rooms) else []
        room = self._first_room + ground if here else 0
        below = room_layers(Levels.of(self._storey, self._top, here), self._tolerance) if ground else []
        # between the faces of a wall there is no floor; only where no room is known, the outline stands for one
        stands = bool(here) or (ground > 0 and not rooms)
        over: list[Layer] = []
        if element:
            around = here or [rooms[i] for i in beside[element - 1]]
            of = self._elements[element - 1]
            levels = Levels.of(self._storey, self._top, around)
            if isinstance(of, Wall | WallFace):
                levels = Levels.of(self._storey, self._top, [rooms[i] for i in beside[element - 1]])
            over = element_layers(of, levels, self._tolerance)
        stack = []
        for z in sorted({start for start, *_ in (*below, *over)}):
            kind, is_wall = _layer_at(below, z)
            if not (stands and kind in (PointClass.FLOOR, PointClass.CEILING)):
                above, above_is_wall = _layer_at(over, z)
                if above is not PointClass.OUTSIDE:
                    kind, is_wall = above, above_is_wall
            wall = self._wall_numbers[element - 1] if element and is_wall else 0
            stack.append((z, self._known.number(kind, wall, room)))
        return stack


def _layer_at(layers: Sequence[Layer], z: float) -> tuple[PointClass, bool]:
    """The class at a height, and whether it belongs to the wall: of the last layer that starts there or below."""
    started = [(kind, is_wall) for start, kind, is_wall in layers if start <= z]
    return started[-1] if started else (PointClass.OUTSIDE, False)


def _split(below: Storey, above: Storey) -> float:
    """Height (z, m) at which one storey's points end and the next one's begin."""
    return (below.ceiling + above.floor) / 2 if below.ceiling < above.floor else above.floor - TOLERANCE


def _walls(storey: Storey) -> tuple[Wall | WallFace, ...]:
    """The walls of a storey, and its faces that belong to none."""
    paired = {face for wall in storey.walls for face in wall.faces}
    return (*storey.walls, *(face for face in storey.wall_faces if not face.id or face.id not in paired))


def _elements(storey: Storey) -> list[tuple[Element, shapely.Geometry]]:
    """What stands on a storey and where, in the order in which it is drawn: the later covers the earlier."""
    drawn: list[tuple[Element, shapely.Geometry]] = [(stair, shapely.Polygon(stair.ring)) for stair in storey.stairs]
    drawn += [(column, shapely.Polygon(column.ring)) for column in storey.columns]
    drawn += [(wall, _body(wall)) for wall in _walls(storey)]
    walls = {wall.id: wall for wall in storey.walls if wall.id}
    openings: tuple[Opening, ...] = (*storey.doors, *storey.windows)
    return drawn + [(opening, _passage(opening, walls.get(opening.wall or ""))) for opening in openings]


def _body(wall: Wall | WallFace) -> shapely.Geometry:
    centreline = shapely.LineString([wall.start, wall.end])
    if isinstance(wall, WallFace):
        return centreline
    return shapely.Polygon(wall.outline) if wall.outline else centreline


def _passage(opening: Opening, wall: Wall | None) -> shapely.Geometry:
    """From jamb to jamb and through the wall, which may be curved."""
    line = shapely.LineString([opening.start, opening.end])
    across = _UNKNOWN_THICKNESS / 2
    if wall is not None:
        centreline = shapely.LineString([wall.start, wall.end])
        across = wall.drawn_thickness / 2 + shapely.distance(centreline, shapely.centroid(line))
    return line.buffer(across + TOLERANCE, cap_style="flat")


def _wall_numbers(storey: Storey, elements: Sequence[Element], before: int) -> list[int]:
    """For each element the number of its wall, counted from 1 over all storeys; 0 without one."""
    numbers = {id(wall): before + i for i, wall in enumerate(_walls(storey), 1)}
    by_name = {wall.id: before + i for i, wall in enumerate(storey.walls, 1) if wall.id}
    return [
        by_name.get(element.wall or "", 0) if isinstance(element, Opening) else numbers.get(id(element), 0)
        for element in elements
    ]


def _beside(shapes: Sequence[shapely.Geometry], areas: Sequence[shapely.Polygon], tolerance: float) -> list[list[int]]:
    """For each shape the rooms that it touches."""
    tree = shapely.STRtree(areas)
    return [sorted(tree.query(shape, predicate="dwithin", distance=tolerance).tolist()) for shape in shapes]


def _grounds(storey: Storey, areas: Sequence[shapely.Polygon]) -> list[tuple[int, shapely.Geometry]]:
    """The areas that are inside, numbered: the rooms from 1 on; last the storey's outline, below them all."""
    if storey.outline:
        whole = shapely.Polygon(storey.outline)
    else:
        ends = [point for wall in _walls(storey) for point in (wall.start, wall.end)]
        whole = shapely.convex_hull(shapely.MultiPoint(ends)) if not areas and ends else shapely.Polygon()
    return [(len(areas) + 1, whole), *enumerate(areas, 1)]


def _rasterise(
    elements: Sequence[tuple[Element, shapely.Geometry]],
    grounds: Sequence[tuple[int, shapely.Geometry]],
    tolerance: float,
) -> tuple[Raster, list[tuple[int, int]]]:
    """The cells of a storey, and for each region the number of its element and of its ground, 0 for none."""
    shapes = [shape for _, shape in elements]
    frame = Frame.around(
        [shape for shape in (*shapes, *(area for _, area in grounds)) if not shape.is_empty], tolerance
    )
    boxes = shapely.STRtree(frame.boxes())
    near = [np.sort(boxes.query(shape, predicate="dwithin", distance=tolerance)) for shape in shapes]
    edges = [np.sort(boxes.query(shapely.boundary(area), predicate="intersects")) for _, area in grounds]
    mixed = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *near, *edges]))
    slot = np.full(frame.columns * frame.rows, -1, dtype=np.int64)
    slot[mixed] = np.arange(len(mixed))

    whole = np.zeros(len(slot), dtype=np.int64)  # the ground of tiles that are all alike
    ground = np.zeros((len(mixed), frame.cells), dtype=np.int32)
    for (number, area), tiles in zip(grounds, edges, strict=True):
        inside = boxes.query(area, predicate="contains_properly")
        whole[inside] = number
        ground[slot[inside[slot[inside] >= 0]]] = number
        _paint(ground, slot[tiles], shapely.contains_xy(area, *frame.centres(tiles)), number)

    element = np.zeros_like(ground)
    nearest = np.full(ground.shape, np.inf, dtype=np.float32)
    for number, ((of, shape), tiles) in enumerate(zip(elements, near, strict=True), 1):
        x, y = frame.centres(tiles)
        if isinstance(of, Opening | Stair):
            _paint(element, slot[tiles], shapely.contains_xy(shape, x, y), number)
        else:
            distance = distances(shape, x, y).astype(np.float32)
            closest = (distance <= tolerance) & (distance < nearest[slot[tiles]])
            _paint(element, slot[tiles], closest, number)
            nearest[slot[tiles]] = np.where(closest, distance, nearest[slot[tiles]])

    several = len(grounds) + 1
    pairs = element.astype(np.int64) * several + ground
    present = np.zeros((len(elements) + 1) * several, dtype=np.bool_)
    present[0] = True
    present[pairs.ravel()] = True
    present[whole] = True
    region = np.cumsum(present) - 1
    numbered = [divmod(int(pair), several) for pair in np.flatnonzero(present)]
    return Raster(frame, mixed, region[pairs], region[whole]), numbered


def _paint(cells: NDArray[np.int32], slots: IntArray, where: NDArray[np.bool_], number: int) -> None:
    cells[slots] = np.where(where, number, cells[slots])
