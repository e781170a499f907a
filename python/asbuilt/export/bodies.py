"""What a wall stands on, for all that draw it, model it, or ask what lies on it."""

from __future__ import annotations

from shapely import LineString, Polygon

from asbuilt.plan import Wall


def wall_body(wall: Wall) -> Polygon:
    """The outline of a wall, m.

    Where it crosses itself, as that of a wall shorter than thick may where mitres meet, or encloses nothing, a
    rectangle along the centreline stands for it: no GIS or CAD program takes a polygon that crosses itself. Empty for
    a wall of no length or no thickness.
    """
    outline = Polygon(wall.outline) if len(wall.outline) > 2 else Polygon()
    if outline.is_valid and outline.area > 0:
        return outline
    return LineString([wall.start, wall.end]).buffer(wall.drawn_thickness / 2, cap_style="flat")
