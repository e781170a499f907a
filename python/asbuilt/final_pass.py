"""One face, one segment (the paper's future "final pass" that connects close lines; not in the paper).

What remains when the rooms are drawn: bits inside the bodies of walls, and faces that were found in two pieces.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from asbuilt.faces import Face

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
    return join_pieces([face for face in faces if not _is_inside_wall(face, faces)])


def join_pieces(faces: list[Face]) -> list[Face]:
    """Join each face to the one that goes on from it, where nothing stands between."""
    joined = list(faces)
    i = 0
    while i < len(joined):
        j = _next_piece(i, joined)
        if j is None:
            i += 1
            continue
        first, second = joined[i], joined[j]
        longer = max(first, second, key=lambda face: face.length)
        joined[i] = replace(
            longer, start=first.start, end=second.end, fixed=(first.fixed[0], second.fixed[1]), score=longer.score
        )
        del joined[j]
        i = 0
    return joined


def _next_piece(i: int, faces: list[Face]) -> int | None:
    """The face that goes on from face i as a piece of the same one."""
    face = faces[i]
    if face.curve is not None:
        return None
    for j, other in enumerate(faces):
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
            for k, third in enumerate(faces)
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
