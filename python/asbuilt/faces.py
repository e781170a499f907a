"""Wall faces from elevations: where along its line a wall stands (not in the paper).

Each step of an elevation is scored for a wall and against it. Filled heights speak for a wall, most of all those under
the ceiling, which furniture does not reach; floor or ceiling that go on behind the plane, or a door leaf standing in
the wall's body, speak against it. Where nothing was seen on the plane and nothing behind it, something stands before
it: such a hidden stretch speaks neither way, so that it is bridged between stretches of wall and nowhere else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from asbuilt.directed import Directed
from asbuilt.elevations import ON_PLANE, Elevations, close_gaps, smooth, usual
from asbuilt.grid import BoolArray, FloatArray, IntArray
from asbuilt.neighbours import near_each
from asbuilt.params import WallParameters
from asbuilt.plan import WallFace
from asbuilt.profiles import StoreyVoxels

_DOOR_WIDTH = (0.5, 2.6)
"""Openings of this width are doors, m."""

_MET = (0.22, 0.12)
"""A stretch shorter than the first, beyond a gap longer than the second, is another wall met end on, m."""
_ABOVE = (0.5, 0.6)
"""No wall stands where the ceiling goes on behind it over more than a share of so many metres each way."""
_FILLED = 0.65
"""What fills more of what a well seen wall does is one, though the floor goes on behind it: its line may be askew."""
LEAF_WIDTH = 1.3
"""Shorter things about which one can walk are door leaves, m."""
_SEEN = 0.35
"""Where less than such a share of floor and ceiling shows before a face, it hardly does."""

_LOW = (0.2, 1.9)
"""Heights of doors, at which a jamb shows, m."""
_BEHIND = (0.03, 0.65)
"""The two faces of a wall with an opening are so far apart, m."""


@dataclass(frozen=True)
class Face(Directed):
    """A stretch of a line on which a wall's face stands.

    Attributes
    ----------
    line : index of its line in the elevations.
    start, end : (2,) m from the storey's origin; the room that sees it is on the left.
    fixed : whether start and end are corners.
    score : the higher, the surer.
    curve : number of the curved wall that it is a chord of, else None.
    seen : whether it was seen, or stands where the other face of its wall tells.
    """

    line: int
    start: FloatArray
    end: FloatArray
    score: float
    fixed: tuple[bool, bool] = (False, False)
    curve: int | None = None
    seen: bool = True

    @property
    def turned(self) -> Face:
        """The same stretch seen from its other side."""
        return replace(self, start=self.end, end=self.start)


def segments_of(faces: Sequence[Face]) -> FloatArray:
    """Start and end of each face (n, 4), m."""
    return np.array([[*face.start, *face.end] for face in faces]).reshape(-1, 4)


def score_steps(elevations: Elevations, parameters: WallParameters) -> FloatArray:
    """For (above 0) or against (below) a wall on each step of the elevations (m,)."""
    upper, lower, whole = (closed(elevations, part, parameters) for part in ("upper", "lower", "whole"))
    behind = elevations.ceiling_behind + elevations.floor_behind
    hidden = (elevations.front > 0.4) & (behind < 0.25) & (elevations.low_behind < 0.3)
    score = score_filling(upper, lower, whole, hidden)
    # No room sees what lies inside another wall.
    inside = (smooth(elevations.whole, elevations.first, 3) < 0.02) & (elevations.front < 0.5)
    score = np.where(inside, np.minimum(score, -0.02), score)
    room_goes_on = (elevations.ceiling_behind > 0.35) & (elevations.front > 0.35) & (upper < 0.25)
    # A cupboard may reach nearly to the ceiling, and yet that goes on over it. What is filled less high may be a pane.
    above = np.minimum(elevations.ceiling_behind, elevations.ceiling_beyond)
    above = smooth(above, elevations.first, 2 * round(_ABOVE[0] / elevations.step) + 1)
    room_goes_on |= (above > _ABOVE[1]) & (elevations.ceiling_behind > 0.35) & (lower > 0.5) & (upper > 0.6)
    score = np.where(room_goes_on, -2.0, score)
    opening = (lower < 0.15) & ((elevations.floor_behind > 0.3) | (elevations.low_behind > 0.3))
    score = np.where(opening, -1.5, score)
    # About a partition one can walk, and see over it: its own filling alone counts.
    partition = np.repeat(elevations.partition, np.diff(elevations.first))
    return np.where(partition, np.where(lower < 0.15, -1.5, 1.5 * lower - 0.6), score)


def score_filling(upper: FloatArray, lower: FloatArray, whole: FloatArray, hidden: BoolArray | bool) -> FloatArray:
    """For or against a wall on steps (m,) by what is filled on the plane; little where something may be hidden."""
    score = 1.5 * upper + lower - 0.45
    score = np.where(hidden & (score < 0), -0.02, score)
    # What shows under the ceiling decides; without it the rest of the height counts for little.
    return np.where(upper < 0.2, np.minimum(score, 0.35 * whole - 0.05), score)


def closed(elevations: Elevations, part: str, parameters: WallParameters) -> FloatArray:
    """A part of the elevations as a share of what a well seen wall fills (m,), with gaps between scan lines closed."""
    full = usual_filling(elevations.whole)
    return closed_shares(getattr(elevations, part), full, elevations.first, elevations.step, parameters)


def closed_shares(
    values: FloatArray, full: float, first: IntArray, step: float, parameters: WallParameters
) -> FloatArray:
    """Values (m,) of steps (m) as shares of what is full, with gaps between scan lines closed, never across lines."""
    width = 2 * (round(parameters.closing / step) // 2) + 1
    return np.clip(close_gaps(values, first, width) / full, 0, 1)


def usual_filling(whole: FloatArray) -> float:
    """Share of its heights that a well seen wall fills, by the shares of all steps (m,): thin clouds fill less."""
    return max(usual(whole, whole), 0.1)


def find_faces(elevations: Elevations, scores: FloatArray, parameters: WallParameters) -> list[Face]:
    """The stretches of each line that score as wall and look like one as a whole."""
    under_ceiling = closed(elevations, "upper", parameters)
    full = usual_filling(elevations.whole)
    faces = []
    for line in range(len(elevations.lines)):
        first, last = elevations.first[line], elevations.first[line + 1]
        start, along = elevations.lines[line, :2], elevations.along(line)
        position = elevations.position(line)
        for low, high, score in maximal_runs(
            scores[first:last] * elevations.step, parameters.min_score, parameters.drop
        ):
            low, high = peel(scores[first:last] > 0, low, high, elevations.step)
            steps = slice(first + low, first + high)
            if elevations.partition[line]:
                if (high - low) * elevations.step < LEAF_WIDTH:
                    continue  # a door's leaf
            elif not _looks_like_a_wall(elevations, steps, under_ceiling[steps], full):
                continue
            ends = [start + (position[low] - elevations.step / 2) * along]
            ends.append(start + (position[high - 1] + elevations.step / 2) * along)
            if elevations.left[steps].mean() < 0.5:
                ends.reverse()
            faces.append(Face(line, ends[0], ends[1], score))
    return faces


def shows(front: float, whole: float) -> bool:
    """Whether so much shows of floor and ceiling before a face, or of both them and itself, that it is well seen."""
    return bool(front > _SEEN or (front > 0.1 and whole > _SEEN))


def covered_length(face: Face, other: Face, apart: float) -> float:
    """Length of `face` that lies beside `other`, nearly parallel, with the room on the same side."""
    relative = np.array([face.start - other.start, face.end - other.start])
    aside = relative @ other.normal
    across = aside[0] * aside[1] < 0 or np.abs(aside).min() < 0.03
    facing = float(face.along @ other.along)
    # The other face of a wall looks the other way; what crosses a wall at a small angle is no face of it.
    if np.abs(aside).max() > apart or (facing < 0.98 and not (abs(facing) > 0.96 and across)):
        return 0.0
    low, high = relative @ other.along
    return float(max(min(high, other.length) - max(low, 0.0), 0.0))


def cut_openings(faces: list[Face], elevations: Elevations, scores: FloatArray, voxels: StoreyVoxels) -> list[Face]:
    """Cut faces where the other face of their wall has an opening.

    A door leaf that stands flush with one face fills it like wall; seen from the other side it stands in a recess,
    between jambs.
    """
    gaps = [
        (before, after)
        for before, after in pairwise(sorted(faces, key=lambda f: (f.line, _along(f, elevations))))
        if before.line == after.line and _is_opening(before, after, elevations, scores)
    ]
    openings = [gap for gap, jambs in zip(gaps, _have_jambs(gaps, voxels), strict=True) if jambs]
    beyond = np.array([[*before.start, *after.end] for before, after in openings]).reshape(-1, 4)
    cut = []
    for face, near in zip(faces, near_each(segments_of(faces), beyond, _BEHIND[1]), strict=True):
        pieces = [face]
        for before, after in (openings[i] for i in near):
            pieces = [part for piece in pieces for part in _without(piece, before, after)]
        cut += pieces
    return cut


def _along(face: Face, elevations: Elevations) -> float:
    """Place of a face's middle along its line, m."""
    middle = (face.start + face.end) / 2
    return float((middle - elevations.lines[face.line, :2]) @ elevations.along(face.line))


