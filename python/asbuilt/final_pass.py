"""One face, one segment (the paper's future "final pass" that connects close lines; not in the paper).

What remains when the rooms are drawn: bits inside the bodies of walls, and faces that were found in two pieces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

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
    """Join each face to the one that goes on from it, where nothing stands between; again, until none does."""
    while True:
        segments = segments_of(faces)
        # Every end with the faces about it: which goes on from it, and which meet it.
        tips = np.concatenate([segments[:, 2:], segments[:, :2]])
        near = near_each(tips, segments, _GAP)
        joined: dict[int, Face | None] = {}
        for i, face in enumerate(faces):
            j = _next_piece(i, near, faces)
            if j is None or i in joined or j in joined:
                continue
            longer = max(face, faces[j], key=lambda one: one.length)
            fixed = (face.fixed[0], faces[j].fixed[1])
            joined[i], joined[j] = replace(longer, start=face.start, end=faces[j].end, fixed=fixed), None
        if not joined:
            return faces
        faces = [one for one in (joined.get(i, face) for i, face in enumerate(faces)) if one is not None]


def _next_piece(i: int, near: Sequence[list[int]], faces: list[Face]) -> int | None:
    """The face that goes on from face i as a piece of the same one; `near` are the faces about ends, then starts."""
    face = faces[i]
    for j in near[i]:
        other = faces[j]
        if j == i or face.curve is not None or other.curve is not None:
            continue
        if float(np.hypot(*(other.start - face.end))) > _GAP or float(face.along @ other.along) < _TURNED:
            continue
        whole = replace(face, end=other.end)
        inner = np.array([face.end, other.start]) - whole.start
        if (
            np.abs(inner @ whole.normal).max() > _ASIDE
            or min(face.along @ whole.along, other.along @ whole.along) < _TURNED
        ):
            continue
        meeting = {k for end in (i, len(faces) + j) for k in near[end]} - {i, j}
        tips = np.array([tip for k in meeting for tip in (faces[k].start, faces[k].end)]).reshape(-1, 2)
        apart = [np.hypot(*(tips - end).T).min(initial=np.inf) for end in (face.end, other.start)]
        if min(apart) > _SAME:
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
