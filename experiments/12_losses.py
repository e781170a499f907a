"""Where the default preset loses length, and why: a table by cause, and the five worst places of each case.

    python experiments/12_losses.py                  the shared cases, planned anew
    python experiments/12_losses.py --plans FOLDER   the plans that `accuracy.py --plans FOLDER` wrote

A loss is a stretch of observed truth that nothing was associated with (missed), or a piece of a detection that is
associated with no truth (false). Causes are told by the rules of `why_missed` and `why_false`, the first that holds,
from the truth and the plan alone: the points are only drawn. They say what stands there, not what the code did.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pypdfium2
import shapely
import shapely.ops
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from PIL import Image

import accuracy
import asbuilt
from asbuilt.density import density_image
from asbuilt.evaluate import evaluate
from asbuilt.evaluate.curves import curved_walls
from asbuilt.evaluate.drawing import DrawingStorey
from asbuilt.evaluate.figures import truth_stretches
from asbuilt.evaluate.result import StoreyEvaluation
from asbuilt.evidence import Evidence
from asbuilt.export import export
from asbuilt.plan import FloorPlan, Storey

PICTURES = accuracy.ROOT / "docs" / "accuracy"
MISSED = (
    "stair railing",
    "closet",
    "room not scanned",
    "drawn as an opening",
    "thin wall merged",
    "partition not drawn",
    "short return",
    "corner short",
    "facet of a curved wall",
    "behind clutter taken for wall",
    "hidden",
    "seen and not drawn",
)
FALSE = ("lintel", "corner long", "reveal of a window", "clutter taken for wall", "inside a wall", "ghost")
#: Losses shorter than this are rounding of the scorer, m.
LEAST = 0.001
#: Losses this near to each other are one place, m.
NEAR = 0.3
#: A face or a piece at the end of one up to this length is short, m.
SHORT = 0.5
#: Faces up to this far from each other are the two of a thin wall, m.
THIN = 0.12
#: Elements up to this far from the middle of a loss are at it, m: about half the thickness of a thick wall.
AT = 0.3
#: A room up to this area in which no scan stood is a closet, m2.
CLOSET = 4.0
WORST = 5
#: The case whose sheet opens the README.
SHEET = "flat"


@dataclass(frozen=True)
class Loss:
    """A stretch (2, 2), m, that was missed or is false, on one storey of the truth."""

    storey: int
    line: Any
    missed: bool
    cause: str

    @property
    def length(self) -> float:
        """Length, m."""
        return float(self.line.length)


@dataclass(frozen=True)
class Level:
    """What the rules look at: one storey's evaluation, the raw truth and the plan of it."""

    evaluation: StoreyEvaluation
    raw: dict[str, Any]
    scanned: frozenset[int] | None
    stairs: tuple[Any, ...]
    openings: tuple[Any, ...]

    @property
    def truth(self) -> DrawingStorey:
        """The truth of the storey."""
        return self.evaluation.truth or DrawingStorey(0, None)

    def left_over(self) -> Iterator[tuple[int, float, float, Any]]:
        """Each piece without association: row of its detection, start and end along it (m), and its line."""
        found, lines = self.evaluation.associations, (self.evaluation.plan or DrawingStorey(0, None)).lines
        for row, start, end in zip(found.left_detected, found.left_start, found.left_end, strict=True):
            if end - start > LEAST:
                whole = shapely.LineString(lines[row].reshape(2, 2))
                yield int(row), float(start), float(end), shapely.ops.substring(whole, start, end)


def losses_of(plan: FloorPlan, truth: dict[str, Any]) -> list[Loss]:
    """All losses of a plan, storey by storey."""
    drawn = {storey.index: storey for storey in plan}
    losses = []
    for evaluation in evaluate(plan, truth).storeys:
        if evaluation.truth is None:
            continue
        index = evaluation.truth.index
        scans = [scan for scan in truth["scans"] if scan["storey"] == index]
        mine = None if evaluation.plan is None else drawn[evaluation.plan.index]
        level = Level(
            evaluation,
            truth["storeys"][index],
            frozenset(scan["room"] for scan in scans) if all("room" in scan for scan in scans) else None,
            () if mine is None else tuple(shapely.Polygon(stair.ring) for stair in mine.stairs),
            () if mine is None else _openings(mine),
        )
        losses += [Loss(index, line, True, cause) for line, cause in _missed(level)]
        losses += [Loss(index, piece[3], False, why_false(level, *piece)) for piece in level.left_over()]
    return losses


