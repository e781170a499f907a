"""What a drawing is made of: layers, and marks on them. They know nothing of DXF, SVG or PDF.

A mark lies in metres of the plan's frame (or, on a sheet's border, in millimetres of paper); its pen, its dashes and
the height of its text are millimetres of paper. The DXF writer makes CAD entities of them, `asbuilt.export.page` ink:
so all drawings show the same.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from asbuilt.plan import Point

Ring = tuple[Point, ...]


@dataclass(frozen=True)
class Layer:
    """How everything on one layer is drawn.

    Attributes
    ----------
    name : by the US National CAD Standard (AIA layers); a storey's layers get its suffix, such as A-WALL-S0.
    pen : width of its lines on paper, mm.
    aci : AutoCAD colour index on the screen.
    grey : of its ink on paper, 0 black to 1 white.
    dashes : lengths of dash and gap on paper, mm; empty for a solid line.
    shown : whether it is switched on in CAD, and drawn on paper.
    """

    name: str
    pen: float
    aci: int
    grey: float = 0.0
    dashes: tuple[float, ...] = ()
    shown: bool = True

    def of(self, storey: int) -> str:
        """The layer's name with the suffix of a storey.

        >>> WALL.of(1)
        'A-WALL-S1'
        """
        return f"{self.name}-S{storey}"


_DASHED = (1.6, 0.9)
WALL = Layer("A-WALL", 0.35, 7)
WALL_UNSEEN = Layer("A-WALL-UNSN", 0.25, 1, dashes=_DASHED)
WALL_PATTERN = Layer("A-WALL-PATT", 0.0, 8, 0.45)
WALL_UNSEEN_PATTERN = Layer("A-WALL-UNSN-PATT", 0.0, 254, 0.86)
WALL_CENTRELINE = Layer("A-WALL-CNTR", 0.13, 8, dashes=(6.0, 1.0, 0.6, 1.0), shown=False)
DOOR = Layer("A-DOOR", 0.25, 3)
DOOR_SWING = Layer("A-DOOR-SWNG", 0.13, 3)
DOOR_HEAD = Layer("A-DOOR-HEAD", 0.13, 3, dashes=_DASHED)
GLAZING = Layer("A-GLAZ", 0.13, 4)
UNKNOWN_OPENING = Layer("A-OPNG-UNKN", 0.18, 30, dashes=_DASHED)
COLUMN = Layer("A-COLS", 0.35, 6)
COLUMN_PATTERN = Layer("A-COLS-PATT", 0.0, 8, 0.45)
STAIR = Layer("A-FLOR-STRS", 0.18, 2)
OUTLINE = Layer("A-FLOR-OTLN", 0.13, 8, shown=False)
AREA = Layer("A-AREA", 0.13, 8, shown=False)
ROOM_TAG = Layer("A-AREA-IDEN", 0.18, 7)
DIMENSION = Layer("A-ANNO-DIMS", 0.13, 8, 0.25)
TITLE_BLOCK = Layer("A-ANNO-TTLB", 0.25, 7)
FRAME = Layer("A-ANNO-BRDR", 0.50, 7)
#: Paper under an opening, so that the faces that run on through it do not show: for ink alone, CAD keeps them whole.
BLANK = Layer("blank", 0.0, 7, 1.0)
#: The layers of a storey in the order in which they are drawn, what covers others last.
STOREY_LAYERS = (
    *(OUTLINE, AREA, STAIR, WALL_UNSEEN_PATTERN, WALL_PATTERN, WALL_CENTRELINE, WALL_UNSEEN, WALL),
    *(COLUMN_PATTERN, COLUMN, BLANK, UNKNOWN_OPENING, GLAZING, DOOR_HEAD, DOOR_SWING, DOOR, ROOM_TAG, DIMENSION),
)


@dataclass(frozen=True, kw_only=True)
class _Mark:
    """What all marks have: the layer, and the id of the element of the plan that they draw."""

    layer: Layer
    id: str = ""


@dataclass(frozen=True)
class Stroke(_Mark):
    """A line through points; `curve` is the curved wall it is a chord of."""

    points: Ring
    closed: bool = False
    curve: int | None = None


@dataclass(frozen=True)
class Arc(_Mark):
    """A circle about `centre`, or the part of it counter-clockwise from `start` to `end` (rad)."""

    centre: Point
    radius: float
    start: float = 0.0
    end: float | None = None

    @property
    def points(self) -> Ring:
        """Points along it, about 7.5 degrees apart; of a circle the first does not stand again as the last."""
        turn = (math.tau if self.end is None else self.end) - self.start
        steps = max(round(turn / math.radians(7.5)), 1)
        turns = [self.start + turn * i / steps for i in range(steps + (self.end is not None))]
        (x, y), radius = self.centre, self.radius
        return tuple((x + radius * math.cos(angle), y + radius * math.sin(angle)) for angle in turns)


@dataclass(frozen=True)
class Fill(_Mark):
    """A filled area: its outer ring, then its holes."""

    rings: tuple[Ring, ...]


@dataclass(frozen=True)
class Text(_Mark):
    """A line of text, its capitals `height` mm high, with its baseline's left end, centre or right end at `at`."""

    at: Point
    text: str
    height: float
    align: Literal["left", "centre", "right"] = "left"
    rotation: float = 0.0
    bold: bool = False


