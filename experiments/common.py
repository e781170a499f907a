"""What the experiments share: a case's evidence, the paper's stages on it, scores, and results with their origin.

A case is read once and kept in ``out/experiments`` under the checksum of its data; `make experiments` starts without
that folder, so that nothing read by earlier code remains. The cases are looked for in ``../shared/cases`` beside the
checkout, or where ``ASBUILT_CASES`` says.
"""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

import asbuilt
from asbuilt import Parameters
from asbuilt.evaluate import Drawing, Face, WallTotals, as_drawing, associate, measure_walls
from asbuilt.evaluate.drawing import TRUTH_SETS, DrawingStorey, TruthSet
from asbuilt.grid import FloatArray, IntArray
from asbuilt.ground import GroundPlaneHistogram
from asbuilt.indices import unique_rows
from asbuilt.storeys import Level, drop_strays, find_storeys

matplotlib.use("Agg")

REPOSITORY = Path(__file__).resolve().parent.parent
RESULTS = Path(__file__).resolve().parent / "results"
CASES = ("school", "skewed", "rotunda")
PAPER = Parameters.preset("paper")
VOXEL = PAPER.storeys.voxel
#: What the paper reports (sections 5.1, 5.2 and 5.4). F is of its first floor alone.
REPORTED = {
    "f": 0.6642,
    "f_batch": 0.6263,
    "distance_error": 0.049,
    "orientation_error_deg": 0.705,
    "over_segmentation": 0.59,
    "overlap": 0.265,
    "slices": 9,
}
Totals = dict[TruthSet, WallTotals]


@dataclass(frozen=True)
class Case:
    """One case, reduced to what the paper's stages need.

    Attributes
    ----------
    occupied : occupied voxels (n, 3) of 10 cm, strays left out; `points` (n,) counts the points in each.
    levels : the storeys that `find_storeys` found; those of these cases are the truth's, in its order.
    input : name, size and checksum of the data.
    """

    name: str
    occupied: IntArray
    points: IntArray
    levels: tuple[Level, ...]
    truth: Drawing
    input: dict[str, Any]

    def storey_of(self, level: Level) -> DrawingStorey:
        """The truth's storey at a level."""
        return min(self.truth, key=lambda storey: abs((storey.floor or 0.0) - level.floor))


def case_folder(name: str) -> Path:
    """Where the files of a case are; exits, saying so, where they are not."""
    folder = Path(os.environ.get("ASBUILT_CASES", REPOSITORY.parent / "shared" / "cases")) / name
    if not folder.is_dir():
        sys.exit(f"{folder}: no such case; ASBUILT_CASES names the folder that holds the cases")
    return folder


@cache
def load_case(name: str) -> Case:
    """A case, from the kept file if its data have been read before."""
    folder = case_folder(name)
    cloud = asbuilt.read(folder / "scans.laz")
    file = cloud.files[0]
    data = {"name": f"{name}/{file.path.name}", "size": file.size, "checksum": file.checksum()}
    cached = cache_file(data["checksum"], "evidence.npz")
    if not cached.exists():
        evidence = asbuilt.gather_evidence(cloud, PAPER.evidence)
        levels = find_storeys(evidence, PAPER.storeys)
        occupied = drop_strays(evidence.occupied(VOXEL))
        coarse = evidence.index // round(VOXEL / evidence.voxel)
        heights = [(level.floor, level.ceiling) for level in levels]
        points = _points_in(occupied, coarse, evidence.count)
        np.savez(cached, occupied=occupied.astype(np.int32), points=points, heights=heights)
    with np.load(cached) as arrays:
        levels = [Level(i, *map(float, heights)) for i, heights in enumerate(arrays["heights"])]
        occupied, points = arrays["occupied"].astype(np.int64), arrays["points"]
    return Case(name, occupied, points, tuple(levels), as_drawing(folder / "truth.json"), data)


def cache_file(checksum: str, name: str) -> Path:
    """Where to keep a file that was made from data with this checksum."""
    folder = REPOSITORY / "out" / "experiments" / checksum.split(":")[1][:16]
    folder.mkdir(parents=True, exist_ok=True)
    return folder / name


