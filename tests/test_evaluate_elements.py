"""Doors, windows, rooms, thickness, accuracy bands and the challenge's measures, by hand-worked examples."""

import math

import numpy as np
import pytest

from asbuilt.evaluate import Drawing, DrawingStorey, Face, Opening, Room, Wall, associate, evaluate
from asbuilt.evaluate.challenge import betti_numbers, measure_challenge
from asbuilt.evaluate.faces import coverage, reliability, score_faces
from asbuilt.evaluate.loa import Offsets
from asbuilt.evaluate.openings import match_openings, measure_openings
from asbuilt.evaluate.rooms import assign_rooms, measure_rooms
from asbuilt.evaluate.thickness import measure_thickness
from asbuilt.plan import loa_band


def exactly(value):
    return pytest.approx(value, abs=1e-9, rel=0)


def opening(x, y, width, turn=0.0):
    step = width / 2 * math.cos(turn), width / 2 * math.sin(turn)
    return Opening((x - step[0], y - step[1], x + step[0], y + step[1]), width)


def box(x0, y0, x1, y1):
    return Room(((x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)), (x1 - x0) * (y1 - y0))


# --- doors and windows --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("along", "across", "width", "found"),
    [
        (0.20, 0.0, 0.9, True),
        (0.21, 0.0, 0.9, False),
        (0.0, 0.35, 0.9, True),
        (0.0, 0.36, 0.9, False),
        (-0.20, -0.35, 1.0, True),
        (0.0, 0.0, 1.01, False),
        (0.0, 0.0, 0.8, True),
        (0.0, 0.0, 0.79, False),
    ],
)
@pytest.mark.parametrize("turn", [0.0, 0.6, 2.5])
def test_an_opening_is_found_in_place_and_in_width(along, across, width, found, turn):
    x, y = along * math.cos(turn) - across * math.sin(turn), along * math.sin(turn) + across * math.cos(turn)
    pairs = match_openings([opening(5 + x, 3 + y, width, turn)], [opening(5, 3, 0.9, turn)])
    assert pairs == ([(0, 0)] if found else [])


def test_openings_are_matched_nearest_first_and_once():
    truth = [opening(0, 0, 0.9), opening(0.3, 0, 0.9)]
    detected = [opening(0.16, 0, 0.95), opening(0.18, 0, 0.9)]
    assert match_openings(detected, truth) == [(0, 0), (1, 1)]
    totals = measure_openings([*detected, opening(9, 9, 1.0)], truth)
    assert (totals.precision, totals.recall) == (exactly(2 / 3), exactly(1))
    assert totals.to_json()["median_width_error"] == exactly(0.025)


def test_openings_none_and_one_sided():
    assert measure_openings([], []).to_json()["f"] is None
    nothing_drawn = measure_openings([], [opening(0, 0, 1)]).to_json()
    assert (nothing_drawn["precision"], nothing_drawn["recall"], nothing_drawn["f"]) == (None, 0, 0)
    assert nothing_drawn["median_width_error"] is None
    assert measure_openings([opening(0, 0, 1)], []).precision == 0


# --- rooms --------------------------------------------------------------------------------------------------------


def test_a_room_is_found_at_an_iou_of_eight_tenths():
    truth = [box(0, 0, 10, 1)]
    assert measure_rooms([box(0, 0, 8, 1)], truth).ious == (exactly(0.8),)
    assert measure_rooms([box(0, 0, 7.9, 1)], truth).ious == ()
    totals = measure_rooms([box(0, 0, 9, 1)], truth)
    assert totals.area_errors == (exactly(0.1),)
    assert totals.to_json()["mean_iou"] == exactly(0.9)


def test_rooms_are_assigned_for_the_greatest_sum():
    truth = [box(0, 0, 4, 1), box(4, 0, 8, 1)]
    detected = [box(3, 0, 8, 1), box(1, 0, 5, 1)]
    pairs = [(i, j) for i, j, _, _ in assign_rooms(detected, truth)]
    assert sorted(pairs) == [(0, 1), (1, 0)]


def test_one_merged_room_finds_neither():
    totals = measure_rooms([box(0, 0, 8, 1)], [box(0, 0, 4, 1), box(4, 0, 8, 1)])
    assert (totals.precision, totals.recall) == (0, 0)


def test_a_hole_is_no_part_of_a_room():
    hollow = Room(box(0, 0, 10, 1).ring, 5.2, holes=(box(1, 0.1, 7, 0.9).ring,))
    assert measure_rooms([hollow], [box(0, 0, 10, 1)]).ious == ()
    assert measure_rooms([hollow], [hollow]).ious == (exactly(1),)


def test_rooms_empty_and_bow_tie():
    assert measure_rooms([], []).to_json()["recall"] is None
    bow = Room(((0, 0), (1, 1), (1, 0), (0, 1)), 0.5)
    assert measure_rooms([bow], [bow]).ious == (exactly(1),)


# --- thickness ----------------------------------------------------------------------------------------------------


