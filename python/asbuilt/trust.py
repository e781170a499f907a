"""How far each element of a plan can be trusted (not in the paper).

A wall face gets a standard deviation of its position and a chance of being real; what is built of faces gets both from
them. Registration and uneven surfaces, not the points' noise, decide how far off a face is: they show in how its
stretches disagree with its line, since noise averages out over a stretch and the others do not. How likely it is real
is a logistic model of what its elevation shows. `experiments/11_trust.py --keep` fits both on plans whose truth is
known and writes `trust.json`; the same script shows how far either can be believed.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TypeVar

import numpy as np
import shapely

from asbuilt.elevations import Elevations
from asbuilt.faces import Face, on_faces, segments_of
from asbuilt.grid import BoolArray, FloatArray, IntArray
from asbuilt.neighbours import near_each
from asbuilt.plan import Column, Opening, Room, Stair, Storey, Wall, WallFace
from asbuilt.profiles import StoreyVoxels

MODEL = Path(__file__).with_name("trust.json")
FEATURES = (
    "scatter",
    "disagreement",
    "front",
    "ceiling_behind",
    "floor_behind",
    "partition",
    "score",
    "length",
    "other_face",
)
"""What the chance of a face is told by, the columns of `Looks.features`."""

_STRETCH = 0.4
"""Voxels of one stretch of this length, in the lower or the upper half of a wall, err together, m."""
_MIDDLE = 1.3
"""Height between the two halves, m."""
_SHARED = 2.0
"""A storey's common disagreement counts as much in each face's own as so many stretches."""
_THICKNESS = (0.03, 0.75)
"""How far behind a face the other face of its wall may stand, m."""
_LIKELY, _SHORT = 0.7, 2.0
"""Less likely faces are drawn on the sides of rooms alone, where they are longer than this, m."""
_ON_SIDE = 0.05
"""A face is on a room's side if its middle is this near to it, m."""
_COLUMN_UNSEEN = 0.02
"""How far off a side of a column is that was not seen, m: the ends of its neighbours fill their last voxels in part."""

AnOpening = TypeVar("AnOpening", bound=Opening)


@dataclass(frozen=True)
class _Model:
    """What was fitted: the factor of sigma, and the weights (k,) of the features with what they add to."""

    sigma: float
    intercept: float
    weights: FloatArray


@dataclass(frozen=True)
class Looks:
    """What the evidence shows of faces.

    Attributes
    ----------
    scatter : (n,) root mean square distance of the voxels' means from the face, m.
    disagreement : (n,) standard deviation of the mean distances of its stretches, m.
    features : (n, len(FEATURES)) what tells real faces from others, each about 0..1 or a logarithm.
    supported : (n,) whether any voxel lies on the face.
    """

    scatter: FloatArray
    disagreement: FloatArray
    features: FloatArray
    supported: BoolArray


def trust_faces(
    wall_faces: Sequence[WallFace], faces: Sequence[Face], elevations: Elevations, voxels: StoreyVoxels
) -> tuple[WallFace, ...]:
    """Faces with their `sigma` and `confidence`; empty for no faces.

    Parameters
    ----------
    wall_faces : as they stand in the plan.
    faces : the same ones, in the same order, from the storey's origin.
    """
    if not faces:
        return ()
    looks = look_at(faces, elevations, voxels)
    sigma, confidence = position_sigma(looks), chance(looks.features)
    return tuple(
        replace(
            face,
            sigma=float(sigma[i]) if looks.supported[i] and faces[i].seen else None,
            confidence=float(confidence[i]),
        )
        for i, face in enumerate(wall_faces)
    )


def drop_unlikely(
    faces: list[Face], rooms: Sequence[shapely.Polygon], elevations: Elevations, voxels: StoreyVoxels
) -> list[Face]:
    """Faces without those that are hardly likely and not needed: short ones, and those on no side of a room.

    Of such faces less than a quarter are real, on plans whose truth is known.
    """
    if not faces:
        return faces
    likely = chance(look_at(faces, elevations, voxels).features)
    sides = shapely.STRtree([room.boundary for room in rooms])
    middles = shapely.points([(face.start + face.end) / 2 for face in faces])
    needed = np.zeros(len(faces), dtype=np.bool_)
    needed[sides.query(middles, predicate="dwithin", distance=_ON_SIDE)[0]] = True
    return [
        face
        for i, face in enumerate(faces)
        if likely[i] > _LIKELY or face.curve is not None or (needed[i] and face.length > _SHORT)
    ]


