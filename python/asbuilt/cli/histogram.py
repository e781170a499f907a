"""The height histogram (figure 2 of the paper) as lines of text, highest first, with floors and ceilings marked."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

import numpy as np

from asbuilt.storeys import HeightHistogram, Level

_BEYOND = 1.5
"""Metres drawn below the lowest floor and above the highest ceiling; strays beyond would squeeze the rest."""


def draw_heights(histogram: HeightHistogram, levels: Sequence[Level], columns: int, rows: int) -> list[str]:
    """Draw one line a bin, or a few bins a line where they are more than `rows`.

    Parameters
    ----------
    histogram : occupied voxels by height.
    levels : storeys to mark.
    columns, rows : space on the terminal, characters.
    """
    low, high = _span(histogram, levels)
    bins = round((high - low) / histogram.step)
    if bins <= 0:
        return []
    first = round((low - histogram.low) / histogram.step)
    group = ceil(bins / rows)
    counts = np.pad(histogram.counts[first : first + bins], (0, -bins % group)).reshape(-1, group).sum(axis=1)
    step = histogram.step * group

    marks: dict[int, list[str]] = {}
    for level in levels:
        marks.setdefault(int((level.floor - low) // step), []).append(
            f"floor of storey {level.index} at {level.floor:.2f}"
        )
        top = min(int((level.ceiling - low) // step), len(counts) - 1)
        marks.setdefault(top, []).append(f"ceiling of storey {level.index} at {level.ceiling:.2f}")

    widest = max((len(", ".join(texts)) for texts in marks.values()), default=0)
    labels = [f"{low + row * step:8.2f} to {low + (row + 1) * step:.2f} |" for row in range(len(counts))]
    wide = max(map(len, labels))
    space = max(columns - wide - widest - 4, 10)
    lines = []
    for row in range(len(counts) - 1, -1, -1):
        bar = "#" * ceil(space * counts[row] / max(counts.max(), 1))
        mark = f"< {', '.join(marks[row])}" if row in marks else ""
        lines.append(f"{labels[row]:>{wide}}{bar:<{space}} {mark}".rstrip())
    return lines


def _span(histogram: HeightHistogram, levels: Sequence[Level]) -> tuple[float, float]:
    """Heights between which to draw, on the borders of bins, m."""
    bottom, top = histogram.low, histogram.low + len(histogram.counts) * histogram.step
    if levels:
        steps_below = int((min(level.floor for level in levels) - _BEYOND - bottom) / histogram.step)
        steps_above = int((top - max(level.ceiling for level in levels) - _BEYOND) / histogram.step)
        bottom += max(steps_below, 0) * histogram.step
        top -= max(steps_above, 0) * histogram.step
    return bottom, top
