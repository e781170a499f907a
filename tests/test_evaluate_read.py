"""Readers of the evaluation: the same walls in every format score the same."""

import json
import math

import ezdxf
import numpy as np
import pytest

from asbuilt.errors import InputError
from asbuilt.evaluate import evaluate, read_drawing


def read_json(tmp_path, data, name="plan.json"):
    path = tmp_path / name
    path.write_text(json.dumps(data), encoding="utf-8")
    return read_drawing(path)


def write_dxf(path, draw, units=6):
    document = ezdxf.new("R2018", units=units)
    draw(document, document.modelspace())
    document.saveas(path)
    return path


def lines_of(drawing, storey=0):
    return np.array(sorted(face.line for face in drawing.storeys[storey].faces))


# --- DXF ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("units", "metre"), [(6, 1.0), (4, 0.001), (5, 0.01), (2, 0.3048), (0, 1.0)])
def test_dxf_units_come_from_insunits(tmp_path, units, metre):
    def draw(document, space):
        space.add_line((1000, 0), (3000, 0), dxfattribs={"layer": "A-WALL-S0"})

    drawing = read_drawing(write_dxf(tmp_path / "plan.dxf", draw, units))
    np.testing.assert_allclose(lines_of(drawing), [[1000 * metre, 0, 3000 * metre, 0]], rtol=1e-9)


def test_dxf_storey_is_the_suffix_of_its_layer(tmp_path):
    def draw(document, space):
        space.add_line((0, 0), (1, 0), dxfattribs={"layer": "A-WALL-S2"})
        space.add_line((0, 0), (2, 0), dxfattribs={"layer": "a-wall"})
        space.add_line((0, 0), (3, 0), dxfattribs={"layer": "A-DOOR-S0"})

    drawing = read_drawing(write_dxf(tmp_path / "plan.dxf", draw))
    assert [storey.index for storey in drawing] == [0, 2]
    assert lines_of(drawing).tolist() == [[0, 0, 2, 0]]
    assert drawing.holds == frozenset()


def test_dxf_layer_pattern(tmp_path):
    def draw(document, space):
        space.add_line((0, 0), (1, 0), dxfattribs={"layer": "Wände EG"})
        space.add_line((0, 0), (2, 0), dxfattribs={"layer": "Möbel"})

    path = write_dxf(tmp_path / "plan.dxf", draw)
    assert lines_of(read_drawing(path, layer="wÄnde*")).tolist() == [[0, 0, 1, 0]]
    with pytest.raises(InputError, match=r"plan\.dxf: no layer matches .*Möbel"):
        read_drawing(path)


def test_dxf_polylines_arcs_and_blocks(tmp_path):
    def draw(document, space):
        wall = {"layer": "A-WALL-S0"}
        space.add_lwpolyline([(0, 0), (1, 0), (1, 1)], close=True, dxfattribs=wall)
        space.add_arc((10, 0), 2, 0, 90, dxfattribs=wall)
        block = document.blocks.new("COLUMN")
        block.add_line((0, 0), (0, 1))  # on layer 0: takes the layer of its insert
        block.add_line((0, 0), (0, 9), dxfattribs={"layer": "A-NOTE"})
        space.add_blockref("COLUMN", (20, 0), dxfattribs={**wall, "rotation": 90})

    storey = read_drawing(write_dxf(tmp_path / "plan.dxf", draw)).storeys[0]
    straight = [face for face in storey.faces if face.curve is None]
    np.testing.assert_allclose(
        sorted(face.line for face in straight),
        [[0, 0, 1, 0], [1, 0, 1, 1], [1, 1, 0, 0], [20, 0, 19, 0]],
        atol=1e-9,
    )
    chords = np.array([face.line for face in storey.faces if face.curve is not None])
    assert len({face.curve for face in storey.faces if face.curve is not None}) == 1
    assert np.hypot(*(chords[:, 2:] - chords[:, :2]).T).sum() == pytest.approx(math.pi, abs=0.01)
    np.testing.assert_allclose(np.hypot(chords[:, 0] - 10, chords[:, 1]), 2, atol=1e-9)


def test_dxf_of_ours_scores_as_its_plan(plan, tmp_path):
    export = pytest.importorskip("asbuilt.export")
    path = tmp_path / "plan.dxf"
    export.export(plan, path)
    result = evaluate(path, plan)
    assert [storey.plan is not None and storey.truth is not None for storey in result.storeys] == [True, True]
    assert result.pooled("all").f == pytest.approx(1, abs=1e-9)
    assert result.pooled("all").distance_error == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("name", ["plan.dxf", "plan.ifc", "plan.json"])
