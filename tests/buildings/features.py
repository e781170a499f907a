"""What makes rooms other than plain polygons: niches, pilasters, partitions that stand free, closets and bays."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from shapely import Polygon, unary_union

from buildings.layout import min_edge
from buildings.model import Room, Storey, Style, edges, pieces, quad, tidy


def decorate(rng: Generator, storey: Storey, style: Style) -> None:
    """Add features to the storey's rooms by the chances of the style."""
    for index in range(len(storey.rooms)):
        room = storey.rooms[index]
        area = room.polygon.area
        if room.kind == "stairs":
            continue
        if rng.random() < style.closet and area > 9 and room.kind != "corridor":
            _closet(rng, storey, index, float(rng.choice(style.partitions)))
        if rng.random() < style.niche:
            _niche(rng, storey, index)
        for _ in range(int(rng.poisson(style.pilaster))):
            _pilaster(rng, storey, index)
        if rng.random() < style.partition and area > 12:
            _partition(rng, storey, index)


def _change(storey: Storey, index: int, polygon: object, *, keep: float = 0.6) -> bool:
    """Give a room another polygon if that is still a sound one."""
    parts = pieces(polygon)
    if len(parts) != 1 or min_edge(parts[0]) < 0.08 or parts[0].area < keep * storey.rooms[index].polygon.area:
        return False
    if parts[0].buffer(-0.3).geom_type != "Polygon":
        return False
    storey.rooms[index].polygon = parts[0]
    return True


def _long_edge(rng: Generator, room: Polygon, least: float) -> tuple[np.ndarray, np.ndarray, float] | None:
    """A random edge of at least that length: start, direction, length; the room is on its left."""
    ring = edges(room)
    length = np.hypot(ring[:, 2] - ring[:, 0], ring[:, 3] - ring[:, 1])
    fit = np.flatnonzero(length >= least)
    if not len(fit):
        return None
    i = rng.choice(fit)
    return ring[i, :2], (ring[i, 2:] - ring[i, :2]) / length[i], float(length[i])


def _niche(rng: Generator, storey: Storey, index: int) -> None:
    """A recess in a wall that is thick enough, from floor to ceiling."""
    others = unary_union([room.polygon for i, room in enumerate(storey.rooms) if i != index])
    for _ in range(12):
        width, depth = float(rng.uniform(0.5, 1.6)), float(rng.uniform(0.12, 0.35))
        edge = _long_edge(rng, storey.rooms[index].polygon, width + 0.8)
        if edge is None:
            return
        start, along, length = edge
        centre = start + along * rng.uniform(width / 2 + 0.3, length - width / 2 - 0.3)
        recess = quad(tuple(centre), tuple(along), width, depth, 0.001)
        rest = recess.buffer(0.1, join_style="mitre")
        if others.intersects(rest) or not storey.footprint.buffer(-0.1).contains(recess):
            continue
        if _change(storey, index, storey.rooms[index].polygon.union(recess)):
            return


def _pilaster(rng: Generator, storey: Storey, index: int) -> None:
    """A pier or a chimney breast that stands out of a wall."""
    width, depth = float(rng.uniform(0.25, 0.7)), float(rng.uniform(0.1, 0.4))
    edge = _long_edge(rng, storey.rooms[index].polygon, width + 1.0)
    if edge is None:
        return
    start, along, length = edge
    centre = start + along * rng.uniform(width / 2 + 0.4, length - width / 2 - 0.4)
    _change(
        storey, index, storey.rooms[index].polygon.difference(quad(tuple(centre), tuple(along), width, 0.001, depth))
    )


def _partition(rng: Generator, storey: Storey, index: int) -> None:
    """A full-height partition that stands free in the room, or a stub from one wall."""
    room = storey.rooms[index].polygon
    length, thickness = float(rng.uniform(1.0, 2.4)), float(rng.uniform(0.06, 0.16))
    if rng.random() < 0.5:
        edge = _long_edge(rng, room, 2.5)
        if edge is None:
            return
        start, along, size = edge
        centre = start + along * rng.uniform(1.0, size - 1.0)
        stub = quad(tuple(centre), tuple(along), thickness, 0.001, min(length, 1.5))
        if stub.difference(room.buffer(0.01)).area < 1e-6 and _roomy(room, stub):
            _change(storey, index, room.difference(stub))
        return
    x0, y0, x1, y1 = room.bounds
    for _ in range(20):
        angle = rng.uniform(0, np.pi)
        centre = (rng.uniform(x0, x1), rng.uniform(y0, y1))
        block = quad(centre, (np.cos(angle), np.sin(angle)), length, thickness / 2, thickness / 2)
        if room.buffer(-0.7).contains(block):
            _change(storey, index, room.difference(block))
            return


