"""The IFC model, read back by IfcOpenShell: its schema, its solids, its relations and its place on the map."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from asbuilt import FloorPlan
from asbuilt.errors import MissingExtraError
from asbuilt.evaluate import evaluate, read_drawing
from asbuilt.export import export
from asbuilt.plan import Column, Door, Room, Stair, Storey, UnknownOpening, Wall, WallFace, Window
from plans import EAST, NORTH, complete_plan
from readback.models import complaints

pytest.importorskip("ifcopenshell")
import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.guid
import ifcopenshell.util.element
import ifcopenshell.util.geolocation
import ifcopenshell.util.placement
import ifcopenshell.util.shape


def written(plan, folder):
    (path,) = export(plan, folder / "plan.ifc")
    return ifcopenshell.open(str(path))


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """The complete plan near the origin, without a reference system."""
    return written(complete_plan(0.0, 0.0, None), tmp_path_factory.mktemp("ifc"))


def named(model, kind, name):
    (found,) = (entity for entity in model.by_type(kind) if entity.Name == name)
    return found


def solid(entity, whole=False):
    """Volume (m3) and the least and greatest corner (m) of an entity's body; of a `whole` one, before its openings."""
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    settings.set("disable-opening-subtractions", whole)
    shape = ifcopenshell.geom.create_shape(settings, entity)
    corners = ifcopenshell.util.shape.get_vertices(shape.geometry)
    return ifcopenshell.util.shape.get_volume(shape.geometry), corners.min(axis=0), corners.max(axis=0)


def about(entity, name="Asbuilt_Trust"):
    found = dict(ifcopenshell.util.element.get_psets(entity).get(name, {}))
    found.pop("id", None)
    return found


def box(x0, y0, x1, y1):
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def arc(radius, pieces, turn, thickness=0.2, measured=True):
    """The pieces of a curved wall about the origin, with their outlines."""
    angles = np.linspace(0.0, turn, pieces + 1)

    def at(r, angle):
        return r * math.cos(angle), r * math.sin(angle)

    for i, (a, b) in enumerate(pairwise(angles)):
        inner, outer = radius - thickness / 2, radius + thickness / 2
        outline = (at(outer, a), at(outer, b), at(inner, b), at(inner, a))
        yield Wall(
            at(radius, a),
            at(radius, b),
            thickness if measured else None,
            thickness,
            outline=outline,
            curve=7,
            id=f"S0-W{i}",
            seen=i / pieces,
            voxels=10,
            sigma=0.001 * (i + 1),
            confidence=0.9,
        )


def odd_storey():
    """What a plan may hold beside the usual: every kind of thing with as little as can be known of it."""
    return Storey(
        0,
        0.0,
        2.5,
        None,
        (WallFace((0.0, 0.0), (4.0, 0.0), id="F"),),
        (
            Wall((0.0, 0.0), (4.0, 0.0), None, 0.1, ("F", "absent"), box(0.0, -0.05, 4.0, 0.05), 1.2, id="W"),
            Wall((9.0, 9.0), (9.0, 9.0), None, 0.1),
            Wall((8.0, 9.0), (8.0, 9.0 + 1e-9), None, 0.1, outline=((7.9, 9.0), (8.1, 9.0), (8.1, 9.0 + 1e-9))),
            *arc(3.0, 12, math.tau),
        ),
        (
            Door((1.0, 0.0), (1.9, 0.0), "W", state="cased", id="cased"),
            Door((5.0, 7.0), (5.9, 7.0), state="cased", id="gap"),
            Door((6.0, 6.0), (6.5, 6.5), head=2.0, hinge="end", swing="right", id="alone"),
            Door((7.0, 6.0), (7.5, 6.5), "absent", id="lost"),
            Door((2.9, -0.4), (2.9, 0.5), "S0-W0", head=2.1, id="bent"),
            Door((6.0, 0.0), (6.9, 0.0), "W", head=2.1, id="beyond"),
            Door((1.0, 0.0), (1.0, 0.9), "W", head=2.1, id="across"),
        ),
        (Window((2.5, 0.0), (3.5, 0.0), "W"),),
        (UnknownOpening((0.1, 0.0), (0.5, 0.0)),),
        (Room(box(0.0, 0.0, 4.0, 4.0), (box(1.0, 1.0, 2.0, 2.0),)), Room(box(4.0, 0.0, 5.0, 4.0), floor=0.1)),
        (Column((np.float64(5.0), 5.0), np.float32(0.5), 0.5, voxels=np.int64(3)),),
        (
            Stair(box(0.0, 0.0, 1.0, 3.0)),
            Stair(box(0.0, 0.0, 2.0, 3.0), ((0.5, 0.0), (0.5, 3.0), (1.5, 3.0)), 2.0),
        ),
    )


