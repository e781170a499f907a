"""Section 6 of the paper, its future work: a Hough transform that takes uncertainty into account, for the threshold.

The same search with a cell's vote set by the paper's threshold, by the share of the height it fills, or by a learned
probability, on cells of 10 cm of which only the count is known, and on those of 5 cm whose points' moments are known.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import asbuilt
import common
import uncertain_hough
from asbuilt import Evidence, merge_collinear
from asbuilt.grid import FloatArray
from asbuilt.params import RefineParameters
from asbuilt.storeys import Level
from common import CASES, PAPER, VOXEL, load_case
from uncertain_hough import (
    Cells,
    above_threshold,
    cells_of_points,
    cells_without_points,
    detect_lines,
    filled_share,
    fit_to_points,
    wall_probability,
)

HEIGHTS = {"nine lowest slices": "lowest", "all": "all"}
PROGRAM, COUNTS, MOMENTS = "the paper's program", "10 cm, counts alone", "5 cm, points' moments"
VOTES = {
    "1 above 2.5 sigma": lambda cells: above_threshold(cells, 2.5),
    "share of the height": filled_share,
    "learned probability": wall_probability,
}
VARIANTS = (
    ("nine lowest slices", PROGRAM, "1 above 2.5 sigma"),
    ("all", PROGRAM, "1 above 2.5 sigma"),
    ("all", PROGRAM, "1 above 4 sigma"),  # the best on all heights, found with the truth (02_parameters)
    ("all", COUNTS, "share of the height"),
    ("all", COUNTS, "learned probability"),
    ("all", MOMENTS, "1 above 2.5 sigma"),
    ("all", MOMENTS, "learned probability"),
    ("all", MOMENTS, "share of the height"),
    ("nine lowest slices", MOMENTS, "share of the height"),
)


def main() -> None:
    storeys = common.storeys_of()
    found = dict(zip(storeys, common.in_parallel(_storey, storeys), strict=True))
    results = [
        {
            **dict(zip(("heights", "cells", "vote"), variant, strict=True)),
            **common.by_storey({key: parts[variant][0] for key, parts in found.items()}),
            "seconds": round(sum(parts[variant][1] for parts in found.values()), 1),
        }
        for variant in VARIANTS
    ]
    common.write_result("07_uncertainty", results, {**PAPER.as_dict(), "uncertain_hough": uncertain_hough.CONSTANTS})
    heading = ["heights", "cells", "vote", "P", "R", "F observed", "F all", *(f"F {case}" for case in CASES)]
    heading += ["E_D, mm", "E_Theta, °", "E_OS", "E_OL", "CPU time, s"]
    common.write_table("07_uncertainty", heading, [_row(result) for result in results])
    _draw()


def _row(result: dict[str, Any]) -> list[Any]:
    observed, everything = result["pooled"]["observed"], result["pooled"]["all"]
    return [
        *(result[key] for key in ("heights", "cells", "vote")),
        *(observed[key] for key in ("precision", "recall", "f")),
        everything["f"],
        *(result["cases"][case]["pooled"]["observed"]["f"] for case in CASES),
        f"{1000 * observed['distance_error']:.1f}",
        f"{observed['orientation_error_deg']:.2f}",
        f"{observed['over_segmentation']:.2f}",
        observed["overlap"],
        f"{result['seconds']:.0f}",
    ]


def _storey(key: tuple[str, int]) -> dict[tuple[str, str, str], tuple[common.Totals, float]]:
    """Scores and processor time, s, of every variant on one storey."""
    case, evidence = load_case(key[0]), _evidence(key[0])
    level = case.levels[key[1]]
    cells = {heights: _cells(case, level, evidence, select) for heights, select in HEIGHTS.items()}
    found = {}
    for heights, kind, vote in VARIANTS:
        start = time.process_time()
        if kind == PROGRAM:
            lines = {"sigmas": float(vote.split()[2])}
            totals = common.run_paper((*key, {"cross_sections": {"select": HEIGHTS[heights]}, "lines": lines}))
        else:
            some = cells[heights][kind]
            totals = common.score(case, level, find_segments(some, VOTES[vote](some)))
        found[heights, kind, vote] = totals, time.process_time() - start
    return found


def _evidence(name: str) -> Evidence:
    return asbuilt.gather_evidence(asbuilt.read(common.case_folder(name) / "scans.laz"), PAPER.evidence)


def _cells(case: common.Case, level: Level, evidence: Evidence, select: str) -> dict[str, Cells]:
    parameters = PAPER.replace(cross_sections={"select": select})
    histogram = common.paper_histogram(case, level, parameters)
    selected = case.occupied[
        asbuilt.select_cross_sections(case.occupied, VOXEL, level, parameters.storeys.slab, parameters.cross_sections)
    ]
    without = cells_without_points(histogram, len(np.unique(selected[:, 2])))
    return {COUNTS: without, MOMENTS: cells_of_points(evidence, selected, VOXEL)}


def find_segments(cells: Cells, weight: FloatArray) -> FloatArray:
    """Lines, those that are one joined, and each fitted: segments (n, 4), m."""
    lines = detect_lines(cells, weight)
    joined = merge_collinear(lines, RefineParameters(merge_distance=cells.side))
    return fit_to_points(joined, cells, weight)


def _draw() -> None:
    """The school's first floor: left the paper's, right by the votes of all points."""
    case = load_case("school")
    level = case.levels[1]
    truth = case.storey_of(level)
    cells = _cells(case, level, _evidence(case.name), "all")[MOMENTS]
    plans = {
        "the paper: threshold, nine lowest slices": common.paper_segments(common.paper_histogram(case, level)),
        "no threshold: the points' own votes, all heights": find_segments(cells, filled_share(cells)),
    }
    figure = Figure(figsize=(9, 4.4), layout="constrained")
    for axes, (title, segments) in zip(figure.subplots(1, 2), plans.items(), strict=True):
        totals = common.score(case, level, segments)["observed"]
        text = f"{title}\nF = {totals.f:.3f}, {1000 * (totals.distance_error or 0):.1f} mm"
        common.draw_plan(axes, segments, truth.lines, text)
    common.write_picture("figure_uncertainty", figure, dpi=90)


if __name__ == "__main__":
    main()