def _roomy(room: Polygon, block: Polygon) -> bool:
    """Whether people still pass: what the block leaves of the room's core hangs together."""
    return room.difference(block).buffer(-0.35).geom_type == "Polygon"


def _closet(rng: Generator, storey: Storey, index: int, thickness: float) -> None:
    """Partition off a corner of a room."""
    room = storey.rooms[index]
    ring = edges(room.polygon)
    for i in rng.permutation(len(ring)):
        before, here = ring[i - 1], ring[i]
        u, v = here[2:] - here[:2], before[:2] - before[2:]
        long_u, long_v = np.hypot(*u), np.hypot(*v)
        u, v = u / long_u, v / long_v
        width, depth = rng.uniform(0.9, 2.0), rng.uniform(0.6, 1.1)
        square = abs(u @ v) < 0.05 and u[0] * v[1] - u[1] * v[0] > 0
        if not square or np.any(before[2:] != here[:2]) or long_u < width + 1.2 or long_v < depth + 0.9:
            continue
        corner = here[:2]
        inner = Polygon([corner, corner + u * width, corner + u * width + v * depth, corner + v * depth])
        shell = inner.buffer(thickness, join_style="mitre")
        closet = tidy(inner.intersection(room.polygon))
        if closet.area > 0.95 * inner.area and _change(storey, index, room.polygon.difference(shell)):
            storey.rooms.append(Room(closet, "closet", room.ceiling, room.step))
            return


def add_bay(rng: Generator, storey: Storey, shell: float, *, curved: bool) -> bool:
    """Push a bay out through the outer wall of one of the rooms, polygonal or round."""
    outline = np.asarray(storey.footprint.exterior.coords)
    for _ in range(40):
        i = int(rng.integers(len(outline) - 1))
        start, along = outline[i], outline[i + 1] - outline[i]
        length = float(np.hypot(*along))
        width = float(rng.uniform(1.8, 3.0))
        if length < width + 2.2:
            continue
        along /= length
        out = np.array([along[1], -along[0]])
        centre = start + along * rng.uniform(width / 2 + 1, length - width / 2 - 1)
        index = _room_behind(storey, centre - out * (shell + 0.1), along, width + 0.8)
        if index is None:
            continue
        inner, outer, arcs = _bay(rng, centre, along, out, width, shell, curved)
        if outer.difference(storey.footprint).area > outer.area * 0.98:
            continue
        before = storey.footprint
        if _change(storey, index, storey.rooms[index].polygon.union(inner)):
            storey.footprint = tidy(before.union(outer))
            storey.arcs += arcs
            return True
    return False


def _room_behind(storey: Storey, point: np.ndarray, along: np.ndarray, width: float) -> int | None:
    strip = quad(tuple(point), tuple(along), width, 0.02, 0.02)
    return next((i for i, room in enumerate(storey.rooms) if room.polygon.contains(strip)), None)


def _bay(
    rng: Generator, centre: np.ndarray, along: np.ndarray, out: np.ndarray, width: float, shell: float, curved: bool
) -> tuple[Polygon, Polygon, list[tuple[float, float, float]]]:
    """Inside and outside of a bay, and the arcs of a round one, whose faces are chords of 0.13 m or more."""
    if not curved:
        depth, slant = float(rng.uniform(0.5, 1.0)), float(rng.uniform(0.2, 0.5))
        left, right = centre - along * width / 2, centre + along * width / 2
        foot = out * -(shell + 0.001)
        inner = Polygon(
            [
                left + foot,
                right + foot,
                right,
                right - along * slant + out * depth,
                left + along * slant + out * depth,
                left,
            ]
        )
        outer = Polygon([left, right, right - along * slant + out * depth, left + along * slant + out * depth])
        return inner, outer.buffer(shell, join_style="mitre"), []
    radius = width / 2
    base = float(np.arctan2(*-along[::-1]))

    def arc(size: float) -> np.ndarray:
        turn = base + np.linspace(0, np.pi, max(12, int(np.pi * size / 0.15)) + 1)
        return centre + size * np.column_stack([np.cos(turn), np.sin(turn)])

    if np.dot(arc(radius)[len(arc(radius)) // 2] - centre, out) < 0:
        base += np.pi
    foot = out * -(shell + 0.001)
    ends = arc(radius)
    inner = Polygon([*ends, ends[-1] + foot, ends[0] + foot])
    x, y = centre
    return inner, Polygon([*arc(radius + shell)]), [(x, y, radius), (x, y, radius + shell)]
