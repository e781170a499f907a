"""Free-standing partitions (not in the paper): walls about which one can walk, thin, often lower than the ceiling.

What tells them from furniture is that both faces are seen, a hand's breadth apart, over a good length and height, with
floor before either. Where the two faces share voxels, the voxels' second moments take them apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from asbuilt.elevations import Elevations, floor_heights, step_of
from asbuilt.faces import Face, covered_length, segments_of
from asbuilt.grid import BoolArray, FloatArray, IntArray
from asbuilt.neighbours import near_each
from asbuilt.profiles import StoreyVoxels

_MIN_LENGTH = 1.5
"""Shorter things that stand free are furniture, m."""
_MAX_THICKNESS = 0.2
"""Thicker things that stand free are furniture, m."""
_HEIGHTS = (0.3, 1.6)
"""A partition is filled from and to these heights, m."""
_FLOOR = 0.08
"""What lies this near to the height of the floor is floor, m."""
_CEILING = 0.15
"""And so far below the ceiling, or higher, nothing is looked at, m."""
_DOOR_HEIGHT = 1.95
"""A screen lower than this is furniture, unless it is long and thick, m."""
_LEAST_STEP = 0.1
"""What is seen along a partition is counted by steps of this, m; by longer ones in thin clouds."""
_STEP = 0.05
_APART = 0.3
"""What stands on a line further apart than this is not one thing, m, as seen in steps of so many m."""
_SIDE = 0.25
"""What is looked for of a cupboard's side, m."""
_UNSEEN = 0.05
"""Screens that do not show how thick they are are this thick, m."""
_FREE = 0.3
"""Behind a screen there is no other wall so near, m."""
_SHARED = 0.09
"""The faces of a partition thinner than this share voxels, m."""


def find_partitions(lines: FloatArray, voxels: StoreyVoxels) -> tuple[FloatArray, BoolArray]:
    """Lines (n, 4), m, with those inside very thin partitions replaced by one for each face; and which are
    partitions' (n,).

    Without voxels or lines nothing changes.
    """
    lines = lines.copy()
    partition = np.zeros(len(lines), dtype=np.bool_)
    replaced = partition.copy()
    faces: list[FloatArray] = []
    step = max(_LEAST_STEP, 2 * step_of(voxels))
    length = np.hypot(lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1])
    floors = _floors(lines, voxels)
    for i in np.flatnonzero(length >= _MIN_LENGTH):
        if replaced[i] or partition[i]:
            continue
        between = (floors[i] - _FLOOR, floors[i] + voxels.height - _CEILING)
        _, voxel, along, offset = voxels.strips(lines[[i]], _MAX_THICKNESS + 0.15, 0.1, between)
        z = voxels.z[voxel] - floors[i]
        direction = (lines[i, 2:] - lines[i, :2]) / length[i]
        for low, high in _stretches(z, along, offset, length[i]):
            here = np.flatnonzero((along > low - 0.1) & (along < high + 0.1))
            stretch = np.concatenate([lines[i, :2] + place * direction for place in (low, high)])
            found = _partition(
                stretch,
                z[here],
                along[here] - low,
                offset[here],
                voxels.covariance.take(voxel[here], axis=0),
                voxels.height,
                step,
            )
            if found is None:
                continue
            planes, sides = found
            normal = np.array([-direction[1], direction[0]])
            relative = lines.reshape(-1, 2, 2) - stretch[:2]
            place, aside = relative @ direction, relative @ normal
            same = (np.abs(aside - planes.mean()) < np.ptp(planes) / 2 + 0.04).all(axis=1)
            same &= (place > -0.3).all(axis=1) & (place < high - low + 0.3).all(axis=1)
            if np.ptp(planes.mean(axis=1)) < _SHARED:
                replaced |= same
                along_planes = [stretch + np.concatenate([plane[0] * normal, plane[1] * normal]) for plane in planes]
                faces += [_turned(face, side > 0) for face, side in zip(along_planes, sides, strict=True)]
            else:
                partition |= same
                forward = place[:, 1] > place[:, 0]
                for k in np.flatnonzero(same):
                    lines[k] = _turned(lines[k], forward[k] == (aside[k].mean() > planes.mean()))
    kept = ~replaced
    marked = np.concatenate([np.ones(len(faces), dtype=np.bool_), partition[kept]])
    return np.concatenate([np.array(faces).reshape(-1, 4), lines[kept]]), marked


