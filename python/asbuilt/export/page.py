"""Marks as ink on paper, through matplotlib: one routine draws SVG and PDF.

matplotlib writes both at the exact size of the paper, with text that stays text, and brings its own typeface, so that
the same plan gives the same bytes on every machine. (ezdxf's drawing add-on, which could render the DXF's layouts,
makes outlines of text and needs PyMuPDF, which is AGPL, for PDF.)
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import groupby
from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.text import Text as TextArtist
from matplotlib.transforms import Affine2D

from asbuilt.export.dimensions import dimension_line, dimension_number
from asbuilt.export.drawing import Drawing
from asbuilt.export.marks import (
    CAP_HEIGHT,
    STOREY_LAYERS,
    Arc,
    Dimension,
    Fill,
    Layer,
    Mark,
    Stroke,
    Tag,
    Text,
)
from asbuilt.plan import Point, Storey

if TYPE_CHECKING:
    from matplotlib.backend_bases import RendererBase

_POINTS = 72 / 25.4
"""Points to the millimetre."""
_TICK = 1.0
"""Half the length of a dimension's tick, mm."""

Place = Callable[[Point], Point]


class _Group(Artist):
    """Artists that lie together: in SVG a group with an id, such as a layer or an element."""

    def __init__(self, name: str, children: list[Artist]) -> None:
        super().__init__()
        self.name, self.children = name, children

    def draw(self, renderer: RendererBase) -> None:
        renderer.open_group("layer", gid=self.name)
        for child in self.children:
            child.draw(renderer)
        renderer.close_group("layer")


def storey_page(drawing: Drawing, storey: Storey | None) -> Figure:
    """One storey on its sheet, or where there is none the sheet with its title block."""
    sheet = drawing.sheet
    figure = empty_page(sheet.width, sheet.height)
    for of_storey, found in drawing.storeys:
        if of_storey is storey:
            draw_marks(figure, found, drawing.page, sheet.metre, suffix=f"-S{of_storey.index}")
    draw_marks(figure, drawing.border(storey), lambda point: point, 1.0)
    return figure