@pytest.mark.parametrize("content", [b"", b"nonsense", b"\xff\xfe\x00\x01" * 50])
def test_broken_files_are_input_errors(tmp_path, name, content):
    if name.endswith("ifc"):
        pytest.importorskip("ifcopenshell")
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"plan\."):
        read_drawing(path)
    with pytest.raises(InputError, match="absent"):
        read_drawing(tmp_path / f"absent{path.suffix}")


# --- Scan-to-BIM challenge ----------------------------------------------------------------------------------------


def test_challenge_2d(tmp_path):
    data = {
        "header": {"layer number": 3, "structure number": [2, 1, 1]},
        "layer 0": {
            "layer name": "A_WALL",
            "points": [
                {"point number": 3, "coordinates": [0, 0, 4, 0, 4, 3]},
                {"point number": 2, "coordinates": [0, 3, 0, 0]},
            ],
        },
        "layer 1": {
            "layer name": "A_DOOR",
            "points": [{"point number": 4, "coordinates": [1, 0, 1.9, 0, 1.9, 0.1, 1, 0.1]}],
        },
        "layer 2": {"layer name": "A_COLUMN", "points": [{"point number": 2, "coordinates": [2, 2, 2.3, 2]}]},
    }
    drawing = read_json(tmp_path, data)
    assert lines_of(drawing).tolist() == [[0, 0, 4, 0], [0, 3, 0, 0], [4, 0, 4, 3]]
    (door,) = drawing.storeys[0].doors
    assert door.width == pytest.approx(0.9)
    assert drawing.holds == {"doors"}
    assert drawing.storeys[0].floor is None


def test_challenge_3d(tmp_path):
    data = {
        "walls": [
            {"start_pt": [0, 0, 0], "end_pt": [4, 0, 0], "width": 0.2, "height": 2.5},
            {"start_pt": [0, 0, 3], "end_pt": [0, 4, 3], "width": 0.1, "height": 2.5},
        ],
        "doors": [{"width": 0.9, "depth": 0.2, "height": 2.1, "loc": [2, 0, 0], "rotation": 180}],
        "columns": [{"width": 0.4, "depth": 0.4, "height": 2.5, "loc": [3, 3, 0], "rotation": 0}],
    }
    drawing = read_json(tmp_path, data)
    assert [storey.floor for storey in drawing] == [0, 3]
    np.testing.assert_allclose(lines_of(drawing), [[0, -0.1, 4, -0.1], [0, 0.1, 4, 0.1]])
    np.testing.assert_allclose(lines_of(drawing, 1), [[-0.05, 0, -0.05, 4], [0.05, 0, 0.05, 4]])
    np.testing.assert_allclose(drawing.storeys[0].doors[0].line, [2.45, 0, 1.55, 0], atol=1e-12)
    walls_alone = read_json(tmp_path, data["walls"])
    assert lines_of(walls_alone).tolist() == lines_of(drawing).tolist()


def test_challenge_against_truth_of_one_storey(tmp_path):
    data = {
        "header": {"layer number": 1, "structure number": [1]},
        "layer 0": {"layer name": "A_WALL", "points": [{"point number": 2, "coordinates": [0, 0, 4, 0]}]},
    }
    truth = {"storeys": [{"floor": 7.0, "walls": [{"p": [0, 0, 4, 0], "side": "interior", "observed": 1.0}]}]}
    assert evaluate(data, truth).pooled().f == 1