# --- the schema ---


@pytest.mark.parametrize(
    "plan",
    [
        FloorPlan(complete_plan().storeys[:1], {"a": {"b": 1}}, ({"name": "ö.e57"},), "EPSG:25832", ("two\nlines",)),
        FloorPlan((odd_storey(), Storey(1, 3.0, 5.5, wall_faces=complete_plan().storeys[0].wall_faces))),
        FloorPlan(),
    ],
    ids=["complete", "odd", "empty"],
)
def test_it_is_valid_by_the_schema_and_its_express_rules(plan, tmp_path):
    (path,) = export(plan, tmp_path / "plan.ifc")
    assert complaints(path) == []


def test_the_validator_would_have_noticed(tmp_path):
    broken = written(FloorPlan(), tmp_path)
    broken.by_type("IfcSite")[0].Name = None
    broken.create_entity("IfcWall", GlobalId=ifcopenshell.guid.new(), PredefinedType="USERDEFINED")  # as what?
    broken.write(str(tmp_path / "broken.ifc"))
    assert len(complaints(tmp_path / "broken.ifc")) == 1


def test_an_empty_plan_has_a_building_without_storeys(tmp_path):
    model = written(FloorPlan(), tmp_path)
    assert model.schema == "IFC4"
    assert len(model.by_type("IfcBuilding")) == 1
    assert not model.by_type("IfcBuildingStorey")


def test_guids_stay_while_scans_and_ids_do(tmp_path):
    plan = complete_plan()
    moved = replace(plan.storeys[0].walls[0], start=(EAST + 4.01, NORTH))
    storey = replace(plan.storeys[0], walls=(moved, *plan.storeys[0].walls[1:]))

    def guids(plan):
        roots = written(plan, tmp_path).by_type("IfcRoot")
        assert len({root.GlobalId for root in roots}) == len(roots)
        return {root.GlobalId: root.is_a() for root in roots}

    assert guids(plan) == guids(replace(plan, storeys=(storey, plan.storeys[1])))
    upper = guids(replace(plan, storeys=plan.storeys[1:]))  # a storey drawn alone
    assert guids(plan).items() >= upper.items()
    assert not guids(plan).keys() & guids(replace(plan, inputs=({"name": "other.e57"},))).keys()


def test_it_does_not_hang_on_where_numbers_come_from(tmp_path):
    plain, numpy = FloorPlan((odd_storey(),)), FloorPlan((odd_storey(),))
    columns = (Column((5.0, 5.0), 0.5, 0.5, voxels=3),)
    plain = FloorPlan((replace(plain.storeys[0], columns=columns),))
    first = export(plain, tmp_path / "plain.ifc")[0].read_bytes()
    assert first == export(numpy, tmp_path / "numpy.ifc")[0].read_bytes()


def test_without_ifcopenshell_one_line_names_the_extra(tmp_path, monkeypatch):
    for name in [name for name in sys.modules if name.startswith("asbuilt.export.ifc")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "ifcopenshell", None)
    with pytest.raises(MissingExtraError, match=r"^[^\n]*pip install 'asbuilt\[ifc\]'$"):
        export(FloorPlan(), tmp_path / "plan.ifc")
    assert list(tmp_path.iterdir()) == []


# --- storeys ---


def test_storeys_stand_at_their_height_and_hold_their_own(model):
    (building,) = model.by_type("IfcBuilding")
    storeys = ifcopenshell.util.element.get_parts(building)
    assert [(storey.Name, storey.Elevation) for storey in storeys] == [("Storey 0", 112.5), ("Storey 1", 115.3)]
    for index, storey in enumerate(storeys):
        place = ifcopenshell.util.placement.get_local_placement(storey.ObjectPlacement)
        assert place[2, 3] == storey.Elevation
        contained = {entity.Name for entity in ifcopenshell.util.element.get_contained(storey)}
        walls = {f"S{index}-W{i}" for i in range(1, 6)}
        others = {"D1", "G1", "U1", "C1", "C2", "T1", "floor"}
        assert contained == walls | {f"S{index}-{name}" for name in others}
        assert {space.Name for space in ifcopenshell.util.element.get_parts(storey)} == {f"{index}01", f"{index}02"}