def _openings(storey: Storey) -> tuple[Any, ...]:
    return tuple(shapely.LineString([o.start, o.end]) for o in (*storey.doors, *storey.unknown_openings))


def _missed(level: Level) -> Iterator[tuple[Any, str]]:
    found, truth = level.evaluation.associations, level.truth
    used = truth.in_use("observed")
    lines = truth.lines
    curve = curved_walls(lines)
    for row in np.flatnonzero(used):
        face = shapely.LineString(lines[row].reshape(2, 2))
        stretches = list(truth_stretches(found, used[found.truth], int(row), face.length))
        for low, high, depth in stretches:
            if depth == 0 and high - low > LEAST:
                yield (
                    shapely.ops.substring(face, low, high),
                    why_missed(level, int(row), low, high, face.length, bool(curve[row] >= 0)),
                )


def why_missed(level: Level, row: int, low: float, high: float, length: float, curved: bool) -> str:
    """The cause of a missed stretch from `low` to `high` of a true face: the first rule that holds.

    - stair railing: beside the plan's stairs, and the truth has no room there or the face is inside one.
    - closet, room not scanned: the room of the face has no scan in it; a closet has at most 4 m2.
    - drawn as an opening: the plan has a door or an unknown opening there.
    - thin wall merged: another true face is within 12 cm beside it and a face is drawn there;
      partition not drawn: none is.
    - short return: the face is shorter than 0.5 m. Facet of a curved wall: it is one.
    - corner short: up to 0.5 m at the end of a face the rest of which was found.
    - behind clutter taken for wall: a false face in front of it, at most 1 m off.
    - hidden: no longer than what no scan hit of its face (the truth says how much, not where).
    - seen and not drawn: what remains.
    """
    face = shapely.LineString(level.truth.lines[row].reshape(2, 2))
    stretch = shapely.ops.substring(face, low, high)
    middle = stretch.centroid
    if any(stair.distance(middle) < AT for stair in level.stairs):
        return "stair railing"
    room = _room(level, middle)
    if room is not None and level.scanned is not None and room not in level.scanned:
        return "closet" if level.raw["rooms"][room]["area"] <= CLOSET else "room not scanned"
    if any(opening.distance(middle) < AT and _parallel(opening, face) for opening in level.openings):
        return "drawn as an opening"
    others = [shapely.LineString(line.reshape(2, 2)) for i, line in enumerate(level.truth.lines) if i != row]
    beside = [other for other in others if 0.01 < other.distance(middle) < THIN and _parallel(other, face)]
    if beside:
        drawn = (level.evaluation.plan or DrawingStorey(0, None)).lines
        near = [shapely.LineString(line.reshape(2, 2)) for line in drawn]
        found = any(line.distance(middle) < THIN and _parallel(line, face) for line in near)
        return "thin wall merged" if found else "partition not drawn"
    if curved:
        return "facet of a curved wall"
    if length < SHORT:
        return "short return"
    at_end = low < LEAST or high > length - LEAST
    if at_end and high - low < min(SHORT, length - LEAST):
        return "corner short"
    if any(piece.distance(middle) < 1.0 and _parallel(piece, face) for *_, piece in level.left_over()):
        return "behind clutter taken for wall"
    observed = level.truth.faces[row].observed
    return "hidden" if high - low < (1 - observed) * length + 0.05 else "seen and not drawn"


