"""How well the scans fit together: each scan's offset to the walls that it shares with others (not in the paper).

The evidence keeps the moments of a voxel's points over all scans, and for each brick of 8 x 8 x 8 voxels the list of
the scans that hit it. So no scan's points are known alone. But the mean of the points on a patch of wall is the mean of
the scans' offsets, each by its share of those points, and a scan's share follows from where the scanner stood: its
points thin out with the square of the distance and with the angle of incidence. Shares change along a wall, and so the
offsets come out by robust least squares, together with the true place and direction of each wall face.

Scanners' positions are needed, which E57 and PTX have and LAS has not. What is *not* looked for: offsets in height, and
scans that are turned. An offset of more than a centimetre comes out too small, or not at all: the wall looks doubled,
and the patches that show it are taken for cluttered ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from asbuilt.evidence import Evidence
from asbuilt.grid import FloatArray, IntArray
from asbuilt.indices import count_rows
from asbuilt.plan import FloorPlan
from asbuilt.report.patches import Patches, cut_faces, is_clean, median

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_PRIOR = 0.01
"""Scans are taken to be off by about this much before anything is known, m; it decides only what no wall tells."""
_TOLD = 0.004
"""An offset with a larger standard error is not told, m."""
_PATCH, _POINT, _SHARES = 0.0006, 0.002, 0.001
"""Standard deviations, m: of a patch from its face's plane; of a point; from shares that are not as expected."""
_AS_EXPECTED = 2.0
"""A patch with this many times more or fewer points than expected is hidden from some of its scans."""
_ROUGH = 0.6
"""A scan of whose patches less than this part of the usual is clean shows its walls beside those of the others."""
_ROUNDS = 6


@dataclass(frozen=True)
class ScanOffset:
    """How a scan lies against the others that see the same walls.

    Attributes
    ----------
    key : of the scan, as in `Evidence.scans`.
    position : of the scanner, m; None where the file does not say.
    points : number of its points.
    faces : wall faces that it shares with others.
    offset : (x, y), m, by which it shows its walls off the place where the others show them; None where unknown.
    error : standard error of each, m; likewise.
    against : keys of the scans that it is compared with, and the weight of each, the largest first.
    remark : why the offset is unknown, or what else to look at, or "".
    """

    key: str
    position: tuple[float, float, float] | None
    points: int
    faces: int = 0
    offset: tuple[float, float] | None = None
    error: tuple[float, float] | None = None
    against: tuple[tuple[str, float], ...] = ()
    remark: str = ""


def scan_offsets(plan: FloorPlan, evidence: Evidence) -> tuple[ScanOffset, ...]:
    """The offset of each scan in the ground plane to the walls that it shares, by the key of the scan.

    Each scan is compared with the mean of the others on the same patches of wall, by how much of them each shares.
    Where that cannot be told, a remark says why. Evidence without scans gives none.
    """
    scans = evidence.scans
    if all(position is None for _, position, _ in scans):
        return tuple(ScanOffset(*scan, remark="the files do not say where the scanner stood") for scan in scans)
    patches, shares = _expect_shares(cut_faces(plan, evidence), evidence)
    clean = is_clean(patches)
    clean_part = _clean_part(shares, clean)
    patches, shares = patches.kept(clean), shares[clean]
    offsets, covariance = _solve(patches, shares)
    others = _others(shares)
    found = []
    for number, (scan, faces) in enumerate(zip(scans, _shared_faces(patches, shares), strict=True)):
        compared = np.zeros((len(scans), 2, 2))  # what is subtracted from what, along x and along y
        compared[:] = -others[number][:, None, None] * np.eye(2)
        compared[number] = np.eye(2)
        weights = compared.reshape(-1, 2)
        dx, dy = (weights.T @ offsets).tolist()
        ex, ey = np.sqrt(np.diag(weights.T @ covariance @ weights)).tolist()
        rough = faces >= 3 and clean_part[number] < _ROUGH * median(clean_part)
        remark = "its walls look doubled: it may be off by a centimetre or more" if rough else ""
        if scan[1] is None:
            found.append(ScanOffset(*scan, remark="the file does not say where the scanner stood"))
        elif faces == 0 or max(ex, ey) > _TOLD:
            found.append(ScanOffset(*scan, faces, remark=remark or "not enough shared walls"))
        else:
            weighed = sorted(((float(w), scans[i][0]) for i, w in enumerate(others[number]) if w > 0), reverse=True)
            against = tuple((key, weight) for weight, key in weighed)
            found.append(ScanOffset(*scan, faces, (dx, dy), (ex, ey), against, remark))
    return tuple(found)


def _expect_shares(patches: Patches, evidence: Evidence) -> tuple[Patches, csr_matrix]:
    """What part of each patch's points is expected of each scan (n, scans), for those where that can be said."""
    from scipy.sparse import csr_matrix  # heavy: help and errors do not wait for it

    patch, scan = _pair(patches, evidence)
    unknown = (np.nan, np.nan, np.nan)
    positions = np.array([unknown if position is None else position for _, position, _ in evidence.scans])
    points = np.array([points for *_, points in evidence.scans], dtype=np.float64)
    ray = positions[scan] - patches.place[patch]
    distance, level = np.linalg.norm(ray, axis=1), np.hypot(ray[:, 0], ray[:, 1])
    ahead = (ray[:, :2] * patches.normal[patch]).sum(axis=1)
    # a scanner turns about the upright: towards the zenith its rays lie closer together
    expected = points[scan] * np.maximum(ahead, 0.0) / (distance**2 * np.maximum(level, 0.1))
    shape = (len(patches.face), len(evidence.scans))
    shares = csr_matrix((expected, (patch, scan)), shape=shape)
    total = np.asarray(shares.sum(axis=1)).ravel()  # not a number where a scan's position is unknown
    seen = total > 0
    surplus = np.log(patches.count[seen] / total[seen])
    seen[seen] = np.abs(surplus - median(surplus)) < np.log(_AS_EXPECTED)
    return patches.kept(seen), csr_matrix(shares[seen].multiply(1.0 / total[seen, None]))