def test_many_storeys_are_stacked(tmp_path):
    lowest = complete_plan(0.0, 0.0, None).storeys[0]
    storeys = tuple(replace(lowest, index=i, floor=3.0 * i, ceiling=3.0 * i + 2.6) for i in range(-2, 10))
    model = written(FloorPlan(storeys), tmp_path)
    found = sorted(model.by_type("IfcBuildingStorey"), key=lambda storey: storey.Elevation)
    assert [storey.Elevation for storey in found] == [3.0 * i for i in range(-2, 10)]
    for storey in found:
        walls = [e for e in ifcopenshell.util.element.get_contained(storey) if e.is_a("IfcWall")]
        heights = [solid(wall)[1][2] for wall in walls]
        assert heights == pytest.approx([storey.Elevation] * 5)
    slabs = sorted(model.by_type("IfcSlab"), key=lambda slab: solid(slab)[1][2])
    assert [about(slab)["ThicknessObserved"] for slab in slabs] == [False] + [True] * 11
    assert [about(slab).get("Thickness") for slab in slabs] == [None] + [pytest.approx(0.4)] * 11


# --- walls ---


def test_a_measured_wall_has_its_outline_an_axis_and_a_material_as_thick(model):
    wall = named(model, "IfcWall", "S0-W1")
    volume, low, high = solid(wall, whole=True)
    assert volume == pytest.approx(0.1 * 5.0 * 2.5)
    np.testing.assert_allclose(low, [3.95, 0.0, 112.5], atol=1e-6)
    np.testing.assert_allclose(high, [4.05, 5.0, 115.0], atol=1e-6)
    (axis,) = (shape for shape in wall.Representation.Representations if shape.RepresentationIdentifier == "Axis")
    assert [point.Coordinates for point in axis.Items[0].Points] == [(0.0, 0.0), (5.0, 0.0)]
    usage = ifcopenshell.util.element.get_material(wall)
    assert usage.is_a("IfcMaterialLayerSetUsage")
    assert [layer.LayerThickness for layer in usage.ForLayerSet.MaterialLayers] == [0.1]
    assert (usage.LayerSetDirection, usage.OffsetFromReferenceLine) == ("AXIS2", -0.05)
    assert about(wall, "Qto_WallBaseQuantities") == {"Length": 5.0, "Height": 2.5, "Width": 0.1}


def test_an_unseen_side_is_drawn_but_has_no_material(model):
    wall = named(model, "IfcWall", "S0-W3")
    volume, low, high = solid(wall)
    assert volume == pytest.approx(0.1 * 5.2 * 2.5)
    np.testing.assert_allclose([low[0], high[0]], [8.0, 8.1], atol=1e-6)
    assert ifcopenshell.util.element.get_material(wall) is None
    said = about(wall)
    assert said["ThicknessObserved"] is False
    assert "Thickness" not in said
    assert said["DrawnThickness"] == 0.1
    assert said["SeenSide"] == "LEFT"  # the wall runs north, its room is in the west
    assert "Width" not in about(wall, "Qto_WallBaseQuantities")


def test_property_sets_of_names_that_buildingsmart_reserves_are_its_own(model):
    names = {entity.Name for entity in model.by_type("IfcPropertySet")}
    assert "Asbuilt_Trust" in names
    assert [name for name in names if name.startswith("Pset_")] == []


def test_every_element_says_how_far_to_trust_it(model):
    trust = {"Seen": 0.9, "Rms": 0.003, "Voxels": 400, "Sigma": 0.002, "LOA": "LOA40", "Confidence": 0.95}
    kinds = ("IfcWall", "IfcDoor", "IfcWindow", "IfcOpeningElement", "IfcSpace", "IfcColumn", "IfcStair")
    for kind in kinds:
        for entity in model.by_type(kind):
            assert about(entity).items() >= trust.items(), entity.Name
    (gap, _) = model.by_type("IfcBuildingElementProxy")
    assert not {"Seen", "Rms", "Sigma", "Confidence"} & about(gap).keys()  # nobody worked them out
    assert about(named(model, "IfcWall", "S0-W1"))["ThicknessObserved"] is True