def draw_backs(faces: list[Face], rooms: Sequence[shapely.Polygon], elevations: Elevations) -> list[Face]:
    """Faces with the backs of screens of which the fronts alone were seen, as thick as the storey's other screens.

    Where no screen shows how thick it is, they are taken to be 5 cm thick. A screen stands in a room (polygons, m from
    the storey's origin), which goes on behind it.
    """
    if not faces:
        return faces
    segments = segments_of(faces)
    behind_each = [(face.start + face.end) / 2 - _FREE / 2 * face.normal for face in faces]
    within = shapely.covers(shapely.union_all(rooms), shapely.points(behind_each))
    thickness, single = [], []
    for i, near in enumerate(near_each(segments, segments, _FREE)):
        face = faces[i]
        if not (elevations.partition[face.line] and within[i]):
            continue
        back = face.turned
        apart = [
            -float(((faces[j].start + faces[j].end) / 2 - face.start) @ face.normal)
            for j in near
            if covered_length(back, faces[j], _FREE) > 0.3 * face.length
        ]
        behind = [distance for distance in apart if distance > 0]
        if not apart:
            single.append((face, back))
        elif behind and min(behind) < _SHARED:
            thickness.append(min(behind))
    usual = float(np.median(thickness)) if thickness else _UNSEEN
    return faces + [
        replace(back, start=back.start - usual * face.normal, end=back.end - usual * face.normal, seen=False)
        for face, back in single
    ]


def _floors(lines: FloatArray, voxels: StoreyVoxels) -> FloatArray:
    """Height (n,) of the floor about each line (n, 4), m: that of a tilted or large building is not level."""
    way = lines[:, 2:] - lines[:, :2]
    along = way / np.maximum(np.hypot(*way.T), 1e-12)[:, None]
    sides = [np.column_stack([-along[:, 1], along[:, 0]]) * sign for sign in (1, -1)]
    places = [np.ascontiguousarray(lines[:, :2] + share * way) for share in (0.25, 0.5, 0.75)]
    heights = [floor_heights(place, along, side, voxels) for place in places for side in sides]
    floors: FloatArray = np.median(heights, axis=0)
    return floors


def _stretches(z: FloatArray, along: FloatArray, offset: FloatArray, length: float) -> list[tuple[float, float]]:
    """From where to where something stands on a line, m along it: a line goes on across what stands apart."""
    standing = (z > _HEIGHTS[0]) & (z < _HEIGHTS[1]) & (np.abs(offset) < _MAX_THICKNESS / 2)
    places = np.flatnonzero(np.bincount((np.clip(along[standing], 0, length) / _STEP).astype(np.int64)))
    if len(places) == 0:
        return []
    runs = np.split(places, np.flatnonzero(np.diff(places) > _APART / _STEP) + 1)
    ends = [(max(run[0] * _STEP, 0.0), min((run[-1] + 1) * _STEP, length)) for run in runs]
    return [(low, high) for low, high in ends if high - low >= _MIN_LENGTH]


def _partition(
    line: FloatArray,
    z: FloatArray,
    along: FloatArray,
    offset: FloatArray,
    covariance: FloatArray,
    height: float,
    step: float,
) -> tuple[FloatArray, IntArray] | None:
    """Offsets at start and end (1 or 2 planes, 2), m, of the faces of a partition along a line (4,), and the sides
    (1: left, -1: right) on which the room before each lies; None where no partition stands. What is seen is counted by
    steps (m) along it.
    """
    length = float(np.hypot(*(line[2:] - line[:2])))
    planes = _two_planes(line, z, along, offset, covariance)
    top = _top(z, offset)
    sides = np.array([-1, 1])
    if planes is None and _DOOR_HEIGHT < top < height - 0.3:
        planes, sides = _screen(length, z, along, offset, step) or (None, sides)
    elif planes is not None and not _stands_free(planes, length, z, along, offset, height, step):
        return None
    if planes is None or (top < _DOOR_HEIGHT and (length < 2 * _MIN_LENGTH or np.ptp(planes.mean(axis=1)) < _SHARED)):
        return None
    return planes, sides


def _turned(line: FloatArray, keep: bool) -> FloatArray:
    """A line (4,) as it is, or with its ends exchanged."""
    return line if keep else line[[2, 3, 0, 1]]


def _two_planes(
    line: FloatArray, z: FloatArray, along: FloatArray, offset: FloatArray, covariance: FloatArray
) -> FloatArray | None:
    """Offsets from the line at its start and end (2 planes, 2) of two parallel planes that its voxels lie on, m.

    If planes lie at c - a and c + a, a voxel of mean offset y has the second moment ``a^2 - c^2 + 2 c y`` whatever its
    share of either: a regression of second moments on means gives both, even if every voxel holds points of both.
    """
    length = float(np.hypot(*(line[2:] - line[:2])))
    nx, ny = (line[1] - line[3]) / length, (line[2] - line[0]) / length
    standing = (z > _HEIGHTS[0]) & (z < _HEIGHTS[1]) & (np.abs(offset) < _MAX_THICKNESS)
    if standing.sum() < 50:
        return None
    y, s = offset[standing], along[standing] / length - 0.5
    second = y**2 + np.array([nx**2, 2 * nx * ny, ny**2]) @ covariance.compress(standing, axis=0).T
    # The planes may be turned against the line: c is linear along it, and so are its products.
    terms = np.column_stack([np.ones_like(y), y, s * y, s, s**2])
    (constant, middle, turn, *_), *_ = np.linalg.lstsq(terms.T @ terms, terms.T @ second, rcond=None)
    middle, turn = middle / 2, turn / 2
    half = np.sqrt(max(constant + middle**2, 0.0))
    share = np.mean(y - middle - turn * s) / max(half, 1e-6)
    if not 0.015 < half < _MAX_THICKNESS / 2 or abs(share) > 0.7:
        return None
    centre = np.array([middle - turn / 2, middle + turn / 2])
    return np.stack([centre - half, centre + half])


