"""Figure 7 of the paper: precision and recall over (a) threshold, (b) fill gap, (c) minimum length, (d) slices.

As in the paper, (a) to (c) take all heights between floor and ceiling (section 5.1) and vary one parameter from its
best setting; (d) varies the number N of slices of lowest density (section 5.3). The threshold is swept again on N = 9.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

import common
from common import CASES

ALL_HEIGHTS = {"select": "all"}
# name: (stage, parameter, the paper's best, values, changes to the paper's preset, title)
SWEEPS: dict[str, tuple[str, str, float, list[float], dict[str, Any], str]] = {
    "threshold": (
        "lines",
        "sigmas",
        2.5,
        [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0],
        {"cross_sections": ALL_HEIGHTS},
        "(a) threshold, sigma above the mean",
    ),
    "fill_gap": (
        "lines",
        "fill_gap",
        0.7,
        [0.2, 0.4, 0.7, 1.2, 2.5],
        {"cross_sections": ALL_HEIGHTS},
        "(b) fill gap, m",
    ),
    "min_length": (
        "lines",
        "min_length",
        0.2,
        [0.2, 0.4, 0.8, 1.5],
        {"cross_sections": ALL_HEIGHTS},
        "(c) minimum line length, m",
    ),
    "slices": ("cross_sections", "count", 9, [1, 2, 3, 5, 7, 9, 12, 16, 24, 33], {}, "(d) slices N"),
    "threshold_on_nine_slices": (
        "lines",
        "sigmas",
        2.5,
        [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0],
        {},
        "threshold on the nine lowest slices",
    ),
}


def main() -> None:
    storeys = common.storeys_of()
    jobs = [
        (name, storey, _changes(stage, parameter, value, base))
        for stage, parameter, _, values, base, _ in SWEEPS.values()
        for value in values
        for name, storey in storeys
    ]
    totals = iter(common.in_parallel(common.run_paper, jobs))
    results = {
        sweep: {
            "parameter": f"{stage}.{parameter}",
            "paper_best": paper,
            "changes": base,
            **common.curves(values, [{key: next(totals) for key in storeys} for _ in values]),
        }
        for sweep, (stage, parameter, paper, values, base, _) in SWEEPS.items()
    }
    common.write_result("02_parameters", results)
    rows = [
        (
            sweep.replace("_", " "),
            f"{found['paper_best']:g}",
            *(f"{found[group][which]['best']:g}" for group in (*CASES, "pooled") for which in ("observed", "all")),
            found["pooled"]["observed"]["best_f"],
            found["pooled"]["all"]["best_f"],
        )
        for sweep, found in results.items()
    ]
    groups = [f"{group}, {which}" for group in (*CASES, "pooled") for which in ("observed", "all")]
    common.write_table("02_parameters", ["parameter", "paper", *groups, "F observed", "F all"], rows)
    _draw(results)


def _changes(stage: str, parameter: str, value: float, base: dict[str, Any]) -> dict[str, Any]:
    return {**base, stage: {**base.get(stage, {}), parameter: value}}


def _draw(results: dict[str, Any]) -> None:
    figure = Figure(figsize=(9, 7.5), layout="constrained")
    colours = dict(zip((*CASES, "pooled"), ("#1f77b4", "#ff7f0e", "#2ca02c", "black"), strict=True))
    for axes, (sweep, found) in zip(figure.subplots(2, 2).ravel(), results.items(), strict=False):
        for group, colour in colours.items():
            for which, style in (("observed", "-"), ("all", "--")):
                curve = found[group][which]
                points = [(r, p) for r, p in zip(curve["recall"], curve["precision"], strict=True) if p is not None]
                label = group if which == "observed" else None
                axes.plot(*zip(*points, strict=True), style, marker=".", color=colour, linewidth=1, label=label)
        pooled = found["pooled"]["observed"]
        for value, r, p in zip(found["values"], pooled["recall"], pooled["precision"], strict=True):
            if p is not None:
                axes.annotate(f"{value:g}", (r, p), fontsize=7, xytext=(3, 3), textcoords="offset points")
        axes.set(title=SWEEPS[sweep][-1], xlabel="recall", ylabel="precision", xlim=(0.5, 1), ylim=(0.3, 0.9))
        axes.grid(alpha=0.3)
    figure.axes[2].legend(loc="lower left", fontsize=8, title="observed truth; dashed: all", title_fontsize=8)
    common.write_picture("figure_07_parameters", figure)


if __name__ == "__main__":
    main()