def test_a_low_wall_has_its_own_height(tmp_path):
    model = written(FloorPlan((odd_storey(),)), tmp_path)
    volume, low, high = solid(named(model, "IfcWall", "W"), whole=True)
    assert volume == pytest.approx(4.0 * 0.1 * 1.2)
    np.testing.assert_allclose([low, high], [[0.0, -0.05, 0.0], [4.0, 0.05, 1.2]], atol=1e-6)


@pytest.mark.parametrize("measured", [True, False])
def test_a_curved_wall_is_one_wall(measured, tmp_path):
    pieces = tuple(arc(3.0, 12, math.tau, measured=measured))
    model = written(FloorPlan((Storey(0, 0.0, 2.5, walls=pieces),)), tmp_path)
    (wall,) = model.by_type("IfcWall")
    ring = 12 / 2 * math.sin(math.tau / 12) * (3.1**2 - 2.9**2)
    assert solid(wall)[0] == pytest.approx(ring * 2.5, rel=1e-4)
    (axis,) = (shape for shape in wall.Representation.Representations if shape.RepresentationIdentifier == "Axis")
    assert len(axis.Items[0].Points) == 13
    said = about(wall)
    assert (said["Voxels"], said["Sigma"], said["Confidence"]) == (120, pytest.approx(0.012), 0.9)
    assert said["Seen"] == pytest.approx(11 / 24)
    assert said["ThicknessObserved"] is measured
    assert (ifcopenshell.util.element.get_material(wall) is not None) is measured


def test_a_plan_of_wall_faces_alone_has_them_as_lines(tmp_path):
    storey = replace(complete_plan().storeys[0], walls=())
    model = written(FloorPlan((storey,)), tmp_path)
    (lines,) = model.by_type("IfcAnnotation")
    assert ifcopenshell.util.element.get_container(lines).is_a("IfcBuildingStorey")
    to_world = ifcopenshell.util.placement.get_local_placement(lines.ObjectPlacement)
    drawn = [
        [(to_world @ (*point.Coordinates, 0.0, 1.0))[:2] for point in line.Points]
        for line in lines.Representation.Representations[0].Items
    ]
    np.testing.assert_allclose(drawn, [(face.start, face.end) for face in storey.wall_faces], atol=1e-6)
    assert not model.by_type("IfcWall")


def test_kinds_are_on_the_layers_of_the_drawing(model):
    layers = {layer.Name: layer.AssignedItems for layer in model.by_type("IfcPresentationLayerAssignment")}
    kinds = (
        "A-AREA",
        "A-COLS",
        "A-DOOR",
        "A-FLOR-OTLN",
        "A-FLOR-STRS",
        "A-GLAZ",
        "A-OPNG-UNKN",
        "A-WALL",
        "A-WALL-UNSN",
    )
    assert sorted(layers) == sorted(f"{kind}-S{i}" for kind in kinds for i in (0, 1))
    on = {shape.OfProductRepresentation[0].ShapeOfProduct[0].Name for shape in layers["A-WALL-UNSN-S0"]}
    assert on == {"S0-W2", "S0-W3", "S0-W4", "S0-W5"}


# --- openings ---


def test_openings_void_the_wall_and_doors_and_windows_fill_them(model):
    for kind, name, host, size in (
        ("IfcDoor", "S0-D1", "S0-W1", (0.9, 2.01)),
        ("IfcWindow", "S0-G1", "S0-W2", (1.2, 1.2)),
    ):
        filling, wall = named(model, kind, name), named(model, "IfcWall", host)
        hole = filling.FillsVoids[0].RelatingOpeningElement
        assert hole.VoidsElements[0].RelatingBuildingElement == wall
        assert (filling.OverallWidth, filling.OverallHeight) == pytest.approx(size)
        assert solid(wall, whole=True)[0] - solid(wall)[0] == pytest.approx(0.1 * size[0] * size[1], abs=1e-6)
        _, low, high = solid(filling)
        assert np.all(low >= solid(hole)[1] - 1e-6)
        assert np.all(high <= solid(hole)[2] + 1e-6)
    np.testing.assert_allclose(
        solid(named(model, "IfcDoor", "S0-D1"))[1:], [[3.98, 2.0, 112.5], [4.02, 2.9, 114.51]], atol=1e-6
    )
    assert solid(named(model, "IfcWindow", "S0-G1"))[1][2] == pytest.approx(112.5 + 0.9)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("wall", ["S0-W1", None])