def why_false(level: Level, row: int, start: float, end: float, piece: Any) -> str:
    """The cause of a piece of a detection that is associated with nothing: the first rule that holds.

    - lintel: along a true door, within its wall. Reveal of a window: across a true window.
    - corner long: up to 0.5 m at the end of a detection the rest of which is true.
    - clutter taken for wall: within a true room (within the outline where the truth has no rooms).
    - inside a wall: within the outline, in no room. Ghost: outside.
    """
    middle = piece.centroid
    doors = [shapely.LineString(np.reshape(door.line, (2, 2))) for door in level.truth.doors]
    if any(door.distance(middle) < AT and _parallel(door, piece) for door in doors):
        return "lintel"
    found = level.evaluation.associations
    if end - start < SHORT and bool((found.detected == row).any()):
        return "corner long"
    windows = [shapely.LineString(np.reshape(window.line, (2, 2))) for window in level.truth.windows]
    if any(window.distance(middle) < 2 * AT and not _parallel(window, piece) for window in windows):
        return "reveal of a window"
    rooms = [shapely.Polygon(room["polygon"]) for room in level.raw["rooms"]]
    outline = shapely.Polygon(level.raw["outline"])
    if any(room.contains(middle) for room in rooms or [outline]):
        return "clutter taken for wall"
    return "inside a wall" if outline.contains(middle) else "ghost"


def _room(level: Level, place: Any) -> int | None:
    """The room on whose boundary a place lies, within 10 cm."""
    distances = [shapely.Polygon(room["polygon"]).exterior.distance(place) for room in level.raw["rooms"]]
    return int(np.argmin(distances)) if distances and min(distances) < 0.1 else None


def _parallel(one: Any, other: Any) -> bool:
    """Whether two segments differ by less than about 20 degrees."""
    a, b = (np.diff(shapely.get_coordinates(line), axis=0)[0] for line in (one, other))
    return abs(float(a @ b)) > 0.94 * float(np.hypot(*a) * np.hypot(*b))


def places(losses: list[Loss]) -> list[list[Loss]]:
    """Losses that lie near each other, the places of the greatest length first."""
    found: list[list[Loss]] = []
    for loss in losses:
        touching = [p for p in found if any(o.storey == loss.storey and o.line.distance(loss.line) < NEAR for o in p)]
        found = [place for place in found if place not in touching]
        found.append([loss, *(other for place in touching for other in place)])
    return sorted(found, key=lambda place: -sum(loss.length for loss in place))


def causes(place: list[Loss]) -> str:
    """What happened at a place, in one line."""
    sums: defaultdict[tuple[bool, str], float] = defaultdict(float)
    for loss in place:
        sums[loss.missed, loss.cause] += loss.length
    listed = sorted(sums.items(), key=lambda item: -item[1])
    said = [f"{cause} ({'missed' if missed else 'false'}, {length:.2f} m)" for (missed, cause), length in listed]
    return ", ".join(said[:1] + [part for part, (_, length) in zip(said, listed, strict=True) if length >= 0.05][1:])


def work(name: str, plans: Path | None) -> tuple[dict[str, dict[str, float]], list[str]]:
    """One case: length by cause, the lines on its worst places; the picture of them is written."""
    folder = accuracy.CASES / name
    parameters = asbuilt.Parameters.preset("default")
    evidence = asbuilt.gather_evidence(asbuilt.read(folder / "scans.laz"), parameters.evidence, threads=1)
    if plans is None:
        plan = asbuilt.extract_floor_plan(evidence, parameters)
    else:
        plan = asbuilt.load_plan(plans / f"{name}.geojson")
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    losses = losses_of(plan, truth)
    table: dict[str, dict[str, float]] = {"missed": dict.fromkeys(MISSED, 0.0), "false": dict.fromkeys(FALSE, 0.0)}
    for loss in losses:
        table["missed" if loss.missed else "false"][loss.cause] += loss.length
    worst = places(losses)[:WORST]
    _draw(name, worst, plan, truth, evidence)
    if name == SHEET:
        _draw_sheet(plan)
    return table, [f"storey {place[0].storey}: {causes(place)}" for place in worst]


