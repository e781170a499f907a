"""Section 5.2 and figures 8 and 9 of the paper: the batch against the incremental Hough transform, and how to stop.

Each search is tuned for itself, one parameter after another, on the pooled F of all truth (the paper's reading); the
incremental one is also shown at the paper's settings. The stop by number of lines is compared with that by strength.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

import common
from common import PAPER, load_case

THRESHOLDS = [2.0, 2.5, 3.0, 4.0]
# Below 40 votes (4 m of wall) the batch search finds tens of thousands of lines a storey, which take minutes to merge
# and have a lower F (0.59 and 0.60 of all truth at 10 and 20 votes on the school's first floor, 0.72 at 40).
BATCH = {"method": "batch", "min_votes": 40, "min_length": 1.0}
TUNING: dict[str, dict[str, list[float]]] = {
    "batch": {"min_votes": [40, 60, 90], "min_length": [1.0, 2.0], "fill_gap": [0.4, 0.7], "sigmas": THRESHOLDS},
    "incremental": {"min_votes": [4, 9], "min_length": [0.2, 1.0, 2.0], "fill_gap": [0.4, 0.7], "sigmas": THRESHOLDS},
}
STRENGTHS = [4, 6, 9, 14, 20]
NUMBERS = [50, 100, 300, 500, 800]


def main() -> None:
    storeys = common.storeys_of()
    batch, batch_steps = _tune(storeys, BATCH, TUNING["batch"])
    tuned, tuned_steps = _tune(storeys, {}, TUNING["incremental"])
    results = {
        "tuned": {"incremental": tuned, "batch": batch},
        "tuning": {"incremental": tuned_steps, "batch": batch_steps},
        "incremental": common.by_storey(_scores(storeys, {})),
        "incremental_tuned": common.by_storey(_scores(storeys, tuned)),
        "batch_tuned": common.by_storey(_scores(storeys, batch)),
        "stop_by_strength": _sweep(storeys, "min_votes", STRENGTHS, {}),
        "stop_by_number": _sweep(storeys, "max_lines", NUMBERS, {}),
    }
    common.write_result("03_batch_or_incremental", results)
    _write_tables(results)
    _draw_room()
    _draw_floor(batch)


def _scores(storeys: list[tuple[str, int]], changes: dict[str, Any]) -> dict[tuple[str, int], common.Totals]:
    jobs = [(name, storey, {"lines": changes}) for name, storey in storeys]
    return dict(zip(storeys, common.in_parallel(common.run_paper, jobs), strict=True))


def _sweep(storeys: list[tuple[str, int]], parameter: str, values: list[Any], base: dict[str, Any]) -> dict[str, Any]:
    jobs = [(name, storey, {"lines": {**base, parameter: value}}) for value in values for name, storey in storeys]
    totals = iter(common.in_parallel(common.run_paper, jobs))
    return common.curves(values, [{key: next(totals) for key in storeys} for _ in values])


def _tune(
    storeys: list[tuple[str, int]], start: dict[str, Any], values: dict[str, list[float]]
) -> tuple[dict[str, Any], dict[str, Any]]:
    best, steps = dict(start), {}
    for parameter, some in values.items():
        steps[parameter] = _sweep(storeys, parameter, some, best)
        best[parameter] = steps[parameter]["pooled"]["all"]["best"]
    return best, steps


def _write_tables(results: dict[str, Any]) -> None:
    rows = []
    for name in (*common.CASES, "pooled"):
        for which in ("observed", "all"):
            row: list[Any] = [f"{name}, {which}"]
            for method in ("incremental", "incremental_tuned", "batch_tuned"):
                found = results[method]["pooled"] if name == "pooled" else results[method]["cases"][name]["pooled"]
                row += [found[which]["precision"], found[which]["recall"], found[which]["f"]]
                row += [found[which]["over_segmentation"]]
            rows.append(row)
    heading = [f"{method} {m}" for method in ("incr.", "incr. tuned", "batch tuned") for m in ("P", "R", "F", "E_OS")]
    common.write_table("03_batch_or_incremental", ["truth", *heading], rows)
    rows = []
    for group in results["stop_by_strength"]:
        if group != "values":
            strength, number = (results[key][group]["all"] for key in ("stop_by_strength", "stop_by_number"))
            rows.append((group, strength["best"], strength["best_f"], number["best"], number["best_f"]))
    common.write_table("03_stop", ["storey", "best strength, votes", "F all", "best number", "F all"], rows)


def _draw_room() -> None:
    """Figure 8a to c: one room at a low, the best and a high threshold."""
    case = load_case("school")
    level = case.levels[1]
    truth = case.storey_of(level)
    low, high = common.class_room(case, level)
    figure = Figure(figsize=(9, 3.2), layout="constrained")
    for axes, sigmas in zip(figure.subplots(1, 3), (0.5, 2.5, 6.0), strict=True):
        parameters = PAPER.replace(lines={"sigmas": sigmas})
        segments = common.paper_segments(common.paper_histogram(case, level, parameters), parameters)
        common.draw_plan(axes, segments, truth.lines, f"threshold {sigmas:g} sigma")
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    common.write_picture("figure_08_room", figure)


def _draw_floor(batch: dict[str, Any]) -> None:
    """Figures 8d and 9: the first floor, incremental and batch."""
    case = load_case("school")
    level = case.levels[1]
    truth = case.storey_of(level)
    figure = Figure(figsize=(9, 4.4), layout="constrained")
    axes_of = figure.subplots(1, 2)
    for axes, name, changes in zip(axes_of, ("incremental (figure 8d)", "batch (figure 9)"), ({}, batch), strict=True):
        parameters = PAPER.replace(lines=changes)
        segments = common.paper_segments(common.paper_histogram(case, level, parameters), parameters)
        f = common.score(case, level, segments)["all"].f
        common.draw_plan(axes, segments, truth.lines, f"{name}: F = {f:.3f} (all)")
    common.write_picture("figure_08_09_plans", figure, dpi=90)


if __name__ == "__main__":
    main()
