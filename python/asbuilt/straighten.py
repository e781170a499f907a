"""Lines drawn askew by two planes a few centimetres apart, laid along the one of them (not in the paper).

The back of a shut door's leaf stands a few centimetres behind the face of its wall, as do shallow niches: a line
fitted to both runs aslant from one to the other, and follows neither.
"""

from __future__ import annotations

import numpy as np

from asbuilt import _core
from asbuilt.grid import FloatArray

_STRETCH = 0.8
"""Stretches of a line are fitted of this length, m, one every half of it."""
_ON = 0.015
"""Points at this distance of a line, m, no longer lie on it."""
_ASKEW = 0.7
"""A line is askew if its points are on it by less than this..."""
_GAIN = 1.2
"""...and another one, along one of its stretches, has so many times as many on it..."""
_PLANE = 0.6
"""...and of those beside that one more than this share lie on one plane."""


def straighten(lines: FloatArray, places: _core.Places, weights: FloatArray, band: float) -> FloatArray:
    """Lines (n, 4), m, each laid along that stretch of it which most of its points are in line with, where it is askew.

    `places` are points, of some weights (m,); those within `band` (m) of a line are its own.
    """
    length = np.hypot(lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1])
    line, point, _, offset = places.strips(lines, band, band)
    mass = np.bincount(line, weights[point], minlength=len(lines))
    held = np.bincount(line, weights[point] * _on(offset), minlength=len(lines))
    askew = np.flatnonzero((length > 2 * _STRETCH) & (held < _ASKEW * mass))
    line, point, along, offset = places.strips(lines[askew], 3 * band, band)
    first = np.searchsorted(line, np.arange(len(askew) + 1))
    straight = lines.copy()
    for number, i in enumerate(askew):
        near = slice(first[number], first[number + 1])
        slope, height = _best(along[near], offset[near], weights[point[near]], float(length[i]), float(held[i]), band)
        x, y = (lines[i, 2:] - lines[i, :2]) / length[i]
        straight[i] += np.outer([height, height + slope * length[i]], [-y, x]).ravel()
    return straight


def _best(
    along: FloatArray, offset: FloatArray, weight: FloatArray, length: float, held: float, band: float
) -> tuple[float, float]:
    """Slope and height, m, of the line through a stretch of points on which most of all of them lie; 0, 0 for none."""
    best, most = (0.0, 0.0), _GAIN * held
    for low in np.arange(0.0, length - _STRETCH / 2, _STRETCH / 2):
        here = (along > low) & (along < low + _STRETCH) & (np.abs(offset) < band)
        slope, height = _fit(along[here], offset[here], weight[here], band)
        aside = offset - height - slope * along
        on = float(weight @ _on(aside))
        within = max(abs(height), abs(height + slope * length)) < 3 * band
        if on > most and within and _on_one_plane(aside, weight, band):
            best, most = (slope, height), on
    return best


def _on_one_plane(aside: FloatArray, weight: FloatArray, band: float) -> bool:
    """Whether of the points beside a line most lie at one distance (m) from it: those of a curve do not."""
    beside = np.flatnonzero((np.abs(aside) > 1.3 * _ON) & (np.abs(aside) < 2.5 * band))
    beside = beside[np.argsort(aside[beside])]
    total = np.concatenate([[0.0], np.cumsum(weight[beside])])
    within = total[np.searchsorted(aside[beside], aside[beside] + _ON)] - total[:-1]
    return bool(within.max(initial=0.0) > _PLANE * total[-1])


def _fit(
    along: FloatArray, offset: FloatArray, weight: FloatArray, band: float, rounds: int = 4
) -> tuple[float, float]:
    """Slope and height, m, of the line on which most of some points lie, in a band that narrows down; 0, 0 for none."""
    slope, height = 0.0, 0.0
    for width in np.linspace(2 * band, _ON, rounds):
        near = weight * np.clip(1 - ((offset - height - slope * along) / width) ** 2, 0, None) ** 2
        mass = max(float(near.sum()), 1e-12)
        mean_along, mean_offset = float(near @ along) / mass, float(near @ offset) / mass
        spread = max(float(near @ (along - mean_along) ** 2), 1e-9)
        slope = float(near @ ((along - mean_along) * (offset - mean_offset))) / spread
        height = mean_offset - slope * mean_along
    return slope, height


def _on(offset: FloatArray) -> FloatArray:
    """How far points (n,) lie on a line, 0..1, by their distances, m."""
    on: FloatArray = np.clip(1 - (offset / _ON) ** 2, 0, None) ** 2
    return on