@dataclass(frozen=True)
class TagLine:
    """One line of a tag: what it tells, as text, and the height of its capitals, mm."""

    name: str
    text: str
    height: float


@dataclass(frozen=True)
class Tag(_Mark):
    """Lines of text, centred about `at`: in CAD one block with attributes."""

    at: Point
    lines: tuple[TagLine, ...]
    rotation: float = 0.0

    def texts(self, metre: float) -> Iterator[Text]:
        """Its lines from the top down, on paper where a metre takes `metre` mm."""
        sin, cos = math.sin(self.rotation), math.cos(self.rotation)
        v = tag_height(self.lines) / 2
        for line in self.lines:
            v -= line.height
            at = (self.at[0] - sin * v / metre, self.at[1] + cos * v / metre)
            bold = line is self.lines[0]
            yield Text(at, line.text, line.height, "centre", self.rotation, bold, layer=self.layer, id=self.id)
            v -= _LEADING * line.height


@dataclass(frozen=True)
class Dimension(_Mark):
    """The distance from `start` to `end`, written along a line through `base` that is parallel to them.

    From start to end its number is read from below or from the right.

    Attributes
    ----------
    level : lines of text by which the number is raised, so as not to run into its neighbour's.
    """

    start: Point
    end: Point
    base: Point
    level: int = 0


Mark = Stroke | Arc | Fill | Text | Tag | Dimension

DIMENSION_TEXT = 1.8
"""Height of the numbers of dimensions, mm."""
_LEADING = 0.75
"""Gap between lines of a tag, as a share of the height of the line above."""


def tag_height(lines: tuple[TagLine, ...]) -> float:
    """From the top of the first line to the baseline of the last, mm; 0 for no lines."""
    return sum((1 + _LEADING) * line.height for line in lines) - (_LEADING * lines[-1].height if lines else 0.0)


@functools.lru_cache(maxsize=4096)
def text_width(text: str, height: float, bold: bool = False) -> float:
    """Width on paper (mm) of text with capitals of `height` mm, in the typeface of SVG and PDF.

    >>> round(text_width("3.95", 2.5), 1)
    7.6
    """
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextToPath

    font = FontProperties(family="DejaVu Sans", weight="bold" if bold else "normal", size=100 * height / CAP_HEIGHT)
    return float(TextToPath().get_text_width_height_descent(text, font, ismath=False)[0]) / 100


def shortened(text: str, height: float, width: float) -> str:
    """The text, its end replaced by an ellipsis where it would be wider than `width` mm.

    >>> shortened("a long name.e57", 2.0, 15.0)
    'a long n…'
    """
    if text_width(text, height) <= width:
        return text
    while text and text_width(f"{text}…", height) > width:
        text = text[:-1]
    return f"{text.rstrip()}…"


CAP_HEIGHT = 0.729
"""Height of the capitals of DejaVu Sans, in ems."""
