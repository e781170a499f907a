"""What the drawings share: how much of the world they show, and how long their scale bar is."""

from __future__ import annotations

import math

from asbuilt.plan import FloorPlan

Bounds = tuple[float, float, float, float]


def plan_bounds(plan: FloorPlan) -> Bounds | None:
    """The rectangle x0, y0, x1, y1 (m) that holds all storeys; None for a plan without faces and outlines.

    All storeys together, so that the drawings of two storeys lie over each other.
    """
    points = [point for face in plan.wall_faces for point in (face.start, face.end)]
    points += [point for storey in plan.storeys for point in storey.outline or ()]
    if not points:
        return None
    xs, ys = zip(*points, strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def scale_bar_length(width: float) -> float:
    """A round length, 1, 2 or 5 times a power of ten, of about a fifth of the drawing's `width` (both m).

    >>> scale_bar_length(12.0), scale_bar_length(80.0), scale_bar_length(0.7)
    (2.0, 10.0, 0.1)
    """
    wanted = width / 5.0
    power = 10.0 ** math.floor(math.log10(wanted))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= wanted * (1 + 1e-9))


def storey_title(index: int, floor: float, ceiling: float) -> str:
    """The line that a drawing of one storey bears.

    >>> storey_title(0, -0.004, 2.5)
    'Storey 0, floor 0.00 m, ceiling 2.50 m'
    """
    return f"Storey {index}, floor {round(floor, 2) + 0.0:.2f} m, ceiling {round(ceiling, 2) + 0.0:.2f} m"