# --- IFC ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def ifc_model(tmp_path):
    """An L of two walls 0.2 m thick and 3 m high on a floor at 1 m, with a door and a window, in millimetres."""
    pytest.importorskip("ifcopenshell")
    import ifcopenshell.api.aggregate
    import ifcopenshell.api.context
    import ifcopenshell.api.feature
    import ifcopenshell.api.geometry
    import ifcopenshell.api.root
    import ifcopenshell.api.spatial
    import ifcopenshell.api.unit

    model = ifcopenshell.file(schema="IFC4")
    project = ifcopenshell.api.root.create_entity(model, ifc_class="IfcProject", name="test")
    ifcopenshell.api.unit.assign_unit(model, length={"is_metric": True, "raw": "MILLIMETERS"})
    context = ifcopenshell.api.context.add_context(model, context_type="Model")
    body = ifcopenshell.api.context.add_context(
        model, context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=context
    )
    storey = ifcopenshell.api.root.create_entity(model, ifc_class="IfcBuildingStorey")
    ifcopenshell.api.aggregate.assign_object(model, products=[storey], relating_object=project)

    def place(element, x, y, z, turned=False):
        matrix = np.eye(4)
        if turned:
            matrix[:2, :2] = [[0, -1], [1, 0]]
        matrix[:3, 3] = x, y, z
        ifcopenshell.api.geometry.edit_object_placement(model, product=element, matrix=matrix, is_si=True)

    def block(name, length, height, thickness):
        element = ifcopenshell.api.root.create_entity(model, ifc_class=name)
        shape = ifcopenshell.api.geometry.add_wall_representation(
            model, context=body, length=length, height=height, thickness=thickness
        )
        ifcopenshell.api.geometry.assign_representation(model, product=element, representation=shape)
        return element

    place(storey, 0, 0, 1)
    walls = [block("IfcWall", 5, 3, 0.2), block("IfcWall", 4, 3, 0.2)]
    place(walls[0], 0, 0, 1)
    place(walls[1], 0.2, 0.2, 1, turned=True)  # from y 0.2 to 4.2, x 0 to 0.2
    parts = list(walls)
    for kind, x, width, sill, height in (("IfcDoor", 1.0, 0.9, 0.0, 2.1), ("IfcWindow", 3.0, 1.2, 0.9, 1.2)):
        hole = block("IfcOpeningElement", width, height, 0.4)
        place(hole, x, -0.1, 1 + sill)
        ifcopenshell.api.feature.add_feature(model, feature=hole, element=walls[0])
        filling = ifcopenshell.api.root.create_entity(model, ifc_class=kind)
        place(filling, x, 0, 1 + sill)
        ifcopenshell.api.feature.add_filling(model, opening=hole, element=filling)
        parts.append(filling)
    ifcopenshell.api.spatial.assign_container(model, products=parts, relating_structure=storey)
    space = block("IfcSpace", 4.8, 2.5, 3)
    place(space, 0.2, 0.2, 1)
    ifcopenshell.api.aggregate.assign_object(model, products=[space], relating_object=storey)
    path = tmp_path / "model.ifc"
    model.write(str(path))
    return path


def test_ifc_walls_are_cut_and_joined(ifc_model):
    (storey,) = read_drawing(ifc_model).storeys
    assert storey.floor == pytest.approx(1)
    expected = [
        # the L, cut in two by the door, going on under the window
        [[0, 0, 1, 0], [1, 0, 1, 0.2], [1, 0.2, 0.2, 0.2], [0.2, 0.2, 0.2, 4.2], [0.2, 4.2, 0, 4.2], [0, 4.2, 0, 0]],
        [[1.9, 0, 5, 0], [5, 0, 5, 0.2], [5, 0.2, 1.9, 0.2], [1.9, 0.2, 1.9, 0]],
    ]
    result = evaluate(
        ifc_model, {"storeys": [{"floor": 1.0, "walls": [{"p": line} for ring in expected for line in ring]}]}
    )
    totals = result.pooled("all")
    assert len(storey.faces) == 10
    assert (totals.precision, totals.recall) == (pytest.approx(1, abs=1e-6), pytest.approx(1, abs=1e-6))
    assert totals.distance_error == pytest.approx(0, abs=1e-5)
    assert totals.matched_ends[0] == 20


def test_ifc_openings_and_spaces(ifc_model):
    drawing = read_drawing(ifc_model)
    (storey,) = drawing.storeys
    assert drawing.holds == {"doors", "windows", "rooms"}
    assert storey.doors[0].width == pytest.approx(0.9, abs=1e-6)
    np.testing.assert_allclose(sorted(storey.doors[0].line), [0.1, 0.1, 1, 1.9], atol=1e-6)
    assert storey.windows[0].width == pytest.approx(1.2, abs=1e-6)
    assert storey.rooms[0].area == pytest.approx(4.8 * 3, abs=1e-6)


def test_ifc_cut_above_the_sill_is_cut_by_the_window_too(ifc_model):
    assert len(read_drawing(ifc_model, cut_height=1.2).storeys[0].faces) == 14


def test_ifc_map_coordinates(ifc_model, tmp_path):
    pytest.importorskip("ifcopenshell")
    import ifcopenshell.api.georeference

    model = ifcopenshell.open(str(ifc_model))
    ifcopenshell.api.georeference.add_georeferencing(model)
    ifcopenshell.api.georeference.edit_georeferencing(
        model,
        coordinate_operation={
            "Eastings": 500_000.0,
            "Northings": 5_000_000.0,
            "OrthogonalHeight": 100.0,
            "XAxisAbscissa": 0.0,
            "XAxisOrdinate": 1.0,
            "Scale": 0.001,
        },
        projected_crs={"Name": "EPSG:25832"},
    )
    path = tmp_path / "map.ifc"
    model.write(str(path))
    (storey,) = read_drawing(path).storeys
    assert storey.floor == pytest.approx(101)
    # the model's x axis points north
    ends = np.array([face.line for face in storey.faces]).reshape(-1, 2)
    np.testing.assert_allclose(ends.min(axis=0), [500_000 - 4.2, 5_000_000], atol=1e-5)
    np.testing.assert_allclose(ends.max(axis=0), [500_000, 5_000_005], atol=1e-5)
