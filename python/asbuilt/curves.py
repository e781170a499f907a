"""Curved walls (not in the paper): chains of short faces that turn steadily become arcs.

A round wall is traced as a chain of chords, each as long as the band lets it be. Where one circle runs through the
voxels of all of them, the arc takes their place, drawn in chords that follow it within half a centimetre and share one
curve.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from asbuilt.faces import Face, segments_of
from asbuilt.grid import BoolArray, FloatArray
from asbuilt.neighbours import near_each
from asbuilt.profiles import StoreyVoxels

_MAX_CHORD = 3.5
"""Longer faces are straight, m."""
_TURN = (np.radians(1.5), np.radians(32))
"""Chords of a curve turn by this much from one to the next, rad."""
_FEWEST = 3
"""Fewer chords are no curve."""
_NEXT = 0.8
"""The next chord starts within this distance of the end of the last, m."""
_MAX_RMS = 0.015
"""Voxels of a curve lie this near to its circle, m."""
_SAGITTA = 0.005
"""The chords that are drawn leave the arc by at most this, m."""
_NOISE = 0.002
"""Mean distances of a curve's voxels over a voxel's length of it scatter by this, m."""
_TOLL = 15.0
"""A facet more must lower the squared error by this many squared units of the noise."""
_DOOR = 0.35
"""Wider gaps in an arc are openings, m."""


def find_curves(faces: list[Face], voxels: StoreyVoxels) -> list[Face]:
    """Faces with the chains that lie on a circle replaced by chords of one curve each; the others as they are."""
    rest = set(range(len(faces)))
    curved: list[Face] = []
    number = 0
    for chain in find_chains(faces):
        left = [i for i in chain if i in rest]  # the others are bits of a curve that was found before
        # The first or the last may be of the wall's other side.
        for part in (left, left[1:], left[:-1]):
            of_curve = [faces[i] for i in part]
            circle = fit_circle(of_curve, voxels) if len(part) >= _FEWEST else None
            if circle is not None:
                break
        else:
            continue
        rest -= set(part)
        while more := [i for i in sorted(rest) if _goes_on(faces[i], circle, of_curve)]:
            rest -= set(more)
            of_curve = in_turn(of_curve + [faces[i] for i in more], circle[0])
            circle = fit_circle(of_curve, voxels) or circle
        chords = _draw_arcs(of_curve, circle, number, voxels)
        rest -= {i for i in rest if _on_circle(faces[i], circle, chords)}
        curved += chords
        number += 1
    return [faces[i] for i in sorted(rest)] + curved


def find_chains(faces: list[Face]) -> list[list[int]]:
    """Indices of faces that follow one another, turning steadily one way; at least three each."""
    short = [i for i, face in enumerate(faces) if face.length < _MAX_CHORD]
    following: dict[int, tuple[int, float]] = {}
    tips = segments_of([faces[i] for i in short])
    for i, near in zip(short, near_each(tips[:, 2:], tips[:, :2], _NEXT), strict=True):
        best = _NEXT
        for j in (short[k] for k in near):
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
        if len(chain) >= _FEWEST and not used & set(chain):
            used |= set(chain)
            chains.append(chain)
    return chains


def fit_circle(chain: list[Face], voxels: StoreyVoxels) -> tuple[FloatArray, float] | None:
    """Centre (2,) and radius, m, of the circle through the voxels along a chain; None where none fits.

    Algebraic least squares (Kasa 1976), twice, the second time on what lies near the first.
    """
    segments = np.array([np.concatenate([face.start, face.end]) for face in chain])
    near = np.unique(voxels.strips(segments, 0.06)[1])
    xy = voxels.xy[near[_is_standing(voxels.z[near], voxels)]]
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


def _goes_on(face: Face, circle: tuple[FloatArray, float], chain: list[Face]) -> bool:
    """Whether a face is of the same curve as a chain: on its circle, near to it, and looking the same way."""
    inward = [float((circle[0] - one.start) @ one.normal) > 0 for one in (face, chain[0])]
    tips, others = (np.array([tip for one in faces for tip in (one.start, one.end)]) for faces in ([face], chain))
    off = np.abs(np.hypot(*(tips - circle[0]).T) - circle[1])
    apart = np.hypot(*np.moveaxis(tips[:, None] - others, 2, 0))
    short = face.length < _MAX_CHORD and float(off.max()) < 0.06
    return inward[0] == inward[1] and short and float(apart.min()) < _NEXT


def in_turn(chords: list[Face], centre: FloatArray) -> list[Face]:
    """Chords of a circle in their order, from after the widest gap between them."""
    middle = np.array([(chord.start + chord.end) / 2 for chord in chords]) - centre
    inward = float(-middle[0] @ chords[0].normal) > 0
    angle = np.arctan2(middle[:, 1], middle[:, 0]) * (1 if inward else -1)
    order = np.argsort(angle, kind="stable")
    gaps = np.diff(angle[order], append=angle[order[0]] + 2 * np.pi)
    return [chords[i] for i in np.roll(order, -int(gaps.argmax()) - 1)]


def _is_standing(z: FloatArray, voxels: StoreyVoxels) -> BoolArray:
    """Which heights above the floor, m, are those of walls."""
    return (z > 0.3) & (z < voxels.height - 0.1)


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


def _draw_arcs(chain: list[Face], circle: tuple[FloatArray, float], curve: int, voxels: StoreyVoxels) -> list[Face]:
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
    chords = []
    for start, end in stretches:
        turns = way * np.array([start, end])
        points = find_facets(turns, circle, voxels)
        if points is None:
            points = _arc(turns, circle)
        for i in range(len(points) - 1):
            fixed = (i > 0, i < len(points) - 2)
            face = replace(chain[0], start=points[i], end=points[i + 1], fixed=fixed, curve=curve)
            middle = (face.start + face.end) / 2
            nearest = min(chain, key=lambda other: float(np.hypot(*((other.start + other.end) / 2 - middle))))
            chords.append(replace(face, line=nearest.line, score=nearest.score))
    return chords


def _arc(turns: FloatArray, circle: tuple[FloatArray, float]) -> FloatArray:
    """Vertices (n, 2) of chords from one angle of a circle to another."""
    centre, radius = circle
    step = 2 * np.arccos(1 - min(_SAGITTA / radius, 1.0))
    angles = np.linspace(float(turns[0]), float(turns[1]), max(int(np.ceil(abs(turns[1] - turns[0]) / step)), 1) + 1)
    # Vertices a little outside, so that the chords follow the arc in the mean.
    points: FloatArray = centre + (radius + _SAGITTA * 2 / 3) * np.column_stack([np.cos(angles), np.sin(angles)])
    return points


def find_facets(turns: FloatArray, circle: tuple[FloatArray, float], voxels: StoreyVoxels) -> FloatArray | None:
    """Vertices (n, 2) of a wall built of flat facets about a circle, from one angle to another; None if it is round.

    In polar coordinates about the centre the reciprocal radius of a straight line is ``a cos + b sin`` of the angle,
    so that fits to all stretches come from running sums. The facets are those that take the least squared error, in
    units of the noise, and a toll for each; the wall is round if the circle takes less.
    """
    centre, radius = circle
    about = voxels.in_box(centre - radius - 2 * _MAX_RMS, centre + radius + 2 * _MAX_RMS)
    apart = voxels.xy[about[_is_standing(voxels.z[about], voxels)]] - centre
    distance = np.hypot(*apart.T)
    near = np.abs(distance - radius) < 2 * _MAX_RMS
    way = float(np.sign(turns[1] - turns[0]))
    angle = (way * (np.arctan2(apart[near, 1], apart[near, 0]) - turns[0])) % (2 * np.pi)
    inside = angle < abs(turns[1] - turns[0])
    count = int(np.ceil(abs(turns[1] - turns[0]) * radius / voxels.voxel))
    bins = np.minimum((angle[inside] * radius / voxels.voxel).astype(np.int64), count - 1)
    weight = np.bincount(bins, minlength=count).astype(np.float64)
    mean = np.bincount(bins, distance[near][inside], minlength=count) / np.maximum(weight, 1)
    seen = np.flatnonzero(weight >= 5)
    if len(seen) < 8:
        return None
    theta = turns[0] + way * (seen + 0.5) * voxels.voxel / radius
    value = radius**2 / mean[seen]  # off by as much as the radius is
    terms = np.column_stack([np.cos(theta), np.sin(theta), value])
    sums = np.concatenate([np.zeros((1, 3, 3)), np.cumsum(terms[:, :, None] * terms[:, None, :], axis=0)])
    total = np.zeros(len(seen) + 1)
    before = np.zeros(len(seen) + 1, dtype=np.int64)
    longest = int(_MAX_CHORD / voxels.voxel)
    for end in range(1, len(seen) + 1):
        first = np.arange(max(end - longest, 0), end)
        cost = total[first] + _misfit(sums[end] - sums[first]) / _NOISE**2 + _TOLL
        best = int(np.argmin(cost))
        total[end], before[end] = cost[best], first[best]
    breaks = [len(seen)]
    while breaks[-1] > 0:
        breaks.append(int(before[breaks[-1]]))
    breaks.reverse()
    round_cost = float(((mean[seen] - radius) ** 2).sum()) / _NOISE**2 + _TOLL
    if total[-1] >= round_cost or len(breaks) < 4:
        return None
    lines = [_chord(sums[j] - sums[i]) for i, j in pairwise(breaks)]
    edges = [turns[0], *(float(theta[i] + theta[i - 1]) / 2 for i in breaks[1:-1]), turns[1]]
    points = [_on_chord(lines[0], edges[0])]
    for one, other, edge in zip(lines[:-1], lines[1:], edges[1:-1], strict=True):
        met = np.arctan2(one[0] - other[0], other[1] - one[1])  # where both have the same radius
        met += np.pi * np.round((edge - met) / np.pi)
        points.append(_on_chord(one, met if abs(met - edge) * radius < 3 * voxels.voxel else edge))
    points.append(_on_chord(lines[-1], edges[-1]))
    return centre + radius**2 * np.array(points)


def _misfit(sums: FloatArray) -> FloatArray:
    """Squared error (n,) of the best chords through stretches of which the moments (n, 3, 3) are given."""
    xx, xy, yy, xv, yv, vv = (sums[:, i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)))
    determinant = np.maximum(xx * yy - xy**2, 1e-12)
    explained = (yy * xv**2 - 2 * xy * xv * yv + xx * yv**2) / determinant
    misfit: FloatArray = np.maximum(vv - explained, 0.0)
    return misfit


def _chord(sums: FloatArray) -> FloatArray:
    """a, b of the chord through a stretch of which the moments (3, 3) are given."""
    return np.asarray(np.linalg.lstsq(sums[:2, :2], sums[:2, 2], rcond=None)[0], dtype=np.float64)


def _on_chord(line: FloatArray, angle: float) -> FloatArray:
    """The point of a chord at an angle about the centre, over the squared radius."""
    ray = np.array([np.cos(angle), np.sin(angle)])
    point: FloatArray = ray / float(line @ ray)
    return point