def _screen(
    length: float, z: FloatArray, along: FloatArray, offset: FloatArray, step: float
) -> tuple[FloatArray, IntArray] | None:
    """The faces of a screen of which only the front is seen; None for other things.

    Offsets from the line (1 or 2 planes, 2), m, and the side on which the room before each lies: 1 for the left.

    A cupboard shows its sides where it shows its front; a screen has none. Its end, where seen, shows how thick it is.
    """
    standing = (z > _HEIGHTS[0]) & (z < _HEIGHTS[1])
    on_floor = np.abs(z) < _FLOOR

    def covered(chosen: BoolArray, low: float = 0.0, high: float = length) -> float:
        chosen = chosen & (along >= low) & (along < high)
        return np.count_nonzero(np.bincount((along[chosen] / step).astype(np.int64))) * step / (high - low)

    # On the other side its body stands on the floor.
    front = max((1, -1), key=lambda sign: np.count_nonzero(on_floor & (sign * offset > 0) & (sign * offset < 0.13)))
    behind = -front * offset
    if length < 2.5 or covered(on_floor & (behind < -0.03) & (behind > -0.13)) < 0.7:
        return None
    if covered(standing & (np.abs(offset) < 0.03)) < 0.9:
        return None
    body = standing & (behind > 0.1) & (behind < 0.1 + _SIDE)
    side = _SIDE * (standing & (np.abs(offset) < 0.03)).sum() / length
    open_ends = [
        tip
        for tip, low in ((0.0, 0.0), (length, length - 1.0))
        if (body & (np.abs(along - tip) < 0.08)).sum() < 0.25 * side and covered(body, low, low + 1.0) < 0.35
    ]
    if not open_ends:
        return None
    caps = [behind[standing & (np.abs(along - tip) < 0.06) & (behind > -0.03) & (behind < 0.15)] for tip in open_ends]
    thickness = max((float(np.percentile(cap, 95)) for cap in caps if len(cap)), default=0.0)
    faces = [0.0] if thickness < 0.025 else [0.0, -front * thickness]
    return np.array([[face, face] for face in faces]), np.array([front, -front][: len(faces)])


def _top(z: FloatArray, offset: FloatArray) -> float:
    """Height to which the middle of a line is filled, m."""
    filled = np.bincount((z[(np.abs(offset) < 0.05) & (z > 0)] / 0.1).astype(np.int64))
    usual = np.median(filled[3:16]) if len(filled) > 16 else 0
    gaps = np.flatnonzero(filled[3:] < 0.3 * usual)
    return 0.1 * (3 + int(gaps[0]) if len(gaps) else len(filled))


def _stands_free(
    planes: FloatArray,
    length: float,
    z: FloatArray,
    along: FloatArray,
    offset: FloatArray,
    height: float,
    step: float,
) -> bool:
    """Whether floor comes close on both sides, both faces are filled, and the whole is lower than the ceiling."""
    s = along / length
    faces = planes[:, [0]] + s * (planes[:, [1]] - planes[:, [0]])
    outside = np.stack([faces[0] - offset, offset - faces[1]])
    steps = max(int(length / (2.5 * step)), 1)

    def covered(chosen: BoolArray) -> float:
        return np.count_nonzero(np.bincount((s[chosen] * steps).astype(np.int64))) / (steps + 1)

    standing = (z > _HEIGHTS[0]) & (z < _HEIGHTS[1])
    floor = [covered((np.abs(z) < _FLOOR) & (out > 0.03) & (out < 0.13)) for out in outside]
    filled = [covered(standing & (np.abs(out) < 0.03)) for out in outside]
    inside = (outside < 0.02).all(axis=0)
    before = (standing & ~inside & (np.abs(offset) < _MAX_THICKNESS)).sum()
    under_ceiling = (inside & (z > height - 0.6) & (z < height - _CEILING)).sum()
    thin = np.ptp(planes.mean(axis=1)) < _SHARED
    return bool(
        min(floor) > 0.5
        and min(filled) > 0.7
        and before < (standing & inside).sum()
        and (thin or under_ceiling < 0.1 * (standing & inside).sum())
    )
