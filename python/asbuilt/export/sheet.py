"""The sheet that a drawing is made for: its size, its scale, and where the plan lies on it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from asbuilt.errors import ParameterError

if TYPE_CHECKING:
    from asbuilt.plan import FloorPlan, Point, Storey

Bounds = tuple[float, float, float, float]
Size = tuple[float, float]

#: Sheets by name, width and height in mm, landscape; those that are chosen by themselves first, smallest first.
SHEETS: dict[str, Size] = {
    "A4": (297.0, 210.0),
    "A3": (420.0, 297.0),
    "A2": (594.0, 420.0),
    "A1": (841.0, 594.0),
    "A0": (1189.0, 841.0),
    "LETTER": (279.4, 215.9),
    "TABLOID": (431.8, 279.4),
    "ARCH-C": (609.6, 457.2),
    "ARCH-D": (914.4, 609.6),
    "ARCH-E": (1219.2, 914.4),
}
_ISO = ("A4", "A3", "A2", "A1", "A0")
SCALES = (20.0, 50.0, 100.0, 200.0, 250.0, 500.0, 1000.0, 2000.0, 5000.0)
"""Scales that are chosen by themselves, the largest drawing first."""
USUAL_SCALE = 100.0
MARGIN = 10.0
"""From the paper's edge to the frame, mm."""
PAD = 6.0
"""From the frame to the drawing, mm."""
_TITLE_BLOCK_WIDE, _TITLE_BLOCK_NARROW = 30.0, 58.0
"""Height of the title block, in one row or, on a narrow sheet, in two, mm."""
_WIDE = 265.0
SMALLEST: Size = (200.0, 130.0)
"""A sheet that is fitted to its drawing is at least this large, mm: the title block must be read."""


@dataclass(frozen=True)
class SheetOptions:
    """What a person may say about a drawing.

    Attributes
    ----------
    scale : "1:100"; None: 1:100 or the next that fits the sheet.
    sheet : "A3", "A3 portrait", "594x420" (mm), or None: the smallest that fits.
    north : of the plan, degrees clockwise from the input's y axis; None where it is not known.
    date : what the title block shows as date. There is no other: the same plan gives the same bytes.
    title : of the project.
    """

    scale: str | float | None = None
    sheet: str | None = None
    north: float | None = None
    date: str | None = None
    title: str | None = None

    def __post_init__(self) -> None:
        parse_scale(self.scale)
        parse_sheet(self.sheet)
        if self.north is not None and not math.isfinite(self.north):
            raise ParameterError(f"north is {self.north:g}, expected degrees clockwise from the y axis")


@dataclass(frozen=True)
class Sheet:
    """A sheet of paper (mm) at a scale (100 for 1:100); its name is "" where it was fitted to the drawing."""

    name: str
    width: float
    height: float
    scale: float

    @property
    def metre(self) -> float:
        """What a metre of the building takes on the paper, mm."""
        return 1000.0 / self.scale

    @property
    def full_name(self) -> str:
        """The name, and whether it is upright: "A4 portrait"."""
        return f"{self.name} portrait" if self.name in SHEETS and self.width < self.height else self.name

    @property
    def title_block(self) -> float:
        """Height of the title block, mm."""
        return _title_block(self.width)

    @property
    def drawing(self) -> Bounds:
        """Where the plan may lie: u0, v0, u1, v1, mm from the lower left corner of the paper."""
        edge = MARGIN + PAD
        return edge, MARGIN + self.title_block + PAD, self.width - edge, self.height - edge

    def holds(self, extent: Size) -> bool:
        """Whether a drawing of this width and height (mm) fits."""
        u0, v0, u1, v1 = self.drawing
        return extent[0] <= u1 - u0 + 1e-6 and extent[1] <= v1 - v0 + 1e-6


def parse_scale(scale: str | float | None) -> float | None:
    """The number of a scale: 100 for "1:100", "100" or 100.

    Raises
    ------
    ParameterError : it is no scale.
    """
    if scale is None:
        return None
    found = re.fullmatch(r"\s*(?:1\s*[:/]\s*)?(\d+(?:\.\d+)?)\s*", f"{scale}")
    if found is None or not 0 < float(found[1]) < math.inf:
        raise ParameterError(f"scale is {scale}, expected a positive number such as 1:100")
    return float(found[1])


