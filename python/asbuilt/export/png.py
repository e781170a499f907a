"""PNG: the plan over the picture of the points' density, the figure that a person looks at first."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from asbuilt.export.sheet import Bounds, plan_bounds, scale_bar_length, storey_title
from asbuilt.plan import FloorPlan, Storey

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence

_DPI = 150
_LONG_SIDE = 12.0  # inches: 1800 pixels
_MARGIN = 0.15  # inches around the plan
_FOOT = 0.45  # inches below it, for the scale bar and the title
_WALL_COLOUR = "#d6004f"


def write(plan: FloorPlan, storey: Storey | None, path: Path, evidence: Evidence | None = None) -> None:
    """Write one storey as PNG; without `evidence` on white."""
    density = None
    if storey is not None and evidence is not None:
        from asbuilt import density_image

        density = density_image(evidence, storey)
    x0, y0, x1, y1 = _bounds(plan, density)
    inches = (_LONG_SIDE - 2 * _MARGIN) / max(x1 - x0, y1 - y0)  # of picture to a metre of building
    width = max((x1 - x0) * inches, 4.0) + 2 * _MARGIN
    height = (y1 - y0) * inches + 2 * _MARGIN + _FOOT

    # the figure's own objects, not pyplot: no state shared with the caller's figures
    figure = Figure(figsize=(width, height), dpi=_DPI, facecolor="white")
    across, up = (x1 - x0) * inches / width, (y1 - y0) * inches / height
    axes = figure.add_axes((_MARGIN / width, (_MARGIN + _FOOT) / height, across, up))
    axes.set_axis_off()
    if density is not None:
        _draw_density(axes, *density)
    if storey is not None:
        segments = [(face.start, face.end) for face in storey.wall_faces]
        axes.add_collection(LineCollection(segments, colors=_WALL_COLOUR, linewidths=1.2, capstyle="round"))
    axes.set_xlim(x0, x1)
    axes.set_ylim(y0, y1)
    _draw_foot(figure, storey, scale_bar_length(x1 - x0) * inches, scale_bar_length(x1 - x0))
    # no version and no date of the program that drew it: the same plan gives the same bytes
    FigureCanvasAgg(figure).print_figure(path, format="png", dpi=_DPI, metadata={"Software": None})


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
    axes.imshow(
        grey, extent=extent, origin="lower", cmap="Greys", vmin=0.0, vmax=1.3 * top, interpolation="antialiased"
    )


def _draw_foot(figure: Figure, storey: Storey | None, bar: float, bar_metres: float) -> None:
    width, height = figure.get_size_inches()
    fields = 5
    for i in range(fields):
        corner = ((_MARGIN + i * bar / fields) / width, 0.3 / height)
        colour = "white" if i % 2 else "black"
        field = Rectangle(
            corner, bar / fields / width, 0.07 / height, facecolor=colour, edgecolor="black", linewidth=0.5
        )
        field.set_transform(figure.transFigure)
        figure.add_artist(field)
    figure.text((_MARGIN + bar + 0.08) / width, 0.3 / height, f"{bar_metres:g} m", fontsize=8)
    title = "No storey found"
    if storey is not None:
        title = f"{storey_title(storey.index, storey.floor, storey.ceiling)}, {len(storey.wall_faces)} wall faces"
    figure.text(_MARGIN / width, 0.1 / height, title, fontsize=8)