def test_thickness_is_compared_with_the_distance_of_the_true_faces():
    truth = DrawingStorey(0, 0.0, (Face((0, 0, 4, 0)), Face((0, -0.12, 4, -0.12))))
    plan = DrawingStorey(
        0,
        0.0,
        (Face((0, 0.002, 4, 0.002), "a"), Face((4, -0.121, 0, -0.121), "b"), Face((0, 9, 1, 9), "c")),
        walls=(Wall(("a", "b"), 0.123), Wall(("a", "c"), 0.3), Wall(("c",), None), Wall(("a", "a"), 0.1)),
    )
    totals = measure_thickness(plan, truth, associate(plan.lines, truth.truth_lines))
    assert totals.errors == (exactly(0.003),)
    assert totals.measured == 3


def test_thickness_of_a_wall_whose_faces_stop_at_a_door():
    left, right = [(0, 0, 2, 0), (3, 0, 5, 0)], [(5, -0.2, 3, -0.2), (2, -0.2, 0, -0.2)]
    truth = DrawingStorey(0, 0.0, tuple(Face(line) for line in left + right))
    faces = tuple(Face(face.line, f"{i}") for i, face in enumerate(truth.faces))
    walls = (Wall(("0", "1", "2", "3"), 0.19), Wall(("0", "1"), 0.19))
    totals = measure_thickness(
        DrawingStorey(0, 0.0, faces, walls=walls), truth, associate(truth.lines, truth.truth_lines)
    )
    assert totals.errors == (exactly(0.01),)
    assert totals.measured == 2


# --- accuracy bands -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("distance", "band"),
    [
        (0.0, "LOA50"),
        (0.001, "LOA50"),
        (0.0011, "LOA40"),
        (0.005, "LOA40"),
        (0.015, "LOA30"),
        (0.05, "LOA20"),
        (1, "LOA10"),
    ],
)
def test_bands(distance, band):
    assert loa_band(distance) == band


def test_percentile_is_pointwise_and_by_length():
    ramp = Offsets(np.array([1.0]), np.array([0.0]), np.array([0.1]))
    assert ramp.percentile(0.95) == pytest.approx(0.095, abs=1e-7)
    crossing = Offsets(np.array([1.0]), np.array([-0.1]), np.array([0.1]))
    assert crossing.percentile(0.5) == pytest.approx(0.05, abs=1e-7)
    two = Offsets(np.array([9.0, 1.0]), np.array([0.002, -0.3]), np.array([0.002, -0.3]))
    assert two.to_json()["band"] == "LOA10"
    assert two.to_json()["bands"] == {
        "LOA50": exactly(0),
        "LOA40": exactly(0.9),
        "LOA30": exactly(0),
        "LOA20": exactly(0),
        "LOA10": exactly(0.1),
    }
    assert Offsets.join([]).to_json()["distance_95"] is None


def test_reliability_and_coverage():
    lines = [(0, 0.004, 4, 0.004), (0, 2.02, 4, 2.02), (0, 9, 4, 9), (-2.1, 4, 2, 4)]
    claims = [
        {"confidence": 0.95, "sigma": 0.003},
        {"confidence": 0.92, "loa": 30},
        {"confidence": 0.91, "sigma": 0.001},
        {"confidence": 1.0, "loa": "LOA50"},
    ]
    faces = tuple(Face(line, str(i), properties=p) for i, (line, p) in enumerate(zip(lines, claims, strict=True)))
    plan = DrawingStorey(0, 0.0, faces)
    truth = np.array([[0, 0, 4, 0], [0, 2, 4, 2], [0, 4, 4, 4]])
    scores = score_faces(plan, associate(plan.lines, truth))
    assert [score.real for score in scores] == [True, True, False, False]  # the last associates by less than half
    assert [score.truth for score in scores] == [(0,), (1,), (), (2,)]
    (row,) = reliability(scores)
    assert row == {"low": 0.9, "high": 1.0, "faces": 4, "confidence": exactly(0.945), "real": exactly(0.5)}
    assert coverage(scores) == {"faces": 2, "covered": exactly(0.5)}  # 4 mm in 5.88 mm; 20 mm not in 15 mm


# --- the challenge ------------------------------------------------------------------------------------------------


def test_mean_cosine_counts_a_missed_wall_as_zero():
    truth = np.array([[0, 0, 4, 0], [0, 3, 4, 3], [0, 6, 4, 6]])
    detected = np.array([[0, 0, 4, 0.04], [0, 3, 4, 3]])
    totals = measure_challenge(associate(detected, truth), np.ones(3, dtype=bool), detected, truth)
    cosine = 4 / math.hypot(4, 0.04)
    report = totals.to_json()
    assert report["mean_cosine"] == exactly((cosine + 1) / 3)
    assert report["mean_cosine_matched"] == exactly((cosine + 1) / 2)
    assert report["warping_error"] is None


