"""Walls with a thickness: two faces that look away from each other with nothing between (not in the paper).

A face looks to its left, so a wall's body lies on its right. Where another face looks the other way behind it, the two
are one wall, and their distance is its thickness; where none was seen, the thickness is not known. Pieces of one wall
are joined across its doors and across the walls that stand against it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from asbuilt.directed import Directed
from asbuilt.grid import FloatArray, IntArray
from asbuilt.neighbours import near_each
from asbuilt.plan import Opening, Wall, WallFace

AnyOpening = TypeVar("AnyOpening", bound=Opening)

_THICKNESS = (0.03, 0.7)
"""Thinnest and thickest wall, m."""
_PARALLEL = np.cos(np.radians(3.0))
"""Faces of one wall are turned less than this against each other; chords of a curved wall may be turned more."""
_PARALLEL_CHORDS = np.cos(np.radians(12.0))
_SAME_PLANE = 0.02
"""Pieces of one wall have faces this near to one plane, m."""
_CROSSING = 0.75
"""A wall goes on behind one that stands against it, if that is no thicker, m."""
_OPENING = 2.8
"""A wall goes on over an opening in it up to this wide, m."""
_MIN_OVERLAP = 0.1
"""Faces that look away from each other over less are not of one wall, m."""
_REACH = 0.5
"""A wall meets another one, or an opening that it goes on over, that is this near to its end, m."""
_BESIDE = 0.15
"""An opening in a wall lies no further from its body, m."""
_SHORTEST_SIDE = 1e-6
"""A side of a wall that is shorter is none, m."""


@dataclass(frozen=True)
class _Piece:
    """A stretch of wall: where its faces lie across `along` (unit vector), and from where to where it goes, m.

    `left` is the offset of the face that looks to the left, `right` of the other one; NaN where it was not seen.
    """

    along: FloatArray
    low: float
    high: float
    left: float
    right: float
    faces: tuple[int, ...]
    curve: int | None

    @cached_property
    def normal(self) -> FloatArray:
        return np.array([-self.along[1], self.along[0]])

    @cached_property
    def middle(self) -> FloatArray:
        across = [offset for offset in (self.left, self.right) if offset == offset]
        middle: FloatArray = self.along * (self.low + self.high) / 2 + self.normal * (sum(across) / len(across))
        return middle


def find_walls(
    faces: Sequence[WallFace], openings: Sequence[Opening], storey: int, unseen_thickness: float
) -> tuple[Wall, ...]:
    """The walls that faces belong to.

    Parameters
    ----------
    faces : of one storey, in the input's frame.
    openings : doors and other openings over which walls go on.
    unseen_thickness : what a wall is drawn with of which one face was seen, m.

    Returns
    -------
    Walls with ids S<storey>-W1...; their centrelines and bodies meet at junctions. None without faces.
    """
    if not faces:
        return ()
    segments = np.array([[*face.start, *face.end] for face in faces])
    origin = segments.reshape(-1, 2).mean(axis=0)  # survey coordinates are large, products of them larger
    segments = segments - np.tile(origin, 2)
    holes = np.array([[*o.start, *o.end] for o in openings]).reshape(-1, 4) - np.tile(origin, 2)
    pieces = _join(_pieces(segments, [face.curve for face in faces]), holes)
    if not pieces:
        return ()
    pieces = _over_openings(pieces, holes, unseen_thickness)
    bodies = [_body(piece, unseen_thickness) for piece in pieces]
    outlines, centrelines = _close_junctions(bodies)
    walls = []
    for number, (piece, body) in enumerate(zip(pieces, bodies, strict=True)):
        start, end = (_point(point + origin) for point in centrelines[number])
        outline = tuple(_point(corner + origin) for corner in outlines[number])
        measured = bool(np.isfinite(piece.left) and np.isfinite(piece.right))
        seen = [bool(faces[i].seen) for i in piece.faces]
        # Of a wall with a face that stands where the other one tells, the thickness was not measured.
        measured &= all(seen) or not any(seen)
        thickness = piece.left - piece.right if measured else None
        names = tuple(faces[i].id for i in piece.faces)
        name = f"S{storey}-W{number + 1}"
        walls.append(
            Wall(
                start,
                end,
                thickness,
                body.thickness,
                names,
                outline,
                None,
                piece.curve,
                id=name,
                **_support(faces, piece),
            )
        )
    return tuple(walls)


def attach(openings: Sequence[AnyOpening], walls: Sequence[Wall]) -> tuple[AnyOpening, ...]:
    """Openings with the wall that each is in, on its centreline and as wide as they were; those without stay."""
    thickest = max((wall.drawn_thickness for wall in walls), default=0.0)
    centrelines = np.array([[*wall.start, *wall.end] for wall in walls]).reshape(-1, 4)
    ends = np.array([[*opening.start, *opening.end] for opening in openings]).reshape(-1, 4)
    near = near_each(ends, centrelines, thickest / 2 + 1.0)
    return tuple(_attached(opening, [walls[i] for i in about]) for opening, about in zip(openings, near, strict=True))


def _attached(opening: AnyOpening, walls: Sequence[Wall]) -> AnyOpening:
    ends = np.array([opening.start, opening.end])
    best, best_distance = None, np.inf
    for wall in walls:
        along, length = _direction(wall)
        if length < opening.length / 2:
            continue  # a stub, or a wall whose junctions leave nothing of its centreline: it has no direction
        low, high, apart = _beside(ends, np.array(wall.start), along)
        beyond = max(-low, high - length, 0.0)
        if beyond < 0.3 and apart < wall.drawn_thickness / 2 + _BESIDE and apart + beyond < best_distance:
            best, best_distance = wall, apart + beyond
    if best is None:
        return opening
    along, _ = _direction(best)
    middle = np.array(best.start) + ((ends.mean(axis=0) - best.start) @ along) * along
    half = np.copysign(opening.length / 2, (ends[1] - ends[0]) @ along) * along
    return replace(opening, start=_point(middle - half), end=_point(middle + half), wall=best.id)


def _beside(ends: FloatArray, start: FloatArray, along: FloatArray) -> tuple[float, float, float]:
    """From where to where an opening (2, 2) reaches along a line, and how far off it lies, m; infinite where askew."""
    place, aside = (ends - start) @ along, (ends - start) @ np.array([-along[1], along[0]])
    askew = np.ptp(aside) > 0.1 * max(float(np.hypot(*(ends[1] - ends[0]))), 0.1)
    return float(place.min()), float(place.max()), np.inf if askew else abs(float(aside.mean()))


def _direction(wall: Wall) -> tuple[FloatArray, float]:
    way = np.subtract(wall.end, wall.start)
    length = max(float(np.hypot(*way)), 1e-9)
    return way / length, length


def _pieces(segments: FloatArray, curves: Sequence[int | None]) -> list[_Piece]:
    """Each face's length by what stands behind it; a pair of faces makes one piece, not two."""
    start, way = segments[:, :2], segments[:, 2:] - segments[:, :2]
    length = np.maximum(np.hypot(*way.T), 1e-9)
    along = way / length[:, None]
    normal = np.column_stack([-along[:, 1], along[:, 0]])
    # What is turned is nearer, or further, at its ends than in its middle.
    reach = _THICKNESS[1] + np.sqrt(1 - _PARALLEL_CHORDS**2) / 2 * length.max(initial=0)
    pieces = []
    for i, near in enumerate(near_each(segments, segments, reach)):
        about = np.array(near, dtype=np.int64)
        ends = segments[about].reshape(-1, 2, 2) - start[i]
        place, aside = ends @ along[i], ends @ normal[i]
        limit = _PARALLEL if curves[i] is None else _PARALLEL_CHORDS
        behind = -aside.mean(axis=1)
        partner = (along[about] @ along[i] < -limit) & (behind > _THICKNESS[0]) & (behind < _THICKNESS[1])
        low, high = np.maximum(place.min(axis=1), 0.0), np.minimum(place.max(axis=1), length[i])
        partner &= high - low > _MIN_OVERLAP
        rest = [(0.0, float(length[i]))]
        for k in np.flatnonzero(partner)[np.argsort(behind[partner], kind="stable")]:
            paired, rest = _split(rest, float(low[k]), float(high[k]))
            for a, b in paired:
                # Seen from the other one the same pair comes up again, if nothing stands between.
                if b - a > _MIN_OVERLAP and (i < near[k] or curves[i] is not None):
                    offset = float(np.interp((a + b) / 2, *_ascending(place[k], aside[k])))
                    pieces.append(_piece(segments, i, a, b, offset, (i, near[k]), curves[i]))
        alone = [(a, b) for a, b in rest if b - a > (_MIN_OVERLAP if len(rest) == 1 and not partner.any() else 0.3)]
        pieces += [_piece(segments, i, a, b, np.nan, (i,), curves[i]) for a, b in alone]
    return pieces


