"""Arcs are found as arcs: faces that share one curve and follow it within a centimetre."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from asbuilt import extract_floor_plan
from asbuilt.curves import find_chains, find_curves, find_facets, fit_circle
from asbuilt.faces import Face
from asbuilt.plan import FloorPlan
from asbuilt.profiles import StoreyVoxels
from rooms import box_room, evidence, level, wall, walls, without

#: What issue readers of the plan are promised.
OFF = 0.01


def disc(radius: float, z: float) -> np.ndarray:
    square = level(-radius, -radius, radius, radius, z)
    return square[np.hypot(square[:, 0], square[:, 1]) < radius]


def circle(radius: float) -> np.ndarray:
    turns = np.linspace(0, 2 * np.pi, 241)[:-1]
    return walls([(radius * np.cos(turn), radius * np.sin(turn)) for turn in turns])


def along(plan: FloorPlan) -> np.ndarray:
    """Points every tenth along the faces that are curved (n, 2)."""
    share = np.linspace(0, 1, 11)[:, None]
    curved = [face for face in plan.wall_faces if face.curve is not None]
    return np.concatenate([np.array(face.start) * (1 - share) + np.array(face.end) * share for face in curved])


@pytest.mark.parametrize("radius", [1.5, 4.0])
def test_a_round_room_is_one_curve(radius: float) -> None:
    plan = extract_floor_plan(evidence(circle(radius), disc(radius, 0), disc(radius, 2.6)))
    assert {face.curve for face in plan.wall_faces} == {0}
    assert np.abs(np.hypot(*along(plan).T) - radius).max() < OFF
    # the last chord may lie on the first
    assert 0 <= sum(face.length for face in plan.wall_faces) - 2 * np.pi * radius < 0.6


def test_a_round_room_closes() -> None:
    plan = extract_floor_plan(evidence(circle(1.5), disc(1.5, 0), disc(1.5, 2.6)))
    assert sum(face.length for face in plan.wall_faces) == pytest.approx(2 * np.pi * 1.5, rel=0.002)


def test_an_apse_is_one_curve_and_the_other_walls_are_none() -> None:
    # a half circle of 2 m radius on the short side of a room
    turns = np.linspace(-np.pi / 2, np.pi / 2, 121)
    arc = [(6 + 2 * np.cos(turn), 2 + 2 * np.sin(turn)) for turn in turns]
    bow = [wall(a, b) for a, b in pairwise(arc)]
    room = without(box_room(0, 0, 6, 4), (5.99, -0.01, -0.01), (6.01, 4.01, 2.61))
    half = [part[part[:, 0] > 6] for part in (disc(2, z) + np.array([6, 2, 0]) for z in (0, 2.6))]
    plan = extract_floor_plan(evidence(room, *bow, *half))
    assert sorted({face.curve for face in plan.wall_faces if face.curve is not None}) == [0]
    assert np.abs(np.hypot(*(along(plan) - [6, 2]).T) - 2).max() < OFF
    straight = [face for face in plan.wall_faces if face.curve is None]
    # where it is tangent, the arc leaves a wall's band of 3 cm only after 0.35 m
    assert sum(face.length for face in straight) == pytest.approx(6 + 6 + 4, abs=2 * 0.36)


def test_a_polygon_of_long_sides_is_no_curve() -> None:
    turns = np.linspace(0, 2 * np.pi, 9)[:-1]
    ring = [(4 * np.cos(turn), 4 * np.sin(turn)) for turn in turns]
    inside = [disc(3.7, z) for z in (0, 2.6)]
    plan = extract_floor_plan(evidence(walls(ring), *inside))
    assert len(plan.wall_faces) == 8
    assert all(face.curve is None for face in plan.wall_faces)


def chords(radius: float, degrees: np.ndarray, gap: float = 0.0) -> list[Face]:
    """Chords of a circle around the origin between turns, each cut short by `gap` (share of its length)."""
    points = radius * np.column_stack([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    return [Face(i, a + gap / 2 * (b - a), b - gap / 2 * (b - a), 9.0) for i, (a, b) in enumerate(pairwise(points))]


def test_chains_turn_steadily() -> None:
    bow = chords(4, np.arange(0, 91, 15), gap=0.1)
    assert find_chains(bow) == [[0, 1, 2, 3, 4, 5]]
    assert find_chains(bow[::-1]) == [[5, 4, 3, 2, 1, 0]]
    assert find_chains(bow[:2]) == []
    square = chords(4, np.arange(0, 361, 90))
    assert find_chains(square) == []
    assert find_chains([]) == []


def voxels_at(xy: np.ndarray, z: np.ndarray) -> StoreyVoxels:
    """Voxels with these means, in the order of their ground cells."""
    index = np.floor(xy / 0.05).astype(np.int64)
    order = np.lexsort((z, index[:, 1], index[:, 0]))
    return StoreyVoxels(np.zeros(2), index[order], xy[order], z[order], np.zeros((len(z), 3)), 0.05, 2.6)


def arc_voxels(radius: float, sigma: float = 0.002) -> StoreyVoxels:
    turns = np.repeat(np.linspace(0, np.pi / 2, 200), 20)
    z = np.tile(np.linspace(0.2, 2.4, 20), 200)
    off = radius + np.random.default_rng(0).normal(0, sigma, len(z))
    xy = np.column_stack([off * np.cos(turns), off * np.sin(turns)])
    return voxels_at(xy, z)


def test_a_circle_through_its_voxels() -> None:
    found = fit_circle(chords(4, np.arange(0, 91, 15)), arc_voxels(4))
    assert found is not None
    centre, radius = found
    assert radius == pytest.approx(4, abs=0.002)
    assert centre == pytest.approx([0, 0], abs=0.002)
    # nothing that is 8 cm thick is one circle, nor what is too flat to tell
    assert fit_circle(chords(4, np.arange(0, 91, 15)), arc_voxels(4, sigma=0.04)) is None
    assert fit_circle(chords(4, np.arange(0, 16, 5)), arc_voxels(4)) is None


def test_a_broken_chain_is_one_curve() -> None:
    bow = chords(4, np.arange(0, 91, 7.5))
    # the fifth chord overlaps the sixth and ends behind it, so that no chain of three passes it
    bow[4] = Face(4, bow[4].start, (bow[5].start + bow[5].end) / 2, 9.0)
    found = find_curves(bow, arc_voxels(4))
    assert {face.curve for face in found} == {0}
    assert sum(face.length for face in found) == pytest.approx(4 * np.pi / 2, rel=0.01)


@pytest.mark.parametrize("end", [0, -1])
def test_a_chain_that_ends_with_a_chord_of_the_other_side_of_the_wall(end: int) -> None:
    inner, outer = chords(4, np.arange(0, 91, 15)), chords(4.3, np.arange(0, 91, 15))
    bow = [*inner[:-1], outer[-1]] if end else [outer[0], *inner[1:]]
    both = [arc_voxels(radius) for radius in (4, 4.3)]
    voxels = voxels_at(np.concatenate([one.xy for one in both]), np.concatenate([one.z for one in both]))
    found = [face for face in find_curves(bow, voxels) if face.curve is not None]
    tips = np.array([tip for face in found for tip in (face.start, face.end)])
    assert np.hypot(*tips.T) == pytest.approx(4, abs=0.01)
    assert sum(face.length for face in found) == pytest.approx(4 * np.radians(75), rel=0.02)


def test_chords_of_a_curve_follow_one_another() -> None:
    straight = Face(9, np.array([0.0, -6.0]), np.array([5.0, -6.0]), 9.0)
    found = find_curves([straight, *chords(4, np.arange(0, 91, 15), gap=0.1)], arc_voxels(4))
    assert found[0] == straight
    bow = found[1:]
    assert all(face.curve == 0 for face in bow)
    for before, after in pairwise(bow):
        assert np.array_equal(before.end, after.start)
    assert find_curves([], arc_voxels(4)) == []


FACET = 0.8
"""Chord of 7.5 degrees of a wall that is built of flat pieces, m."""
AROUND = FACET / 2 / np.sin(np.radians(3.75))
"""Its vertices lie on this circle, m."""


def faceted_voxels(degrees: np.ndarray, radius: float, sigma: float = 0.002) -> StoreyVoxels:
    """A wall of flat pieces from vertex to vertex."""
    turns = np.radians(degrees)
    vertices = radius * np.column_stack([np.cos(turns), np.sin(turns)])
    share = (np.arange(32) + 0.5)[:, None] / 32
    xy = np.concatenate([a + share * (b - a) for a, b in pairwise(vertices)]).repeat(20, axis=0)
    z = np.tile(np.linspace(0.2, 2.4, 20), len(xy) // 20)
    xy = xy + np.random.default_rng(0).normal(0, sigma, xy.shape)
    return voxels_at(xy, z)


@pytest.mark.parametrize("clockwise", [False, True])
def test_flat_pieces_of_a_round_wall_get_their_vertices(clockwise: bool) -> None:
    true = np.arange(0, 91, 7.5)
    seen = faceted_voxels(true, AROUND)
    traced = chords(AROUND, np.arange(90, -1, -15) if clockwise else np.arange(0, 91, 15), gap=0.1)
    found = find_curves(traced, seen)
    inner = np.array([face.end for face in found[:-1]])
    vertices = AROUND * np.column_stack([np.cos(np.radians(true)), np.sin(np.radians(true))])[1:-1]
    assert len(inner) == len(vertices)
    apart = np.hypot(*(inner - (vertices[::-1] if clockwise else vertices)).T)
    assert apart.max() < 0.02
    assert all(face.curve == 0 for face in found)


def test_a_true_arc_stays_an_arc() -> None:
    turns = np.radians([2.0, 88.0])
    circle = (np.zeros(2), AROUND)
    assert find_facets(turns, circle, arc_voxels(AROUND)) is None
    assert find_facets(turns, circle, faceted_voxels(np.arange(0, 91, 7.5), AROUND)) is not None
    found = find_curves(chords(AROUND, np.arange(0, 91, 15), gap=0.1), arc_voxels(AROUND))
    off = [np.hypot(*point) - AROUND for face in found for point in (face.start, (face.start + face.end) / 2)]
    assert np.abs(off).max() < 0.006


def test_what_was_hardly_seen_has_no_facets() -> None:
    nothing = voxels_at(np.zeros((0, 2)), np.zeros(0))
    assert find_facets(np.radians([0.0, 90.0]), (np.zeros(2), AROUND), nothing) is None
