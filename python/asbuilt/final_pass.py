"""One face, one segment (the paper's future "final pass" that connects close lines; not in the paper).

What remains when the rooms are drawn: bits inside the bodies of walls, and faces that were found in two pieces.
"""

from __future__ import annotations

from dataclasses import replace
from heapq import heappop, heappush

import numpy as np

from asbuilt.faces import Face, segments_of
from asbuilt.neighbours import near_each

_BIT = 0.6
"""A face inside a wall's body is shorter than this, m."""
_BODY = 0.5
"""Thickest wall in whose body bits are looked for, m."""
_GAP = 0.3
"""Narrower gaps between faces of one plane are no openings, m."""
_ASIDE = 0.04
"""Pieces of one face lie this near to the line between their outer ends, m."""
_TURNED = np.cos(np.radians(8.0))
"""And are turned against it by less than this."""
_SAME = 1e-3
"""Ends this near to each other are joined, m."""


def finish_faces(faces: list[Face]) -> list[Face]:
    """Faces without bits inside walls, and with the pieces of one face joined."""
    near = near_each(segments_of(faces), segments_of(faces), _BODY)
    return join_pieces(
        [face for face, about in zip(faces, near, strict=True) if not _is_inside_wall(face, [faces[j] for j in about])]
    )


def join_pieces(faces: list[Face]) -> list[Face]:
    """Join each face to the one that goes on from it, where nothing stands between."""
    joined = dict(enumerate(faces))
    # Ends stay where they are: that of face i is i, its start len(faces) + i. Which face has which changes.
    ends = np.array([face.end for face in faces] + [face.start for face in faces]).reshape(-1, 2)
    near = near_each(ends, ends, _GAP + 2 * _SAME)
    owner = dict(enumerate([*range(len(faces)), *range(len(faces))]))
    end_of = {i: i for i in joined}
    waiting = list(joined)
    while waiting:
        i = heappop(waiting)
        if i not in joined:
            continue
        about = {owner[end] for end in near[end_of[i]] if end in owner}
        j = _next_piece(i, {k: joined[k] for k in sorted(about)})
        if j is None:
            continue
        first, second = joined[i], joined.pop(j)
        longer = max(first, second, key=lambda face: face.length)
        joined[i] = replace(
            longer, start=first.start, end=second.end, fixed=(first.fixed[0], second.fixed[1]), score=longer.score
        )
        met = (end_of[i], len(faces) + j)
        end_of[i] = end_of.pop(j)
        owner[end_of[i]] = i
        for end in met:
            del owner[end]
        # What may go on, or on from, the new face and what was kept from it by the ends that are no more.
        for end in (*met, end_of[i], len(faces) + i):
            for k in {owner[other] for other in near[end] if other in owner}:
                heappush(waiting, k)
    return list(joined.values())


def _next_piece(i: int, faces: dict[int, Face]) -> int | None:
    """The face that goes on from face i as a piece of the same one, of those about its end."""
    face = faces[i]
    if face.curve is not None:
        return None
    for j, other in faces.items():
        gap = float(np.hypot(*(other.start - face.end)))
        if j == i or other.curve is not None or gap > _GAP or float(face.along @ other.along) < _TURNED:
            continue
        whole = replace(face, end=other.end)
        inner = np.array([face.end, other.start]) - whole.start
        if (
            np.abs(inner @ whole.normal).max() > _ASIDE
            or min(face.along @ whole.along, other.along @ whole.along) < _TURNED
        ):
            continue
        met = [
            float(np.hypot(*(tip - end))) < _SAME
            for k, third in faces.items()
            if k not in (i, j)
            for tip in (third.start, third.end)
            for end in (face.end, other.start)
        ]
        if not any(met):
            return j
    return None


def _is_inside_wall(face: Face, faces: list[Face]) -> bool:
    """Whether a short face stands between the two faces of a wall, away from its ends."""
    if face.length > _BIT or face.curve is not None:
        return False
    tips = np.array([face.start, face.end])

    def stands_behind(other: Face) -> bool:
        relative = tips - other.start
        place, aside = relative @ other.along, relative @ other.normal
        return bool(
            (place > 0.05).all()
            and (place < other.length - 0.05).all()
            and (aside < 0.01).all()
            and (aside > -_BODY).all()
        )

    before = [other for other in faces if other is not face and other.length > _BIT and stands_behind(other)]
    return any(float(one.along @ other.along) < -0.98 for n, one in enumerate(before) for other in before[n + 1 :])
