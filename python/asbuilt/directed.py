"""What runs from a start to an end on the ground: faces, sides of rooms, holes in walls."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from asbuilt.grid import FloatArray


class Directed:
    """A straight stretch with a direction; the room that sees it is on its left."""

    start: FloatArray
    end: FloatArray

    @cached_property
    def length(self) -> float:
        """Length, m."""
        return float(np.hypot(*(self.end - self.start)))

    @cached_property
    def along(self) -> FloatArray:
        """Unit vector (2,) from start to end."""
        return (self.end - self.start) / max(self.length, 1e-12)

    @cached_property
    def normal(self) -> FloatArray:
        """Unit vector (2,) towards the room."""
        along = self.along
        return np.array([-along[1], along[0]])