@pytest.mark.parametrize(
    ("hinge", "swing", "opens_to", "operation"),
    [
        # the door runs from (4, 2) north to (4, 2.9); left of it is west
        ("start", "left", (-1, 0), "SINGLE_SWING_LEFT"),
        ("end", "left", (-1, 0), "SINGLE_SWING_RIGHT"),
        ("start", "right", (1, 0), "SINGLE_SWING_RIGHT"),
        ("end", "right", (1, 0), "SINGLE_SWING_LEFT"),
        (None, None, (-1, 0), "NOTDEFINED"),
    ],
)
def test_a_door_opens_along_its_y_axis_with_its_hinges_as_seen_along_it(
    hinge, swing, opens_to, operation, wall, reverse, tmp_path
):
    storey = complete_plan(0.0, 0.0, None).storeys[0]
    door = replace(storey.doors[0], hinge=hinge, swing=swing, wall=wall)
    if reverse:  # the same door, told from its other end
        other = {"start": "end", "end": "start", "left": "right", "right": "left", None: None}
        door = replace(door, start=door.end, end=door.start, hinge=other[hinge], swing=other[swing])
    model = written(FloorPlan((replace(storey, doors=(door,)),)), tmp_path)
    (made,) = model.by_type("IfcDoor")
    assert made.OperationType == operation
    place = ifcopenshell.util.placement.get_local_placement(made.ObjectPlacement)
    if hinge is not None:
        np.testing.assert_allclose(place[:2, 1], opens_to, atol=1e-9)
        hung_at = place[:2, 3] + (0.0 if operation.endswith("LEFT") else 0.9) * place[:2, 0]
        np.testing.assert_allclose(hung_at, (4.0, 2.0) if hinge == "start" else (4.0, 2.9), atol=1e-6)
    _, low, high = solid(made)
    np.testing.assert_allclose([low[:2], high[:2]], [[3.98, 2.0], [4.02, 2.9]], atol=1e-6)


def test_openings_that_are_no_doors_and_doors_that_have_no_wall(tmp_path):
    model = written(FloorPlan((odd_storey(),)), tmp_path)
    assert {door.Name for door in model.by_type("IfcDoor")} == {"alone", "lost", "bent", "beyond", "across"}
    wall = named(model, "IfcWall", "W")
    # a doorway without a leaf up to the top of the low wall, and a window of unknown height, which gets all of it
    assert {void.RelatedOpeningElement.Name for void in wall.HasOpenings} == {"cased", "S0"}
    assert solid(wall)[0] == pytest.approx((4.0 - 0.9 - 1.0) * 0.1 * 1.2, abs=1e-6)
    (window,) = model.by_type("IfcWindow")
    assert (window.OverallWidth, window.OverallHeight) == (pytest.approx(1.0), None)
    for name, centre in (("beyond", [6.45, 0.0]), ("across", [1.0, 0.45])):  # not where the wall that they name is
        door = named(model, "IfcDoor", name)
        assert not door.FillsVoids
        np.testing.assert_allclose(np.add(*solid(door)[1:])[:2] / 2, centre, atol=1e-6)
    alone = named(model, "IfcDoor", "alone")
    assert not alone.FillsVoids
    assert ifcopenshell.util.element.get_container(alone).is_a("IfcBuildingStorey")
    assert alone.OverallHeight == pytest.approx(2.0)
    _, low, high = solid(alone)
    np.testing.assert_allclose((low + high)[:2] / 2, [6.25, 6.25], atol=1e-6)
    cased, unknown = model.by_type("IfcBuildingElementProxy")
    assert (cased.Name, cased.ObjectType, about(cased)["State"]) == ("gap", "OPENING", "cased")
    assert unknown.ObjectType == "UNKNOWNOPENING"
    assert about(unknown).keys() & {"State", "Sill", "Head"} == set()


