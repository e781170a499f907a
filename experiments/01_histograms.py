"""Figures 2, 3 and 4c of the paper: height histogram, ground-plane histogram, distribution of wall orientations."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

import common
from asbuilt import detect_lines, find_floor_and_ceiling, height_histogram, orientation_distribution, threshold_cells
from asbuilt.orientation import angle_between, dominant_orientations, lengths, orientations
from asbuilt.storeys import HeightHistogram
from common import CASES, PAPER, VOXEL, load_case


def main() -> None:
    results = {name: [_storey(name, level) for level in load_case(name).levels] for name in CASES}
    common.write_result("01_histograms", results)
    rows = [
        (f"{name} {storey['storey']}", *(storey[key] for key in _COLUMNS))
        for name, storeys in results.items()
        for storey in storeys
    ]
    common.write_table("01_histograms", ["storey", *_COLUMNS.values()], rows)
    _draw_heights()
    _draw_ground_plane()
    _draw_orientations()


_COLUMNS = {
    "floor_error": "floor error, m",
    "ceiling_error": "ceiling error, m",
    "emptiest_height": "emptiest height above floor, m",
    "lowest_nine": "heights of the nine emptiest slices, m",
    "dense_cells": "cells kept",
    "dominant_share": "length within 5° of the dominant orientations",
}


def _storey(name: str, level: common.Level) -> dict[str, object]:
    case, (floor, ceiling) = load_case(name), common.truth_heights(name)[level.index]
    histogram = _height_histogram(case, level)
    between = (histogram.heights > level.floor + 0.3) & (histogram.heights < level.ceiling - 0.2)
    counts, heights = histogram.counts[between], histogram.heights[between] - level.floor
    lowest = np.sort(heights[np.argsort(counts, kind="stable")[:9]])
    ground = common.paper_histogram(case, level)
    segments = detect_lines(ground, PAPER.lines)
    found = find_floor_and_ceiling(histogram)
    dominant = dominant_share(segments)
    return {
        "storey": level.index,
        "floor_error": None if found is None else round(found[0] - floor, 3),
        "ceiling_error": None if found is None else round(found[1] - ceiling, 3),
        "emptiest_height": round(float(heights[np.argmin(counts)]), 2),
        "lowest_nine": f"{lowest[0]:.2f} to {lowest[-1]:.2f}",
        "dense_cells": len(threshold_cells(ground, PAPER.lines.sigmas)),
        "dominant_share": round(dominant, 3),
        "height_histogram": {"low": histogram.low, "step": histogram.step, "counts": histogram.counts.tolist()},
        "orientation_distribution": np.round(orientation_distribution(segments, PAPER.orientation.bin), 2).tolist(),
    }


def dominant_share(segments: np.ndarray) -> float:
    """Share of the length within 5 degrees of one of the two dominant orientations."""
    dominant = dominant_orientations(segments, PAPER.orientation)
    if dominant is None:
        return 0.0
    off = np.min([np.abs(angle_between(orientations(segments), target)) for target in dominant], axis=0)
    weights = lengths(segments)
    return float(weights[off <= PAPER.orientation.snap].sum() / weights.sum())


def _height_histogram(case: common.Case, level: common.Level) -> HeightHistogram:
    """Of one storey: from half a metre of slab below its floor to the next floor."""
    z = (case.occupied[:, 2] + 0.5) * VOXEL
    above = [other.floor for other in case.levels if other.floor > level.floor]
    top = min([*above, level.ceiling + 0.5]) - 0.15
    return height_histogram(case.occupied[(z > level.floor - 0.25) & (z < top)], VOXEL)


def _draw_heights() -> None:
    figure = Figure(figsize=(9, 3.2), layout="constrained")
    for axes, name in zip(figure.subplots(1, 3), CASES, strict=True):
        histogram = height_histogram(load_case(name).occupied, VOXEL)
        axes.barh(histogram.heights, histogram.counts / 1000, height=VOXEL, color="#4a6fa5")
        for level in load_case(name).levels:
            axes.axhline(level.floor, color="#d6202a", linewidth=0.8, label="floor" if level.index == 0 else None)
            axes.axhline(level.ceiling, color="#1a9850", linewidth=0.8, label="ceiling" if level.index == 0 else None)
        axes.set_title(name, fontsize=10)
        axes.set_xlabel("occupied voxels, thousands")
    figure.axes[0].set_ylabel("height, m")
    figure.axes[0].legend(fontsize=7, frameon=False)
    common.write_picture("figure_02_heights", figure)


def _draw_ground_plane() -> None:
    """Figure 3 and figure 1b: a room, and the whole storey that it is part of."""
    case = load_case("school")
    histogram = common.paper_histogram(case, case.levels[1])
    x0, x1, y0, y1 = histogram.grid.extent
    figure = Figure(figsize=(9, 4.4), layout="constrained")
    for axes, title in zip(figure.subplots(1, 2), ("one room (figure 3)", "first floor (figure 1b)"), strict=True):
        axes.imshow(histogram.counts.T, origin="lower", extent=(x0, x1, y0, y1), cmap="gray_r", vmax=9)
        axes.set_title(title, fontsize=10)
        axes.set_axis_off()
    low, high = common.class_room(case, case.levels[1])
    figure.axes[0].set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    walls = case.storey_of(case.levels[1]).lines.reshape(-1, 2)
    figure.axes[1].set(
        xlim=(walls[:, 0].min() - 1, walls[:, 0].max() + 1), ylim=(walls[:, 1].min() - 1, walls[:, 1].max() + 1)
    )
    common.write_picture("figure_03_ground_plane", figure)


def _draw_orientations() -> None:
    figure = Figure(figsize=(9, 2.6), layout="constrained")
    for axes, name in zip(figure.subplots(1, 3), CASES, strict=True):
        case = load_case(name)
        total = sum(
            orientation_distribution(
                detect_lines(common.paper_histogram(case, level), PAPER.lines), PAPER.orientation.bin
            )
            for level in case.levels
        )
        # the paper measures from the vector [0, 1]; an undirected line turned by 90 degrees
        axes.bar((np.arange(180) + 90) % 180, total, width=1.0, color="#4a6fa5")
        axes.set(title=name, xlabel="orientation from [0, 1], degrees", xlim=(0, 180))
    figure.axes[0].set_ylabel("length, m")
    common.write_picture("figure_04c_orientations", figure)


if __name__ == "__main__":
    main()
