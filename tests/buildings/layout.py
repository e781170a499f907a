"""Cut a footprint into rooms: each cut takes a wall of its own thickness out of one room and leaves two."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from shapely import LineString, Point, Polygon, affinity

from buildings.model import disc, edges, pieces, tidy

FAR = 100.0


def inset(polygon: Polygon, thickness: list[float] | float) -> Polygon:
    """Move each edge of a ring inwards by its thickness; corners stay where the moved edges meet."""
    ring = edges(tidy(polygon))
    along = ring[:, 2:] - ring[:, :2]
    along /= np.hypot(*along.T)[:, None]
    normal = np.column_stack([-along[:, 1], along[:, 0]])
    moved = ring[:, :2] + normal * np.broadcast_to(np.asarray(thickness, dtype=float), len(ring))[:, None]
    corners = []
    for i in range(len(ring)):
        (p, u), (q, v) = (moved[i - 1], along[i - 1]), (moved[i], along[i])
        cross = u[0] * v[1] - u[1] * v[0]
        corners.append(p + u * (((q - p)[0] * v[1] - (q - p)[1] * v[0]) / cross))
    return tidy(Polygon(corners))


def straight_wall(x: float, y: float, angle: float, thickness: float) -> Polygon:
    """A wall without end through a point."""
    u = np.array([np.cos(angle), np.sin(angle)])
    return LineString([(x, y) - FAR * u, (x, y) + FAR * u]).buffer(thickness / 2, cap_style="flat")


def bent_wall(x: float, y: float, angle: float, turn: float, thickness: float) -> Polygon:
    """A wall that turns at a point: what it cuts off is L-shaped on one side."""
    u, v = (np.array([np.cos(a), np.sin(a)]) for a in (angle, angle + turn))
    line = LineString([(x, y) + FAR * u, (x, y), (x, y) + FAR * v])
    return line.buffer(thickness / 2, cap_style="flat", join_style="mitre", mitre_limit=20)


def round_wall(x: float, y: float, radius: float, thickness: float) -> Polygon:
    """A ring wall, `radius` that of its inner face."""
    return disc(x, y, radius + thickness).difference(disc(x, y, radius))


def cut(room: Polygon, wall: Polygon, least_area: float = 3.0, least_width: float = 1.3) -> list[Polygon]:
    """The rooms that a wall leaves, or the room alone if one of them would be of no use."""
    parts = pieces(room.difference(wall))
    for part in parts:
        core = part.buffer(-least_width / 2)
        if (
            part.area < least_area
            or core.is_empty
            or core.geom_type != "Polygon"
            or min_edge(part) < 0.12
            or sharpest(part) < 40
        ):
            return [room]
    return parts if len(parts) > 1 else [room]


def min_edge(polygon: Polygon) -> float:
    """The shortest edge between two real corners: slivers make no building, but a cut chord of an arc may be short."""
    shortest = np.inf
    for ring in (polygon.exterior, *polygon.interiors):
        points = np.asarray(ring.coords)[:-1]
        step = np.roll(points, -1, axis=0) - points
        length, angle = np.hypot(*step.T), np.arctan2(step[:, 1], step[:, 0])
        turn = np.abs((angle - np.roll(angle, 1) + np.pi) % (2 * np.pi) - np.pi)
        real = (turn > 0.26) & (np.roll(turn, -1) > 0.26)
        shortest = min(shortest, length[real].min(initial=np.inf))
    return float(shortest)


def sharpest(polygon: Polygon) -> float:
    """The sharpest corner of the outer ring, degrees."""
    points = np.asarray(polygon.exterior.coords)[:-1]
    a, b = np.roll(points, 1, axis=0) - points, np.roll(points, -1, axis=0) - points
    turn = np.arctan2(b[:, 0] * a[:, 1] - b[:, 1] * a[:, 0], (a * b).sum(axis=1))
    return float(np.degrees(turn % (2 * np.pi)).min())


def main_direction(room: Polygon) -> float:
    """Angle of the room's longest edge."""
    ring = edges(room)
    x1, y1, x2, y2 = ring[np.argmax(np.hypot(ring[:, 2] - ring[:, 0], ring[:, 3] - ring[:, 1]))]
    return float(np.arctan2(y2 - y1, x2 - x1))


def divide(
    rng: Generator,
    room: Polygon,
    count: int,
    thicknesses: tuple[float, ...],
    arcs: list[tuple[float, float, float]],
    *,
    oblique: float = 0.0,
    bent: float = 0.15,
    round_corner: float = 0.0,
) -> list[Polygon]:
    """Cut until there are `count` rooms, the largest first; the last three are chances of such a cut."""
    rooms = [room]
    for _ in range(12 * count):
        if len(rooms) >= count:
            break
        rooms.sort(key=lambda part: -part.area)
        index = 0 if rng.random() < 0.8 else int(rng.integers(len(rooms)))
        target = rooms.pop(index)
        thickness = float(rng.choice(thicknesses))
        kind = rng.random()
        ring: tuple[float, float, float] | None = None
        if kind < round_corner:
            x, y = np.asarray(target.exterior.coords)[rng.integers(len(target.exterior.coords))]
            radius = rng.uniform(0.3, 0.55) * np.sqrt(target.area)
            ring, wall = (x, y, radius), round_wall(x, y, radius, thickness)
        else:
            wall = _crossing_wall(rng, target, thickness, kind < round_corner + bent, oblique)
        parts = cut(target, wall)
        if len(parts) > 1 and ring is not None:
            arcs += [ring, (ring[0], ring[1], ring[2] + thickness)]
        rooms += parts
    return rooms


def _crossing_wall(rng: Generator, room: Polygon, thickness: float, bent: bool, oblique: float) -> Polygon:
    angle = main_direction(room)
    turned = affinity.rotate(room, -angle, origin=(0, 0), use_radians=True)
    x0, y0, x1, y1 = turned.bounds
    u, v = rng.uniform(0.3, 0.7, 2)
    x, y = affinity.rotate(
        Point(x0 + u * (x1 - x0), y0 + v * (y1 - y0)), angle, origin=(0, 0), use_radians=True
    ).coords[0]
    skew = float(rng.uniform(-0.45, 0.45)) if rng.random() < oblique else 0.0
    if bent:
        quarter = int(rng.integers(4)) * np.pi / 2
        return bent_wall(x, y, angle + quarter + skew, np.pi / 2 + (rng.uniform(-0.3, 0.5) if skew else 0.0), thickness)
    across = np.pi / 2 if (x1 - x0) * rng.uniform(0.75, 1.3) > y1 - y0 else 0.0
    return straight_wall(x, y, angle + across + skew, thickness)