def test_an_opening_goes_through_all_pieces_of_a_curved_wall_and_not_its_far_side(tmp_path):
    pieces = tuple(arc(3.0, 36, math.tau))
    door = Door((3.0, -0.6), (3.0, 0.6), "S0-W0", head=2.0, id="D")
    model = written(FloorPlan((Storey(0, 0.0, 2.5, walls=pieces, doors=(door,)),)), tmp_path)
    (wall,) = model.by_type("IfcWall")
    removed = solid(wall, whole=True)[0] - solid(wall)[0]
    assert removed == pytest.approx(1.2 * 0.2 * 2.0, rel=0.03)  # the arc is a little longer than its chord


# --- rooms, slabs, columns, stairs ---


def test_spaces_have_their_number_and_quantities(model):
    space = named(model, "IfcSpace", "002")
    assert solid(space)[0] == pytest.approx(3.95 * 5.0 * 2.4)
    quantities = about(space, "Qto_SpaceBaseQuantities")
    area = 3.95 * 5.0
    expected = {"Height": 2.4, "GrossPerimeter": 2 * (3.95 + 5.0), "GrossFloorArea": area, "NetFloorArea": area}
    assert quantities == pytest.approx({**expected, "GrossVolume": area * 2.4, "NetVolume": area * 2.4})


def test_what_stands_in_a_space_is_not_part_of_it_and_an_unseen_ceiling_gives_no_height(tmp_path):
    model = written(FloorPlan((odd_storey(),)), tmp_path)
    first, second = model.by_type("IfcSpace")
    assert solid(first)[0] == pytest.approx(15.0 * 2.5)
    assert about(first, "Qto_SpaceBaseQuantities") == {
        "GrossPerimeter": 16.0,
        "GrossFloorArea": 16.0,
        "NetFloorArea": 15.0,
    }
    assert solid(second)[1][2] == pytest.approx(0.1)


def test_slabs_end_at_the_floor_and_at_the_ceiling_below(model):
    (lower, upper) = (named(model, "IfcSlab", f"S{i}-floor") for i in (0, 1))
    assert solid(lower)[0] == pytest.approx(8.2 * 5.2 * 0.1)
    assert solid(lower)[2][2] == pytest.approx(112.5)
    assert about(lower)["ThicknessObserved"] is False
    assert [solid(upper)[1][2], solid(upper)[2][2]] == pytest.approx([115.0, 115.3])
    assert about(upper)["Thickness"] == pytest.approx(0.3)


def test_columns_are_turned_rectangles_and_circles(model):
    volume, low, high = solid(named(model, "IfcColumn", "S0-C1"))
    assert volume == pytest.approx(0.3 * 0.4 * 2.5)
    reach = (0.3 * math.cos(0.2) + 0.4 * math.sin(0.2)) / 2
    assert [low[0], high[0]] == pytest.approx([1.5 - reach, 1.5 + reach])
    volume, low, high = solid(named(model, "IfcColumn", "S0-C2"))
    assert volume == pytest.approx(math.pi * 0.175**2 * 2.5, rel=0.01)  # IfcOpenShell makes polygons of circles
    assert [low[2], high[2]] == pytest.approx([112.5, 115.0])


def test_a_straight_flight_rises_along_its_path(model):
    stair = named(model, "IfcStair", "S0-T1")
    assert stair.PredefinedType == "STRAIGHT_RUN_STAIR"
    volume, low, high = solid(stair)
    # along y from 0.1 to 1.9 it rises by 1.6; before, there is none; the last 0.1 m is level with the block's top
    assert volume == pytest.approx(1.0 * (1.8 * 1.6 / 2 + 0.1 * 1.6), abs=1e-6)
    np.testing.assert_allclose(high, [5.05, 2.0, 114.1], atol=1e-6)
    assert low[2] == pytest.approx(112.5)


def test_a_stair_that_was_hardly_seen_is_its_outline(tmp_path):
    model = written(FloorPlan((odd_storey(),)), tmp_path)
    for stair in model.by_type("IfcStair"):
        assert "Body" not in [shape.RepresentationIdentifier for shape in stair.Representation.Representations]
        assert stair.PredefinedType == "NOTDEFINED"


# --- the map ---


