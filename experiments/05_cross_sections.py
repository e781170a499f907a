"""Figure 10 of the paper (section 5.3): each 10 cm slice by itself, and where clutter is.

A slice one voxel high has counts of nought and one, between which any threshold lies; all its occupied cells vote.
The N slices of lowest density are in 02_parameters.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import pearsonr, spearmanr

import common
from asbuilt import ground_plane_histogram
from asbuilt.grid import FloatArray
from asbuilt.storeys import Level
from common import CASES, PAPER, VOXEL, load_case

ONE_SLICE = PAPER.replace(lines={"sigmas": 0.0})
ROBOT = 0.3


def main() -> None:
    jobs = [
        (name, storey, z) for name, storey in common.storeys_of() for z in _slices(name, load_case(name).levels[storey])
    ]
    scores = dict(zip(jobs, common.in_parallel(_score_slice, jobs), strict=True))
    results: dict[str, Any] = {}
    for name, storey in common.storeys_of():
        mine = [(job, part) for job, part in scores.items() if job[:2] == (name, storey)]
        results[f"{name} {storey}"] = _storey(load_case(name), load_case(name).levels[storey], mine)
    bands = _bands(scores)
    common.write_result("05_cross_sections", {"slices": results, "bands": bands}, ONE_SLICE.as_dict())
    rows = [
        (
            name,
            *(found["correlation"][which][m][kind] for which in ("observed", "all") for m, kind in _CORRELATIONS),
            *found["observed"]["f_by_band"].values(),
        )
        for name, found in results.items()
    ]
    heading = [f"r({m}, voxels), {which}" for which in ("observed", "all") for m, _ in _CORRELATIONS]
    common.write_table("05_cross_sections", ["storey", *heading, *(f"F {band}" for band in BANDS)], rows)
    _draw(results)
    _draw_slices()


_CORRELATIONS = (("precision", "pearson"), ("recall", "pearson"), ("f", "pearson"))
BANDS = {"below 1 m": (0.0, 1.0), "1 to 2.5 m": (1.0, 2.5), "above 2.5 m": (2.5, 9.0)}


def _slices(name: str, level: Level) -> list[int]:
    """Voxel layers between floor and ceiling, as the paper's stages choose from."""
    every = PAPER.replace(cross_sections={"select": "all"})
    case = load_case(name)
    inside = common.asbuilt.select_cross_sections(case.occupied, VOXEL, level, PAPER.storeys.slab, every.cross_sections)
    return np.unique(case.occupied[inside, 2]).tolist()


def _segments(name: str, storey: int, z: int) -> FloatArray:
    occupied = load_case(name).occupied
    return common.paper_segments(ground_plane_histogram(occupied[occupied[:, 2] == z], VOXEL), ONE_SLICE)


def _score_slice(job: tuple[str, int, int]) -> common.Totals:
    case = load_case(job[0])
    return common.score(case, case.levels[job[1]], _segments(*job))


def _storey(case: common.Case, level: Level, scores: list[tuple[tuple[str, int, int], common.Totals]]) -> Any:
    heights = [round((z + 0.5) * VOXEL - level.floor, 3) for (_, _, z), _ in scores]
    voxels = [int((case.occupied[:, 2] == z).sum()) for (_, _, z), _ in scores]
    found: dict[str, Any] = {"height": heights, "voxels": voxels, "correlation": {}}
    for which in common.TRUTH_SETS:
        walls = [part[which] for _, part in scores]
        columns = {m: [round(float(getattr(w, m) or 0.0), 4) for w in walls] for m in ("precision", "recall", "f")}
        found["correlation"][which] = {
            m: {
                "pearson": round(float(pearsonr(voxels, values).statistic), 3),
                "spearman": round(float(spearmanr(voxels, values).statistic), 3),
            }
            for m, values in columns.items()
        }
        by_band = {
            band: round(float(np.mean([f for f, h in zip(columns["f"], heights, strict=True) if low <= h < high])), 4)
            for band, (low, high) in BANDS.items()
        }
        best = int(np.argmax(columns["f"]))
        found[which] = {**columns, "best_height": heights[best], "best_f": columns["f"][best], "f_by_band": by_band}
    return found


def _bands(scores: dict[tuple[str, int, int], common.Totals]) -> Any:
    """Pooled over all storeys: slices near the height of a robot's sensor, and those of each band."""

    def over(low: float, high: float) -> Any:
        return common.measures(
            common.pooled(
                part
                for (name, storey, z), part in scores.items()
                if low <= (z + 0.5) * VOXEL - load_case(name).levels[storey].floor < high
            )
        )

    return {"robot": over(ROBOT - 0.06, ROBOT + 0.06), **{band: over(*limits) for band, limits in BANDS.items()}}


def _draw(results: dict[str, Any]) -> None:
    figure = Figure(figsize=(9, 6), layout="constrained")
    for axes, (name, found) in zip(figure.subplots(2, 3).ravel(), results.items(), strict=True):
        for measure, colour in (("precision", "#1f77b4"), ("recall", "#2ca02c")):
            axes.plot(found["height"], found["observed"][measure], color=colour, linewidth=1.2, label=measure)
        share = np.array(found["voxels"]) / max(found["voxels"])
        axes.plot(found["height"], share, color="#d6202a", linewidth=1.2, label="voxels, of the fullest slice")
        lowest = np.argsort(found["voxels"], kind="stable")[: PAPER.cross_sections.count]
        axes.plot(np.array(found["height"])[lowest], share[lowest], "o", color="#1a9850", fillstyle="none", ms=5)
        correlation = found["correlation"]["observed"]["f"]["pearson"]
        axes.set_title(f"{name}: r(F, voxels) = {correlation:.2f}", fontsize=9)
        axes.set(ylim=(0, 1.02))
        axes.grid(alpha=0.3)
    for axes in figure.axes[-3:]:
        axes.set_xlabel("height above the floor, m")
    figure.axes[0].legend(fontsize=7, frameon=False)
    common.write_picture("figure_10_cross_sections", figure)


def _draw_slices() -> None:
    """Figure 10b and c: what a robot sees, against the nine lowest slices."""
    case = load_case(CASES[0])
    level = case.levels[1]
    z = round((level.floor + ROBOT) / VOXEL - 0.5)
    nine = common.paper_segments(common.paper_histogram(case, level))
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    for axes, segments, title in zip(
        figure.subplots(1, 2),
        (_segments(case.name, 1, z), nine),
        ("one slice at 30 cm (figure 10b)", "the nine lowest slices (figure 10c)"),
        strict=True,
    ):
        f = common.score(case, level, segments)["observed"].f
        common.draw_plan(axes, segments, case.storey_of(level).lines, f"{title}: F = {f:.3f}")
    common.write_picture("figure_10bc_plans", figure, dpi=90)


if __name__ == "__main__":
    main()
