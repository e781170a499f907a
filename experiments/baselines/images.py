"""Baselines on pictures: Hough's transform of a slice [4], and the practitioner's lines in a density image."""

from __future__ import annotations

from typing import Any

import numpy as np

from asbuilt.grid import FloatArray
from baselines.storey import StoreyCloud, merge, runs

CELL = 0.02


def batch_hough(cloud: StoreyCloud, height: float, votes: int, gap: float, min_length: float) -> FloatArray:
    """[4]: all peaks of the Hough transform of a slice 10 cm high, on cells of 5 cm; cut into runs of cells."""
    from skimage.transform import hough_line, hough_line_peaks

    cell = 0.05
    near = np.abs(cloud.points[:, 2] - cloud.floor - height) <= 0.05
    index = np.unique(np.floor(cloud.points[near, :2] / cell).astype(np.int64), axis=0)
    low = index.min(axis=0)
    image = np.zeros(np.ptp(index, axis=0) + 1, dtype=bool)
    image[tuple((index - low).T)] = True
    space, angles, distances = hough_line(image, np.linspace(-np.pi / 2, np.pi / 2, 360, endpoint=False))
    peaks = hough_line_peaks(space, angles, distances, min_distance=2, min_angle=4, threshold=votes, num_peaks=2000)
    centres, found = index + 0.5, []
    for angle, distance in zip(*peaks[1:], strict=True):
        # skimage's x is the column, here the second index: distance = column cos + row sin
        normal = np.array([np.sin(angle), np.cos(angle)])
        near_line = np.abs((centres - 0.5 - low) @ normal - distance) <= 1.0
        origin = (low + 0.5 + distance * normal) * cell
        along = np.array([-normal[1], normal[0]])
        found.append(runs(centres[near_line] * cell, origin, along, gap, min_length, 4))
    return merge(found, distance=0.1)


def probabilistic_hough(cloud: StoreyCloud, share: float, votes: int, gap: float, min_length: float) -> FloatArray:
    """Matas et al., by OpenCV, on the denser cells of a 2 cm density image of the upper half of the room."""
    import cv2

    image, low = _density_image(cloud, share)
    binary = ((image > 0) * 255).astype(np.uint8)
    lines = cv2.HoughLinesP(binary, 1, np.pi / 360, votes, minLineLength=min_length / CELL, maxLineGap=gap / CELL)
    return merge([_in_metres(lines, low)])


def line_segment_detector(cloud: StoreyCloud, share: float, gap: float, min_length: float) -> FloatArray:
    """Von Gioi et al., by OpenCV, on the density image; the two edges of a line are joined with the collinear ones."""
    import cv2

    image, low = _density_image(cloud, share)
    lines = cv2.createLineSegmentDetector().detect((255 * np.minimum(image, 1)).astype(np.uint8))[0]
    found = _in_metres(lines, low)
    return merge([found[np.hypot(*(found[:, 2:] - found[:, :2]).T) >= min_length]], gap=gap)


def _density_image(cloud: StoreyCloud, share: float) -> tuple[FloatArray, FloatArray]:
    """Points a cell, by `share` of their 99th percentile: below 1 is nought, above rises to one; and its corner, m."""
    z = cloud.points[:, 2]
    half = (z > (cloud.floor + cloud.ceiling) / 2) & (z < cloud.ceiling - 0.15)
    index = np.floor(cloud.points[half, :2] / CELL).astype(np.int64)
    # strays seen through windows would stretch the picture to hundreds of megabytes
    low, high = np.percentile(index, [0.05, 99.95], axis=0).astype(np.int64) + np.array([[-50], [50]])
    inside = ((index >= low) & (index <= high)).all(axis=1)
    shape = tuple(high - low + 1)
    flat = np.ravel_multi_index(tuple((index[inside] - low).T), shape)
    counts = np.bincount(flat, minlength=shape[0] * shape[1]).reshape(shape).astype(float)
    dense = np.percentile(counts[counts > 0], 99)
    image = np.where(counts >= share * dense, np.log1p(counts) / np.log1p(dense), 0.0)
    return image, low * CELL


def _in_metres(lines: Any, low: FloatArray) -> FloatArray:
    """OpenCV's x is the column: the second index."""
    if lines is None:
        return np.zeros((0, 4))
    pixels = np.asarray(lines, dtype=float).reshape(-1, 2, 2)[:, :, ::-1]
    return ((pixels + 0.5) * CELL + low).reshape(-1, 4)
