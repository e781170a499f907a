"""Faces around rooms (not in the paper): each side of a room is drawn from corner to corner, but for its openings.

A room's ring follows its faces and what they go on to. So it tells where a face that something hides goes on, where it
ends, and which short piece stands between a door and a corner.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely

from asbuilt.directed import Directed
from asbuilt.elevations import Elevations
from asbuilt.faces import Face, segments_of, usual_filling
from asbuilt.grid import BoolArray, FloatArray, IntArray
from asbuilt.neighbours import near_each
from asbuilt.plan import Opening
from asbuilt.profiles import StoreyVoxels

_ON_SIDE = 0.03
"""A face lies on a room's side if both its ends are this near to its line, m."""
_BEHIND = 0.65
"""An opening in the wall behind a side is no further from it, m."""
_RECESS = 0.4
"""Nor further before it, m."""
_SHORT = 0.6
"""A piece of a side shorter than this is wall unless an opening shows, m."""
_GOES_ON = 0.15
"""Where no more of floor and ceiling than this goes on behind a side, wall is hidden."""
_ALONE = (1.5, 3.5)
"""A side on which no face was found is drawn up to these lengths, m..."""
_SHOWS = (0.3, 0.6)
"""...if something shows over this share of it."""
_FILLED = 0.17
"""Something shows on a step if so much is filled there, of what a well seen wall fills."""
_STANDING = (0.2, 1.9)
"""It shows between these heights, m: higher up it may be a beam."""
_BESIDE = 0.08
"""What shows this near to a face is that one, m."""
_SLACK = 0.01
"""What is looked for within a distance is sought a little further, so that rounding leaves nothing out, m."""
_DOUBLE = 0.3
"""A board, or the pane of a window, is no further before or behind a side, m."""


