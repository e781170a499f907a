"""Wall faces cut into patches by the bricks of the evidence: what registration and tilt are measured on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asbuilt import _core
from asbuilt.evidence import Evidence
from asbuilt.grid import FloatArray, IntArray
from asbuilt.indices import count_rows
from asbuilt.plan import FloorPlan, Storey, WallFace

_ON_FACE = 0.02
"""Voxels with their mean this close to a wall face lie on it, m."""
_CLEAR = (0.15, 0.1)
"""Of a wall, what is this far above the floor and below the ceiling counts, m."""
_CLEAN = 1.3
"""A clean patch is at most so many times as rough as most."""
_LIKELY = 0.5
"""Confidence of a face that counts."""
_LEAST = 20
"""A patch with fewer points says nothing."""


@dataclass(frozen=True)
class Patches:
    """Wall faces cut by the bricks of the evidence, as arrays over the patches (n).

    Attributes
    ----------
    face : (n,) number of its face, as `straight_faces` counts.
    brick : (n, 3) index of the brick that holds this part of the face.
    along : (n,) where on its face, from -1/2 to 1/2.
    offset, roughness : (n,) mean of its points, and their standard deviation, off the face's line, m.
    count : (n,) number of points.
    place : (n, 3) mean of the points, m.
    normal : (n, 2) of the face, towards those who see it.
    """

    face: IntArray
    brick: IntArray
    along: FloatArray
    offset: FloatArray
    roughness: FloatArray
    count: FloatArray
    place: FloatArray
    normal: FloatArray

    def kept(self, mask: NDArray[np.bool_]) -> Patches:
        """Those that a mask (n,) keeps."""
        return Patches(*(values[mask] for values in vars(self).values()))


def straight_faces(plan: FloorPlan) -> list[tuple[WallFace, Storey]]:
    """The likely wall faces that are no chords of a curve, each with its storey, in the order of their numbers.

    A face that is likelier none than one tells nothing of scans; a plan from elsewhere may not say how likely its are.
    """
    return [
        (face, storey)
        for storey in plan
        for face in storey.wall_faces
        if face.curve is None and (face.confidence is None or face.confidence >= _LIKELY)
    ]


def cut_faces(plan: FloorPlan, evidence: Evidence) -> Patches:
    """The patches of all straight wall faces that hold enough points."""
    faces = straight_faces(plan)
    segments = np.array([(*face.start, *face.end) for face, _ in faces]).reshape(-1, 4)
    heights = np.array([(storey.floor + _CLEAR[0], storey.ceiling - _CLEAR[1]) for _, storey in faces]).reshape(-1, 2)
    place = evidence.index * evidence.voxel + evidence.mean
    places = _core.Places(place[:, :2], evidence.index[:, :2].astype(np.int32, copy=False), evidence.voxel)
    face, voxel, along, offset = places.strips(segments, _ON_FACE, 0.0)
    standing = (place[voxel, 2] > heights[face, 0]) & (place[voxel, 2] < heights[face, 1])
    face, voxel, along, offset = face[standing], voxel[standing], along[standing], offset[standing]

    step = segments[:, 2:] - segments[:, :2]
    length = np.hypot(step[:, 0], step[:, 1])
    normal = np.column_stack([-step[:, 1], step[:, 0]]) / length[:, None]
    # by the brick of the foot on the face: a wall that lies on the border of two bricks is not split between them
    foot = place[voxel]
    foot[:, :2] -= offset[:, None] * normal[face]
    side = evidence.core.brick_scans()["side"] * evidence.voxel
    bricks, brick, _ = count_rows(np.floor(foot / side).astype(np.int64))
    keys, patch = np.unique(face * len(bricks) + brick, return_inverse=True)
    number, brick = np.divmod(keys, max(len(bricks), 1))
    weight = evidence.count[voxel].astype(np.float64)
    count: FloatArray = np.bincount(patch, weight, minlength=len(keys)).astype(np.float64)

    def mean(values: FloatArray) -> FloatArray:
        return np.bincount(patch, weight * values, minlength=len(keys)) / count

    (nx, ny), (xx, xy, yy) = normal[face].T, evidence.covariance[voxel].T
    square = mean(offset**2 + nx**2 * xx + 2 * nx * ny * xy + ny**2 * yy)
    centre = mean(offset)
    patches = Patches(
        number,
        bricks[brick],
        mean(along) / length[number] - 0.5,
        centre,
        np.sqrt(np.maximum(square - centre**2, 0.0)),
        count,
        np.column_stack([mean(place[voxel, axis]) for axis in range(3)]),
        normal[number],
    )
    return patches.kept(count >= _LEAST)


def is_clean(patches: Patches) -> NDArray[np.bool_]:
    """Which patches (n,) are about as smooth as most: no picture, no door frame, no mixed edge is on them."""
    clean: NDArray[np.bool_] = patches.roughness <= _CLEAN * median(patches.roughness)
    return clean


def median(values: FloatArray) -> float:
    """The median of (n,) values; 0 without any."""
    return float(np.median(values)) if len(values) else 0.0