def _draw(name: str, worst: list[list[Loss]], plan: FloorPlan, truth: dict[str, Any], evidence: Evidence) -> None:
    """The places side by side: truth green, faces drawn blue, missed red, false orange, over the density in grey."""
    figure = Figure(figsize=(2.0 * WORST, 2.2), facecolor="white", layout="constrained")
    matched = {s.truth.index: s.plan.index for s in evaluate(plan, truth).storeys if s.truth and s.plan}
    for number, (axes, place) in enumerate(zip(figure.subplots(1, WORST), worst, strict=False), 1):
        index = place[0].storey
        drawn_faces: list[Any] = []
        mine = next((storey for storey in plan if storey.index == matched.get(index)), None)
        if mine is not None:
            image, extent = density_image(evidence, mine)
            axes.imshow(image, extent=extent, origin="lower", cmap="Greys", vmin=0, vmax=90, interpolation="nearest")
            drawn_faces = [(face.start, face.end) for face in mine.wall_faces]
        walls = [np.reshape(wall["p"], (2, 2)) for wall in truth["storeys"][index]["walls"]]
        _lines(axes, walls, "#9be0a8", 4.5)
        _lines(axes, drawn_faces, "#1f5fd0", 1.3)
        _lines(axes, [loss.line.coords for loss in place if loss.missed], "#e00020", 2.6)
        _lines(axes, [loss.line.coords for loss in place if not loss.missed], "#ff8c00", 2.6)
        x0, y0, x1, y1 = shapely.union_all([loss.line for loss in place]).bounds
        half = max(x1 - x0, y1 - y0) / 2 + 1.0
        axes.set(xlim=((x0 + x1) / 2 - half, (x0 + x1) / 2 + half), ylim=((y0 + y1) / 2 - half, (y0 + y1) / 2 + half))
        axes.set(xticks=[], yticks=[])
        axes.set_title(f"{number}: {2 * half:.1f} m wide", fontsize=7)
    PICTURES.mkdir(exist_ok=True)
    path = PICTURES / f"{name}.png"
    FigureCanvasAgg(figure).print_figure(path, dpi=90, metadata={"Software": None})
    with Image.open(path) as picture:
        picture.convert("RGB").quantize(128).save(path, optimize=True)


def _draw_sheet(plan: FloorPlan) -> None:
    """The first page of the plan's PDF as a picture."""
    with TemporaryDirectory() as folder:
        (path,) = export(plan, Path(folder) / "plan.pdf")
        with pypdfium2.PdfDocument(path) as document:
            page = document[0].render(scale=0.92).to_pil()
    page.convert("L").quantize(16).save(PICTURES / "sheet.png", optimize=True)


def _lines(axes: Axes, lines: list[Any], colour: str, width: float) -> None:
    axes.add_collection(LineCollection(lines, colors=colour, linewidths=width, capstyle="butt"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plans", type=Path, metavar="FOLDER", help="plans to look at; made anew without")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    arguments = parser.parse_args()
    names = sorted(name for group, name in accuracy.jobs([]) if group == accuracy.SHARED)
    if not names:
        parser.exit(1, f"{accuracy.CASES} is absent; ASBUILT_CASES names another place\n")
    with ProcessPoolExecutor(arguments.jobs, mp_context=get_context("spawn")) as processes:
        found = dict(zip(names, processes.map(partial(work, plans=arguments.plans), names), strict=True))
    lengths = {name: table for name, (table, _) in found.items()}
    results = accuracy.KEPT.parent
    written = {"command": "python experiments/12_losses.py", "version": asbuilt.__version__, "length_m": lengths}
    rounded = json.loads(json.dumps(written), parse_float=lambda text: round(float(text), 3))
    (results / "12_losses.json").write_text(json.dumps(rounded, indent=1) + "\n", encoding="utf-8")
    (results / "12_losses.md").write_text(_table(lengths), encoding="utf-8")
    sections = []
    for name, (_, lines) in found.items():
        listed = "\n".join(f"{i}. {line}" for i, line in enumerate(lines, 1))
        sections.append(f"### {name}\n\n![The worst places of {name}](accuracy/{name}.png)\n\n{listed}\n")
    (results / "12_worst.md").write_text("\n".join(sections), encoding="utf-8")


def _table(lengths: dict[str, dict[str, dict[str, float]]]) -> str:
    lines = ["| m | " + " | ".join([*lengths, "all"]) + " |", "|---" + "|---:" * (len(lengths) + 1) + "|"]
    for kind, listed in (("missed", MISSED), ("false", FALSE)):
        rows = [[table[kind][cause] for table in lengths.values()] for cause in listed]
        totals = [sum(column) for column in zip(*rows, strict=True)]
        for cause, row in ((f"**{kind}**", totals), *zip(listed, rows, strict=True)):
            cells = [f"{value:.1f}" if value >= 0.05 else "-" for value in (*row, sum(row))]
            lines.append(f"| {cause} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