def test_survey_coordinates_stay_small_and_the_map_conversion_leads_back(tmp_path):
    model = written(complete_plan(), tmp_path)
    _, low, _ = solid(named(model, "IfcWall", "S0-W1"))
    assert np.all(np.abs(low) < 1000)
    (crs,) = model.by_type("IfcProjectedCRS")
    assert crs.Name == "EPSG:25832"
    east, north, up = ifcopenshell.util.geolocation.auto_xyz2enh(model, *low.tolist())
    assert (east, north, up) == pytest.approx((EAST + 3.95, NORTH, 112.5), abs=1e-6)


WKT = (
    'COMPD_CS["map and height",PROJCS["DHDN / zone 3",GEOGCS["DHDN",AUTHORITY["EPSG","4314"]],UNIT["m",1]{own}],'
    'VERT_CS["NHN",AUTHORITY["EPSG","5783"]]]'
)


@pytest.mark.parametrize(
    ("crs", "name"),
    [
        (WKT.format(own=',AUTHORITY["EPSG","31467"]'), "EPSG:31467"),
        (WKT.format(own=""), "DHDN / zone 3"),
        ('PROJCRS["a [b] ]",BASEGEOGCRS["WGS 84",ID["EPSG",4326]],ID["EPSG",32632]]', "EPSG:32632"),
        ('LOCAL_CS["scanner"]', None),
        ('GEOGCS["WGS 84",AUTHORITY["EPSG","4326"]]', None),
        (None, None),
    ],
)
def test_the_reference_system_goes_in_by_its_own_name_or_not_as_a_map(crs, name, tmp_path):
    model = written(complete_plan(crs=crs), tmp_path)
    systems = model.by_type("IfcProjectedCRS")
    assert [(system.Name, system.Description) for system in systems] == ([] if name is None else [(name, crs)])
    assert about(model.by_type("IfcProject")[0])["CRS"] == (crs or "none")
    # with a map or without, the coordinates are those of the scans, and each number in the file is small
    result = evaluate(tmp_path / "plan.ifc", complete_plan(crs=crs))
    assert result.pooled().recall == pytest.approx(1.0)
    assert result.pooled().distance_error == pytest.approx(0.0, abs=1e-6)
    (site,) = model.by_type("IfcSite")
    far = ifcopenshell.util.placement.get_local_placement(site.ObjectPlacement)[:2, 3].tolist()
    assert far == ([0.0, 0.0] if name is not None else [500_000.0, 5_400_000.0])
    points = [p.Coordinates for p in model.by_type("IfcCartesianPoint")]
    assert [p for p in points if max(map(abs, p)) > 1000] == (
        [] if name is not None else [(500_000.0, 5_400_000.0, 0.0)]
    )


def test_coordinates_near_the_origin_are_those_of_the_plan(model):
    np.testing.assert_allclose(solid(named(model, "IfcWall", "S0-W1"))[1][:2], [3.95, 0.0], atol=1e-6)
    assert not model.by_type("IfcMapConversion")


# --- the evaluation's own reader ---


def test_the_model_scores_as_the_plan_does(tmp_path):
    plan = complete_plan()
    (path,) = export(plan, tmp_path / "plan.ifc")
    result = evaluate(path, plan)
    totals = result.pooled("all")
    assert totals.recall == pytest.approx(1.0, abs=1e-6)
    # beyond the plan's faces the model has the reveals of the door, two of 0.1 m on each storey, and no unseen side
    faces = sum(face.length for face in plan.wall_faces)
    assert totals.precision == pytest.approx(faces / (faces + 4 * 0.1), abs=1e-4)
    assert totals.distance_error == pytest.approx(0.0, abs=1e-6)
    assert totals.matched_ends[0] == 2 * 20


def test_a_doorway_without_a_leaf_is_read_as_a_door(tmp_path):
    storey = complete_plan(0.0, 0.0, None).storeys[0]
    cased = replace(storey.doors[0], state="cased", hinge=None, swing=None)
    door = replace(storey.doors[0], start=(4.0, 3.5), end=(4.0, 4.4), id="S0-D2")
    plan = FloorPlan((replace(storey, doors=(cased, door)),))
    model = written(plan, tmp_path)
    assert [made.Name for made in model.by_type("IfcDoor")] == ["S0-D2"]
    (read,) = read_drawing(tmp_path / "plan.ifc").storeys
    assert sorted(door.width for door in read.doors) == pytest.approx([0.9, 0.9])