def parse_sheet(sheet: str | None) -> list[tuple[str, Size]] | None:
    """Name and size of what a sheet's name can mean: landscape, then portrait, unless it says which.

    >>> parse_sheet("a4"), parse_sheet("A4 portrait")
    ([('A4', (297.0, 210.0)), ('A4', (210.0, 297.0))], [('A4', (210.0, 297.0))])

    Raises
    ------
    ParameterError : there is no such sheet.
    """
    if sheet is None:
        return None
    custom = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*[xX]\s*(\d+(?:\.\d+)?)\s*", sheet)
    if custom is not None:
        size = float(custom[1]), float(custom[2])
        if not (SMALLEST[1] <= min(size) and SMALLEST[0] <= max(size) <= 5000):
            smallest = f"{SMALLEST[0]:g}x{SMALLEST[1]:g}"
            raise ParameterError(f"sheet is {sheet}, expected WIDTHxHEIGHT from {smallest} to 5000x5000 mm")
        return [(f"{size[0]:g} x {size[1]:g} mm", size)]
    name, _, turn = sheet.strip().upper().partition(" ")
    if name not in SHEETS or turn.strip() not in ("", "PORTRAIT", "LANDSCAPE"):
        listed = ", ".join(SHEETS)
        raise ParameterError(f"sheet is {sheet!r}, expected {listed}, with or without portrait, or 594x420 in mm")
    width, height = SHEETS[name]
    ways = {"LANDSCAPE": (width, height), "PORTRAIT": (height, width)}
    return [(name, size) for way, size in ways.items() if turn.strip() in ("", way)]


def fitted_sheet(extent: Size, scale: float) -> Sheet:
    """A sheet without a name, as large as a drawing of this width and height (mm) needs."""
    edge = 2 * (MARGIN + PAD)
    width = max(extent[0] + edge, SMALLEST[0])
    return Sheet("", math.ceil(width), math.ceil(max(extent[1] + edge + _title_block(width), SMALLEST[1])), scale)


def _title_block(width: float) -> float:
    return _TITLE_BLOCK_WIDE if width - 2 * MARGIN >= _WIDE else _TITLE_BLOCK_NARROW


def sheets_to_try(options: SheetOptions) -> list[Sheet]:
    """Every sheet and scale that the options allow, the best first.

    A given scale takes the smallest sheet. A given sheet takes the largest drawing, though not above 1:50; neither
    given, 1:100 comes before all other scales.
    """
    scale, sizes = parse_scale(options.scale), parse_sheet(options.sheet)
    if scale is not None:
        scales = [scale]
    elif sizes is not None:
        scales = [known for known in SCALES if known >= 50]
    else:
        scales = [known for known in SCALES if known >= USUAL_SCALE]
    sizes = sizes or [each for name in _ISO for each in parse_sheet(name) or ()]
    return [Sheet(name, *size, known) for known in scales for name, size in sizes]


def what_would_fit(extent: Callable[[float], Size], options: SheetOptions) -> str:
    """One line for a drawing that does not fit its sheet: which scale or which sheet would hold it.

    Parameters
    ----------
    extent : width and height of the drawing at a scale, mm.
    options : with a sheet.
    """
    scale = parse_scale(options.scale) or SCALES[-1]
    of_that_size = sheets_to_try(SheetOptions(sheet=options.sheet))
    of_that_scale = sheets_to_try(SheetOptions(scale=scale))
    ways = [f"scale 1:{sheet.scale:g}" for sheet in of_that_size if sheet.holds(extent(sheet.scale))][:1]
    ways += [f"sheet {sheet.full_name}" for sheet in of_that_scale if sheet.holds(extent(scale))][:1]
    width, height = extent(scale)
    takes = f"at 1:{scale:g} the drawing takes {width:.0f} x {height:.0f} mm beside its title block"
    return f"{takes}, too much for sheet {options.sheet}; what fits: {' or '.join(ways) or 'no sheet up to A0'}"


def plan_bounds(plan: FloorPlan) -> Bounds | None:
    """The rectangle x0, y0, x1, y1 (m) that holds all storeys; None for a plan with nothing in it.

    All storeys together, so that the drawings of two storeys lie over each other.
    """
    points = [point for storey in plan for point in storey_points(storey)]
    if not points:
        return None
    xs, ys = zip(*points, strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def storey_points(storey: Storey) -> list[Point]:
    """Points (m) that hold all elements of a storey; none where there is nothing."""
    lines = (*storey.wall_faces, *storey.walls, *storey.doors, *storey.windows, *storey.unknown_openings)
    points = [point for line in lines for point in (line.start, line.end)]
    rings = [wall.outline for wall in storey.walls] + [room.ring for room in storey.rooms]
    rings += [column.ring for column in storey.columns] + [stair.ring for stair in storey.stairs]
    return points + [point for ring in (*rings, storey.outline or ()) for point in ring]


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
