"""The clean-up after section 3.4: merge collinear pieces, fit each line to its data."""

from __future__ import annotations

import numpy as np

from asbuilt.grid import FloatArray
from asbuilt.ground import GroundPlaneHistogram, threshold_cells
from asbuilt.orientation import angle_between, lengths, orientations
from asbuilt.params import LineParameters, RefineParameters


def merge_collinear(segments: FloatArray, parameters: RefineParameters | None = None) -> FloatArray:
    """Join segments (n, 4), m, that lie on one line and overlap or nearly touch; longest first.

    Each segment, longest first, takes in those that are turned and shifted little against it and start within the gap
    of what it covers; the union keeps its line.
    """
    parameters = parameters or RefineParameters()
    rest = segments[np.argsort(-lengths(segments), kind="stable")]
    merged = []
    while len(rest) > 0:
        seed, rest = rest[0], rest[1:]
        origin, along = seed[:2], (seed[2:] - seed[:2]) / max(float(np.hypot(*(seed[2:] - seed[:2]))), 1e-12)
        ends = np.stack([seed[:2], seed[2:]])
        low, high = 0.0, float((ends[1] - origin) @ along)
        while len(rest) > 0:
            relative = rest.reshape(-1, 2, 2) - origin
            position = relative @ along
            offset = np.abs(relative @ np.array([-along[1], along[0]])).max(axis=1)
            turned = np.abs(angle_between(orientations(rest), float(np.arctan2(along[1], along[0]))))
            near = (turned <= parameters.merge_angle) & (offset <= parameters.merge_distance)
            near &= position.min(axis=1) <= high + parameters.merge_gap
            near &= position.max(axis=1) >= low - parameters.merge_gap
            if not near.any():
                break
            low, high = min(low, float(position[near].min())), max(high, float(position[near].max()))
            rest = rest[~near]
        merged.append(np.concatenate([origin + low * along, origin + high * along]))
    return np.array(merged).reshape(-1, 4)


def fit_to_cells(segments: FloatArray, histogram: GroundPlaneHistogram, lines: LineParameters) -> FloatArray:
    """Shift each segment (n, 4), m, to the weighted mean of the dense cells along it; its orientation stays.

    Cells within one cell of the segment count, weighted by the voxels above them.
    """
    cells = threshold_cells(histogram, lines.sigmas, lines.statistics_over)
    centres = histogram.grid.to_metres(cells)
    weights = histogram.counts[cells[:, 0], cells[:, 1]]
    fitted = segments.copy()
    for i, (x1, y1, x2, y2) in enumerate(segments):
        length = np.hypot(x2 - x1, y2 - y1)
        if length == 0:
            continue
        along = np.array([x2 - x1, y2 - y1]) / length
        normal = np.array([-along[1], along[0]])
        relative = centres - (x1, y1)
        position, offset = relative @ along, relative @ normal
        near = (np.abs(offset) <= histogram.grid.cell) & (position >= 0) & (position <= length)
        if near.any():
            fitted[i] += np.tile(np.average(offset[near], weights=weights[near]) * normal, 2)
    return fitted