def _ascending(place: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
    order = np.argsort(place)
    return place[order], value[order]


def _split(
    rest: list[tuple[float, float]], low: float, high: float
) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """What of intervals lies within [low, high], and what remains."""
    inside = [(max(a, low), min(b, high)) for a, b in rest if min(b, high) > max(a, low)]
    outside = [(a, min(b, low)) for a, b in rest if a < low] + [(max(a, high), b) for a, b in rest if b > high]
    return inside, sorted((a, b) for a, b in outside if b > a)


def _piece(
    segments: FloatArray, i: int, low: float, high: float, behind: float, faces: tuple[int, ...], curve: int | None
) -> _Piece:
    """A piece of face i from `low` to `high` along it, its other face at `behind` across it."""
    way = segments[i, 2:] - segments[i, :2]
    along = way / max(float(np.hypot(*way)), 1e-9)
    normal = np.array([-along[1], along[0]])
    from_origin = float(segments[i, :2] @ along)
    left = float(segments[i, :2] @ normal)
    return _Piece(along, from_origin + low, from_origin + high, left, left + behind, faces, curve)


def _join(pieces: list[_Piece], holes: FloatArray) -> list[_Piece]:
    """Join pieces of one wall that follow one another."""
    pieces = sorted(pieces, key=lambda p: (p.low - p.high, p.faces))
    ends = np.array([p.middle + side * (p.high - p.low) / 2 * p.along for p in pieces for side in (-1, 1)])
    near = near_each(ends.reshape(-1, 4), ends.reshape(-1, 4), _OPENING + 2 * _THICKNESS[1])
    joined: dict[int, _Piece] = {}
    members: dict[int, list[int]] = {}
    joined_to: dict[int, int] = {}  # in which of these each piece is
    for number, piece in enumerate(pieces):
        own = [number]
        while True:
            about = sorted({joined_to[j] for i in own for j in near[i] if j in joined_to} & joined.keys())
            found = next((i for i in about if _follows(piece, joined[i], holes)), None)
            if found is None:
                break
            piece = _joined(joined.pop(found), piece)
            own += members.pop(found)
        joined[number], members[number] = piece, own
        joined_to |= dict.fromkeys(own, number)
    return sorted(joined.values(), key=lambda p: p.faces)


def _follows(one: _Piece, other: _Piece, holes: FloatArray) -> bool:
    if one.curve is not None or other.curve is not None or abs(float(one.along @ other.along)) < _PARALLEL:
        return False
    if abs(float((other.middle - one.middle) @ one.normal)) > _THICKNESS[1] + 0.06 * (other.high - other.low):
        return False
    other = _seen_along(other, one.along, one.middle)
    apart = [abs(a - b) for a, b in ((one.left, other.left), (one.right, other.right))]
    if not (np.isnan(apart) | (np.array(apart) < _SAME_PLANE)).all() or np.isnan(apart).all():
        return False
    if np.isnan(apart).any() and np.isnan(one.left + one.right) != np.isnan(other.left + other.right):
        # One was seen from both sides and the other was not: one wall if the other is but the end of it.
        if min(one.high - one.low, other.high - other.low) > _CROSSING:
            return False
    elif np.isnan(apart).any() and np.isnan(one.left) != np.isnan(other.left):
        return False
    gap = max(one.low, other.low) - min(one.high, other.high)
    return gap < _CROSSING or (gap < _OPENING and _bridged(one, other, holes))


def _seen_along(piece: _Piece, along: FloatArray, about: FloatArray) -> _Piece:
    """A piece as measured along a nearly equal or opposite direction, its faces where they are nearest to a point."""
    sign = 1.0 if float(piece.along @ along) > 0 else -1.0
    left, right = (piece.left, piece.right) if sign > 0 else (-piece.right, -piece.left)
    low, high = (piece.low, piece.high) if sign > 0 else (-piece.high, -piece.low)
    # The same planes, as they pass a point of the other piece.
    turn = float(about @ np.array([-along[1], along[0]])) - sign * float(about @ piece.normal)
    return replace(piece, along=sign * piece.along, left=left + turn, right=right + turn, low=low, high=high)


def _joined(one: _Piece, other: _Piece) -> _Piece:
    """Two pieces as one, along the longer."""
    if other.high - other.low > one.high - one.low:
        one, other = other, one
    other = _seen_along(other, one.along, one.middle)
    weights = np.array([one.high - one.low, other.high - other.low])
    left, right = (
        float(np.average(np.array(pair)[~np.isnan(pair)], weights=weights[~np.isnan(pair)]))
        if not np.isnan(pair).all()
        else np.nan
        for pair in ((one.left, other.left), (one.right, other.right))
    )
    faces = tuple(sorted({*one.faces, *other.faces}))
    return replace(
        one, low=min(one.low, other.low), high=max(one.high, other.high), left=left, right=right, faces=faces
    )


def _bridged(one: _Piece, other: _Piece, holes: FloatArray) -> bool:
    """Whether an opening lies in the gap between two pieces."""
    low, high = min(one.high, other.high), max(one.low, other.low)
    middles = (holes[:, :2] + holes[:, 2:]) / 2
    place, aside = middles @ one.along, middles @ one.normal
    near = np.abs(aside - np.nanmean([one.left, one.right])) < _THICKNESS[1] / 2 + 0.1
    return bool((near & (place > low) & (place < high)).any())


@dataclass(frozen=True)
class _Body(Directed):
    """A wall as a rectangle: its axis from start to end, (2,) each, and its thickness, m."""

    start: FloatArray
    end: FloatArray
    thickness: float


def _body(piece: _Piece, unseen_thickness: float) -> _Body:
    left = piece.left if np.isfinite(piece.left) else piece.right + unseen_thickness
    right = piece.right if np.isfinite(piece.right) else piece.left - unseen_thickness
    across = (left + right) / 2 * piece.normal
    return _Body(piece.low * piece.along + across, piece.high * piece.along + across, left - right)


def _over_openings(pieces: list[_Piece], holes: FloatArray, unseen_thickness: float) -> list[_Piece]:
    """Walls go on over openings at their ends, where no other wall has them: a door in the corner of a room."""
    pieces = list(pieces)
    bodies = [_body(piece, unseen_thickness) for piece in pieces]
    axes = np.array([[*body.start, *body.end] for body in bodies])
    near = near_each(holes, axes, max(body.thickness for body in bodies) + _REACH)
    for hole, about in zip(holes.reshape(-1, 2, 2), near, strict=True):
        reached = []
        for i in about:
            low, high, apart = _beside(hole, bodies[i].start, bodies[i].along)
            low, high = min(low, 0.0), max(high - bodies[i].length, 0.0)  # how far it reaches beyond either end
            if pieces[i].curve is None and apart < bodies[i].thickness / 2 + _BESIDE:
                reached.append((max(high, -low), low, high, i))
        if not reached:
            continue
        beyond, low, high, i = min(reached)
        if 0 < beyond < _REACH + float(np.hypot(*(hole[1] - hole[0]))):
            pieces[i] = replace(pieces[i], low=pieces[i].low + low, high=pieces[i].high + high)
            bodies[i] = _body(pieces[i], unseen_thickness)
    return pieces


def _close_junctions(bodies: list[_Body]) -> tuple[list[list[FloatArray]], list[tuple[FloatArray, FloatArray]]]:
    """Outline (4 corners) and centreline of each wall, with its ends where it meets another one.

    At an L both are mitred; at a T the wall ends on the other's face, its centreline on the other's centreline.
    """
    start = np.array([body.start for body in bodies])
    end = np.array([body.end for body in bodies])
    along = np.array([body.along for body in bodies])
    half = np.array([body.thickness for body in bodies]) / 2
    length = np.hypot(*(end - start).T)
    axes, reach = np.hstack([start, end]), 2 * (_REACH + half.max(initial=0))
    near = zip(*(near_each(tips, axes, reach) for tips in (start, end)), strict=True)
    outlines, centrelines = [], []
    for i, (body, (at_start, at_end)) in enumerate(zip(bodies, near, strict=True)):
        corners, axis = [], []
        for tip, outward, about in ((body.start, -body.along, at_start), (body.end, body.along, at_end)):
            met = _met(i, tip, outward, np.array([j for j in about if j != i]), start, along, half, length)
            sides = [tip + sign * half[i] * body.normal for sign in (1, -1)]
            if met is not None:
                j, place, on_other = met
                axis.append(tip + place * outward)
                is_end = on_other < half[i] + _REACH / 2 or on_other > length[j] - half[i] - _REACH / 2
                sides = _mitred(
                    sides, outward, start[j], along[j], half[j], on_other > length[j] / 2 if is_end else None
                )
            else:
                axis.append(tip)
            corners.append(sides)
        outlines.append(_ring(body, *corners))
        centrelines.append((axis[0], axis[1]))
    return outlines, centrelines


def _met(
    i: int,
    tip: FloatArray,
    outward: FloatArray,
    about: IntArray,
    start: FloatArray,
    along: FloatArray,
    half: FloatArray,
    length: FloatArray,
) -> tuple[int, float, float] | None:
    """The wall `about` (n,) a tip of wall i that it meets: its number, how far beyond the tip, and where on its
    centreline, m.
    """
    if len(about) == 0:
        return None
    start, along, half_of, length_of = start[about], along[about], half[about], length[about]
    cross = outward[0] * along[:, 1] - outward[1] * along[:, 0]
    apart = start - tip
    with np.errstate(divide="ignore", invalid="ignore"):
        place = (apart[:, 0] * along[:, 1] - apart[:, 1] * along[:, 0]) / cross
        on_other = (apart[:, 0] * outward[1] - apart[:, 1] * outward[0]) / cross
    near = (np.abs(cross) > 0.1) & (place > -_REACH - half_of) & (place < _REACH + half_of)
    near &= place > -length[i] / 2  # both ends of a short wall are near the same one: only the nearer meets it
    near &= (on_other > -_REACH - half[i]) & (on_other < length_of + _REACH + half[i])
    if not near.any():
        return None
    k = int(np.flatnonzero(near)[np.argmin(np.abs(place[near]))])
    return int(about[k]), float(place[k]), float(on_other[k])


def _mitred(
    sides: list[FloatArray], outward: FloatArray, start: FloatArray, along: FloatArray, half: float, at_end: bool | None
) -> list[FloatArray]:
    """Corners of a wall's end, drawn out to the faces of another wall; `at_end` tells which of its ends, None a T."""
    normal = np.array([-along[1], along[0]])
    near = -np.sign(float(outward @ normal))  # the other's face that looks towards this wall
    ends = []
    for corner in sides:
        side = near
        if at_end is not None:
            # On the inner side of the turn a face ends on the other's near face, on the outer side on its far one.
            leaving = -along if at_end else along
            middle = (sides[0] + sides[1]) / 2
            side = near if float((corner - middle) @ leaving) > 0 else -near
        reach = float((start + side * half * normal - corner) @ normal) / float(outward @ normal)
        ends.append(corner + reach * outward)
    return ends


def _ring(body: _Body, at_start: list[FloatArray], at_end: list[FloatArray]) -> list[FloatArray]:
    """Outline of a wall between the corners (left, right) of its ends, anticlockwise; it never crosses itself.

    The ends of a wall that is shorter than thick may cross: on one side of it, and its body is a triangle, or on both,
    and nothing is left between the walls that it meets. Then it keeps its own rectangle.
    """
    left, right = (float((end - start) @ body.along) for start, end in zip(at_start, at_end, strict=True))
    if min(left, right) > _SHORTEST_SIDE:
        return [at_start[1], at_end[1], at_end[0], at_start[0]]
    if max(left, right) <= _SHORTEST_SIDE:
        across = body.thickness / 2 * body.normal
        return [body.start - across, body.end - across, body.end + across, body.start + across]
    kept, lost = (1, 0) if right > left else (0, 1)
    share = max(left, right) / (max(left, right) - min(left, right))
    tip = at_start[kept] + min(share, 1.0) * (at_start[lost] - at_start[kept])
    ring = [at_start[kept], at_end[kept], tip]
    return ring if kept else ring[::-1]


def _support(faces: Sequence[WallFace], piece: _Piece) -> dict[str, Any]:
    """What was seen of a wall: its faces' figures together."""
    own = [faces[i] for i in piece.faces]
    length = np.array([max(face.length, 1e-9) for face in own])
    square = np.array([np.nan if face.rms is None else face.rms**2 for face in own])
    known = np.isfinite(square)
    return {
        "seen": float(np.average([face.seen or 0.0 for face in own], weights=length)),
        "rms": float(np.sqrt(np.average(square[known], weights=length[known]))) if known.any() else None,
        "voxels": sum(face.voxels for face in own),
    }


def _point(point: FloatArray) -> tuple[float, float]:
    return float(point[0]), float(point[1])