def test_betti_numbers_count_parts_and_enclosed_areas():
    picture = np.zeros((12, 20), dtype=bool)
    assert betti_numbers(picture) == (0, 0)
    picture[2:9, 2] = picture[2:9, 9] = picture[2, 2:10] = picture[8, 2:10] = True
    assert betti_numbers(picture) == (1, 1)
    picture[2:9, 5] = True
    picture[4, 15] = True
    assert betti_numbers(picture) == (2, 2)
    ring = np.zeros((5, 5), dtype=bool)
    ring[[0, 1, 2, 3, 4, 3, 2, 1], [2, 1, 0, 1, 2, 3, 4, 3]] = True  # joined at corners only, and still closed
    assert betti_numbers(ring) == (1, 1)


def ring_of(x0, y0, x1, y1):
    return [[x0, y0, x1, y0], [x1, y0, x1, y1], [x1, y1, x0, y1], [x0, y1, x0, y0]]


def test_topology_of_the_line_work():
    one = np.array(ring_of(0, 0, 8, 4), dtype=float)
    two = np.vstack([one, [[4, 0, 4, 4]]])
    empty, none = associate(np.zeros((0, 4)), np.zeros((0, 4))), np.zeros(0, dtype=bool)
    same = measure_challenge(empty, none, two, two)
    assert (same.patch_difference, same.components, same.holes) == (0, 0, 0)
    assert same.room_intersection == same.room_union > 0
    missing = measure_challenge(empty, none, one, two)
    assert missing.holes == 1
    assert missing.patch_difference > 0
    assert 0.4 < missing.room_intersection / missing.room_union < 0.55


# --- in the whole -------------------------------------------------------------------------------------------------


def storey(**parts):
    return DrawingStorey(0, 0.0, (Face((0, 0, 4, 0)),), **parts)


def test_what_a_truth_does_not_hold_is_not_scored():
    truth = {"storeys": [{"floor": 0.0, "walls": [{"p": [0, 0, 4, 0]}], "doors": [], "windows": [], "rooms": []}]}
    plan = Drawing((storey(doors=(opening(1, 0, 0.9),), rooms=(box(0, 0, 4, 4),)),))
    report = evaluate(plan, truth).to_json()["pooled"]
    assert (report["doors"], report["windows"], report["rooms"], report["thickness"]) == (None, None, None, None)


def test_a_plan_without_doors_as_truth_holds_none():
    plan = Drawing((storey(doors=(opening(1, 0, 0.9),)),))
    assert evaluate(plan, Drawing((storey(),))).to_json()["pooled"]["doors"] is None


def test_what_a_plan_cannot_hold_is_not_scored_but_what_it_missed_is():
    truth = Drawing((storey(doors=(opening(1, 0, 0.9),)),), frozenset({"doors"}))
    assert evaluate(Drawing((storey(),), frozenset()), truth).to_json()["pooled"]["doors"] is None
    missed = evaluate(Drawing((storey(),)), truth).to_json()["pooled"]["doors"]
    assert (missed["precision"], missed["recall"], missed["f"]) == (None, 0, 0)


def test_doors_and_rooms_of_geojson():
    def feature(kind, geometry, **properties):
        return {"type": "Feature", "geometry": geometry, "properties": {"kind": kind, "storey": 0, **properties}}

    ring = [[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]]
    plan = {
        "type": "FeatureCollection",
        "features": [
            feature("storey", None, floor=0.02, ceiling=2.5),
            feature("wall_face", {"type": "LineString", "coordinates": [[0, 0], [4, 0]]}, id="a", curve=None),
            feature("wall_face", {"type": "LineString", "coordinates": [[4, -0.1], [0, -0.1]]}, id="b", curve=None),
            feature("wall", {"type": "Polygon", "coordinates": [ring]}, faces=["a", "b"], thickness=0.1),
            feature("door", {"type": "LineString", "coordinates": [[1, 0], [1.9, 0]]}, width=0.88, state="open"),
            feature("window", {"type": "LineString", "coordinates": [[2, 0], [3, 0]]}),
            feature("room", {"type": "Polygon", "coordinates": [ring]}, area=12.1),
            feature("column", {"type": "Polygon", "coordinates": [ring]}),
        ],
    }
    truth = {
        "storeys": [
            {
                "floor": 0.0,
                "walls": [{"p": [0, 0, 4, 0]}, {"p": [0, -0.105, 4, -0.105], "side": "exterior"}],
                "doors": [{"line": [1, -0.05, 1.9, -0.05], "width": 0.9}],
                "windows": [{"line": [2, -0.05, 3, -0.05], "width": 1.0}],
                "rooms": [{"polygon": ring, "area": 12.0}],
            }
        ]
    }
    result = evaluate(plan, truth)
    report = result.to_json()["pooled"]
    assert report["doors"]["f"] == report["windows"]["f"] == report["rooms"]["f"] == 1
    assert report["doors"]["median_width_error"] == exactly(0.02)
    assert report["windows"]["median_width_error"] == exactly(0)
    assert report["rooms"]["median_area_error"] == exactly(0.1 / 12)
    assert report["thickness"]["median_error"] == exactly(0.005)
    assert report["observed"]["challenge"]["room_iou"] == exactly(1)
    assert result.storeys[0].to_json()["doors"]["found"] == 1