def position_sigma(looks: Looks) -> FloatArray:
    """Standard deviation (n,) of the positions of faces, m: such that 95 % of real faces lie within 1.96 of it.

    The geometric mean of the two kinds of misfit, times a factor that the known errors of plans give. Of what was tried
    it is the sharpest: either kind alone, or either divided by the root of the number of stretches, must claim larger
    errors to hold as often.
    """
    sigma: FloatArray = _model().sigma * np.sqrt(looks.scatter * looks.disagreement)
    return sigma


def chance(features: FloatArray) -> FloatArray:
    """How likely faces with features (n, k) are real (n,)."""
    model = _model()
    likely: FloatArray = 1 / (1 + np.exp(-(model.intercept + features @ model.weights)))
    return likely


def look_at(faces: Sequence[Face], elevations: Elevations, voxels: StoreyVoxels) -> Looks:
    """What the evidence and the elevations show of faces."""
    segments = segments_of(faces)
    length = np.maximum(np.hypot(*(segments[:, 2:] - segments[:, :2]).T), 1e-6)
    face_of, voxel, along, offset = on_faces(faces, voxels)
    z = voxels.z[voxel]
    count = np.bincount(face_of, minlength=len(faces))
    scatter = np.sqrt(np.bincount(face_of, offset**2, minlength=len(faces)) / np.maximum(count, 1))
    disagreement = _disagreement(face_of, along, offset, z, length)
    means = np.array([_means(face, elevations) for face in faces])
    score = np.array([face.score for face in faces])
    features = np.column_stack(
        [
            np.log(np.clip(scatter, 0.001, 0.03) / 0.003),
            np.log(np.clip(disagreement, 0.0003, 0.02) / 0.001),
            means,
            np.log(np.clip(score, 0.1, 10.0)),
            np.log(np.clip(length, 0.1, 5.0)),
            [
                _other_face(segment, segments[near])
                for segment, near in zip(segments, near_each(segments, segments, _THICKNESS[1]), strict=True)
            ],
        ]
    )
    return Looks(scatter, disagreement, features, count > 0)


def _disagreement(
    face_of: IntArray, along: FloatArray, offset: FloatArray, z: FloatArray, length: FloatArray
) -> FloatArray:
    """Standard deviation of the mean offsets of each face's stretches (n,), m, drawn towards the storey's common one.

    Voxels (k,) are on faces of lengths (n,). A short face has too few stretches to tell by itself.
    """
    pieces = np.maximum(np.ceil(length / _STRETCH).astype(np.int64), 1)
    first = np.concatenate([[0], np.cumsum(2 * pieces)])
    piece = np.minimum((along / length[face_of] * pieces[face_of]).astype(np.int64), pieces[face_of] - 1)
    stretch = first[face_of] + 2 * piece + (z > _MIDDLE)
    count = np.bincount(stretch, minlength=first[-1])
    mean = np.bincount(stretch, offset, minlength=first[-1]) / np.maximum(count, 1)
    owner = np.repeat(np.arange(len(length)), 2 * pieces)
    weight = np.where(count > 3, count, 0).astype(np.float64)
    total = np.maximum(np.bincount(owner, weight), 1e-9)
    middle = np.bincount(owner, weight * mean) / total
    free = np.maximum(np.bincount(owner, weight > 0) - 1.0, 0.0)
    variance = np.bincount(owner, weight * (mean - middle[owner]) ** 2) / total * (free + 1) / np.maximum(free, 1)
    common = float((free * variance).sum() / max(free.sum(), 1.0))
    return np.asarray(np.sqrt((free * variance + _SHARED * common) / (free + _SHARED)))


def _means(face: Face, elevations: Elevations) -> tuple[float, float, float, float]:
    """Means of `front`, `ceiling_behind` and `floor_behind` along a face, and whether it is a partition's.

    Floor and ceiling do go on behind a free-standing partition, so that they say nothing about it.
    """
    steps = elevations.beside(face.line, face.start, face.end)
    front, ceiling, floor = (
        float(part[steps].mean()) for part in (elevations.front, elevations.ceiling_behind, elevations.floor_behind)
    )
    return (front, 0.0, 0.0, 1.0) if elevations.partition[face.line] else (front, ceiling, floor, 0.0)


