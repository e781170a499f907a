"""Faces that meet in corners, exactly (the paper's future "final pass"; not in the paper).

With its room on the left of each face, the faces around a room follow one another: one's end is the next one's start,
at a corner of the room or around a corner of a wall. A face is drawn out to a corner where what lies between may be
hidden, and cut where another wall stands against it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from asbuilt.elevations import Elevations
from asbuilt.faces import Face, covered_length, segments_of
from asbuilt.grid import FloatArray
from asbuilt.neighbours import near_each
from asbuilt.params import WallParameters

_MAX_THICKNESS = 0.7
"""A wall that stands against a face hides no more of it than this, m."""
_MIN_ALONE = 0.9
"""Shorter faces that meet no other are clutter, m."""
_AGAINST = 0.3
"""A face that stands against another starts or ends this near to it, m."""
_STUB = 0.7
"""A face does not run on beyond another one by less than this, m."""
_TOUCH = 0.05
"""Nor by as little as this, which is rounding, m."""
_FURNITURE = (2.5, 0.45)
"""Longest front of furniture that may be taken for a wall, and how far it stands before the wall, m."""
_MAX_COST = 1.2
"""Faces further than this from a corner, in all, do not meet there, m."""


@dataclass(frozen=True)
class Meeting:
    """Two faces, the corner (2,) where the first can end and the second start, and what that takes, m."""

    first: int
    second: int
    corner: FloatArray
    cost: float


def close_corners(
    faces: list[Face], elevations: Elevations, scores: FloatArray, parameters: WallParameters
) -> list[Face]:
    """Cut faces where walls stand against them, and let ends and starts meet."""
    faces = cut_at_walls(cut_stubs(faces))
    closed = list(faces)
    for meeting in sorted(find_meetings(faces, elevations, scores, parameters), key=lambda m: (m.cost, m.first)):
        i, j = meeting.first, meeting.second
        if meeting.cost > _MAX_COST or closed[i].fixed[1] or closed[j].fixed[0]:
            continue
        closed[i] = replace(closed[i], end=meeting.corner, fixed=(closed[i].fixed[0], True))
        closed[j] = replace(closed[j], start=meeting.corner, fixed=(True, closed[j].fixed[1]))
    near_faces = near_each(segments_of(closed), segments_of(closed), _FURNITURE[1])
    return [
        after
        for before, after, near in zip(faces, closed, near_faces, strict=True)
        if not _stands_before(after, [closed[j] for j in near])
        and after.length >= parameters.min_length
        and float(before.along @ after.along) > 0
        and (any(after.fixed) or after.length >= _MIN_ALONE)
    ]


def _stands_before(face: Face, faces: list[Face]) -> bool:
    """Whether a short face that meets no other stands close before a longer one: the front of a sofa, a board."""
    if any(face.fixed) or face.length > _FURNITURE[0] or face.curve is not None:
        return False
    return any(
        other is not face
        and other.length > face.length
        and covered_length(face, other, _FURNITURE[1]) > 0.8 * face.length
        for other in faces
    )


def drop_columns(faces: list[Face], across: float = 1.2) -> list[Face]:
    """Leave out faces that stand about a column: joined to one another only, all within `across` m."""
    tips: dict[tuple[float, float], list[int]] = {}
    for i, face in enumerate(faces):
        for tip in (face.start, face.end):
            tips.setdefault((round(float(tip[0]), 6), round(float(tip[1]), 6)), []).append(i)
    group = list(range(len(faces)))

    def root(i: int) -> int:
        while group[i] != i:
            i = group[i]
        return i

    for together in tips.values():
        for i in together[1:]:
            group[root(i)] = root(together[0])
    members: dict[int, list[Face]] = {}
    for i, face in enumerate(faces):
        members.setdefault(root(i), []).append(face)
    columns = set()
    for key, loop in members.items():
        points = np.array([tip for face in loop for tip in (face.start, face.end)])
        # The middle of a column lies behind all of its faces.
        behind = all(float((points.mean(axis=0) - face.start) @ face.normal) < 0 for face in loop)
        if len(loop) >= 2 and behind and np.ptp(points, axis=0).max() < across:
            columns.add(key)
    return [face for i, face in enumerate(faces) if root(i) not in columns]


def find_meetings(
    faces: list[Face], elevations: Elevations, scores: FloatArray, parameters: WallParameters
) -> list[Meeting]:
    """Pairs of faces of which one can end where the other starts."""
    if not faces:
        return []
    start, end, along, length = _arrays(faces)
    segments, reach = segments_of(faces), max(parameters.extend, parameters.trim) + _TOUCH
    following = near_each(end, start, 2 * reach)
    about_ends, about_starts = (near_each(tips, segments, reach) for tips in (end, start))
    meetings = []
    for i, face in enumerate(faces):
        others = following[i]
        cross, on_first, on_second = _crossings(start, along, i, others)
        beyond_end, beyond_start = on_first - length[i], -on_second
        near = np.abs(cross) > 0.26
        for beyond in (beyond_end, beyond_start):
            near &= (beyond > -parameters.trim) & (beyond < parameters.extend)
        near &= (on_first > 0.03) & (on_second < length[others] - 0.03)
        for n in np.flatnonzero(near):
            j = others[n]
            corner = start[i] + on_first[n] * along[i]
            ways = ((end[i], about_ends[i]), (start[j], about_starts[j]))
            if any(_is_barred(tip, corner, start, end, along, sorted({*about} - {i, j})) for tip, about in ways):
                continue
            cost = _cost(face, float(beyond_end[n]), True, elevations, scores)
            cost += _cost(faces[j], float(beyond_start[n]), False, elevations, scores)
            meetings.append(Meeting(i, j, corner, cost))
    return meetings


def _is_barred(
    tip: FloatArray, corner: FloatArray, start: FloatArray, end: FloatArray, along: FloatArray, others: list[int]
) -> bool:
    """Whether one of the `others` among the faces stands between a tip and a corner."""
    way = corner - tip
    if np.hypot(*way) < 0.05:
        return False
    start, end, along = start[others], end[others], along[others]
    normal = np.column_stack([-along[:, 1], along[:, 0]])
    sides = np.stack([((point - start) * normal).sum(axis=1) for point in (tip + 0.02 * way, tip + 0.98 * way)])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = sides[0] / (sides[0] - sides[1])
    crossing = tip + 0.02 * way + share[:, None] * 0.96 * way
    place = ((crossing - start) * along).sum(axis=1)
    length = ((end - start) * along).sum(axis=1)
    return bool(((sides[0] * sides[1] < 0) & (place > 0.05) & (place < length - 0.05)).any())


def cut_stubs(faces: list[Face]) -> list[Face]:
    """Cut faces that run a little way through another one: no wall stands in the way of what a room sees."""
    if not faces:
        return []
    faces = list(faces)
    start, end, along, length = _arrays(faces)
    crossed = near_each(segments_of(faces), segments_of(faces), _TOUCH)  # cut faces cross no more than before
    i = 0
    while i < len(faces):
        others = crossed[i]
        cross, on_first, on_second = _crossings(start, along, i, others)
        through = (np.abs(cross) > 0.26) & (on_second > _TOUCH) & (on_second < length[others] - _TOUCH)
        stub = np.minimum(on_first, length[i] - on_first)
        through &= (stub > _TOUCH) & (stub < _STUB) & (stub < np.minimum(on_second, length[others] - on_second))
        if faces[i].curve is not None or not through.any():
            i += 1
            continue
        place = float(on_first[np.flatnonzero(through)[np.argmin(stub[through])]])
        tip = faces[i].start + place * faces[i].along
        faces[i] = replace(faces[i], start=tip) if place < length[i] / 2 else replace(faces[i], end=tip)
        for array, values in zip((start, end, along, length), _arrays(faces[i : i + 1]), strict=True):
            array[i] = values[0]
    return faces


def cut_at_walls(faces: list[Face]) -> list[Face]:
    """Cut each face where both faces of another wall stand against it: what lies between them is that wall's body."""
    if not faces:
        return []
    start, _, along, length = _arrays(faces)
    near_faces = near_each(segments_of(faces), segments_of(faces), _AGAINST + _TOUCH)
    fixed_start: dict[int, FloatArray] = {}
    fixed_end: dict[int, FloatArray] = {}
    pieces: list[Face] = []
    origins: list[int] = []
    for i, face in enumerate(faces):
        others = near_faces[i]
        cross, on_first, on_second = _crossings(start, along, i, others)
        inside = (on_first > 0.05) & (on_first < length[i] - 0.05)
        # Where a face starts on this one, this room ends; where one ends on it, the next room begins.
        starting = np.flatnonzero(inside & (cross > 0.26) & (np.abs(on_second) < _AGAINST))
        ending = np.flatnonzero(inside & (cross < -0.26) & (np.abs(on_second - length[others]) < _AGAINST))
        place, fixed = 0.0, face.fixed[0]
        rest = face
        for j in starting[np.argsort(on_first[starting], kind="stable")]:
            body = on_first[ending] - on_first[j]
            within = (body > 0.02) & (body < _MAX_THICKNESS)
            if on_first[j] <= place + 0.05 or not within.any():
                continue
            k = ending[within][np.argmin(body[within])]
            corner, next_corner = (start[i] + on_first[m] * along[i] for m in (j, k))
            pieces.append(replace(rest, end=corner, fixed=(fixed, True)))
            origins.append(i)
            fixed_start[others[j]], fixed_end[others[k]] = corner, next_corner
            place, fixed = float(on_first[k]), True
            rest = replace(face, start=next_corner)
        pieces.append(replace(rest, fixed=(fixed, face.fixed[1])))
        origins.append(i)
    for n, (piece, i) in enumerate(zip(pieces, origins, strict=True)):
        if i in fixed_start and not piece.fixed[0] and np.array_equal(piece.start, faces[i].start):
            piece = replace(piece, start=fixed_start[i], fixed=(True, piece.fixed[1]))
        if i in fixed_end and not piece.fixed[1] and np.array_equal(piece.end, faces[i].end):
            piece = replace(piece, end=fixed_end[i], fixed=(piece.fixed[0], True))
        pieces[n] = piece
    return [piece for piece in pieces if piece.length > 0.05]


