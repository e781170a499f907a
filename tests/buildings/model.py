"""What a building is made of before anything is scanned: storeys, rooms, openings. Lengths in metres, z up."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from shapely import MultiPolygon, Point, Polygon
from shapely.geometry.polygon import orient

Pair = tuple[float, float]


@dataclass
class Room:
    """A clear room between finished walls; heights are above the storey's floor. `ceiling` is None where it is open."""

    polygon: Polygon
    kind: str = "room"
    ceiling: float | None = 2.6
    step: float = 0.0


@dataclass
class Opening:
    """A hole through a wall: where it is cut (`box`), its reveals, and its heights above the storey's floor.

    `kind` is "door", "cased" (no leaf), "window" or "french" (a window down to the floor). `rooms` are indices, -1 the
    outside.
    """

    kind: str
    box: Polygon
    passage: Polygon
    jambs: list[tuple[Pair, Pair]]
    line: tuple[Pair, Pair]
    width: float
    sill: float
    head: float
    rooms: tuple[int, int]
    closed: bool = False

    @property
    def to_floor(self) -> bool:
        """Whether one could walk through, so that nothing may stand before it."""
        return self.kind != "window"

    @property
    def is_doorway(self) -> bool:
        """Whether faces stop here, as the cases' do at doors alone."""
        return self.kind in ("door", "cased")


@dataclass(frozen=True)
class Style:
    """Ranges (m) and chances (0..1) that make the difference between one kind of building and another.

    `partitions` are the thicknesses to choose from. `cased` and `tall` are chances of a doorway without leaf and of one
    up to the ceiling, `niche`, `pilaster` and `closet` of one in a room, `furnished` scales the number of pieces,
    `outside` is how many scans go around the house.
    """

    partitions: tuple[float, ...] = (0.06, 0.1, 0.125, 0.24)
    head: tuple[float, float] = (1.95, 2.2)
    door: tuple[float, float] = (0.7, 1.0)
    cased: float = 0.2
    tall: float = 0.1
    closed: float = 0.3
    sill: tuple[float, float] = (0.4, 1.1)
    lintel: tuple[float, float] = (2.0, 2.4)
    window: tuple[float, float] = (0.6, 2.0)
    french: float = 0.2
    ceilings: tuple[float, ...] = (2.5, 2.5, 2.5, 2.35)
    open_ceiling: float = 0.0
    step: float = 0.0
    oblique: float = 0.1
    bent: float = 0.15
    round_corner: float = 0.0
    niche: float = 0.1
    pilaster: float = 0.2
    closet: float = 0.2
    partition: float = 0.1
    beam: float = 0.1
    column: float = 0.0
    mirror: float = 0.1
    furnished: float = 1.0
    outside: int = 0
    kinds: tuple[str, ...] = ("living", "bedroom", "kitchen", "bath", "study")


@dataclass
class Storey:
    """One level: `floor` is its z, `height` reaches to the slab. `arcs` are (x, y, radius) of its round faces."""

    floor: float
    height: float
    footprint: Polygon
    rooms: list[Room]
    arcs: list[tuple[float, float, float]] = field(default_factory=list)
    openings: list[Opening] = field(default_factory=list)
    stairwell: Polygon | None = None
    columns: list[tuple[Polygon, bool]] = field(default_factory=list)


def tidy(polygon: Polygon) -> Polygon:
    """The polygon without repeated or collinear vertices, its ring counter-clockwise (inside on the left)."""

    def ring(coordinates: object) -> np.ndarray:
        points = np.asarray(coordinates)[:-1, :2]
        for _ in range(2):
            keep = np.hypot(*(points - np.roll(points, 1, axis=0)).T) > 1e-4
            points = points[keep]
            before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
            size = np.hypot(*before.T) * np.hypot(*after.T)
            turn = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]) / size
            points = points[turn > 1e-5]
        return points

    return orient(Polygon(ring(polygon.exterior.coords), [ring(hole.coords) for hole in polygon.interiors]))


def pieces(geometry: object) -> list[Polygon]:
    """The polygons of a polygon or a collection, tidied, crumbs left out."""
    parts = geometry.geoms if hasattr(geometry, "geoms") else [geometry]
    return [tidy(part) for part in parts if isinstance(part, Polygon) and part.area > 0.02]


def edges(polygon: Polygon) -> np.ndarray:
    """All edges (n, 4) of a polygon and its holes, the polygon on their left."""
    rings = [np.asarray(ring.coords)[:, :2] for ring in (polygon.exterior, *polygon.interiors)]
    return np.concatenate([np.hstack([ring[:-1], ring[1:]]) for ring in rings])


def quad(centre: Pair, along: Pair, width: float, back: float, front: float) -> Polygon:
    """A rectangle around `centre`, `width` along the unit vector `along`, from -back to front along its left normal."""
    c, u = np.array(centre), np.array(along)
    n = np.array([-u[1], u[0]])
    left, right = c - u * width / 2, c + u * width / 2
    return Polygon([left - n * back, right - n * back, right + n * front, left + n * front])


def disc(x: float, y: float, radius: float, phase: float = 0.0) -> Polygon:
    """A circle in chords: as fine as 2.5 degrees, but no chord below 0.13 m, which the scoring would leave out."""
    step = min(max(np.radians(2.5), 0.13 / radius), np.radians(12.0))
    angle = phase + np.linspace(0, 2 * np.pi, int(2 * np.pi / step), endpoint=False)
    return Polygon(np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)]))


def on_arc(storey: Storey, edge: np.ndarray) -> tuple[float, float, float] | None:
    """The arc that an edge is a chord of, also where it was cut; None for a straight face."""
    length = np.hypot(edge[2] - edge[0], edge[3] - edge[1])
    for x, y, radius in storey.arcs:
        chord = 2 * radius * np.sin(np.radians(6.1))
        sag = radius - np.hypot([edge[0] - x, edge[2] - x], [edge[1] - y, edge[3] - y])
        if length < max(chord, 0.3) and sag.min() > -0.002 and sag.max() < 0.006:
            return x, y, radius
    return None


def inside(polygon: Polygon | MultiPolygon, x: float, y: float) -> bool:
    """Whether a point lies in a polygon."""
    return bool(polygon.contains(Point(x, y)))