def _is_opening(before: Face, after: Face, elevations: Elevations, scores: FloatArray) -> bool:
    """Whether what lies between two faces of a line is an opening of a door's width."""
    start, along = elevations.lines[before.line, :2], elevations.along(before.line)
    tips = [sorted(float((tip - start) @ along) for tip in (face.start, face.end)) for face in (before, after)]
    low, high = tips[0][1], tips[1][0]
    if float(before.along @ after.along) < 0 or not _DOOR_WIDTH[0] < high - low < _DOOR_WIDTH[1]:
        return False
    position = elevations.position(before.line)
    inside = scores[elevations.first[before.line] :][: len(position)][(position > low) & (position < high)]
    return bool((inside < -1).mean() > 0.5)


def _have_jambs(gaps: list[tuple[Face, Face]], voxels: StoreyVoxels) -> BoolArray:
    """Whether surfaces turn back into the wall where the openings between pairs of faces begin or end (n,)."""
    if not gaps:
        return np.zeros(0, dtype=np.bool_)
    about = []
    for before, after in gaps:
        tips = np.array([before.start, before.end, after.start, after.end])
        near = tips[np.argsort((tips - before.start) @ before.along)[1:3]]
        about += [np.hstack([tip - 0.1 * before.along, tip + 0.1 * before.along]) for tip in near]
    tip, _, _, offset = voxels.strips(np.array(about), 0.08, between=_LOW)
    behind = offset < -(ON_PLANE + 0.005)
    jambs: BoolArray = (np.bincount(tip[behind], minlength=len(about)) >= 8).reshape(-1, 2).max(axis=1)
    return jambs


