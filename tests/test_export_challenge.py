"""The Scan-to-BIM challenge's two forms: as its own programs expect them, and read back by the evaluation."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from asbuilt import FloorPlan
from asbuilt.evaluate import evaluate, read_drawing
from asbuilt.export import export
from asbuilt.plan import Column, Door, Storey, Wall
from plans import EAST, NORTH, complete_plan


def one_storey(*doors, **changes):
    """The lower storey of the complete plan, alone, with these doors instead of its own."""
    plan = complete_plan()
    storey = replace(plan.storeys[0], **({"doors": doors} if doors else {}), **changes)
    return replace(plan, storeys=(storey,))


def test_2d_counts_its_layers_structures_and_points(tmp_path):
    (path,) = export(one_storey(), tmp_path / "plan.2d.json")
    data = json.loads(path.read_text())
    assert list(data) == ["header", "layer 0", "layer 1", "layer 2"]
    assert data["header"] == {"layer number": 3, "structure number": [10, 1, 2]}
    layers = [data[f"layer {i}"] for i in range(data["header"]["layer number"])]
    assert [layer["layer name"] for layer in layers] == ["A_WALL", "A_DOOR", "A_COLUMN"]
    assert [len(layer["points"]) for layer in layers] == data["header"]["structure number"]
    for structure in (structure for layer in layers for structure in layer["points"]):
        assert list(structure) == ["point number", "coordinates"]
        assert len(structure["coordinates"]) == 2 * structure["point number"]
    assert layers[0]["points"][0]["coordinates"] == [EAST, NORTH, EAST + 3.95, NORTH]
    assert layers[1]["points"][0]["coordinates"] == [EAST + 4.0, NORTH + 2.0, EAST + 4.0, NORTH + 2.9]
    assert [structure["point number"] for structure in layers[2]["points"]] == [5, 25]


def test_2d_is_one_file_a_storey_under_its_whole_suffix(tmp_path):
    written = export(complete_plan(), tmp_path / "plan.2d.json")
    assert [path.name for path in written] == ["plan_s0.2d.json", "plan_s1.2d.json"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["plan_s0.2d.json", "plan_s1.2d.json"]


def test_2d_scores_as_the_plan_does(tmp_path):
    plan = one_storey()
    (path,) = export(plan, tmp_path / "plan.2d.json")
    result = evaluate(path, plan)
    totals = result.pooled("all")
    assert (totals.precision, totals.recall) == (pytest.approx(1), pytest.approx(1))
    assert totals.distance_error == pytest.approx(0, abs=1e-6)
    (door,) = read_drawing(path).storeys[0].doors
    assert door.width == pytest.approx(0.9, abs=1e-6)


@pytest.mark.parametrize("suffix", [".2d.json", ".3d.json"])
def test_what_has_no_leaf_or_was_not_looked_through_is_no_door(suffix, tmp_path):
    doors = [Door((x, 0.0), (x + 0.9, 0.0), state=state) for x, state in enumerate(("cased", "unknown", "shut"))]
    (path,) = export(one_storey(*doors), tmp_path / f"plan{suffix}")
    found = read_drawing(path).storeys[0].doors
    assert [door.line[0] for door in found] == [1.0, 2.0]


def test_3d_has_boxes_with_their_base_on_the_floor(tmp_path):
    (path,) = export(one_storey(), tmp_path / "plan.3d.json")
    data = json.loads(path.read_text())
    assert list(data) == ["walls", "doors", "columns"]
    assert data["walls"][0] == {
        "start_pt": [EAST + 4.0, NORTH, 112.5],
        "end_pt": [EAST + 4.0, NORTH + 5.0, 112.5],
        "width": 0.1,
        "height": 2.5,
    }
    assert data["doors"] == [
        {"width": 0.9, "depth": 0.1, "height": 2.01, "loc": [EAST + 4.0, NORTH + 2.45, 112.5], "rotation": 90.0}
    ]
    square, round_ = data["columns"]
    place = [EAST + 1.5, NORTH + 2.5, 112.5]
    assert square == {"width": 0.3, "depth": 0.4, "height": 2.5, "loc": place, "rotation": round(math.degrees(0.2), 6)}
    assert (round_["width"], round_["depth"], round_["rotation"]) == (0.35, 0.35, 0.0)


def test_3d_comes_back_with_its_storeys(tmp_path):
    plan = complete_plan()
    (path,) = export(plan, tmp_path / "plan.3d.json")
    drawing = read_drawing(path)
    assert [storey.floor for storey in drawing] == [112.5, 115.3]
    for storey, read in zip(plan, drawing, strict=True):
        assert len(read.faces) == 2 * len(storey.walls)
        expected = [(wall.start, wall.end) for wall in storey.walls]
        middles = read.lines.reshape(-1, 2, 4).mean(axis=1).reshape(-1, 2, 2)
        np.testing.assert_allclose(middles, expected, atol=1e-6)
        np.testing.assert_allclose(read.doors[0].line, (*storey.doors[0].start, *storey.doors[0].end), atol=1e-6)


def test_3d_keeps_to_what_was_seen(tmp_path):
    storey = Storey(
        0,
        1.0,
        3.5,
        walls=(Wall((0.0, 0.0), (4.0, 0.0), None, 0.1, height=1.2),),
        doors=(Door((3.0, 2.0), (2.0, 2.0), "absent"), Door((2.0, 5.0), (2.0, 4.2), sill=0.3, head=2.3)),
        columns=(Column((np.float64(1.0), 1.0), np.float32(0.5), 0.25),),
    )
    (path,) = export(FloorPlan((storey,)), tmp_path / "plan.3d.json")
    data = json.loads(path.read_text())
    assert data["walls"][0]["height"] == 1.2
    # a head that nobody saw and a wall that is not known are the form's own default, 0
    assert data["doors"][0] == {"width": 1.0, "depth": 0.0, "height": 0.0, "loc": [2.5, 2.0, 1.0], "rotation": 180.0}
    assert data["doors"][1]["loc"] == [2.0, 4.6, 1.3]
    assert (data["doors"][1]["height"], data["doors"][1]["rotation"]) == (2.0, 270.0)
    assert data["columns"][0]["width"] == 0.5


def test_3d_of_a_plan_with_wall_faces_alone_has_these(tmp_path):
    plan = one_storey(walls=())
    (path,) = export(plan, tmp_path / "plan.3d.json")
    assert {wall["width"] for wall in json.loads(path.read_text())["walls"]} == {0.0}
    assert evaluate(path, plan).pooled("all").recall == pytest.approx(1)


@pytest.mark.parametrize("suffix", [".2d.json", ".3d.json"])
def test_an_empty_plan_is_an_empty_file_of_its_form(suffix, tmp_path):
    (path,) = export(FloorPlan(), tmp_path / f"plan{suffix}")
    drawing = read_drawing(path)
    assert [storey.faces for storey in drawing] in ([], [()])
