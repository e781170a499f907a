"""Seeded random buildings and their scans, for tests and experiments; independent of the cases and of the method.

Seeds 0-9 are for development. Seeds 100-109 are held back: nobody looks at their errors or tunes on them; they are
only ever summed up in a table.

>>> from buildings import generate
>>> building = generate(3, preset="house")  # doctest: +SKIP
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray
from shapely import Point, box, unary_union

from buildings.furniture import Furnisher
from buildings.model import Storey
from buildings.openings import Openings, connect
from buildings.presets import PRESETS
from buildings.scanner import Caster, Scanner, scan
from buildings.scene import Scene
from buildings.transform import Building, load_case, turn
from buildings.truth import flight_truth, mark_observed, storey_truth

Array = NDArray[np.float64]

DEVELOPMENT_SEEDS = tuple(range(10))
HELD_BACK_SEEDS = tuple(range(100, 110))

__all__ = ["DEVELOPMENT_SEEDS", "HELD_BACK_SEEDS", "PRESETS", "Building", "Scanner", "generate", "load_case"]


def generate(
    seed: int,
    *,
    preset: str | None = None,
    scanner: Scanner | None = None,
    stations: float = 1.0,
    furnished: bool = True,
    turned: bool = True,
) -> Building:
    """Make a building and scan it; the same seed and options give the same points.

    Parameters
    ----------
    preset : one of `PRESETS`; None takes them in turn by the seed.
    scanner : angular grid and errors; its `step_deg` sets the density.
    stations : scales the number of scans; 0 gives one per room.
    furnished : False leaves the rooms bare, doors without leaves.
    turned : False leaves the building's main direction along x.
    """
    names = list(PRESETS)
    name = names[seed % len(names)] if preset is None else preset
    rng = np.random.default_rng([seed, names.index(name)])
    storeys, style = PRESETS[name](rng)
    for storey in storeys:
        connect(rng, Openings(rng, storey), style)
    scene = Scene()
    standing = []
    for level, storey in enumerate(storeys):
        scene.add_storey(storey, storeys[level + 1] if level + 1 < len(storeys) else None)
        furnisher = Furnisher(rng, scene, storey, style)
        if furnished:
            furnisher.furnish()
        standing.append(furnisher.stands)
    stairs(scene, storeys)
    # a house that was scanned from outside stands alone: else the neighbours would be walls of no truth
    scene.surroundings(rng, storeys, street=style.outside == 0)
    positions, rooms = _stations(rng, storeys, standing, stations)
    around = _around(rng, storeys[0], style.outside)
    positions = np.concatenate([positions, around])
    caster, scanner = Caster(scene), scanner or Scanner()
    clouds = [scan(caster, scanner, position, rng) for position in positions]
    points = np.concatenate(clouds)
    index = np.repeat(np.arange(len(clouds), dtype=np.int32), [len(cloud) for cloud in clouds])
    places = [{"storey": level, "room": room} for level, room in rooms] + [{"storey": 0}] * len(around)
    truth: dict[str, Any] = {
        "case": f"{name}-{seed}",
        "scans": [
            {"id": i, "position": position.tolist(), **place, "points": len(cloud)}
            for i, (position, place, cloud) in enumerate(zip(positions, places, clouds, strict=True))
        ],
        "storeys": [storey_truth(storey) for storey in storeys],
    }
    for entry, above in zip(truth["storeys"], storeys[1:], strict=False):
        entry["stairs"] = flight_truth(above)
    mark_observed(points, truth)
    building = Building(f"{name}-{seed}", points, index, positions, truth)
    if turned:
        return turn(building, float(rng.uniform(0, 2 * np.pi)))
    return building


def stairs(scene: Scene, storeys: list[Storey]) -> None:
    """A straight flight up each stairwell, and a railing around it."""
    for below, above in itertools.pairwise(storeys):
        if above.stairwell is None:
            continue
        x0, y0, x1, y1 = above.stairwell.bounds
        count = 15
        rise, run = (above.floor - below.floor) / count, (x1 - x0) / count
        for i in range(count):
            x = x0 + i * run
            z = below.floor + (i + 1) * rise
            scene.wall((x, y0), (x, y1), z - rise, z)
            scene.level(box(x, y0, x + run, y1), z)
        for x in np.arange(x0 + 0.1, x1, 0.12):
            scene.wall((x, y0), (x + 0.03, y0), above.floor, above.floor + 0.95)
        scene.wall((x0, y0), (x1, y0), above.floor + 0.95, above.floor + 1.0)


def _stations(
    rng: np.random.Generator, storeys: list[Storey], standing: list[list], scale: float
) -> tuple[Array, list[tuple[int, int]]]:
    """Scanner positions: far from each other within each room, clear of what stands there."""
    positions, rooms = [], []
    for level, (storey, stands) in enumerate(zip(storeys, standing, strict=True)):
        for index, room in enumerate(storey.rooms):
            if room.kind == "closet":
                continue
            free = room.polygon.buffer(-0.45).difference(unary_union(stands).buffer(0.3))
            if free.is_empty:
                free = room.polygon.buffer(-0.3)
            x0, y0, x1, y1 = free.bounds
            spots = rng.uniform((x0, y0), (x1, y1), (400, 2))
            spots = spots[[free.contains(Point(spot)) for spot in spots]]
            count = max(1, min(6, round(scale * (1 + 0.6 * np.sqrt(room.polygon.area)))))
            chosen = [spots[0]] if len(spots) else []
            while len(chosen) < count and len(spots):
                away = np.min([np.hypot(*(spots - spot).T) for spot in chosen], axis=0)
                chosen.append(spots[int(away.argmax())])
            for spot in chosen:
                positions.append([*spot, storey.floor + room.step + rng.uniform(1.35, 1.75)])
                rooms.append((level, index))
    return np.array(positions), rooms


def _around(rng: np.random.Generator, storey: Storey, count: int) -> Array:
    """Scanner positions (count, 3) on the ground around the house."""
    path = storey.footprint.buffer(4.0).exterior
    start = rng.random()
    spots = [path.interpolate((start + i / count) % 1.0, normalized=True) for i in range(count)]
    return np.array([[spot.x, spot.y, storey.floor + 1.4] for spot in spots]).reshape(-1, 3)
