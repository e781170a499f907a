"""PNG: the plan in colour over the picture of the points' density, the figure that a person looks at first."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.typing import NDArray

from asbuilt.export import marks
from asbuilt.export.labels import room_tags
from asbuilt.export.marks import Fill, Mark, Text
from asbuilt.export.page import draw_marks, empty_page, fixed_output
from asbuilt.export.sheet import Bounds, plan_bounds, storey_title
from asbuilt.export.symbols import storey_marks
from asbuilt.export.title_block import count, scale_bar
from asbuilt.plan import FloorPlan, Point, Storey

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence

_DPI = 150
_LONG_SIDE = 304.8  # mm: 1800 pixels
_NARROWEST = 110.0
_MARGIN = 4.0  # mm around the plan
_FOOT = 11.0  # mm below it, for the scale bar and the title
_TEXT = 2.2
_COLOURS = {
    marks.AREA: "#2a9fd61c",
    marks.WALL_UNSEEN: "#d6004f",
    marks.WALL: "#d6004f",
    marks.COLUMN: "#7b2cbf",
    marks.STAIR: "#8a5a00",
    marks.UNKNOWN_OPENING: "#e07b00",
    marks.GLAZING: "#005fd6",
    marks.DOOR_HEAD: "#00843d",
    marks.DOOR_SWING: "#00843d",
    marks.DOOR: "#00843d",
    marks.ROOM_TAG: "#1b2a3a",
}
_FOOT_COLOURS = {marks.TITLE_BLOCK: "black"}


def write(plan: FloorPlan, storey: Storey | None, path: Path, evidence: Evidence | None = None) -> None:
    """Write one storey as PNG; without `evidence` on white."""
    density = None
    if storey is not None and evidence is not None:
        from asbuilt import density_image

        density = density_image(evidence, storey)
    x0, y0, x1, y1 = _bounds(plan, density)
    metre = (_LONG_SIDE - 2 * _MARGIN) / max(x1 - x0, y1 - y0)  # mm of picture to a metre of building
    width = max((x1 - x0) * metre + 2 * _MARGIN, _NARROWEST)
    height = (y1 - y0) * metre + 2 * _MARGIN + _FOOT

    def place(point: Point) -> Point:
        return _MARGIN + (point[0] - x0) * metre, _MARGIN + _FOOT + (point[1] - y0) * metre

    with fixed_output():
        figure = empty_page(width, height)
        if density is not None:
            (u0, v0), (u1, v1) = (place((density[1][i], density[1][i + 2])) for i in (0, 1))
            _draw_density(figure.axes[0], density[0], (u0, u1, v0, v1))
        if storey is not None:
            draw_marks(figure, _marks(storey, metre), place, metre, colours=_COLOURS)
        draw_marks(figure, _foot(storey, metre), lambda point: point, 1.0, colours=_FOOT_COLOURS)
        # no version and no date of the program that drew it: the same plan gives the same bytes
        metadata: dict[str, Any] = {"Software": None}
        FigureCanvasAgg(figure).print_figure(path, format="png", dpi=_DPI, metadata=metadata)


def _bounds(plan: FloorPlan, density: tuple[NDArray[np.float64], Bounds] | None) -> Bounds:
    """The plan and all but the outermost percent of the points: what the plan missed must be seen as well."""
    boxes = [box for box in (plan_bounds(plan),) if box is not None]
    if density is not None and density[0].sum() > 0:
        image, (x0, x1, y0, y1) = density
        left, right = _bulk(image.sum(axis=0))
        bottom, top = _bulk(image.sum(axis=1))
        boxes.append((x0 + left * (x1 - x0), y0 + bottom * (y1 - y0), x0 + right * (x1 - x0), y0 + top * (y1 - y0)))
    if not boxes:
        return 0.0, 0.0, 1.0, 1.0
    lower, upper = np.min(boxes, axis=0), np.max(boxes, axis=0)
    pad = 0.02 * max(upper[2] - lower[0], upper[3] - lower[1], 0.5)
    return lower[0] - pad, lower[1] - pad, upper[2] + pad, upper[3] + pad


def _bulk(sums: NDArray[np.float64]) -> tuple[float, float]:
    """First and last place, as shares of the length, between which all but 0.5 % at each end lies."""
    shares = np.cumsum(sums) / np.sum(sums)
    first, last = np.searchsorted(shares, (0.005, 0.995))
    return float(first / len(sums)), float((last + 1) / len(sums))


def _draw_density(axes: Axes, image: NDArray[np.float64], extent: Bounds) -> None:
    """Grey by the logarithm: a wall holds a hundred times the points of a table, and both should be seen."""
    grey = np.log1p(image)
    top = float(np.quantile(grey[grey > 0], 0.99)) if (grey > 0).any() else 1.0
    page = axes.axis()  # which imshow would change
    axes.imshow(
        grey, extent=extent, origin="lower", cmap="Greys", vmin=0.0, vmax=1.7 * top, interpolation="antialiased"
    )
    axes.axis(page)
    axes.set_aspect("auto")


def _marks(storey: Storey, metre: float) -> Iterator[Mark]:
    for room in storey.rooms:
        yield Fill((room.ring, *room.holes), layer=marks.AREA)
    # openings are not blanked out: the points below them must be seen
    yield from (mark for mark in storey_marks(storey) if mark.layer is not marks.AREA)
    yield from room_tags(storey, metre)


def _foot(storey: Storey | None, metre: float) -> Iterator[Mark]:
    yield from scale_bar((_MARGIN + 1.0, 8.6), 60.0, metre)
    title = "No storey found"
    if storey is not None:
        kinds = ((storey.doors, "door"), (storey.windows, "window"), (storey.rooms, "room"))
        counts = [
            count(len(storey.wall_faces), "wall face"),
            *(count(len(found), noun) for found, noun in kinds if found),
        ]
        title = ", ".join([storey_title(storey.index, storey.floor, storey.ceiling), *counts])
    yield Text((_MARGIN, 1.8), title, _TEXT, layer=marks.TITLE_BLOCK)
