"""Lines along which walls may stand, to a millimetre (not in the paper).

The paper's Hough transform over all cells of a storey is as coarse as its bins. Here lines are traced from place to
place (`asbuilt._core.Places.trace_lines`), joined where they continue each other, and fitted to the means of the voxels
along them.
"""

from __future__ import annotations

import numpy as np

from asbuilt import _core
from asbuilt.grid import BoolArray, FloatArray, IntArray
from asbuilt.neighbours import near_ahead, of_each
from asbuilt.params import WallParameters
from asbuilt.profiles import Columns, StoreyVoxels
from asbuilt.straighten import straighten

_MIN_WEIGHT = 0.12
"""Filled area that makes a line worth following, m^2."""
_TURNED = (0.03, 0.01)
"""Lines that continue each other are turned by less than this (sine of the angle): near ones, and those further on."""


def find_wall_lines(columns: Columns, voxels: StoreyVoxels, parameters: WallParameters) -> FloatArray:
    """Segments (n, 4), m from the storey's origin, that walls may stand on, strongest first."""
    # Where most voxels hold one point, as many again were missed.
    density = float(np.clip(((1 - voxels.thinness) / 0.55) ** 2, 0.15, 1.0))
    tall = columns.filled >= max(density * parameters.min_profile / voxels.voxel, 2)
    places = _core.Places(columns.xy[tall], columns.index[tall].astype(np.int32, copy=False), voxels.voxel)
    weights = columns.filled[tall]
    lines, strength = places.trace_lines(
        weights,
        band=parameters.band,
        reach=0.5,
        gap=parameters.trace_gap,
        min_weight=density * _MIN_WEIGHT / voxels.voxel**2,
        min_length=0.1,
    )
    lines = join_collinear(lines, strength, parameters)
    lines = fit_lines(lines, places, weights, parameters.band)
    straight = straighten(lines, places, weights, parameters.band)
    turned = (straight != lines).any(axis=1)
    straight[turned] = fit_lines(straight[turned], places, weights, parameters.band)
    return straight


def join_collinear(lines: FloatArray, strength: FloatArray, parameters: WallParameters) -> FloatArray:
    """Join lines (n, 4), m, of one plane: the same direction, the same offset, and no wide gap between."""
    order = np.argsort(-strength, kind="stable")
    lines = lines[order]
    length = np.hypot(lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1])
    # What continues one line of those that were joined may be turned against the first of them.
    aside = 3 * parameters.band + _TURNED[0] * parameters.bridge
    pairs = near_ahead(lines, 1.01 * parameters.bridge, aside)
    about = of_each(len(lines), *pairs)
    in_line = _in_line(lines, length, *pairs, parameters)
    free = np.ones(len(lines), dtype=np.bool_)
    joined = []
    for i in range(len(lines)):
        if not free[i]:
            continue
        free[i] = False
        start, along = lines[i, :2], (lines[i, 2:] - lines[i, :2]) / length[i]
        normal = np.array([-along[1], along[0]])
        low, high = 0.0, float(length[i])
        others = set(about[i])
        while in_line[i]:
            other = np.array([j for j in sorted(others) if free[j]], dtype=np.int64)
            relative = lines[other].reshape(-1, 2, 2) - start
            position = np.sort(relative @ along, axis=1)
            offset = np.abs(relative @ normal).max(axis=1)
            turned = np.abs((lines[other, 2:] - lines[other, :2]) @ normal) / length[other]
            gap = np.maximum(position[:, 0] - high, low - position[:, 1])
            near = gap < 1.0
            same = gap < parameters.bridge
            same &= offset < np.where(near, parameters.band, 0.67 * parameters.band)
            same &= turned < np.where(near, *_TURNED)
            if not same.any():
                break
            free[other[same]] = False
            others.update(k for j in other[same] for k in about[j])
            low, high = min(low, float(position[same, 0].min())), max(high, float(position[same, 1].max()))
        joined.append(np.concatenate([start + low * along, start + high * along]))
    return np.array(joined).reshape(-1, 4)


def _in_line(
    lines: FloatArray, length: FloatArray, one: IntArray, other: IntArray, parameters: WallParameters
) -> BoolArray:
    """Which lines (n,) another one may continue; most stand alone, and need no closer look."""
    along = (lines[one, 2:] - lines[one, :2]) / length[one, None]
    relative = lines[other].reshape(-1, 2, 2) - lines[one, None, :2]
    offset = relative[:, :, 1] * along[:, :1] - relative[:, :, 0] * along[:, 1:]
    place = (relative * along[:, None]).sum(axis=2)
    gap = np.maximum(place.min(axis=1) - length[one], -place.max(axis=1))
    found = np.zeros(len(lines), dtype=np.bool_)
    # A little more than is asked for in the end, so that rounding leaves none out.
    near = (one != other) & (np.abs(offset).max(axis=1) < 1.01 * parameters.band) & (gap < 1.01 * parameters.bridge)
    found[one[near & (np.abs(np.ptp(offset, axis=1)) < 1.01 * _TURNED[0] * length[other])]] = True
    return found


def fit_lines(lines: FloatArray, places: _core.Places, weights: FloatArray, band: float, rounds: int = 3) -> FloatArray:
    """Fit each line (n, 4), m, to the points within `band` of it by weighted (m,) least squares of their offsets.

    After the first of the `rounds` a point counts the less the farther it is (Tukey's biweight), so that frames, boards
    and backs of furniture, which all stand on the room's side, do not draw the line to them.
    """
    count = len(lines)
    for fitted in range(rounds):
        line, point, along, offset = places.strips(lines, band, band)
        weight = weights[point]
        if fitted:
            weight = weight * (1 - (offset / band) ** 2) ** 2

        def total(values: FloatArray, line: IntArray = line, weight: FloatArray = weight) -> FloatArray:
            return np.bincount(line, weight * values, minlength=count).astype(np.float64, copy=False)

        mass = np.maximum(total(np.ones_like(along)), 1e-12)
        mean_along, mean_offset = total(along) / mass, total(offset) / mass
        spread = total(along * along) / mass - mean_along**2
        slope = (total(along * offset) / mass - mean_along * mean_offset) / np.maximum(spread, 1e-9)
        slope = np.where(spread > 1e-4, slope, 0.0)
        length = np.hypot(lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1])
        along_unit = (lines[:, 2:] - lines[:, :2]) / length[:, None]
        normal = np.column_stack([-along_unit[:, 1], along_unit[:, 0]])
        first = (mean_offset - slope * mean_along)[:, None] * normal
        last = (mean_offset + slope * (length - mean_along))[:, None] * normal
        lines = lines + np.hstack([first, last])
    return lines
