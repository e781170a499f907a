"""A scene for the ray caster: vertical quads, level polygons and upright cylinders.

Anything that stands in a building is made of these three; `add_storey` makes the walls, floors and ceilings.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from shapely import LineString, Polygon, box, unary_union

from buildings.model import Opening, Pair, Storey, edges, on_arc

Array = NDArray[np.float64]
NO_ARC = (0.0, 0.0, 0.0)


class Scene:
    """Surfaces, collected in lists and frozen into arrays by `freeze`."""

    def __init__(self) -> None:
        self.quads: list[tuple[float, ...]] = []
        self.levels: list[tuple[Array, float]] = []
        self.cylinders: list[tuple[float, float, float, float, float]] = []

    def wall(
        self,
        p: Iterable[float],
        q: Iterable[float],
        z0: float,
        z1: float,
        *,
        solid: float = 1.0,
        arc: tuple[float, float, float] | None = None,
        mirror: bool = False,
    ) -> None:
        """A vertical quad from p to q; `solid` is the chance that a ray stops at it; hits on an arc are put on it."""
        if z1 - z0 > 1e-4:
            self.quads.append((*p, *q, z0, z1, solid, *(arc or NO_ARC), float(mirror)))

    def level(self, polygon: Polygon, z: float) -> None:
        """A horizontal polygon."""
        for part in getattr(polygon, "geoms", [polygon]):
            if isinstance(part, Polygon) and part.area > 1e-4:
                self.levels.append((edges(part), z))

    def block(self, footprint: Polygon, z0: float, z1: float, *, solid: float = 1.0) -> None:
        """An upright prism with top and bottom."""
        for edge in edges(footprint):
            self.wall(edge[:2], edge[2:], z0, z1, solid=solid)
        self.level(footprint, z1)
        self.level(footprint, z0)

    def cylinder(self, x: float, y: float, radius: float, z0: float, z1: float) -> None:
        """An upright cylinder with top and bottom."""
        self.cylinders.append((x, y, radius, z0, z1))
        turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
        disc = Polygon(np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn)]))
        self.level(disc, z1)
        self.level(disc, z0)

    def add_storey(self, storey: Storey, above: Storey | None) -> None:
        """Faces, reveals, floors and ceilings of a storey; a stairwell leads up to the storey above."""
        floor = storey.floor
        up = above.stairwell if above is not None and above.stairwell is not None else Polygon()
        down = storey.stairwell or Polygon()
        slab = floor + storey.height
        for room in storey.rooms:
            top = slab if room.ceiling is None else floor + room.ceiling
            self._faces(storey, room.polygon, floor + room.step, top)
            self.level(room.polygon.difference(down), floor + room.step)
            if room.ceiling is not None:
                self.level(room.polygon.difference(up), top)
            if not up.is_empty and room.polygon.contains(up.representative_point()):
                for edge in edges(up):
                    self.wall(edge[:2], edge[2:], top, above.floor if above else top)
        self._faces(storey, storey.footprint, floor - 0.3, slab + 0.2)
        for opening in storey.openings:
            self._reveals(storey, opening)
        for footprint, is_round in storey.columns:
            if is_round:
                x0, y0, x1, y1 = footprint.bounds
                self.cylinder((x0 + x1) / 2, (y0 + y1) / 2, (x1 - x0) / 2, floor, slab)
            else:
                self.block(footprint, floor, slab)

    def _faces(self, storey: Storey, polygon: Polygon, bottom: float, top: float) -> None:
        for edge in edges(polygon):
            arc = on_arc(storey, edge)
            for a, b, opening in spans(edge, storey.openings):
                low, high = (
                    (bottom, bottom) if opening is None else (storey.floor + opening.sill, storey.floor + opening.head)
                )
                self.wall(a, b, bottom, min(low, top), arc=arc)
                self.wall(a, b, max(high, bottom), top, arc=arc)

    def _reveals(self, storey: Storey, opening: Opening) -> None:
        bottom, top = storey.floor + opening.sill, storey.floor + opening.head
        for a, b in opening.jambs:
            self.wall(a, b, bottom, top)
        self.level(opening.passage, bottom)
        self.level(opening.passage, top)
        for index in opening.rooms:  # the riser of a step up into the doorway
            if index >= 0 and opening.to_floor:
                room = storey.rooms[index]
                for a, b in _shared(room.polygon, opening.passage):
                    self.wall(a, b, storey.floor + room.step, bottom)

    def surroundings(self, rng: np.random.Generator, storeys: list[Storey], *, street: bool) -> None:
        """Ground outside, and fronts of the houses across the `street` if there is one."""
        ground = storeys[0].floor - 0.25
        whole = unary_union([storey.footprint for storey in storeys])
        x0, y0, x1, y1 = whole.bounds
        self.level(box(x0 - 25, y0 - 25, x1 + 25, y1 + 25).difference(whole), ground)
        for _ in range(3):
            turn = rng.uniform(0, 2 * np.pi)
            out = np.array([np.cos(turn), np.sin(turn)])
            centre = np.array([(x0 + x1) / 2, (y0 + y1) / 2]) + out * (
                np.hypot(x1 - x0, y1 - y0) / 2 + rng.uniform(4, 10)
            )
            along = np.array([-out[1], out[0]]) * rng.uniform(4, 9)
            height = rng.uniform(5, 9) if street else 0.0
            self.wall(centre - along, centre + along, ground, ground + height)

    def freeze(self) -> tuple[Array, Array]:
        """Quads (n, 11): x1, y1, x2, y2, z0, z1, solid, arc x, y, radius, mirror; cylinders (n, 5)."""
        return np.array(self.quads).reshape(-1, 11), np.array(self.cylinders).reshape(-1, 5)


def spans(edge: Array, openings: list[Opening]) -> list[tuple[Pair, Pair, Opening | None]]:
    """Cut an edge where openings go through it: stretches in order, each with its opening or None."""
    start, step = edge[:2], edge[2:] - edge[:2]
    length = float(np.hypot(*step))
    line = LineString([start, edge[2:]])
    cuts: list[tuple[float, float, Opening]] = []
    for opening in openings:
        if opening.box.intersects(line):
            inside = opening.box.intersection(line)
            if inside.geom_type == "LineString" and inside.length > 1e-6:
                at = sorted((np.asarray(inside.coords) - start) @ step / length)
                cuts.append((max(at[0], 0.0), min(at[1], length), opening))
    stretches: list[tuple[float, float, Opening | None]] = []
    last = 0.0
    for low, high, opening in sorted(cuts, key=lambda part: part[0]):
        stretches += [(last, low, None), (low, high, opening)]
        last = high
    stretches.append((last, length, None))
    unit = step / length
    return [(tuple(start + a * unit), tuple(start + b * unit), o) for a, b, o in stretches if b - a > 1e-6]


def _shared(room: Polygon, passage: Polygon) -> list[tuple[Pair, Pair]]:
    """Edges of a passage that lie on a room's boundary."""
    boundary = room.boundary.buffer(1e-4)
    lines = [(tuple(edge[:2]), tuple(edge[2:])) for edge in edges(passage)]
    return [line for line in lines if boundary.contains(LineString(line))]
