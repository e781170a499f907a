"""Faces that are none, or that look the wrong way, told by the others (not in the paper).

What stands before a wall, in it or behind it makes planes of its own: boards, panes, door leaves, what leans on it, and
facades that were seen through a window.
"""

from __future__ import annotations

import numpy as np

from asbuilt.elevations import Elevations
from asbuilt.faces import LEAF_WIDTH, Face, covered_length, segments_of, shows, usual_filling
from asbuilt.neighbours import near_each

_SURE, _HALF_SURE = 0.9, 0.6
"""It is sure which side sees a face if more than this share of its steps tells so; or half sure."""
_THICKNESS, _PARALLEL = (0.04, 0.4), np.cos(np.radians(2.0))
"""The faces of a wall are so far apart, m, and turned less against each other."""
_FILLED = 0.35
"""A face that is filled less, of what a well seen wall fills, is a pane, whichever side sees it."""
_LEAF, _FREE = 0.08, 0.15
"""A leaf is thinner than the first, and nothing stands within the second of its free end, m."""
_MEETS = 1.0
"""A face that hardly shows meets another one so near, m."""
_ASLANT = (
    (np.cos(np.radians(5.0)), 2.0, 0.025),
    (np.cos(np.radians(30.0)), 4.0, 0.025),
    (np.cos(np.radians(60.0)), 4.0, 0.25),
)
"""What passes through a face at an angle with a cosine above the first leans on it or goes through openings in it, if
that is so many times as long, and it reaches so far to both sides, m."""
_FROM_END = 0.4
"""Nearer to the longer one's ends it may be a chord of the curve in which that ends, m."""
_SLIVER = (0.5, 0.06)
"""A face shorter than this, and this near to a longer one's line, is none of its own, m."""


def turn_backs(faces: list[Face], elevations: Elevations) -> list[Face]:
    """Faces, those turned round of which it is not sure which side sees them and which look at the back of a surer one.

    Through a thin wall, floor and ceiling of the room behind show as near as those of the room before.
    """
    full = usual_filling(elevations.whole)
    sure = [_sureness(face, elevations) for face in faces]
    filled = [elevations.whole[_steps_of(face, elevations)].mean() > _FILLED * full for face in faces]
    turned = list(faces)
    for i, near in enumerate(near_each(segments_of(faces), segments_of(faces), _THICKNESS[1])):
        if sure[i] > _SURE or not filled[i]:
            continue
        back = faces[i].turned
        is_back = any(sure[j] > sure[i] and _is_back(faces[i], faces[j]) for j in near)
        if is_back and not any(covered_length(back, faces[j], _THICKNESS[1]) > 0.1 for j in near):
            turned[i] = back
    return turned


def drop_doubles(faces: list[Face], apart: float = 0.3) -> list[Face]:
    """Of faces that lie behind one another as seen from the room, keep the surest: a room sees one of them only.

    A window's pane, a niche's back or a board makes a plane of its own within `apart` m of the wall's. Nor is there a
    room so narrow that the wall on its other side is as near: that is the back of what stands before the wall.
    """
    faces = sorted(faces, key=lambda f: -f.score)
    kept: dict[int, Face] = {}
    for i, near in enumerate(near_each(segments_of(faces), segments_of(faces), apart)):
        face = faces[i]
        if not any(
            covered_length(face, other, apart) > 0.5 * face.length
            or _is_sliver(face, other)
            or _leans(face, other)
            or (_before(face, other) and covered_length(face.turned, other, apart) > 0.5 * face.length)
            for other in (kept[j] for j in near if j in kept)
        ):
            kept[i] = face
    return list(kept.values())


def drop_leaves(faces: list[Face]) -> list[Face]:
    """Faces without those of door leaves: short, thin, and about one of whose ends one can walk."""
    segments = segments_of(faces)
    near_tips = near_each(segments.reshape(-1, 2), segments, _FREE)
    leaves = set()
    for i, near in enumerate(near_each(segments, segments, _LEAF)):
        face = faces[i]
        if face.length > LEAF_WIDTH:
            continue
        backs = [
            j
            for j in near
            if faces[j].length < LEAF_WIDTH
            and not _before(face, faces[j])
            and covered_length(face.turned, faces[j], _LEAF) > 0.5 * face.length
        ]
        own = {i, *backs}
        if backs and any(set(near_tips[2 * i + end]) <= own for end in (0, 1)):
            leaves.add(i)
    return [face for i, face in enumerate(faces) if i not in leaves]