def _points_in(occupied: IntArray, index: IntArray, count: IntArray) -> IntArray:
    """Points in each of the voxels `occupied` (sorted), from finer voxels with their coarse `index`."""
    coarse = unique_rows(index)
    low, span = coarse.min(axis=0), np.ptp(coarse, axis=0).astype(np.int64) + 1

    def keys(rows: IntArray) -> IntArray:
        local = rows - low
        return (local[:, 0] * span[1] + local[:, 1]) * span[2] + local[:, 2]

    totals = np.bincount(np.searchsorted(keys(coarse), keys(index)), weights=count)
    return totals[np.searchsorted(keys(coarse), keys(occupied))].astype(np.int64)


def truth_heights(name: str) -> list[tuple[float, float]]:
    """Height (m) of the floor and of the highest ceiling of each of a case's true storeys."""
    storeys = json.loads((case_folder(name) / "truth.json").read_text(encoding="utf-8"))["storeys"]
    return [(storey["floor"], storey["floor"] + storey["height"]) for storey in storeys]


def storeys_of(names: Iterable[str] = CASES) -> list[tuple[str, int]]:
    """(case, storey) of all storeys of some cases."""
    return [(name, level.index) for name in names for level in load_case(name).levels]


def paper_histogram(case: Case, level: Level, parameters: Parameters = PAPER) -> GroundPlaneHistogram:
    """Sections 3.1, 3.2 and 5.3."""
    selected = asbuilt.select_cross_sections(
        case.occupied, VOXEL, level, parameters.storeys.slab, parameters.cross_sections
    )
    return asbuilt.ground_plane_histogram(case.occupied[selected], VOXEL)


def paper_segments(histogram: GroundPlaneHistogram, parameters: Parameters = PAPER) -> FloatArray:
    """Sections 3.3 and 3.4, and the clean-up: wall segments (n, 4), m, of a ground-plane histogram."""
    segments = asbuilt.detect_lines(histogram, parameters.lines)
    dominant = asbuilt.dominant_orientations(segments, parameters.orientation) or ()
    segments = asbuilt.snap_to(segments, dominant, parameters.orientation.snap)
    if parameters.refine.merge:
        merged = asbuilt.merge_collinear(segments, parameters.refine)
        segments = asbuilt.fit_to_cells(merged, histogram, parameters.lines)
    return segments


def score(case: Case, level: Level, segments: FloatArray, max_distance: float | None = 0.25) -> Totals:
    """Section 4 for one storey, against both truths."""
    truth = case.storey_of(level)
    lines = truth.truth_lines
    found = associate(segments, lines, max_distance)
    return {which: measure_walls(found, segments, lines, truth.in_use(which)) for which in TRUTH_SETS}


def drawing(case: Case, segments: Sequence[FloatArray]) -> Drawing:
    """Wall segments (n, 4), m, of each of a case's storeys, as `evaluate` takes them."""
    storeys = (
        DrawingStorey(
            level.index, level.floor, tuple(Face(tuple(line), str(i)) for i, line in enumerate(lines.tolist()))
        )
        for level, lines in zip(case.levels, segments, strict=True)
    )
    return Drawing(tuple(storeys), frozenset(), case.name)


def run_paper(job: tuple[str, int, dict[str, Any]]) -> Totals:
    """Score the paper's method on a storey, with changes to its preset."""
    name, storey, changes = job
    case, parameters = load_case(name), PAPER.replace(**changes)
    level = case.levels[storey]
    return score(case, level, paper_segments(paper_histogram(case, level, parameters), parameters))


def in_parallel(function: Callable[[Any], Any], jobs: Sequence[Any]) -> list[Any]:
    """`function` of each job, in their order, on all cores."""
    with ProcessPoolExecutor(mp_context=get_context("fork")) as pool:
        return list(pool.map(function, jobs, chunksize=1))


def pooled(parts: Iterable[Totals]) -> Totals:
    """Storeys added up: lengths, never ratios."""
    listed = list(parts)
    return {which: sum((part[which] for part in listed), WallTotals()) for which in TRUTH_SETS}


def measures(totals: Totals) -> dict[str, dict[str, float | None]]:
    """The measures of section 4, by truth, rounded to what the data can bear."""
    names = ("precision", "recall", "f", "distance_error", "orientation_error_deg", "over_segmentation", "overlap")
    table: dict[str, dict[str, float | None]] = {}
    for which, walls in totals.items():
        values = {name: getattr(walls, name) for name in names}
        table[which] = {name: _rounded(value) for name, value in values.items()}
    return table