def _without(face: Face, before: Face, after: Face) -> list[Face]:
    """A face without the stretch opposite the opening between two faces of its wall's other side."""
    if float(face.along @ before.along) > -0.99:
        return [face]
    behind = [float((tip - face.start) @ face.normal) for tip in (before.start, after.end)]
    if not all(_BEHIND[0] < -distance < _BEHIND[1] for distance in behind):
        return [face]
    ends = [float((tip - face.start) @ face.along) for near in (before, after) for tip in (near.start, near.end)]
    low, high = sorted(ends)[1:3]
    if high < 0.1 or low > face.length - 0.1:
        return [face]
    rest = [
        replace(face, end=face.start + max(low, 0.0) * face.along),
        replace(face, start=face.start + min(high, face.length) * face.along),
    ]
    return [piece for piece, length in zip(rest, (low, face.length - high), strict=True) if length > 0.1]


def snap_to_jambs(faces: list[Face], voxels: StoreyVoxels, reach: float = 0.2) -> list[Face]:
    """Move ends to the surfaces that turn back from them: the jamb of an opening, the end of a wall, a corner.

    Voxels up to 0.12 m behind a face's plane, within `reach` (m) of its end, mark where such a surface stands.
    """
    if not faces:
        return faces
    tips = np.array([tip for face in faces for tip in (face.start, face.end)])
    along = np.array([face.along for face in faces for _ in (0, 1)])
    ends = np.hstack([tips - reach * along, tips + reach * along])
    tip, _, place, offset = voxels.strips(ends, 0.12, between=_LOW)
    behind = offset < -(ON_PLANE + 0.005)
    tip, place = tip[behind], place[behind] - reach
    moved = tips.copy()
    first = np.searchsorted(tip, np.arange(len(tips) + 1))
    for i in range(len(tips)):
        near = np.sort(place[first[i] : first[i + 1]])
        if len(near) < 6:
            continue
        within = np.searchsorted(near, near + 0.02) - np.arange(len(near))
        best = int(within.argmax())
        if within[best] >= max(6, 0.4 * len(near)):
            moved[i] += float(np.mean(near[best : best + within[best]])) * along[i]
    return [replace(face, start=moved[2 * i], end=moved[2 * i + 1]) for i, face in enumerate(faces)]


def maximal_runs(scores: FloatArray, least: float, drop: float) -> list[tuple[int, int, float]]:
    """Runs (first, past the last, sum) of scores (n,) with the largest sums.

    A run begins at a positive score, ends at its highest sum, and is closed once the sum has fallen by `drop` below
    that. Runs of less than `least` are left out.
    """
    runs = []
    past = 0
    of_step = scores.tolist()
    for first in np.flatnonzero(scores > 0).tolist():
        if first < past:
            continue
        total = best = 0.0
        for i in range(first, len(of_step)):
            total += of_step[i]
            if total > best:
                best, past = total, i + 1
            if total < best - drop or total < 0:
                break
        if best >= least:
            runs.append((first, past, best))
    return runs


