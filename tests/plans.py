"""A plan made by hand that has one of everything, for the tests of exports and reports."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from asbuilt.plan import (
    Column,
    Door,
    FloorPlan,
    Point,
    Room,
    Stair,
    Storey,
    UnknownOpening,
    Wall,
    WallFace,
    Window,
)

EAST, NORTH = 500000.125, 5400000.25
"""Survey coordinates (UTM), where a format that keeps too few digits would show."""
_TRUST = {"seen": 0.9, "rms": 0.003, "voxels": 400, "sigma": 0.002, "confidence": 0.95}


def complete_plan(east: float = EAST, north: float = NORTH, crs: str | None = "EPSG:25832") -> FloorPlan:
    """Two rooms side by side, 3.95 x 5 m each, on each of two storeys.

    The wall between them is 0.10 m thick and measured, with a door; the outer walls are seen from inside only, with a
    window, an opening that nobody looked through, a square and a round column and a stair.
    """

    def at(x: float, y: float) -> tuple[float, float]:
        return east + x, north + y

    def ring(*corners: tuple[float, float]) -> tuple[tuple[float, float], ...]:
        return tuple(at(x, y) for x, y in corners)

    def storey(index: int, floor: float) -> Storey:
        name = f"S{index}"
        west = [(0.0, 0.0), (3.95, 0.0), (3.95, 5.0), (0.0, 5.0)]
        east_room = [(4.05, 0.0), (8.0, 0.0), (8.0, 5.0), (4.05, 5.0)]
        sides = [
            (west[0], west[1]),
            (west[1], (3.95, 2.0)),
            ((3.95, 2.9), west[2]),
            (west[2], west[3]),
            (west[3], west[0]),
            (east_room[0], east_room[1]),
            (east_room[1], east_room[2]),
            (east_room[2], east_room[3]),
            (east_room[3], (4.05, 2.9)),
            ((4.05, 2.0), east_room[0]),
        ]
        faces = tuple(WallFace(at(*a), at(*b), id=f"{name}-F{i + 1}", **_TRUST) for i, (a, b) in enumerate(sides))

        def unseen(number: int, a: tuple[float, float], b: tuple[float, float], *faces: str) -> Wall:
            """An outer wall, its faces on the left of the centreline, 0.10 m drawn."""
            length = ((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2) ** 0.5
            nx, ny = -(b[1] - a[1]) / length * 0.05, (b[0] - a[0]) / length * 0.05
            corners = [(a[0] + nx, a[1] + ny), (b[0] + nx, b[1] + ny), (b[0] - nx, b[1] - ny), (a[0] - nx, a[1] - ny)]
            return Wall(
                at(*a),
                at(*b),
                None,
                0.1,
                tuple(f"{name}-{face}" for face in faces),
                ring(*corners[::-1]),
                id=f"{name}-W{number}",
                **_TRUST,
            )

        walls = (
            Wall(
                at(4.0, 0.0),
                at(4.0, 5.0),
                0.1,
                0.1,
                (f"{name}-F2", f"{name}-F3", f"{name}-F9", f"{name}-F10"),
                ring((3.95, 0.0), (4.05, 0.0), (4.05, 5.0), (3.95, 5.0)),
                id=f"{name}-W1",
                **_TRUST,
            ),
            unseen(2, (-0.1, -0.05), (8.1, -0.05), "F1", "F6"),
            unseen(3, (8.05, -0.1), (8.05, 5.1), "F7"),
            unseen(4, (8.1, 5.05), (-0.1, 5.05), "F4", "F8"),
            unseen(5, (-0.05, 5.1), (-0.05, -0.1), "F5"),
        )
        return Storey(
            index=index,
            floor=floor,
            ceiling=floor + 2.5,
            outline=ring((-0.1, -0.1), (8.1, -0.1), (8.1, 5.1), (-0.1, 5.1)),
            wall_faces=faces,
            walls=walls,
            doors=(
                Door(
                    at(4.0, 2.0),
                    at(4.0, 2.9),
                    f"{name}-W1",
                    0.0,
                    2.01,
                    "open",
                    "start",
                    "left",
                    id=f"{name}-D1",
                    **_TRUST,
                ),
            ),
            windows=(Window(at(5.0, -0.05), at(6.2, -0.05), f"{name}-W2", 0.9, 2.1, id=f"{name}-G1", **_TRUST),),
            unknown_openings=(UnknownOpening(at(8.05, 1.0), at(8.05, 1.8), f"{name}-W3", id=f"{name}-U1"),),
            rooms=(
                Room(
                    ring(*west),
                    (),
                    f"{index}01",
                    floor,
                    floor + 2.5,
                    ("scan 1", "scan 2"),
                    id=f"{name}-R1",
                    **_TRUST,
                ),
                Room(ring(*east_room), (), f"{index}02", floor, floor + 2.4, ("scan 3",), id=f"{name}-R2", **_TRUST),
            ),
            columns=(
                Column(at(1.5, 2.5), 0.3, 0.4, "square", 0.2, id=f"{name}-C1", **_TRUST),
                Column(at(6.5, 3.5), 0.35, 0.35, "round", id=f"{name}-C2", **_TRUST),
            ),
            stairs=(
                Stair(
                    ring((4.05, 0.0), (5.05, 0.0), (5.05, 2.0), (4.05, 2.0)),
                    ring((4.55, 0.1), (4.55, 1.9)),
                    1.6,
                    id=f"{name}-T1",
                    **_TRUST,
                ),
            ),
        )

    return FloorPlan(
        storeys=(storey(0, 112.5), storey(1, 115.3)),
        parameters={"preset_name": "default", "walls": {"band": 0.03}},
        inputs=({"name": "scan.e57", "size": 1, "checksum": "00"},),
        crs=crs,
        notes=("an example",),
    )


def mapped(value: Any, move: Callable[[Point], Point], turn: float = 0.0) -> Any:
    """A plan, or a part of one, with every point of the ground plane moved, and columns turned by `turn` (rad)."""
    if isinstance(value, tuple):
        numbers = len(value) == 2 and all(isinstance(part, float) for part in value)
        return move(value) if numbers else tuple(mapped(part, move, turn) for part in value)
    if not dataclasses.is_dataclass(value) or isinstance(value, type):
        return value
    changed = {field.name: mapped(getattr(value, field.name), move, turn) for field in dataclasses.fields(value)}
    if isinstance(value, Column):
        changed["rotation"] += turn
    return type(value)(**changed)
