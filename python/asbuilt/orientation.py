"""Dominant orientations (section 3.4 of the paper). Orientations are of undirected lines: radians in [0, pi)."""

from __future__ import annotations

import numpy as np

from asbuilt.grid import FloatArray
from asbuilt.params import OrientationParameters

_NEAR_PERPENDICULAR = np.radians(20)
"""The secondary orientation lies this near to the perpendicular of the dominant one, rad."""


def orientations(segments: FloatArray) -> FloatArray:
    """Orientation of each segment (n, 4): (n,) rad in [0, pi)."""
    return np.arctan2(segments[:, 3] - segments[:, 1], segments[:, 2] - segments[:, 0]) % np.pi


def lengths(segments: FloatArray) -> FloatArray:
    """Length of each segment (n, 4): (n,) m."""
    return np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1])


def orientation_distribution(segments: FloatArray, bin_width: float) -> FloatArray:
    """Length of the segments (n, 4) at each orientation (figure 4c): (m,) m, bins from 0 to pi, smoothed over three."""
    bins = max(round(np.pi / bin_width), 1)
    index = (orientations(segments) / np.pi * bins + 0.5).astype(np.int64) % bins
    counts = np.bincount(index, weights=lengths(segments), minlength=bins)
    return counts + 0.5 * (np.roll(counts, 1) + np.roll(counts, -1))


def dominant_orientations(
    segments: FloatArray, parameters: OrientationParameters | None = None
) -> tuple[float, float] | None:
    """The dominant orientation, rad, and the secondary one near its perpendicular; None without segments.

    Each is the largest peak of the distribution, brought to the length-weighted mean of what lies within two bins.
    """
    parameters = parameters or OrientationParameters()
    if len(segments) == 0:
        return None
    distribution = orientation_distribution(segments, parameters.bin)
    width = np.pi / len(distribution)
    centres = np.arange(len(distribution), dtype=np.float64) * width
    first = float(centres[int(np.argmax(distribution))])
    near = np.abs(angle_between(centres, first + np.pi / 2)) <= _NEAR_PERPENDICULAR
    second = float(centres[int(np.argmax(np.where(near, distribution, -1.0)))])
    if distribution[near].max() == 0:
        second = (first + np.pi / 2) % np.pi
    return _mean_near(segments, first, 2 * width), _mean_near(segments, second, 2 * width)


def snap_to(segments: FloatArray, targets: tuple[float, ...], within: float) -> FloatArray:
    """Turn the segments (n, 4) that lie `within` (rad) of a target orientation onto it, about their centres (3.4)."""
    if len(segments) == 0 or len(targets) == 0:
        return segments.copy()
    current = orientations(segments)
    off = np.stack([angle_between(np.asarray(target), current) for target in targets])
    nearest = np.abs(off).argmin(axis=0)
    turn = off[nearest, np.arange(len(segments))]
    turn = np.where(np.abs(turn) <= within, turn, 0.0)
    centre = (segments[:, :2] + segments[:, 2:]) / 2
    half = (segments[:, 2:] - segments[:, :2]) / 2
    cosine, sine = np.cos(turn), np.sin(turn)
    turned = np.column_stack([cosine * half[:, 0] - sine * half[:, 1], sine * half[:, 0] + cosine * half[:, 1]])
    return np.hstack([centre - turned, centre + turned])


def angle_between(a: FloatArray, b: FloatArray | float) -> FloatArray:
    """From orientation b to a, the short way round: rad in [-pi/2, pi/2)."""
    return (np.asarray(a) - b + np.pi / 2) % np.pi - np.pi / 2


def _mean_near(segments: FloatArray, orientation: float, within: float) -> float:
    off = angle_between(orientations(segments), orientation)
    weights = np.where(np.abs(off) <= within, lengths(segments), 0.0)
    if weights.sum() == 0:
        return orientation
    return float((orientation + np.average(off, weights=weights)) % np.pi)