def _arrays(faces: list[Face]) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    start = np.array([face.start for face in faces])
    end = np.array([face.end for face in faces])
    length = np.maximum(np.hypot(*(end - start).T), 1e-12)
    return start, end, (end - start) / length[:, None], length


def _crossings(
    start: FloatArray, along: FloatArray, i: int, others: list[int]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where line i crosses others (n,): sine of the angle from i to them, and the place on i and on each of them, m."""
    x, y = along[others].T
    cross = along[i, 0] * y - along[i, 1] * x
    apart = start[others] - start[i]
    with np.errstate(divide="ignore", invalid="ignore"):
        on_first = (apart[:, 0] * y - apart[:, 1] * x) / cross
        on_second = (apart[:, 0] * along[i, 1] - apart[:, 1] * along[i, 0]) / cross
    return cross, on_first, on_second


def _cost(face: Face, beyond: float, at_end: bool, elevations: Elevations, scores: FloatArray) -> float:
    """What it takes to draw a face out by `beyond` m, or to cut it back: length, and length that speaks against it."""
    tip = face.end if at_end else face.start
    moved = tip + (beyond if at_end else -beyond) * face.along
    passed = scores[elevations.between(face.line, tip, moved)]
    # A hidden stretch costs nothing more; one where neither wall nor room was seen does.
    against = 1.5 * (passed < -1).sum() + (passed < -0.2).sum() if beyond > 0 else (passed > 0.8).sum()
    return 0.35 * abs(beyond) + float(against) * elevations.step
