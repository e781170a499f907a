"""Doors and windows: a box through a wall, wherever a face of one room has another room or the outside behind it."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from shapely import LineString, MultiLineString, Point, Polygon, box, unary_union
from shapely.ops import linemerge

from buildings.model import Opening, Storey, Style, edges, quad

DEEPEST = 1.0  # m of wall that a door may pass
MARGIN = 0.12  # m of plain wall beside an opening


class Openings:
    """Places openings in the walls of one storey without overlap."""

    def __init__(self, rng: Generator, storey: Storey) -> None:
        self.rng, self.storey = rng, storey
        x0, y0, x1, y1 = storey.footprint.bounds
        self.outside = box(x0 - 9, y0 - 9, x1 + 9, y1 + 9).difference(storey.footprint)
        self.wall = storey.footprint.difference(unary_union([room.polygon for room in storey.rooms]))
        self.taken: list[Polygon] = []

    def between(
        self, first: int, second: int, kind: str, width: float, sill: float, head: float, tries: int = 40
    ) -> Opening | None:
        """Try to open the wall between two rooms (-1 is the outside); the opening is added to the storey if it fits."""
        room = self.storey.rooms[first].polygon
        other = self.outside if second < 0 else self.storey.rooms[second].polygon
        if room.distance(other) > DEEPEST:
            return None
        spots = _spots(room)
        near = [i for i, (x, y, _, _) in enumerate(spots) if other.distance(Point(x, y)) < DEEPEST]
        for i in self.rng.permutation(near)[:tries]:
            opening = self._at(spots[i], room, other, kind, width, sill, head, (first, second))
            if opening is not None:
                self.storey.openings.append(opening)
                return opening
        return None

    def _at(
        self,
        spot: np.ndarray,
        room: Polygon,
        other: Polygon,
        kind: str,
        width: float,
        sill: float,
        head: float,
        rooms: tuple[int, int],
    ) -> Opening | None:
        point, along = spot[:2], spot[2:]
        outward = np.array([along[1], -along[0]])
        ahead = LineString([point, point + DEEPEST * outward]).intersection(other)
        if ahead.is_empty:
            return None
        depth = Point(point).distance(ahead)
        if depth < 0.04:
            return None
        cutter = quad(tuple(point), tuple(along), width, depth + 0.13, 0.13)
        wider = quad(tuple(point), tuple(along), width + 2 * MARGIN, depth + 0.13, 0.13)
        if any(wider.intersects(taken) for taken in self.taken):
            return None
        passage = cutter.intersection(self.wall)
        if passage.geom_type != "Polygon" or cutter.area - passage.area - cutter.intersection(room).area > (
            cutter.intersection(other).area + 1e-6
        ):
            return None
        for side in (room, other):
            piece = wider.intersection(side.boundary)
            piece = linemerge(piece) if isinstance(piece, MultiLineString) else piece
            span = width + 2 * MARGIN
            # a plain stretch of wall, maybe a little curved, and no corner
            if piece.geom_type != "LineString" or not 0.99 * span < piece.length < 1.12 * span:
                return None
            if Point(piece.coords[0]).distance(Point(piece.coords[-1])) < 0.98 * piece.length:
                return None
        corners = np.asarray(cutter.exterior.coords)
        jambs = []
        for a, b in ((corners[0], corners[3]), (corners[1], corners[2])):
            reveal = LineString([a, b]).intersection(self.wall)
            if reveal.geom_type != "LineString" or reveal.length < 0.03:
                return None
            jambs.append(tuple(reveal.coords))
        line = tuple(tuple(np.mean(np.asarray(jamb), axis=0)) for jamb in jambs)
        self.taken.append(wider)
        return Opening(kind, cutter, passage, jambs, line, width, sill, head, rooms)


def _spots(room: Polygon) -> np.ndarray:
    """Places (n, 4) along the faces where an opening might have its middle: x, y and the direction of the face."""
    spots = []
    for x1, y1, x2, y2 in edges(room):
        start, step = np.array([x1, y1]), np.array([x2 - x1, y2 - y1])
        length = np.hypot(*step)
        count = max(1, int(length / 0.2))
        spots += [[*(start + step * (i + 0.5) / count), *(step / length)] for i in range(count)]
    return np.array(spots)


def connect(rng: Generator, places: Openings, style: Style, extra: float = 0.2) -> None:
    """Doors until all rooms hang together, and some more; then windows and a front door by the style."""
    storey = places.storey
    group = list(range(len(storey.rooms)))
    pairs = [(i, j) for i in group for j in group if i < j]
    for i, j in [pairs[k] for k in rng.permutation(len(pairs))]:
        if group[i] == group[j] and rng.random() > extra:
            continue
        if "closet" in (storey.rooms[i].kind, storey.rooms[j].kind) and group[i] == group[j]:
            continue
        opening = _door(rng, places, style, i, j)
        if opening is not None:
            old, new = group[i], group[j]
            group = [new if g == old else g for g in group]
    _door(rng, places, style, int(rng.integers(len(storey.rooms))), -1)
    for i, room in enumerate(storey.rooms):
        if room.kind == "closet":
            continue
        for _ in range(int(rng.integers(1, 2 + int(room.polygon.area > 14) + int(room.polygon.area > 40)))):
            _window(rng, places, style, i)


def _door(rng: Generator, places: Openings, style: Style, i: int, j: int) -> Opening | None:
    rooms = [places.storey.rooms[k] for k in (i, j) if k >= 0]
    step = max(room.step for room in rooms)
    clear = min(places.storey.height - 0.05 if room.ceiling is None else room.ceiling for room in rooms)
    closet = any(room.kind == "closet" for room in rooms)
    kind = "cased" if rng.random() < style.cased and j >= 0 and not closet else "door"
    width = float(rng.uniform(*style.door)) if kind == "door" else float(rng.uniform(0.9, 2.2))
    width = 0.7 if closet else width
    head = clear if rng.random() < style.tall else min(clear, step + float(rng.uniform(*style.head)))
    opening = places.between(i, j, kind, width, step, head)
    if opening is None and width > 0.85:
        opening = places.between(i, j, kind, 0.8, step, head)
    if opening is not None:
        opening.closed = kind == "door" and (j < 0 or rng.random() < style.closed)
    return opening


def _window(rng: Generator, places: Openings, style: Style, i: int) -> None:
    room = places.storey.rooms[i]
    clear = places.storey.height - 0.1 if room.ceiling is None else room.ceiling
    head = min(clear - 0.05, room.step + float(rng.uniform(*style.lintel)))
    french = rng.random() < style.french
    sill = room.step if french else room.step + float(rng.uniform(*style.sill))
    width = float(rng.uniform(*style.window))
    for attempt in (width, 0.6 * width):
        if places.between(i, -1, "french" if french else "window", attempt, sill, head) is not None:
            return
