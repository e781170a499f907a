"""Baselines in the plane: lines in ordered scans, as robots see them.

Duda and Hart's iterative end-point fit [2], Pavlidis and Horowitz's split and merge [7] and RANSAC, as Nguyen et al.
[6] compare them, on a horizontal slice; Wulf et al.'s farthest points [12]. Numbers are the paper's references.
"""

from __future__ import annotations

import numpy as np

from asbuilt.grid import FloatArray
from baselines.storey import StoreyCloud, fit_line, merge, runs, split_at_jumps

JUMP = 0.3
LEAST = 6


def iterative_end_point_fit(cloud: StoreyCloud, height: float, tolerance: float, min_length: float) -> FloatArray:
    """[2]: a polyline is cut at its farthest point from the chord until none is farther than `tolerance` (m)."""
    from skimage.measure import approximate_polygon

    found = []
    for scan in cloud.scanner_lines(height):
        for part in split_at_jumps(scan, JUMP):
            if len(part) < LEAST:
                continue
            corners = approximate_polygon(part, tolerance)
            chords = np.hstack([corners[:-1], corners[1:]])
            found.append(chords[np.hypot(*(chords[:, 2:] - chords[:, :2]).T) >= min_length])
    return merge(found)


def split_and_merge(cloud: StoreyCloud, height: float, tolerance: float, min_length: float) -> FloatArray:
    """[7]: as above, but lines are fitted, and neighbours joined again where one line serves both."""
    found = []
    for scan in cloud.scanner_lines(height):
        for part in split_at_jumps(scan, JUMP):
            pieces = _join(_split(part, tolerance), tolerance)
            found += [runs(piece, *fit_line(piece), JUMP, min_length, LEAST) for piece in pieces]
    return merge(found)


def line_scanner(cloud: StoreyCloud, tolerance: float, min_length: float) -> FloatArray:
    """What a robot sees: split and merge at the height of its line scanner, 30 cm."""
    return split_and_merge(cloud, 0.3, tolerance, min_length)


def ransac_lines(cloud: StoreyCloud, height: float, tolerance: float, min_length: float, least: int) -> FloatArray:
    """Fischler and Bolles: in each scan, the line through two random points that most points lie on; and again."""
    random = np.random.default_rng(0)
    found = []
    for scan in cloud.scanner_lines(height):
        rest = scan
        while len(rest) >= LEAST:
            a, b = rest[random.integers(len(rest), size=(2, 100))]
            normal = np.column_stack([a[:, 1] - b[:, 1], b[:, 0] - a[:, 0]])
            apart = np.hypot(*normal.T)[:, None]
            off = normal @ rest.T - (normal * a).sum(axis=1)[:, None]
            near = (np.abs(off) <= tolerance * apart) & (apart > 0)
            best = near[int(near.sum(axis=1).argmax())]
            if best.sum() < least:
                break
            found.append(runs(rest[best], *fit_line(rest[best]), JUMP, min_length, least // 2))
            rest = rest[~best]
    return merge(found)


def farthest_points(cloud: StoreyCloud, tolerance: float, min_length: float, window: int = 8) -> FloatArray:
    """[12]: the farthest point of each vertical scan line is wall; a window slides over them and grows along lines."""
    found = []
    for scan in cloud.farthest_points(step_deg=1.0):
        for part in split_at_jumps(scan, 2 * JUMP):
            start = 0
            while start + window <= len(part):
                end = start + window
                centre, along = fit_line(part[start:end])
                if _off(part[start:end], centre, along).max() > tolerance:
                    start += 1
                    continue
                while end < len(part) and _off(part[end : end + 1], centre, along)[0] <= tolerance:
                    end += 1
                    centre, along = fit_line(part[start:end])
                found.append(runs(part[start:end], centre, along, 2 * JUMP, min_length, window))
                start = end
    return merge(found)


def _off(points: FloatArray, centre: FloatArray, along: FloatArray) -> FloatArray:
    return np.abs((points - centre) @ np.array([-along[1], along[0]]))


def _split(points: FloatArray, tolerance: float) -> list[FloatArray]:
    if len(points) < LEAST:
        return []
    if _off(points, *fit_line(points)).max() <= tolerance:
        return [points]
    # a fitted line is often farthest from the ends, which are no corners; the chord never is
    chord = points[-1] - points[0]
    at = int(_off(points, points[0], chord / max(float(np.hypot(*chord)), 1e-9))[2:-2].argmax()) + 2
    return [*_split(points[:at], tolerance), *_split(points[at:], tolerance)]


def _join(pieces: list[FloatArray], tolerance: float) -> list[FloatArray]:
    joined: list[FloatArray] = []
    for piece in pieces:
        both = np.concatenate([joined[-1], piece]) if joined else piece
        if joined and _off(both, *fit_line(both)).max() <= tolerance:
            joined[-1] = both
        else:
            joined.append(piece)
    return joined