def peel(wall: BoolArray, low: int, high: int, step: float) -> tuple[int, int]:
    """A run from step `low` to before `high`, without what only another wall fills that it meets end on.

    Such a wall fills a step or two of the line beyond its own end, with nothing seen between.
    """
    inside = np.flatnonzero(np.diff(np.concatenate([[False], wall[low:high], [False]]).astype(np.int8))) + low
    stretches = inside.reshape(-1, 2)
    first, last = 0, len(stretches) - 1
    while first < last and _is_met(stretches[first], stretches[first + 1, 0] - stretches[first, 1], step):
        first += 1
    while first < last and _is_met(stretches[last], stretches[last, 0] - stretches[last - 1, 1], step):
        last -= 1
    return int(stretches[first, 0]), int(stretches[last, 1])


def _is_met(stretch: IntArray, gap: int, step: float) -> bool:
    return bool((stretch[1] - stretch[0]) * step < _MET[0] and gap * step > _MET[1])


def _looks_like_a_wall(elevations: Elevations, steps: slice, under_ceiling: FloatArray, full: float) -> bool:
    """Whether a run as a whole can be a wall; each limit is one that a true wall hardly ever passes."""
    upper = elevations.upper[steps] / full
    whole = elevations.whole[steps] / full
    floor_behind, ceiling_behind = elevations.floor_behind[steps].mean(), elevations.ceiling_behind[steps].mean()
    length = len(upper) * elevations.step
    front = elevations.front[steps].mean()
    # Where the wall itself shows in few places, floor and ceiling do, too.
    if front < 0.1 * np.clip(whole.mean(), 0.3, 1.0) or whole.mean() < 0.06:
        return False  # outside, or in a window's reveal
    if not shows(front, whole.mean()) and under_ceiling.mean() < 0.5:
        return False  # a facade, of which windows show what is lower
    filled = min(upper.mean(), whole.mean()) > _FILLED and ceiling_behind < 0.3
    if (floor_behind > 0.45 and not filled) or (ceiling_behind > 0.45 and upper.mean() < 0.3):
        return False  # in the middle of a room
    if elevations.top[steps].mean() < 0.1 * full and elevations.lower[steps].mean() > 0.5 * full:
        return False  # a cupboard nearly as high as the room
    if length < 1.3 and (upper.mean() < 0.5 or whole.mean() < 0.45):
        return False  # a door leaf, or a thing on a wall
    if length < 0.65:
        # A line that runs on meets other walls end on: each fills only a step or two.
        return bool(upper.mean() >= 0.5 and whole.mean() >= 0.42 and max(floor_behind, ceiling_behind) <= 0.3)
    return bool((under_ceiling > 0.4).mean() >= 0.25)


def on_faces(faces: Sequence[Face], voxels: StoreyVoxels) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """The standing voxels on the planes of faces, face after face: face, voxel, distance along and to the left, m."""
    return voxels.strips(segments_of(faces), ON_PLANE, between=(0.15, voxels.height - 0.1))


def measure_faces(faces: list[Face], voxels: StoreyVoxels, storey: int) -> tuple[WallFace, ...]:
    """Faces as they stand in the plan, in the input's frame, with what supports each.

    The residual is that of the points, by the first and second moments of the voxels on the plane.
    """
    if not faces:
        return ()
    face_of, voxel, along, offset = on_faces(faces, voxels)
    normal = np.array([face.normal for face in faces]).take(face_of, axis=0)
    xx, xy, yy = voxels.covariance.take(voxel, axis=0).T
    variance = normal[:, 0] ** 2 * xx + 2 * normal[:, 0] * normal[:, 1] * xy + normal[:, 1] ** 2 * yy
    count = np.bincount(face_of, minlength=len(faces))
    square = np.bincount(face_of, offset**2 + variance, minlength=len(faces)) / np.maximum(count, 1)
    step = 2 * voxels.voxel
    at = (along / step).astype(np.int64)
    span = int(at.max(initial=0)) + 1
    filled = np.zeros((len(faces), span), dtype=np.bool_)
    filled[face_of, at] = True
    seen = np.count_nonzero(filled, axis=1)
    plan = []
    for i, face in enumerate(faces):
        if not face.seen:
            count[i] = seen[i] = square[i] = 0
        (x1, y1), (x2, y2) = voxels.origin + face.start, voxels.origin + face.end
        start, end = (float(x1), float(y1)), (float(x2), float(y2))
        share = min(float(seen[i]) / max(np.ceil(face.length / step), 1), 1.0)
        name, rms = f"S{storey}-F{i + 1}", float(np.sqrt(square[i])) if count[i] else None
        plan.append(WallFace(start, end, face.curve, id=name, seen=share, rms=rms, voxels=int(count[i])))
    return tuple(plan)
