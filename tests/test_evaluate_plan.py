"""Whole plans against whole truths: storeys, sources, truth sets, and the cases against themselves."""

import dataclasses
import json

import pytest

from asbuilt.errors import InputError, ParameterError
from asbuilt.evaluate import evaluate, read_drawing
from asbuilt.plan import FloorPlan, Storey, WallFace


def truth_of(*storeys):
    """A truth.json: per storey its floor and its walls (x1, y1, x2, y2, side, observed)."""
    return {
        "storeys": [
            {
                "floor": floor,
                "height": 3.0,
                "walls": [{"p": list(wall[:4]), "side": wall[4], "observed": wall[5]} for wall in walls],
                "jambs": [list(jamb) for jamb in jambs],
            }
            for floor, walls, jambs in storeys
        ]
    }


def plan_of(*storeys):
    return FloorPlan(
        tuple(
            Storey(i, floor, floor + 2.5, None, tuple(WallFace(line[:2], line[2:]) for line in lines))
            for i, (floor, lines) in enumerate(storeys)
        )
    )


ROOM = [
    (0, 0, 4, 0, "interior", 1.0),
    (0, -0.3, 4, -0.3, "exterior", 1.0),
    (0, 3, 4, 3, "interior", 0.2),
    (4, 0, 4, 0.09, "interior", 1.0),
]


def test_observed_truth_is_seen_from_inside():
    plan = plan_of((0.0, [(0, 0.01, 4, 0.01), (0, -0.31, 4, -0.31), (0, 3, 4, 3)]))
    result = evaluate(plan, truth_of((0.0, ROOM, [])))
    observed, everything = result.pooled("observed"), result.pooled("all")
    assert observed.truth_length == pytest.approx(4)
    assert observed.detected_length == pytest.approx(4)
    assert (observed.precision, observed.recall) == (1, 1)
    assert everything.truth_length == pytest.approx(12.09)
    assert everything.detected_length == pytest.approx(12)
    assert everything.recall == pytest.approx(12 / 12.09)


def test_segments_tell_where_each_part_went():
    plan = plan_of((0.0, [(4.5, 0.01, 1, 0.01), (0, -0.31, 4, -0.31)]))
    first, second = evaluate(plan, truth_of((0.0, ROOM, []))).storeys[0].segments()
    assert (first["truth"], first["observed"], first["all"]) == (0, True, True)
    assert (first["start"], first["end"]) == (pytest.approx(0.5), pytest.approx(3.5))
    assert (first["truth_start"], first["truth_end"]) == (pytest.approx(1), pytest.approx(4))
    assert first["distance"] == pytest.approx(0.01)
    assert (second["truth"], second["observed"], second["all"]) == (1, False, True)


def test_jambs_are_ignored_by_both():
    truth = truth_of((0.0, ROOM[:1], [(0, 0, 0, 0.2)]))
    result = evaluate(plan_of((0.0, [(0, 0, 4, 0), (0.01, 0, 0.01, 0.2)])), truth)
    for which in ("observed", "all"):
        assert result.pooled(which).precision == 1
        assert result.pooled(which).truth_length == 4


def test_storeys_are_matched_by_nearest_floor_within_a_metre():
    wall = [(0, 0, 4, 0, "interior", 1.0)]
    truth = truth_of((-3.0, wall, []), (0.0, wall, []), (3.0, wall, []))
    plan = plan_of((0.1, [(0, 0, 4, 0)]), (0.4, [(0, 0, 2, 0)]), (4.2, [(0, 0, 8, 0)]))
    result = evaluate(plan, truth)
    pairs = [(s.plan and s.plan.index, s.truth and s.truth.index) for s in result.storeys]
    assert pairs == [(None, 0), (0, 1), (None, 2), (1, None), (2, None)]
    pooled = result.pooled("observed")
    assert pooled.recall == pytest.approx(1 / 3)
    assert pooled.precision == pytest.approx(4 / 14)
    assert [s["index"] for s in result.to_json()["storeys"]] == [0, 1, 2, None, None]


def test_one_storey_alone():
    wall = [(0, 0, 4, 0, "interior", 1.0)]
    truth = truth_of((0.0, wall, []), (3.0, wall, []))
    plan = plan_of((3.0, [(0, 0, 4, 0)]), (9.0, [(0, 0, 4, 0)]))
    assert evaluate(plan, truth, storeys=[1]).pooled().f == 1
    assert evaluate(plan, truth, storeys=[0]).pooled().f == 0
    with pytest.raises(ParameterError, match="storey 2"):
        evaluate(plan, truth, storeys=[2])


def test_an_empty_plan_has_no_precision():
    report = evaluate(FloorPlan(), truth_of((0.0, ROOM, []))).to_json()
    assert report["pooled"]["observed"]["precision"] is None
    assert report["pooled"]["observed"]["recall"] == 0
    assert report["pooled"]["observed"]["f"] == 0


def test_every_source_of_a_plan_gives_the_same(plan, tmp_path):
    path = tmp_path / "plan.geojson"
    path.write_text(json.dumps(plan.to_geojson()), encoding="utf-8")
    expected = evaluate(plan, plan).to_json()
    for source in (plan.to_geojson(), path, str(path), read_drawing(path)):
        report = evaluate(source, plan).to_json()
        assert report["pooled"] == expected["pooled"]
    assert expected["pooled"]["all"]["f"] == 1


def test_faces_of_one_curve_are_one_detection():
    chords = [(6.0, 0.0, 5.95, 0.78), (5.95, 0.78, 5.8, 1.55), (5.8, 1.55, 5.54, 2.3)]
    truth = truth_of((0.0, [(*chord, "interior", 1.0) for chord in chords], []))
    plan = plan_of((0.0, chords))
    assert evaluate(plan, truth).pooled().over_segmentation == 2
    storey = plan.storeys[0]
    curved = tuple(dataclasses.replace(face, curve=7) for face in storey.wall_faces)
    one = FloorPlan((dataclasses.replace(storey, wall_faces=curved),))
    assert evaluate(one, truth).pooled().over_segmentation == 0


@pytest.mark.parametrize("text", ["", "{", "[]", '{"storeys": [{"walls": 3}]}', '{"type": "FeatureCollection"}'])
def test_a_file_that_is_no_plan_is_an_input_error(text, tmp_path):
    path = tmp_path / "broken.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"broken\.json"):
        evaluate(path, path)


def test_a_missing_file_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match=r"none\.geojson"):
        read_drawing(tmp_path / "none.geojson")


CASES = ["flat", "flat_e57", "fzk_haus", "niedriha", "rotunda", "school", "skewed", "small_house"]


@pytest.mark.parametrize("case", CASES)
def test_the_truth_of_a_case_against_itself_is_perfect(cases, case):
    path = cases / case / "truth.json"
    report = evaluate(path, path).to_json()
    for which in ("observed", "all"):
        measures = report["pooled"][which]
        assert measures["precision"] == pytest.approx(1, abs=1e-9)
        assert measures["recall"] == pytest.approx(1, abs=1e-9)
        assert measures["within_15mm"] == pytest.approx(1, abs=1e-9)
        for name in ("distance_error", "orientation_error_deg", "over_segmentation", "overlap"):
            assert measures[name] == pytest.approx(0, abs=1e-9), name
        assert measures["endpoints"]["5cm"]["f"] == 1
