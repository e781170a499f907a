"""The classes that points get, and the numbers that files know them by."""

from __future__ import annotations

from enum import IntEnum


class PointClass(IntEnum):
    """What a point lies on. The values are those of LAS (ASPRS, point formats 6 to 10): from 64 on, users define."""

    OUTSIDE = 1
    FLOOR = 2
    WALL = 6
    CEILING = 64
    DOOR = 65
    WINDOW = 66
    COLUMN = 67
    STAIR = 68
    CLUTTER = 69

    @property
    def title(self) -> str:
        """Its name as people write it.

        >>> PointClass.WALL.title
        'wall'
        """
        return self.name.lower()