def empty_page(width: float, height: float) -> Figure:
    """A white figure of exactly that size, mm, measured in mm from its lower left corner."""
    figure = Figure(figsize=(width / 25.4, height / 25.4), facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(0.0, width)
    axes.set_ylim(0.0, height)
    return figure


def draw_marks(
    figure: Figure,
    found: Iterable[Mark],
    place: Place,
    metre: float,
    suffix: str = "",
    colours: Mapping[Layer, str] | None = None,
) -> None:
    """Put marks on a page, in their order.

    Parameters
    ----------
    figure : from `empty_page`.
    place : a mark's points as mm of paper.
    metre : what one unit of the marks takes on paper, mm.
    suffix : of the storey, for the names of its layers.
    colours : ink by layer, for those layers alone; None: each layer's own grey.
    """
    axes = figure.axes[0]
    shown = [mark for mark in found if (mark.layer.shown if colours is None else mark.layer in colours)]
    named: set[str] = set()  # an element's id stands where it is first drawn: in SVG an id may stand but once
    for layer, of_layer in groupby(sorted(shown, key=_painting_order), key=lambda mark: mark.layer):
        ink = f"{layer.grey:g}" if colours is None else colours[layer]
        elements: list[Artist] = []
        for name, of_element in groupby(of_layer, key=lambda mark: mark.id):
            artists = [artist for mark in of_element for artist in _artists(mark, place, metre, ink)]
            for artist in artists:
                artist.axes = axes
                artist.set_figure(figure)
                artist.set_transform(axes.transData)
            elements += artists if not name or name in named else [_Group(name, artists)]
            named.add(name)
        group = _Group(layer.name + suffix, elements)
        group.set_figure(figure)
        axes.add_artist(group)


def _painting_order(mark: Mark) -> int:
    """What covers others last; the layers of the border, which are none of a storey's, as they come."""
    return STOREY_LAYERS.index(mark.layer) if mark.layer in STOREY_LAYERS else len(STOREY_LAYERS)


def _artists(mark: Mark, place: Place, metre: float, ink: str) -> Iterable[Artist]:
    if isinstance(mark, Stroke):
        return [_line([place(point) for point in mark.points], mark.layer, ink, mark.closed)]
    if isinstance(mark, Arc):
        return [_arc(mark, place, metre, ink)]
    if isinstance(mark, Fill):
        return [_filled([[place(point) for point in ring] for ring in mark.rings], ink)]
    if isinstance(mark, Text):
        return [_text(mark, place, ink)]
    if isinstance(mark, Tag):
        return [_text(text, place, ink) for text in mark.texts(metre)]
    return _dimension(mark, place, metre, ink)


def _line(points: list[Point], layer: Layer, ink: str, closed: bool = False) -> PathPatch:
    patch = PathPatch(Path(points + points[:1] * closed, closed=closed))
    return _stroked(patch, layer, ink)


def _stroked(patch: PathPatch, layer: Layer, ink: str) -> PathPatch:
    width = layer.pen * _POINTS
    patch.set(facecolor="none", edgecolor=ink, linewidth=width, joinstyle="round", capstyle="round")
    if layer.dashes:
        patch.set(linestyle=(0, tuple(part * _POINTS for part in layer.dashes)), capstyle="butt")
    return patch


def _arc(arc: Arc, place: Place, metre: float, ink: str) -> PathPatch:
    u, v = place(arc.centre)
    unit = Path.unit_circle() if arc.end is None else Path.arc(math.degrees(arc.start), math.degrees(arc.end))
    path = unit.transformed(Affine2D().scale(arc.radius * metre).translate(u, v))
    return _stroked(PathPatch(path), arc.layer, ink)


def _filled(rings: list[list[Point]], ink: str) -> PathPatch:
    path = Path.make_compound_path(*(Path([*ring, ring[0]], closed=True) for ring in rings))
    return PathPatch(path, facecolor=ink, edgecolor="none", linewidth=0)


def _text(text: Text, place: Place, ink: str) -> TextArtist:
    u, v = place(text.at)
    return TextArtist(
        u,
        v,
        text.text,
        fontsize=text.height / CAP_HEIGHT * _POINTS,
        fontfamily="sans-serif",  # DejaVu Sans first, which matplotlib brings; an SVG names others after it
        fontweight="bold" if text.bold else "normal",
        color=ink,
        rotation=math.degrees(text.rotation),
        rotation_mode="anchor",
        horizontalalignment="center" if text.align == "centre" else text.align,
        verticalalignment="baseline",
        parse_math=False,  # a dollar is a dollar
    )


def _dimension(dimension: Dimension, place: Place, metre: float, ink: str) -> Iterator[Artist]:
    """A line with slanted ticks and the distance on it."""
    (u1, v1), (u2, v2) = (place(end) for end in dimension_line(dimension))
    angle = math.atan2(v2 - v1, u2 - u1)
    cos, sin = math.cos(angle), math.sin(angle)
    layer, bold = dimension.layer, dataclasses.replace(dimension.layer, pen=2 * dimension.layer.pen)
    yield _line([(u1, v1), (u2, v2)], layer, ink)
    for u, v in ((u1, v1), (u2, v2)):
        across, slant = (-1.5 * _TICK * sin, 1.5 * _TICK * cos), (0.7 * _TICK * (cos - sin), 0.7 * _TICK * (sin + cos))
        for (du, dv), pen in ((across, layer), (slant, bold)):
            yield _line([(u - du, v - dv), (u + du, v + dv)], pen, ink)
    yield _text(dimension_number(dimension, metre), place, ink)


@contextlib.contextmanager
def fixed_output() -> Iterator[None]:
    """Settings under which matplotlib keeps text as text and gives the same bytes for the same marks."""
    # rcdefaults: what a user has set for plots of their own is none of a plan's business
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(
            {
                "svg.fonttype": "none",
                "svg.hashsalt": "asbuilt",
                "pdf.fonttype": 42,
                "path.simplify": False,
                "path.snap": False,
                "lines.scale_dashes": False,
            }
        )
        yield


def page_title(storey: Storey | None, drawing: Drawing) -> str:
    """What a viewer shows as the document's name."""
    title = drawing.options.title or "As-built floor plan"
    return title if storey is None else f"{title}, storey {storey.index}"