def drop_unmet(faces: list[Face], elevations: Elevations) -> list[Face]:
    """Faces without those before which floor and ceiling hardly show, but where such a one meets another face.

    Those that meet none stand outside, and were seen through a window or in a mirror. Nor is such a face kept beside
    another one if it is not even told which side sees it: it is a pane.
    """
    full = usual_filling(elevations.whole)
    seen = [_is_seen(face, elevations, full) for face in faces]
    well_seen = [face for face, is_seen in zip(faces, seen, strict=True) if is_seen]
    near_tips = near_each(segments_of(faces).reshape(-1, 2), segments_of(well_seen), _MEETS)

    def is_met(i: int) -> bool:
        face, met = faces[i], {*near_tips[2 * i], *near_tips[2 * i + 1]}
        beside = any(
            covered_length(side, well_seen[j], _THICKNESS[1]) > 0.5 * face.length
            for side in (face, face.turned)
            for j in met
        )
        return bool(met) and not (beside and _sureness(face, elevations) < _HALF_SURE)

    return [face for i, face in enumerate(faces) if seen[i] or is_met(i)]


def _sureness(face: Face, elevations: Elevations) -> float:
    """Share of the steps of a face that tell that it is seen from its left."""
    left = float(elevations.left[_steps_of(face, elevations)].mean())
    return left if float(face.along @ elevations.along(face.line)) > 0 else 1 - left


def _steps_of(face: Face, elevations: Elevations) -> slice:
    return elevations.beside(face.line, face.start, face.end)


def _is_back(face: Face, other: Face) -> bool:
    """Whether a face would be the back of another one that stands before it, if it looked the other way."""
    apart = float(((other.start + other.end) / 2 - face.start) @ face.normal)
    return bool(
        _THICKNESS[0] < apart < _THICKNESS[1]
        and float(face.along @ other.along) > _PARALLEL
        and covered_length(face, other, _THICKNESS[1]) > 0.5 * face.length
    )


def _is_seen(face: Face, elevations: Elevations, full: float) -> bool:
    """Whether floor and ceiling show before a face, or it shows itself in most places."""
    steps = _steps_of(face, elevations)
    if elevations.partition[face.line]:
        return True
    filled = elevations.whole[steps].mean() / full
    return shows(elevations.front[steps].mean(), filled if elevations.covered[steps].mean() > 0.3 else 0.0)


def _is_sliver(face: Face, other: Face) -> bool:
    """Whether a short face is a bit of a longer one that it goes on from or runs along, a little turned."""
    if face.length > _SLIVER[0] or other.length < 2 * _SLIVER[0]:
        return False
    relative = np.array([face.start - other.start, face.end - other.start])
    place = np.sort(relative @ other.along)
    aside = np.abs(relative @ other.normal).max()
    return bool(aside < _SLIVER[1] and place[0] < other.length + _SLIVER[1] and place[1] > -_SLIVER[1])


def _leans(face: Face, other: Face) -> bool:
    """Whether a face passes aslant through a longer one, as what leans on a wall does."""
    relative = np.array([face.start - other.start, face.end - other.start])
    aside = relative @ other.normal
    if aside[0] * aside[1] >= 0:
        return False
    crossing = float(relative @ other.along @ np.abs(aside[::-1]) / np.abs(aside).sum())
    slant, longer, reach = abs(float(face.along @ other.along)), other.length / face.length, np.abs(aside).min()
    return _FROM_END < crossing < other.length - _FROM_END and any(
        slant > cosine and longer >= times and reach > least for cosine, times, least in _ASLANT
    )


def _before(face: Face, other: Face) -> bool:
    """Whether a face stands on the side to which another one looks."""
    return float(((face.start + face.end) / 2 - other.start) @ other.normal) > 0
