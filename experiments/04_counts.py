"""Section 3.1's alternatives: what the histograms count, and whether floor and ceiling are removed.

Voxels count once (the paper's choice); points count as they are; or each point weighs the inverse of the density
around it, which the paper names as an alternative and did not do. Thresholds of 2 (section 3.3) and 2.5 (5.1).
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

import common
from asbuilt.grid import FloatArray, Grid, IntArray
from asbuilt.ground import GroundPlaneHistogram
from asbuilt.storeys import HeightHistogram, Level, find_floor_and_ceiling
from common import PAPER, VOXEL, load_case

COUNTS = ("voxels", "points", "inverse density")
THRESHOLDS = [1.0, 2.0, 2.5]
HEIGHTS = {"nine lowest slices": "lowest", "all but floor and ceiling": "removed", "all, floor and ceiling too": "kept"}


def main() -> None:
    storeys = common.storeys_of()
    settings = [(count, heights, sigmas) for count in COUNTS for heights in HEIGHTS.values() for sigmas in THRESHOLDS]
    jobs = [(name, storey, *setting) for setting in settings for name, storey in storeys]
    found = dict(zip(jobs, common.in_parallel(_run, jobs), strict=True))
    results: dict[str, Any] = {"threshold": {}, "floor_and_ceiling": {}}
    rows = []
    for count in COUNTS:
        for label, heights in HEIGHTS.items():
            scores = [{key: found[(*key, count, heights, sigmas)] for key in storeys} for sigmas in THRESHOLDS]
            curve = results["threshold"][f"{count}, {label}"] = common.curves(THRESHOLDS, scores)
            pooled = curve["pooled"]
            at = [pooled[which]["f"][THRESHOLDS.index(k)] for which in ("observed", "all") for k in (2.0, 2.5)]
            best = [pooled[which][key] for which in ("observed", "all") for key in ("best", "best_f")]
            rows.append((count, label, *at, f"{best[0]:g}", best[1], f"{best[2]:g}", best[3]))
        errors = [_height_errors(name, storey, count) for name, storey in storeys]
        results["floor_and_ceiling"][count] = dict(zip((f"{n} {s}" for n, s in storeys), errors, strict=True))
    common.write_result("04_counts", results)
    heading = [f"F {which}, {k}" for which in ("observed", "all") for k in ("2 sigma", "2.5 sigma")]
    heading += ["best k, observed", "F observed", "best k, all", "F all"]
    common.write_table("04_counts", ["counts", "heights", *heading], rows)
    rows = [
        (
            f"{n} {s}",
            *(results["floor_and_ceiling"][c][f"{n} {s}"][key] for c in COUNTS for key in ("floor", "ceiling")),
        )
        for n, s in storeys
    ]
    heading = [f"{count}: {key}, m" for count in COUNTS for key in ("floor", "ceiling")]
    common.write_table("04_floor_and_ceiling", ["storey", *heading], rows)


@cache
def weights(name: str, count: str) -> FloatArray:
    """What each occupied voxel (n,) of a case adds to a histogram."""
    case = load_case(name)
    if count == "voxels":
        return np.ones(len(case.occupied))
    if count == "points":
        return case.points.astype(np.float64)
    return case.points / _density(case)


def _density(case: common.Case) -> FloatArray:
    """Points per occupied voxel among the 27 voxels around each (n,): the density of the surfaces there."""
    low, span = case.occupied.min(axis=0) - 1, np.ptp(case.occupied, axis=0) + 3
    local = case.occupied - low
    keys = (local[:, 0] * span[1] + local[:, 1]) * span[2] + local[:, 2]
    points, voxels = np.zeros(len(keys)), np.zeros(len(keys))
    for step in np.ndindex(3, 3, 3):
        x, y, z = np.array(step) - 1
        wanted = keys + (x * span[1] + y) * span[2] + z
        at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        there = keys[at] == wanted
        points += np.where(there, case.points[at], 0)
        voxels += there
    return points / voxels


def _run(job: tuple[str, int, str, str, float]) -> common.Totals:
    name, storey, count, heights, sigmas = job
    case = load_case(name)
    level = case.levels[storey]
    parameters = PAPER.replace(lines={"sigmas": sigmas})
    chosen = _choose(case, level, heights, weights(name, count))
    occupied = case.occupied[chosen]
    return common.score(
        case, level, common.paper_segments(_histogram(occupied, weights(name, count)[chosen]), parameters)
    )


def _choose(case: common.Case, level: Level, heights: str, weight: FloatArray) -> IntArray:
    """Rows of the voxels that take part; as `asbuilt.select_cross_sections`, but by any weight."""
    z = (case.occupied[:, 2] + 0.5) * VOXEL
    slab = PAPER.storeys.slab
    if heights == "kept":
        return np.flatnonzero((z > level.floor - slab) & (z < level.ceiling + slab))
    inside = np.flatnonzero((z > level.floor + slab + VOXEL / 2) & (z < level.ceiling - slab))
    if heights == "removed":
        return inside
    layers = case.occupied[inside, 2] - case.occupied[inside, 2].min()
    lowest = np.argsort(np.bincount(layers, weights=weight[inside]), kind="stable")[: PAPER.cross_sections.count]
    return inside[np.isin(layers, lowest)]


def _histogram(occupied: IntArray, weight: FloatArray) -> GroundPlaneHistogram:
    grid = Grid.around(occupied[:, :2], VOXEL)
    flat = np.ravel_multi_index(tuple((occupied[:, :2] - np.array(grid.low)).T), grid.shape)
    counts = np.bincount(flat, weights=weight, minlength=grid.shape[0] * grid.shape[1]).reshape(grid.shape)
    return GroundPlaneHistogram(grid, counts)


def _height_errors(name: str, storey: int, count: str) -> dict[str, float | None]:
    """Errors (m) of the bottom-most and top-most local maximum, in the storey with a quarter metre on either side."""
    case = load_case(name)
    level, truth = case.levels[storey], common.truth_heights(name)[storey]
    z = (case.occupied[:, 2] + 0.5) * VOXEL
    rows = np.flatnonzero((z > level.floor - 0.25) & (z < truth[1] + 0.15))
    layers = case.occupied[rows, 2]
    counts = np.bincount(layers - layers.min(), weights=weights(name, count)[rows])
    found = find_floor_and_ceiling(HeightHistogram(float(layers.min() * VOXEL), VOXEL, counts))
    if found is None:
        return {"floor": None, "ceiling": None}
    return {"floor": round(found[0] - truth[0], 3), "ceiling": round(found[1] - truth[1], 3)}


if __name__ == "__main__":
    main()
