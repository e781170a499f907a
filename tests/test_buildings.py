"""The generator that accuracy is measured with is itself right: its truth, its points, and what is done to them."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import numpy as np
import pytest
from shapely import LineString, Point, Polygon, STRtree, points, unary_union

import buildings
from asbuilt.evaluate import evaluate
from buildings import Building, Scanner, generate
from buildings.transform import (
    TRANSFORMS,
    add_noise,
    add_storey,
    add_strays,
    one_scan_per_room,
    scale,
    shift,
    thin,
    tilt,
    to_utm,
    turn,
    without_ceilings,
)
from buildings.truth import mark_observed

#: Coarse enough to be quick; E_D of a face is then a matter of fewer points, not of other ones.
COARSE = Scanner(step_deg=1.6)
EXACT = Scanner(step_deg=1.6, noise=(0.0, 0.0), mixed=0.0, dropout=0.0, shift=0.0, turn_deg=0.0)
SEEDS = {"flat": 0, "house": 1, "office": 2, "museum": 3, "oldtown": 4}


@pytest.fixture(scope="module")
def flat() -> Building:
    return generate(0, scanner=COARSE)


@cache
def barely_scanned(preset: str) -> Building:
    """For tests of the truth alone."""
    return generate(SEEDS[preset], preset=preset, scanner=Scanner(step_deg=6.0))


def observed(truth: dict[str, Any]) -> np.ndarray:
    return np.array([wall["observed"] for storey in truth["storeys"] for wall in storey["walls"]])


@pytest.mark.parametrize("preset", buildings.PRESETS)
def test_truth_against_itself_is_perfect(preset: str) -> None:
    building = barely_scanned(preset)
    scores = evaluate(building.truth, building.truth).scores
    walls = scores.walls["all"]
    assert walls.f == pytest.approx(1.0)
    assert walls.distance_error == pytest.approx(0.0, abs=1e-9)
    assert walls.over_segmentation == pytest.approx(0.0)
    assert walls.overlap == pytest.approx(0.0)
    for totals in (scores.doors, scores.windows, scores.rooms):
        assert totals is not None
        assert totals.to_json()["f"] == pytest.approx(1.0)


@pytest.mark.parametrize("preset", buildings.PRESETS)
def test_plans_are_sound(preset: str) -> None:
    building = barely_scanned(preset)
    for storey in building.truth["storeys"]:
        rooms = [Polygon(room["polygon"]) for room in storey["rooms"]]
        outline = Polygon(storey["outline"])
        assert all(room.is_valid and room.area > 0.4 for room in rooms)
        # rooms keep walls between them and around them: the thinnest wall is 6 cm
        assert sum(room.area for room in rooms) == pytest.approx(unary_union(rooms).area)
        assert all(outline.buffer(-0.05).contains(room) for room in rooms)
        tree = STRtree(rooms)
        for i, room in enumerate(rooms):
            near = [j for j in tree.query(room.buffer(0.055)) if j != i and rooms[j].distance(room) < 0.055]
            # a free-standing partition is a hole that the ring does not show
            assert not near
        for wall in storey["walls"]:
            x1, y1, x2, y2 = wall["p"]
            assert np.hypot(x2 - x1, y2 - y1) > 1e-3
        # faces stop at doors: none passes through the middle of one
        faces = unary_union([LineString(np.reshape(wall["p"], (2, 2))) for wall in storey["walls"]])
        for door in storey["doors"]:
            middle = LineString(np.reshape(door["line"], (2, 2))).interpolate(0.5, normalized=True)
            assert faces.distance(middle) > 0.02
            assert np.hypot(*np.subtract(door["line"][2:], door["line"][:2])) == pytest.approx(door["width"], rel=0.15)


def test_every_room_has_a_door() -> None:
    for preset in SEEDS:
        for storey in barely_scanned(preset).truth["storeys"]:
            ways = [*storey["doors"], *(window for window in storey["windows"] if window["sill"] < 0.5)]
            lines = unary_union([LineString(np.reshape(way["line"], (2, 2))) for way in ways])
            assert all(lines.distance(Polygon(room["polygon"])) < 0.6 for room in storey["rooms"])


@pytest.mark.parametrize("preset", buildings.PRESETS)
def test_exact_points_of_a_bare_building_lie_on_its_surfaces(preset: str) -> None:
    building = generate(SEEDS[preset], preset=preset, scanner=EXACT, furnished=False)
    storey = building.truth["storeys"][0]
    cloud = building.points
    # between the highest step and the lowest ceiling there are but walls, reveals, columns and what is outside
    cloud = cloud[(cloud[:, 2] > storey["floor"] + 0.5) & (cloud[:, 2] < storey["floor"] + 1.9)]
    inside = [room["polygon"] for room in storey["rooms"]]
    lines = [LineString(np.reshape(wall["p"], (2, 2))) for wall in storey["walls"]]
    lines += [LineString(np.reshape(jamb, (2, 2))) for jamb in storey["jambs"]]
    rooms = unary_union([Polygon(ring).buffer(0.02) for ring in inside])
    where = points(cloud[::7, :2])
    within = np.array([rooms.contains(point) for point in where[:4000]])
    tree = STRtree(lines)
    _, distance = tree.query_nearest(where[:4000][within], return_distance=True, all_matches=False)
    # columns and stairs stand in the rooms and are not among the walls; round walls are chords, 3 mm off at most
    tolerance = {"flat": 0.99, "oldtown": 0.99}.get(preset, 0.9)
    assert np.mean(distance < 0.004) > tolerance


def test_noise_is_what_was_asked_for() -> None:
    exact = generate(0, scanner=dataclasses.replace(EXACT, noise=(0.002, 0.002)), furnished=False)
    clean = generate(0, scanner=EXACT, furnished=False)
    assert len(exact.points) == len(clean.points)
    off = np.linalg.norm(exact.points - clean.points, axis=1)
    assert np.sqrt(np.mean(off**2)) == pytest.approx(0.002, rel=0.05)


def test_the_same_seed_gives_the_same_points(flat: Building) -> None:
    again = generate(0, scanner=COARSE)
    assert np.array_equal(flat.points, again.points)
    assert flat.truth == again.truth
    other = generate(5, preset="flat", scanner=COARSE)
    assert len(other.points) != len(flat.points)


def test_observed_by_brute_force(flat: Building) -> None:
    storey = flat.truth["storeys"][0]
    rooms = [(Polygon(room["polygon"]).boundary, room["ceiling"]) for room in storey["rooms"]]
    rng = np.random.default_rng(0)
    for i in rng.permutation(len(storey["walls"]))[:12]:
        wall = storey["walls"][i]
        start, end = np.reshape(wall["p"], (2, 2))
        top = storey["height"]
        if wall["side"] == "interior":
            ceilings = [ceiling for ring, ceiling in rooms if ring.distance(Point((start + end) / 2)) < 0.002]
            top = min(top, ceilings[0]) if ceilings else top  # none where a partition stands free
        cloud = flat.points[(flat.points[:, 2] > 0.4) & (flat.points[:, 2] < top - 0.06)]
        length = np.hypot(*(end - start))
        along = (end - start) / length
        at, off = (cloud[:, :2] - start) @ along, (cloud[:, :2] - start) @ [-along[1], along[0]]
        count = max(1, round(length / 0.1))
        close = at[(np.abs(off) <= 0.03) & (at >= 0) & (at < length)]
        pieces = np.histogram(close, bins=count, range=(0, length))[0]
        assert wall["observed"] == pytest.approx(np.mean(pieces >= 3), abs=1.01 / count)


def test_scan_lists_agree(flat: Building) -> None:
    entries = flat.truth["scans"]
    assert len(entries) == len(flat.positions) == flat.scans.max() + 1
    assert [entry["points"] for entry in entries] == np.bincount(flat.scans).tolist()
    storey = flat.truth["storeys"][0]
    for entry, position in zip(entries, flat.positions, strict=True):
        assert Polygon(storey["rooms"][entry["room"]]["polygon"]).contains(Point(position[:2]))
        assert entry["position"] == pytest.approx(position)


@pytest.mark.parametrize("name", TRANSFORMS)
def test_changed_truth_is_still_whole(name: str, flat: Building) -> None:
    before = flat.points.copy()
    changed = TRANSFORMS[name](flat)
    assert np.array_equal(flat.points, before)
    assert len(changed.points) == len(changed.scans)
    assert changed.points.dtype == np.float64
    scores = evaluate(changed.truth, changed.truth)
    assert scores.pooled("all").f == pytest.approx(1.0)


@pytest.mark.parametrize(
    "change",
    [lambda b: turn(b, 0.4), shift, scale, to_utm],
    ids=["turn", "shift", "scale", "utm"],
)
def test_truth_moves_with_the_points(change: Any, flat: Building) -> None:
    changed = change(flat)
    marked = {**changed.truth, "storeys": [dict(storey) for storey in changed.truth["storeys"]]}
    for storey in marked["storeys"]:
        storey["walls"] = [dict(wall) for wall in storey["walls"]]
    mark_observed(changed.points, marked)
    # a point on the rim of a piece may fall on the other side
    assert np.abs(observed(marked) - observed(flat.truth)).mean() < 0.002


def test_what_the_changes_do(flat: Building) -> None:
    assert len(thin(flat).points) == pytest.approx(0.1 * len(flat.points), rel=0.05)
    assert (add_noise(flat).points - flat.points).std() == pytest.approx(0.01, rel=0.01)
    strays = add_strays(flat).points[len(flat.points) :]
    assert len(strays) == round(0.002 * len(flat.points))
    assert 500 < np.abs(strays - flat.points.mean(axis=0)).max() <= 1000
    lean = tilt(flat).points - flat.points
    assert np.abs(lean[:, 2]).max() < np.radians(0.5) * 45
    assert np.abs(lean[:, 2]).max() > 0.02


def test_without_ceilings(flat: Building) -> None:
    storey = flat.truth["storeys"][0]
    cloud = without_ceilings(flat).points
    for room in storey["rooms"]:
        ring = Polygon(room["polygon"]).buffer(-0.05)
        high = cloud[cloud[:, 2] > storey["floor"] + room["ceiling"] - 0.149]
        assert not any(ring.contains(Point(point)) for point in high[::5, :2])


def test_one_scan_per_room(flat: Building) -> None:
    single = one_scan_per_room(flat)
    kept = np.unique(single.scans)
    rooms = [flat.truth["scans"][i]["room"] for i in kept]
    assert len(set(rooms)) == len(rooms)
    before, after = observed(flat.truth), observed(single.truth)
    assert (after <= before + 1e-9).all()
    assert after.sum() < before.sum()


def test_a_second_storey(flat: Building) -> None:
    double = add_storey(flat)
    lower, upper = double.truth["storeys"]
    assert upper["floor"] > lower["floor"] + lower["height"]
    assert len(double.positions) == 2 * len(flat.positions) == double.scans.max() + 1
    marked = {**double.truth, "storeys": [{**upper, "walls": [dict(wall) for wall in upper["walls"]]}]}
    mark_observed(double.points, marked)
    assert np.abs(observed(marked) - observed(flat.truth)).mean() < 0.01


def test_leaning_walls_keep_their_place_at_half_height(flat: Building) -> None:
    double = add_storey(flat)
    leaning = tilt(double)
    for storey, before in zip(leaning.truth["storeys"], double.truth["storeys"], strict=True):
        level = storey["floor"] + storey["height"] / 2
        slab = np.abs(double.points[:, 2] - level) < 0.05
        thin_truth = {**leaning.truth, "storeys": [{**storey, "walls": [dict(wall) for wall in storey["walls"]]}]}
        mark_observed(leaning.points[slab], thin_truth)
        flat_truth = {**double.truth, "storeys": [{**before, "walls": [dict(wall) for wall in before["walls"]]}]}
        mark_observed(double.points[slab], flat_truth)
        assert observed(thin_truth).mean() == pytest.approx(observed(flat_truth).mean(), abs=0.02)