@dataclass(frozen=True)
class _Side(Directed):
    """One straight side of a room, the room on its left."""

    start: FloatArray
    end: FloatArray
    of_hole: bool = False

    def place(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where points (..., 2) are along the side and to its left, m."""
        apart = points - self.start
        return apart @ self.along, apart @ self.normal


def draw_room_faces(
    faces: list[Face],
    rooms: Sequence[shapely.Polygon],
    openings: Sequence[Opening],
    windows: Sequence[Opening],
    elevations: Elevations,
    scores: FloatArray,
    voxels: StoreyVoxels,
) -> list[Face]:
    """Faces with those on the sides of rooms drawn from corner to corner; the others as they are.

    Parameters
    ----------
    rooms : their polygons, m from the storey's origin.
    openings : doors and what else faces stop at, in the input's frame.
    windows : in the input's frame; faces go on under and over them, be they as low as the floor.
    """
    sides = [side for room in rooms for side in _sides(room)]
    holes, panes = (
        np.array([[o.start, o.end] for o in some]).reshape(-1, 2, 2) - voxels.origin for some in (openings, windows)
    )
    tips = np.array([[face.start, face.end] for face in faces]).reshape(-1, 2, 2)
    straight = np.array([face.curve is None for face in faces], dtype=np.bool_)
    elevated = np.array([elevations.partition[face.line] for face in faces], dtype=np.bool_)
    well_seen = usual_filling(elevations.whole) * (_STANDING[1] - _STANDING[0]) / elevations.step
    drawn: list[Face] = []
    taken = np.zeros(len(faces), dtype=np.bool_)
    within: list[list[tuple[float, float]]] = [[] for _ in faces]
    segments = np.array([[*side.start, *side.end] for side in sides]).reshape(-1, 4)
    near_faces = [np.array(near, dtype=np.int64) for near in near_each(segments, segments_of(faces), _DOUBLE + _SLACK)]
    near_holes, near_panes = (near_each(segments, some.reshape(-1, 4), _BEHIND + _SLACK) for some in (holes, panes))
    stand_ins = _StandIns(faces)
    for side, near, about, glass in zip(sides, near_faces, near_holes, near_panes, strict=True):
        place, aside = side.place(tips[near])
        if (
            ~straight[near]
            & (np.abs(aside).max(axis=1, initial=0) < _ON_SIDE)
            & (np.abs(place.mean(axis=1) - side.length / 2) < side.length / 2)
        ).any():
            continue
        on = straight[near] & (np.abs(aside).max(axis=1, initial=0) < _ON_SIDE) & (place[:, 1] > place[:, 0])
        on &= (place[:, 1] > 0.02) & (place[:, 0] < side.length - 0.02)
        own = [faces[i] for i in near[on]]
        taken[near[on]] = True
        for i, begin in zip(near[on], place[on, 0].tolist(), strict=True):
            within[i].append((-begin, side.length - begin))
        gone = _openings_on(side, holes[about])
        stretches = [(max(a, 0.0), min(b, side.length)) for a, b in place[on]]
        shared = np.minimum(place.max(axis=1), side.length) - np.maximum(place.min(axis=1), 0.0)
        # What stands free in a room shows on all its sides, or is none of a wall.
        close = (np.abs(aside).max(axis=1) < _BESIDE) & (shared > _BESIDE)
        beside = side.of_hole or bool(shared[close].sum() > 0.3 * side.length)
        glazed = _openings_on(side, panes[glass])
        wall = _without(
            _filled(side, stretches + glazed, own, gone, elevations, scores, voxels, well_seen, beside), gone
        )
        for low, high in wall:
            if high - low < 0.1:
                continue
            model = min(own, key=lambda f: -_shared(side, f, low, high), default=None)
            if model is None:
                model = stand_ins.of(side)
            fixed = (low < 0.01, high > side.length - 0.01)
            start = side.start if fixed[0] else side.start + low * side.along
            end = side.end if fixed[1] else side.start + high * side.along
            drawn.append(replace(model, start=start, end=end, fixed=fixed))
    rest = np.flatnonzero(~taken)
    no_wall = _is_clutter(tips[rest], rooms) | _is_double(tips, sides, near_faces)[rest] | _is_reveal(tips[rest], panes)
    rest = rest[~no_wall | elevated[rest] | ~straight[rest]]
    beyond = [part for i in np.flatnonzero(taken) for part in _beyond(faces[i], within[i], elevations, scores)]
    return [faces[i] for i in rest] + beyond + drawn


def _beyond(face: Face, within: list[tuple[float, float]], elevations: Elevations, scores: FloatArray) -> list[Face]:
    """What of a face goes on beyond the sides of rooms on which it lies: into a room that was not found."""
    parts = []
    for low, high in _without([(0.0, face.length)], within):
        if high - low < _BEHIND:
            continue  # no more than the wall that it meets there
        part = replace(face, start=face.start + low * face.along, end=face.start + high * face.along)
        steps = scores[elevations.between(face.line, part.start, part.end)]
        if np.count_nonzero(steps > 0) > 0.5 * len(steps):
            parts.append(part)
    return parts


def _is_clutter(tips: FloatArray, rooms: Sequence[shapely.Polygon]) -> BoolArray:
    """Which short faces (n, 2, 2) stand within a room and on none of its sides."""
    inner = shapely.union_all([room.buffer(-2 * _ON_SIDE) for room in rooms])
    shapely.prepare(inner)
    short = np.hypot(*(tips[:, 1] - tips[:, 0]).T) < _ALONE[0]
    within: BoolArray = short & shapely.covers(inner, shapely.linestrings(tips))
    return within


def _is_double(tips: FloatArray, sides: Sequence[_Side], near_faces: Sequence[IntArray]) -> BoolArray:
    """Which faces (n, 2, 2) stand close before or behind a side of a room and look the same way.

    `near_faces` are those near each side.
    """
    double = np.zeros(len(tips), dtype=np.bool_)
    for side, faces in zip(sides, near_faces, strict=True):
        place, aside = side.place(tips[faces])
        length = np.maximum(place[:, 1] - place[:, 0], 1e-9)
        shared = np.minimum(place[:, 1], side.length) - np.maximum(place[:, 0], 0.0)
        near = (np.abs(aside) < _DOUBLE).all(axis=1) & (np.abs(np.ptp(aside, axis=1)) < 0.15 * length)
        double[faces] |= near & (place[:, 1] > place[:, 0]) & (shared > 0.6 * length)
    return double


def _is_reveal(tips: FloatArray, windows: FloatArray) -> BoolArray:
    """Which faces (n, 2, 2) lie across the ends of windows (m, 2, 2), no farther from them than walls are thick."""
    reveal = np.zeros(len(tips), dtype=np.bool_)
    about = near_each(windows.reshape(-1, 4), tips.reshape(-1, 4), _BEHIND + _BESIDE + _SLACK)
    for (start, end), near in zip(windows, about, strict=True):
        window = _Side(start, end)
        place, aside = window.place(tips[near])
        from_end = np.minimum(np.abs(place), np.abs(place - window.length))
        reveal[near] |= ((from_end < _BESIDE) & (np.abs(aside) < _BEHIND)).all(axis=1)
    return reveal


def _sides(room: shapely.Polygon) -> list[_Side]:
    """The straight sides of a room, the room on the left of each."""
    oriented = shapely.geometry.polygon.orient(room)
    # A hole as small as a column's is none of a wall.
    holes = [ring for ring in oriented.interiors if ring.length > 2 * _ALONE[0]]
    return [
        _Side(*pair, of_hole=number > 0)
        for number, ring in enumerate((oriented.exterior, *holes))
        for points in [shapely.get_coordinates(ring)]
        for pair in pairwise(points)
    ]


def _openings_on(side: _Side, holes: FloatArray) -> list[tuple[float, float]]:
    """From where to where openings (n, 2, 2) in the wall behind a side interrupt it, m along it."""
    place, aside = side.place(holes)
    # A room that reaches into the recess of a door has the door before that side.
    through = (aside > -_BEHIND).all(axis=1) & (aside < _RECESS).all(axis=1) & (np.ptp(aside, axis=1) < 0.15)
    low, high = place.min(axis=1), place.max(axis=1)
    through &= (high > 0.05) & (low < side.length - 0.05) & (high - low > 0.3)
    return sorted(
        (max(float(a), 0.0), min(float(b), side.length)) for a, b in zip(low[through], high[through], strict=True)
    )


def _filled(
    side: _Side,
    stretches: list[tuple[float, float]],
    own: list[Face],
    gone: list[tuple[float, float]],
    elevations: Elevations,
    scores: FloatArray,
    voxels: StoreyVoxels,
    well_seen: float,
    beside: bool,
) -> list[tuple[float, float]]:
    """The stretches of a side on which faces stand, and those between them on which wall is hidden.

    `well_seen` is how many voxels stand on a step of a well seen wall.
    """
    rest = _without([(0.0, side.length)], stretches + gone)
    if own:
        hidden = [(a, b) for a, b in rest if _is_hidden(side, a, b, own, elevations, scores)]
    else:
        # Beside another face, what shows is that one.
        rest = [] if beside else rest
        hidden = [(a, b) for a, b in rest if _shows(side, a, b, voxels, well_seen, elevations.step)]
    return _merged(stretches + hidden)


def _is_hidden(
    side: _Side, low: float, high: float, own: list[Face], elevations: Elevations, scores: FloatArray
) -> bool:
    """Whether the elevation of a face of a side does not speak against wall from `low` to `high`."""
    if high - low < 0.15:
        return True
    line = max(own, key=lambda f: f.length).line
    ends = (side.start + at * side.along for at in (low, high))
    steps = elevations.between(line, *ends)
    if steps.stop <= steps.start:
        return False
    if max(elevations.floor_behind[steps].mean(), elevations.ceiling_behind[steps].mean()) < _GOES_ON:
        return True  # whatever stands before it, nothing can be walked into or seen behind it
    against = float((scores[steps] < -1).mean())
    return against < (0.7 if high - low < _SHORT else 0.3)


def _shows(side: _Side, low: float, high: float, voxels: StoreyVoxels, well_seen: float, step: float) -> bool:
    """Whether something stands on a stretch of a side without faces."""
    length = high - low
    if not 0.1 < length < _ALONE[1]:
        return False
    segment = np.concatenate([side.start + low * side.along, side.start + high * side.along])[None]
    _, voxel, place, _ = voxels.strips(segment, _ON_SIDE)
    standing = (voxels.z[voxel] > _STANDING[0]) & (voxels.z[voxel] < _STANDING[1])
    counts = np.bincount((place[standing] / step).astype(np.int64), minlength=1)
    return bool((counts >= _FILLED * well_seen).sum() * step > _SHOWS[length > _ALONE[0]] * length)


def _without(intervals: list[tuple[float, float]], gone: list[tuple[float, float]]) -> list[tuple[float, float]]:
    for low, high in gone:
        intervals = [
            part for a, b in intervals for part in ((a, min(b, low)), (max(a, high), b)) if part[1] > part[0] + 1e-6
        ]
    return sorted(intervals)


def _merged(intervals: list[tuple[float, float]]) -> list[tuple[float, float]]:
    joined: list[tuple[float, float]] = []
    for low, high in sorted(intervals):
        if joined and low < joined[-1][1] + 0.02:
            joined[-1] = (joined[-1][0], max(joined[-1][1], high))
        else:
            joined.append((low, high))
    return joined


def _shared(side: _Side, face: Face, low: float, high: float) -> float:
    place, _ = side.place(np.stack([face.start, face.end]))
    return float(min(place.max(), high) - max(place.min(), low))


class _StandIns:
    """Faces whose elevation may stand in for that of a side without any."""

    def __init__(self, faces: Sequence[Face]) -> None:
        self.faces: Sequence[Face] = faces
        self.middles = np.array([(face.start + face.end) / 2 for face in faces]).reshape(-1, 2)
        self.ways = np.array([face.along for face in faces]).reshape(-1, 2)
        self.tree = shapely.STRtree(shapely.points(self.middles))

    def of(self, side: _Side) -> Face:
        """The nearest among the faces most parallel to a side."""
        middle = (side.start + side.end) / 2
        for within in (4.0, 32.0, np.inf):
            near = np.sort(self.tree.query(shapely.box(*(middle - within), *(middle + within))))
            apart = np.hypot(*(self.middles[near] - middle).T)
            apart += 100 * (1 - np.abs(self.ways[near] @ side.along))
            if apart.min(initial=np.inf) < within:
                break  # whatever lies further away is no nearer, be it as parallel as can be
        return self.faces[int(near[apart.argmin()])]