def _other_face(segment: FloatArray, others: FloatArray) -> float:
    """Share of the length of a face (4,) behind which the other face of its wall was found, among those near (n, 4)."""
    way = segment[2:] - segment[:2]
    length = max(float(np.hypot(*way)), 1e-6)
    along = way / length
    relative = others.reshape(-1, 2, 2) - segment[:2]
    behind = -(relative @ np.array([-along[1], along[0]]))
    place = relative @ along
    other = (place[:, 1] < place[:, 0]) & (behind.min(axis=1) > _THICKNESS[0]) & (behind.max(axis=1) < _THICKNESS[1])
    other &= np.ptp(behind, axis=1) < 0.2 * np.ptp(place, axis=1)
    covered = np.minimum(place[other, 0], length) - np.maximum(place[other, 1], 0.0)
    return float(np.clip(covered, 0, None).max(initial=0.0) / length)


def trust_elements(storey: Storey) -> Storey:
    """A storey whose elements but its faces have a sigma and a confidence, by the faces that they are built of.

    A wall is as likely as its faces are on average; its centreline is surer than either face where both were seen. An
    opening is less likely than its wall, the less the less of its outline was seen. A room is as likely as the faces
    along its ring. Columns and stairs stand for themselves.
    """
    faces = {face.id: face for face in storey.wall_faces}
    walls = tuple(_trust_wall(wall, faces) for wall in storey.walls)
    by_id = {wall.id: wall for wall in walls}
    return replace(
        storey,
        walls=walls,
        doors=tuple(_trust_opening(door, by_id) for door in storey.doors),
        windows=tuple(_trust_opening(window, by_id) for window in storey.windows),
        unknown_openings=tuple(_trust_opening(opening, by_id) for opening in storey.unknown_openings),
        rooms=_trust_rooms(storey.rooms, storey.wall_faces),
        columns=tuple(_trust_column(column) for column in storey.columns),
        stairs=tuple(_trust_stair(stair) for stair in storey.stairs),
    )


def _trust_wall(wall: Wall, faces: dict[str, WallFace]) -> Wall:
    of_wall = [faces[name] for name in wall.faces if name in faces]
    sigma, confidence = _together(of_wall, [face.length for face in of_wall])
    if sigma is not None and wall.thickness is not None:
        sigma /= 2**0.5
    return replace(wall, sigma=sigma, confidence=confidence)


def _trust_opening(opening: AnOpening, walls: dict[str, Wall]) -> AnOpening:
    wall = walls.get(opening.wall or "")
    certain = 1.0 if wall is None or wall.confidence is None else wall.confidence
    confidence = (1 + (opening.seen or 0.0)) / 2 * certain
    if wall is None or wall.sigma is None:
        return replace(opening, sigma=None, confidence=confidence)
    return replace(opening, sigma=float(np.hypot(wall.sigma, opening.rms or 0.0)), confidence=confidence)


def _trust_rooms(rooms: Sequence[Room], faces: Sequence[WallFace]) -> tuple[Room, ...]:
    import shapely  # heavy: help and errors do not wait for it

    lines = shapely.STRtree([shapely.LineString([face.start, face.end]) for face in faces])
    trusted = []
    for room in rooms:
        edge = shapely.Polygon(room.ring, room.holes).boundary.buffer(0.03)
        about = np.sort(lines.query(edge))
        shared = shapely.length(shapely.intersection(lines.geometries[about], edge))
        along = shared > 0.1
        sigma, confidence = _together([faces[i] for i in about[along].tolist()], shared[along].tolist())
        trusted.append(replace(room, sigma=sigma, confidence=confidence))
    return tuple(trusted)


def _trust_column(column: Column) -> Column:
    seen = column.seen or 0.0
    return replace(column, sigma=(column.rms or 0.0) / 2 + _COLUMN_UNSEEN * (1 - seen), confidence=0.8 + 0.2 * seen)


def _trust_stair(stair: Stair) -> Stair:
    return replace(stair, confidence=0.5 + 0.5 * (stair.seen or 0.0))


def _together(faces: Sequence[WallFace], lengths: Sequence[float]) -> tuple[float | None, float]:
    """Sigma and confidence of what faces make together, by the lengths (m) with which they take part."""
    total = sum(lengths)
    if total <= 0:
        return None, 0.0
    confidence = sum((face.confidence or 0.0) * part for face, part in zip(faces, lengths, strict=True)) / total
    known = [(face.sigma, part) for face, part in zip(faces, lengths, strict=True) if face.sigma is not None]
    if not known:
        return None, confidence
    square = sum(sigma**2 * part for sigma, part in known) / sum(part for _, part in known)
    return float(square**0.5), confidence


@cache
def _model() -> _Model:
    model = json.loads(MODEL.read_text(encoding="utf-8"))
    return _Model(model["sigma"], model["intercept"], np.array([model["weights"][name] for name in FEATURES]))
