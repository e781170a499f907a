"""Curved walls (not in the paper): chains of short faces that turn steadily become arcs.

A round wall is traced as a chain of chords, each as long as the band lets it be. Where one circle runs through the
voxels of all of them, the arc takes their place, drawn in chords that follow it within half a centimetre and share one
curve.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from asbuilt import _core
from asbuilt.faces import Face
from asbuilt.grid import FloatArray
from asbuilt.profiles import StoreyVoxels

_MAX_CHORD = 3.5
"""Longer faces are straight, m."""
_TURN = (np.radians(1.5), np.radians(32))
"""Chords of a curve turn by this much from one to the next, rad."""
_NEXT = 0.8
"""The next chord starts within this distance of the end of the last, m."""
_MAX_RMS = 0.015
"""Voxels of a curve lie this near to its circle, m."""
_SAGITTA = 0.005
"""The chords that are drawn leave the arc by at most this, m."""
_DOOR = 0.35
"""Wider gaps in an arc are openings, m."""


def find_curves(faces: list[Face], voxels: StoreyVoxels) -> list[Face]:
    """Faces with the chains that lie on a circle replaced by chords of one curve each; the others as they are."""
    rest = set(range(len(faces)))
    curved: list[Face] = []
    number = 0
    for chain in find_chains(faces):
        circle = fit_circle([faces[i] for i in chain], voxels)
        if circle is None:
            continue
        rest -= set(chain)
        chords = _draw_arcs([faces[i] for i in chain], circle, number)
        rest -= {i for i in rest if _on_circle(faces[i], circle, chords)}
        curved += chords
        number += 1
    return [faces[i] for i in sorted(rest)] + curved


def find_chains(faces: list[Face]) -> list[list[int]]:
    """Indices of faces that follow one another, turning steadily one way; at least three each."""
    short = [i for i, face in enumerate(faces) if face.length < _MAX_CHORD]
    following: dict[int, tuple[int, float]] = {}
    for i in short:
        best = _NEXT
        for j in short:
            apart = float(np.hypot(*(faces[j].start - faces[i].end)))
            turn = _turn(faces[i], faces[j])
            ahead = float((faces[j].end - faces[i].end) @ faces[i].along) > 0
            if i != j and apart < best and ahead and _TURN[0] < abs(turn) < _TURN[1]:
                best = apart
                following[i] = (j, np.sign(turn))
    chains = []
    used: set[int] = set()
    led = {j for j, _ in following.values()}
    for i in [k for k in short if k not in led] + short:
        chain = [i]
        sign = 0.0
        while chain[-1] in following and chain[-1] not in used:
            j, turn = following[chain[-1]]
            if j in used or j in chain or sign * turn < 0:
                break
            chain.append(j)
            sign = turn
        if len(chain) >= 3 and not used & set(chain):
            used |= set(chain)
            chains.append(chain)
    return chains


def fit_circle(chain: list[Face], voxels: StoreyVoxels) -> tuple[FloatArray, float] | None:
    """Centre (2,) and radius, m, of the circle through the voxels along a chain; None where none fits.

    Algebraic least squares (Kasa 1976), twice, the second time on what lies near the first.
    """
    segments = np.array([np.concatenate([face.start, face.end]) for face in chain])
    standing = voxels.xy[(voxels.z > 0.3) & (voxels.z < voxels.height - 0.1)]
    _, point, _, _ = _core.strips(standing, segments, 0.06, 0.0)
    xy = standing[np.unique(point)]
    if len(xy) < 30:
        return None
    origin = xy.mean(axis=0)
    near = np.ones(len(xy), dtype=np.bool_)
    centre, radius = origin, 0.0
    for _ in range(3):
        terms = np.column_stack([2 * (xy[near] - origin), np.ones(int(near.sum()))])
        solution = np.linalg.lstsq(terms, ((xy[near] - origin) ** 2).sum(axis=1), rcond=None)[0]
        centre = origin + solution[:2]
        radius = float(np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 0.0)))
        off = np.hypot(*(xy - centre).T) - radius
        near = np.abs(off) < 0.03
        if near.mean() < 0.6:
            return None
    spanned = sum(face.length for face in chain) / max(radius, 1e-9)
    good = np.sqrt(np.mean(off[near] ** 2)) < _MAX_RMS and 0.4 < radius < 100 and spanned > np.radians(20)
    return (centre, radius) if good else None


def _on_circle(face: Face, circle: tuple[FloatArray, float], chords: list[Face]) -> bool:
    """Whether a face is a bit of the curve that the chain left out, or lies across it."""
    centre, radius = circle
    middle = (face.start + face.end) / 2
    off = np.abs(np.hypot(*(np.array([face.start, middle, face.end]) - centre).T) - radius)
    beside = min(float(np.hypot(*((chord.start + chord.end) / 2 - middle))) for chord in chords)
    return face.length < _MAX_CHORD and bool(off.max() < 0.12) and beside < 0.5


def _turn(first: Face, second: Face) -> float:
    """Signed angle from one face's direction to another's, rad."""
    a, b = first.along, second.along
    return float(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b))


def _draw_arcs(chain: list[Face], circle: tuple[FloatArray, float], curve: int) -> list[Face]:
    """Chords along the stretches of a circle that the faces of a chain cover, in the chain's direction."""
    centre, radius = circle
    angles = [np.arctan2(*(tip - centre)[::-1]) for face in chain for tip in (face.start, face.end)]
    # Counter-clockwise arcs see their centre on the left.
    way = 1.0 if float((centre - chain[0].start) @ chain[0].normal) > 0 else -1.0
    place = np.unwrap([way * angle for angle in angles]).reshape(-1, 2)
    stretches: list[list[float]] = []
    for start, end in place[np.argsort(place[:, 0], kind="stable")]:
        if stretches and (start - stretches[-1][1]) * radius < _DOOR:
            stretches[-1][1] = max(stretches[-1][1], float(end))
        else:
            stretches.append([float(start), float(end)])
    # A full circle ends where it starts.
    stretches[-1][1] = min(stretches[-1][1], stretches[0][0] + 2 * np.pi)
    step = 2 * np.arccos(1 - min(_SAGITTA / radius, 1.0))
    chords = []
    for start, end in stretches:
        count = max(int(np.ceil((end - start) / step)), 1)
        # Vertices a little outside, so that the chords follow the arc in the mean.
        turns = way * np.linspace(start, end, count + 1)
        points = centre + (radius + _SAGITTA * 2 / 3) * np.column_stack([np.cos(turns), np.sin(turns)])
        for i in range(count):
            face = replace(chain[0], start=points[i], end=points[i + 1], fixed=(i > 0, i < count - 1), curve=curve)
            middle = (face.start + face.end) / 2
            nearest = min(chain, key=lambda other: float(np.hypot(*((other.start + other.end) / 2 - middle))))
            chords.append(replace(face, line=nearest.line, score=nearest.score))
    return chords
