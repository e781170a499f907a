"""What stands at a place of the plan, from bottom to top: the class of a point by its height."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from asbuilt.label.classes import PointClass
from asbuilt.plan import Column, Door, Opening, Room, Stair, Storey, Wall, WallFace

#: From this z (m) on, until the next layer starts, points are of this class; True where they belong to the wall.
Layer = tuple[float, PointClass, bool]


@dataclass(frozen=True)
class Levels:
    """Heights (z, m) between which something stands: of the floor, the ceiling, and the end of its storey above."""

    floor: float
    ceiling: float
    top: float

    @staticmethod
    def of(storey: Storey, top: float, rooms: Iterable[Room]) -> Levels:
        """From the lowest floor to the highest ceiling of the rooms beside it; the storey's, where they have none."""
        rooms = tuple(rooms)
        floors = [room.floor for room in rooms if room.floor is not None]
        ceilings = [room.ceiling for room in rooms if room.ceiling is not None]
        floor, ceiling = min(floors, default=storey.floor), max(ceilings, default=storey.ceiling)
        return Levels(floor, ceiling, max(top, ceiling))


def room_layers(levels: Levels, tolerance: float) -> list[Layer]:
    """Floor, what stands in the room, and ceiling, with all that the storey has above it: ceilings step and slope."""
    return [
        (levels.floor - tolerance, PointClass.FLOOR, False),
        (levels.floor + tolerance, PointClass.CLUTTER, False),
        (levels.ceiling - tolerance, PointClass.CEILING, False),
        (max(levels.top, levels.ceiling + tolerance), PointClass.OUTSIDE, False),
    ]


def element_layers(element: object, levels: Levels, tolerance: float) -> list[Layer]:
    """What an element is from its foot to its top; OUTSIDE where it is not, and the room shows."""
    foot, top = levels.floor - tolerance, levels.ceiling + tolerance
    if isinstance(element, Opening):
        kind = PointClass.DOOR if isinstance(element, Door) else PointClass.WINDOW
        sill = foot if element.sill is None else levels.floor + element.sill
        head = top if element.head is None else levels.floor + element.head
        layers = [(foot, PointClass.WALL, True), (sill, kind, True), (head, PointClass.WALL, True)]
        if kind is PointClass.DOOR and sill <= levels.floor + tolerance:
            threshold = [(foot, PointClass.FLOOR, False), (levels.floor + tolerance, kind, True)]
            layers = [*threshold, (head, PointClass.WALL, True)]
        return [*layers, (top, PointClass.OUTSIDE, False)]
    if isinstance(element, Stair):
        end = top if element.rise is None else levels.floor + element.rise + tolerance
        return [(levels.floor + tolerance, PointClass.STAIR, False), (end, PointClass.OUTSIDE, False)]
    if isinstance(element, Wall) and element.height is not None:
        top = levels.floor + element.height + tolerance
    if isinstance(element, Wall | WallFace):
        return [(foot, PointClass.WALL, True), (top, PointClass.OUTSIDE, False)]
    if isinstance(element, Column):
        return [(foot, PointClass.COLUMN, False), (top, PointClass.OUTSIDE, False)]
    raise TypeError(f"{type(element).__name__} does not stand in a plan")
