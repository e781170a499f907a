"""Kinds of building: how the footprint is made and cut, and the style of what goes into it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from shapely import Polygon, affinity, box

from buildings.features import add_bay, decorate
from buildings.layout import cut, divide, inset, round_wall, straight_wall
from buildings.model import Room, Storey, Style, disc, pieces, tidy

FLAT = Style(mirror=0.15)
HOUSE = Style(
    ceilings=(2.45, 2.45, 2.6), bent=0.3, head=(1.98, 2.15), closet=0.4, french=0.35, oblique=0.05, step=0.2, outside=6
)
OFFICE = Style(
    partitions=(0.08, 0.1, 0.15, 0.2),
    head=(2.05, 2.4),
    door=(0.85, 1.1),
    tall=0.35,
    ceilings=(2.7, 2.7, 2.5, 2.4, 3.0),
    window=(1.0, 2.4),
    sill=(0.0, 0.9),
    french=0.1,
    column=0.8,
    partition=0.4,
    pilaster=0.1,
    round_corner=0.1,
    kinds=("office", "office", "meeting", "store"),
)
MUSEUM = Style(
    partitions=(0.3, 0.4, 0.5),
    head=(2.1, 2.4),
    door=(0.9, 1.3),
    cased=0.7,
    tall=0.1,
    ceilings=(3.6, 3.6, 3.2),
    open_ceiling=0.3,
    step=0.45,
    sill=(0.8, 1.2),
    lintel=(2.4, 3.0),
    niche=0.4,
    pilaster=0.6,
    partition=0.5,
    column=0.4,
    oblique=0.3,
    furnished=0.5,
    kinds=("gallery",),
)
OLDTOWN = Style(
    partitions=(0.12, 0.25, 0.4, 0.6),
    head=(1.95, 2.05),
    door=(0.7, 0.9),
    cased=0.15,
    tall=0.0,
    ceilings=(2.3, 2.45, 2.7, 2.9),
    open_ceiling=0.1,
    step=0.3,
    oblique=0.9,
    bent=0.1,
    niche=0.6,
    pilaster=0.5,
    window=(0.6, 1.2),
    sill=(0.5, 1.0),
    beam=0.5,
)


def flat(rng: Generator) -> tuple[list[Storey], Style]:
    """Seven to nine rooms, plasterboard to masonry, off the axes; now and then a quarter-round wall."""
    width, depth = rng.uniform(10, 14), rng.uniform(7.5, 10)
    outer = box(0, 0, width, depth)
    if rng.random() < 0.6:
        outer = outer.difference(box(width * rng.uniform(0.55, 0.7), depth * rng.uniform(0.5, 0.7), 99, 99))
    style = replace(FLAT, round_corner=0.12)
    storey = _storey(rng, outer, float(rng.uniform(0.24, 0.42)), int(rng.integers(6, 9)), style, 0.0, 2.75)
    return [storey], style


def house(rng: Generator) -> tuple[list[Storey], Style]:
    """Two storeys around a stair hall, with bays, closets and L-shaped rooms."""
    width, depth = rng.uniform(9.5, 12), rng.uniform(8, 10)
    outer, shell = box(0, 0, width, depth), float(rng.uniform(0.3, 0.45))
    inner = inset(outer, shell)
    x0, y0, _, _ = inner.bounds
    hall = box(x0 + rng.uniform(3.0, 4.0), y0, 99, y0 + rng.uniform(3.4, 4.2)).intersection(
        box(0, 0, x0 + rng.uniform(6.4, 7.2), 99)
    )
    wall = float(rng.choice((0.115, 0.175, 0.24)))
    rest = inner.difference(hall.buffer(wall, join_style="mitre"))
    hx0, _, _, hy1 = hall.bounds
    well = box(hx0 + 0.02, hy1 - 1.0, hx0 + 2.7, hy1 - 0.02)
    storeys = []
    for level, floor in enumerate((0.0, 2.8)):
        arcs: list[tuple[float, float, float]] = []
        rooms = [part for piece in pieces(rest) for part in divide(rng, piece, 4, HOUSE.partitions, arcs, bent=0.35)]
        storey = Storey(floor, 2.6, tidy(outer), _rooms(rng, rooms, HOUSE), arcs)
        storey.rooms.append(Room(tidy(hall), "stairs", 2.5))
        storey.stairwell = well if level else None
        if level == 0:
            add_bay(rng, storey, shell, curved=bool(rng.random() < 0.5))
        storeys.append(storey)
    for storey in storeys:
        decorate(rng, storey, HOUSE)
    return storeys, HOUSE


def office(rng: Generator) -> tuple[list[Storey], Style]:
    """A corridor with offices on both sides, a bent or rounded front, columns, glass, dropped ceilings."""
    width, depth = rng.uniform(20, 27), rng.uniform(12, 15)
    corners = [(0, 0), (width, 0), (width, depth), (0, depth)]
    kind = rng.random()
    arcs: list[tuple[float, float, float]] = []
    shell = float(rng.uniform(0.2, 0.35))
    if kind < 0.5:
        corners[1:3] = [(width + rng.uniform(-3, 3), rng.uniform(-1, 2.5)), (width, depth)]
        outer = Polygon(corners)
    else:
        radius = depth / 2
        outer = box(0, 0, width - radius, depth).union(disc(width - radius, radius, radius, np.pi / 2))
        arcs += [(width - radius, radius, radius), (width - radius, radius, radius - shell)]
    inner = inset(outer, shell)
    middle, half = depth * rng.uniform(0.45, 0.55), rng.uniform(0.8, 1.1)
    thick = float(rng.choice(OFFICE.partitions))
    angle = float(rng.uniform(-0.08, 0.08))
    rooms = [inner]
    for side in (-1, 1):
        wall = straight_wall(width / 2, middle + side * (half + thick / 2), angle, thick)
        rooms = [part for room in rooms for part in cut(room, wall)]
    rooms.sort(key=lambda room: abs(room.representative_point().y - middle))
    corridor, sides = rooms[0], rooms[1:]
    made = [Room(corridor, "corridor", 2.4)]
    for side in sides:
        made += _rooms(
            rng, divide(rng, side, int(rng.integers(4, 6)), OFFICE.partitions, arcs, round_corner=0.1), OFFICE
        )
    storey = Storey(0.0, 3.1, tidy(outer), made, arcs)
    decorate(rng, storey, OFFICE)
    _columns(rng, storey, OFFICE)
    return [storey], OFFICE


def museum(rng: Generator) -> tuple[list[Storey], Style]:
    """A rotunda within galleries cut by radial walls; thick walls, niches, piers, missing ceilings."""
    width, depth, shell = rng.uniform(18, 23), rng.uniform(16, 19), float(rng.uniform(0.5, 0.7))
    outer = box(0, 0, width, depth)
    if rng.random() < 0.5:
        bevel = rng.uniform(2, 4)
        outer = Polygon(
            [(0, 0), (width - bevel, 0), (width, bevel), (width, depth), (bevel, depth), (0, depth - bevel)]
        )
    inner = inset(outer, shell)
    x, y = width * rng.uniform(0.42, 0.58), depth * rng.uniform(0.45, 0.55)
    radius, thick = float(rng.uniform(3.0, 4.2)), float(rng.choice((0.3, 0.45, 0.6)))
    rooms = pieces(inner.difference(round_wall(x, y, radius, thick)))
    rotunda = min(rooms, key=lambda room: room.centroid.distance(disc(x, y, 0.2)))
    ring = next(room for room in rooms if room is not rotunda)
    arcs = [(x, y, radius), (x, y, radius + thick)]
    turn = rng.uniform(0, 2 * np.pi)
    count = int(rng.integers(3, 6))
    for k in range(count):
        angle = turn + 2 * np.pi * (k + rng.uniform(-0.15, 0.15)) / count
        half = straight_wall(x, y, angle, float(rng.choice(MUSEUM.partitions)))
        u = np.array([np.cos(angle), np.sin(angle)])
        ahead = affinity.rotate(box(0, -50, 80, 50), np.degrees(angle), origin=(0, 0))
        ring = ring.difference(half.intersection(affinity.translate(ahead, x + u[0], y + u[1])))
    galleries = pieces(ring)
    made = [Room(rotunda, "gallery", None if rng.random() < 0.5 else 4.4)]
    for gallery in galleries:
        made += _rooms(rng, divide(rng, gallery, int(rng.integers(1, 3)), MUSEUM.partitions, arcs, oblique=0.5), MUSEUM)
    storey = Storey(0.0, 4.5, tidy(outer), made, arcs)
    decorate(rng, storey, MUSEUM)
    _columns(rng, storey, MUSEUM)
    return [storey], MUSEUM


def oldtown(rng: Generator) -> tuple[list[Storey], Style]:
    """A crooked town house: no two walls parallel, stone of 40 to 70 cm, steps, beams, niches."""
    width, depth = rng.uniform(11, 15), rng.uniform(9, 12)
    corners = np.array([(0, 0), (width * 0.5, 0), (width, 0), (width, depth), (0, depth)], dtype=float)
    corners += rng.uniform(-0.9, 0.9, corners.shape)
    corners[1] -= (0, 1.0)
    walls = [float(t) for t in rng.uniform(0.4, 0.7, len(corners))]
    outer = tidy(Polygon(corners))
    storey = _storey(rng, outer, walls, int(rng.integers(5, 8)), OLDTOWN, 0.0, 3.0)
    return [storey], OLDTOWN


def _storey(
    rng: Generator, outer: Polygon, shell: list[float] | float, count: int, style: Style, floor: float, height: float
) -> Storey:
    arcs: list[tuple[float, float, float]] = []
    rooms = divide(
        rng,
        inset(outer, shell),
        count,
        style.partitions,
        arcs,
        oblique=style.oblique,
        bent=style.bent,
        round_corner=style.round_corner,
    )
    storey = Storey(floor, height, tidy(outer), _rooms(rng, rooms, style), arcs)
    if rng.random() < 0.5:
        add_bay(rng, storey, float(np.max(shell)), curved=bool(rng.random() < 0.6))
    decorate(rng, storey, style)
    return storey


def _rooms(rng: Generator, polygons: list[Polygon], style: Style) -> list[Room]:
    rooms = []
    for polygon in polygons:
        ceiling = None if rng.random() < style.open_ceiling else float(rng.choice(style.ceilings))
        step = float(rng.uniform(0.1, style.step)) if style.step and rng.random() < 0.3 else 0.0
        rooms.append(Room(polygon, str(rng.choice(style.kinds)), ceiling, step))
    return rooms


def _columns(rng: Generator, storey: Storey, style: Style) -> None:
    """Columns, round or square, that stand free in the larger rooms."""
    for room in storey.rooms:
        if room.polygon.area < 18 or rng.random() > style.column:
            continue
        x0, y0, x1, y1 = room.polygon.bounds
        size, is_round = float(rng.uniform(0.3, 0.5)), bool(rng.random() < 0.5)
        for _ in range(6):
            x, y = rng.uniform(x0, x1), rng.uniform(y0, y1)
            shape = disc(x, y, size / 2) if is_round else box(x - size / 2, y - size / 2, x + size / 2, y + size / 2)
            apart = all(shape.distance(other) > 2.0 for other, _ in storey.columns)
            if room.polygon.buffer(-0.6).contains(shape) and apart:
                storey.columns.append((shape, is_round))


PRESETS: dict[str, Callable[[Generator], tuple[list[Storey], Style]]] = {
    "flat": flat,
    "house": house,
    "office": office,
    "museum": museum,
    "oldtown": oldtown,
}