def _clean_part(shares: csr_matrix, clean: NDArray[np.bool_]) -> FloatArray:
    """What part (scans,) of the patches that a scan shares with others is clean; 0 for one that shares none."""
    shared = (shares - shares.multiply(shares)).tocsr()
    total = np.asarray(shared.sum(axis=0)).ravel()
    part: FloatArray = np.asarray(shared[clean].sum(axis=0)).ravel() / np.maximum(total, 1e-9)
    return part


def _pair(patches: Patches, evidence: Evidence) -> tuple[IntArray, IntArray]:
    """Each patch with each scan that hit its brick, as two arrays of numbers (pairs,)."""
    hits = evidence.core.brick_scans()
    both = np.concatenate([patches.brick, hits["brick"]])
    _, brick_of, _ = count_rows(both)
    of_patch, of_hit = brick_of[: len(patches.face)], brick_of[len(patches.face) :]
    first = np.searchsorted(of_hit, of_patch)  # the hits are sorted by brick
    number = np.searchsorted(of_hit, of_patch, side="right") - first
    patch = np.repeat(np.arange(len(of_patch)), number)
    within = np.arange(len(patch)) - np.repeat(np.cumsum(number) - number, number)
    return patch, hits["scan"][first[patch] + within].astype(np.int64)


def _solve(patches: Patches, shares: csr_matrix) -> tuple[FloatArray, FloatArray]:
    """Offsets x, y of each scan (2 scans,), m, and their covariance.

    Least squares with weights by `_PATCH`, `_POINT` and `_SHARES`, repeated with less weight for what lies off. Each
    face's own place and direction are found with them and then left out (Schur's complement).
    """
    from scipy.sparse import csr_matrix, diags, hstack  # heavy: help and errors do not wait for it

    size, scans = shares.shape
    rows = np.arange(size)
    faces, face = np.unique(patches.face, return_inverse=True)
    by_scan = hstack([shares.multiply(patches.normal[:, axis, None]) for axis in (0, 1)]).tocsr()
    by_scan = by_scan[:, np.arange(2 * scans).reshape(2, scans).T.ravel()]  # x and y of a scan next to each other
    of_face = csr_matrix((np.ones(size), (rows, face)), shape=(size, len(faces)))
    by_face = hstack([of_face, of_face.multiply(patches.along[:, None])]).tocsr()
    spread = 1.0 - np.asarray(shares.multiply(shares).sum(axis=1)).ravel()
    sigma = np.sqrt(_PATCH**2 + _POINT**2 / patches.count + _SHARES**2 * spread)
    weight = sigma**-2
    for _ in range(_ROUNDS):
        weighted = diags(weight)
        # faces may lie anywhere within a metre, scans within a centimetre
        face_face = (by_face.T @ weighted @ by_face).toarray() + np.eye(2 * len(faces))
        face_scan = (by_face.T @ weighted @ by_scan).toarray()
        scan_scan = (by_scan.T @ weighted @ by_scan).toarray() + np.eye(2 * scans) / _PRIOR**2
        face_sum, scan_sum = by_face.T @ (weight * patches.offset), by_scan.T @ (weight * patches.offset)
        eliminated = np.linalg.solve(face_face, np.column_stack([face_scan, face_sum]))
        covariance = np.linalg.inv(scan_scan - face_scan.T @ eliminated[:, :-1])
        offsets = covariance @ (scan_sum - face_scan.T @ eliminated[:, -1])
        places = eliminated[:, -1] - eliminated[:, :-1] @ offsets
        residual = np.abs(patches.offset - by_scan @ offsets - by_face @ places) / sigma
        scale = max(1.4826 * median(residual), 1.0)
        weight = 1.0 / (sigma * scale) ** 2 / np.maximum(residual / (2.0 * scale), 1.0)
    return offsets, covariance


def _others(shares: csr_matrix) -> FloatArray:
    """How much of each scan's (row) patches each other scan (column) sees; rows sum to 1, or to 0 without others."""
    common = (shares.T @ shares).toarray()
    np.fill_diagonal(common, 0.0)
    total = common.sum(axis=1, keepdims=True)
    parts: FloatArray = np.divide(common, total, out=np.zeros_like(common), where=total > 0)
    return parts


def _shared_faces(patches: Patches, shares: csr_matrix) -> list[int]:
    """Number of faces of which each scan sees a patch that others see as well."""
    pairs = shares.tocoo()
    shared = (pairs.data > 0.05) & (pairs.data < 0.95)
    seen = np.unique(np.column_stack([pairs.col, patches.face[pairs.row]])[shared], axis=0)
    counts: list[int] = np.bincount(seen[:, 0], minlength=shares.shape[1]).tolist()
    return counts