def by_storey(scores: dict[tuple[str, int], Totals]) -> dict[str, Any]:
    """Measures per storey, per case and over all cases."""
    names = dict.fromkeys(name for name, _ in scores)
    table: dict[str, Any] = {
        name: {
            "storeys": [measures(part) for (case, _), part in scores.items() if case == name],
            "pooled": measures(pooled(part for (case, _), part in scores.items() if case == name)),
        }
        for name in names
    }
    return {"cases": table, "pooled": measures(pooled(scores.values()))}


def curves(values: Sequence[Any], scores: Sequence[dict[tuple[str, int], Totals]]) -> dict[str, Any]:
    """Precision, recall and F over the values of a parameter: per storey, per case and over all; with the best by F."""
    keys = list(scores[0])
    groups: dict[str, list[tuple[str, int]]] = {f"{name} {storey}": [(name, storey)] for name, storey in keys}
    groups |= {name: [key for key in keys if key[0] == name] for name in dict.fromkeys(name for name, _ in keys)}
    groups["pooled"] = keys
    table: dict[str, Any] = {"values": list(values)}
    for group, members in groups.items():
        table[group] = {}
        for which in TRUTH_SETS:
            walls = [pooled(score[key] for key in members)[which] for score in scores]
            columns = {name: [_rounded(getattr(w, name)) for w in walls] for name in ("precision", "recall", "f")}
            best = int(np.argmax([w.f or 0.0 for w in walls]))
            table[group][which] = {**columns, "best": values[best], "best_f": columns["f"][best]}
    return table


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(float(value), 5)


def write_result(
    name: str, results: Any, parameters: dict[str, Any] | None = None, cases: Sequence[str] = CASES
) -> None:
    """Write results/NAME.json with what made it: command, version, parameters and the checksums of the data."""
    origin = {
        "command": f"python experiments/{Path(sys.argv[0]).name}",
        "version": asbuilt.__version__,
        "data": [load_case(case).input for case in cases],
        "parameters": PAPER.as_dict() if parameters is None else parameters,
        "results": results,
    }
    RESULTS.mkdir(exist_ok=True)
    text = json.dumps(origin, indent=1, ensure_ascii=False)
    # rows of numbers read better, and differ better, on one line
    text = re.sub(r"\[\s+([^\[\]{}]*?)\s+\]", lambda found: f"[{' '.join(found[1].split())}]", text)
    (RESULTS / f"{name}.json").write_text(text + "\n", encoding="utf-8")


def write_table(name: str, heading: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write results/NAME.md: a table for the page of the documentation."""
    lines = ["| " + " | ".join(heading) + " |", "|---" + "|---:" * (len(heading) - 1) + "|"]
    lines += ["| " + " | ".join(_cell(value) for value in row) + " |" for row in rows]
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / f"{name}.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.3f}" if isinstance(value, float) else str(value)


def write_picture(name: str, figure: Figure, dpi: int = 80, colours: int = 128) -> None:
    """Write results/NAME.png with few colours, so that it stays small."""
    from PIL import Image

    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.png"
    figure.savefig(path, dpi=dpi, metadata={"Software": None})
    with Image.open(path) as image:
        image.convert("RGB").quantize(colours).save(path, optimize=True)


def draw_plan(axes: Any, segments: FloatArray, truth: FloatArray, title: str) -> None:
    """Segments over the truth, to scale."""
    draw_segments(axes, truth, "#c8c8c8", 2.2)
    draw_segments(axes, segments, "#1f4fa3", 0.9)
    axes.set_title(title, fontsize=9)
    low, high = truth.reshape(-1, 2).min(axis=0) - 1, truth.reshape(-1, 2).max(axis=0) + 1
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))


def class_room(case: Case, level: Level) -> tuple[FloatArray, FloatArray]:
    """Corners (x, y), m, of the rectangle around a storey's first class room: the one room of figures 3 and 8."""
    room = next(room for room in case.storey_of(level).rooms if room.properties.get("kind") == "class")
    ring = np.array(room.ring)
    return ring.min(axis=0) - 0.8, ring.max(axis=0) + 0.8


def draw_segments(axes: Any, segments: FloatArray, colour: str, width: float = 1.0, label: str | None = None) -> None:
    """Draw segments (n, 4), m, to scale."""
    from matplotlib.collections import LineCollection

    lines = LineCollection(list(segments.reshape(-1, 2, 2)), colors=colour, linewidths=width, label=label)
    axes.add_collection(lines)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.autoscale_view()
