"""DXF, SVG and PDF show the same drawing; each is read back by a program that is not ours."""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import ezdxf
import numpy as np
import pypdf
import pypdfium2
import pytest
import shapely

from asbuilt import FloorPlan, Storey, WallFace
from asbuilt.errors import ParameterError
from asbuilt.export import export
from asbuilt.export.labels import room_tags
from asbuilt.export.symbols import storey_marks
from asbuilt.plan import Column, Door, Room, Stair, Wall
from plans import complete_plan
from readback.ink import collisions

SVG = "{http://www.w3.org/2000/svg}"
POINT = 25.4 / 72  # mm


def one_storey(plan: FloorPlan, **changes: object) -> FloorPlan:
    return dataclasses.replace(plan, storeys=(dataclasses.replace(plan.storeys[0], **changes),))


def row_of_rooms(count: int, turn: float = 0.0) -> FloorPlan:
    """Rooms of 4 x 5 m in a row, 0.1 m between them, turned about the origin."""
    cos, sin = math.cos(turn), math.sin(turn)

    def ring(x0: float, y0: float, x1: float, y1: float) -> tuple[tuple[float, float], ...]:
        corners = ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
        return tuple((x * cos - y * sin, x * sin + y * cos) for x, y in corners)

    rooms = tuple(Room(ring(4.1 * i, 0, 4.1 * i + 4, 5), number=f"{i + 1}", id=f"R{i}") for i in range(count))
    faces, walls = [], []
    for i, room in enumerate(rooms):
        ends = zip(room.ring, room.ring[1:] + room.ring[:1], strict=True)
        faces += [WallFace(a, b, id=f"F{i}.{j}", sigma=0.002) for j, (a, b) in enumerate(ends)]
        sides = [(4.1 * i, -0.1, 4.1 * i + 4, 0.0, (0,), None), (4.1 * i, 5.0, 4.1 * i + 4, 5.1, (2,), None)]
        if i + 1 < count:
            sides.append((4.1 * i + 4, 0.0, 4.1 * i + 4.1, 5.0, (1,), 0.1))
        for x0, y0, x1, y1, own, thickness in sides:
            outline = ring(x0, y0, x1, y1)
            start, end = (
                ((x0, (y0 + y1) / 2), (x1, (y0 + y1) / 2))
                if y1 - y0 < 1
                else (((x0 + x1) / 2, y0), ((x0 + x1) / 2, y1))
            )
            start, end = ((x * cos - y * sin, x * sin + y * cos) for x, y in (start, end))
            walls.append(
                Wall(start, end, thickness, 0.1, tuple(f"F{i}.{j}" for j in own), outline, id=f"W{len(walls)}")
            )
    return FloorPlan((Storey(0, 0.0, 2.5, None, tuple(faces), tuple(walls), rooms=rooms),))


# SVG


def test_svg_is_to_scale_and_its_description_leads_back_to_the_world(tmp_path):
    plan = complete_plan()
    lower, upper = export(plan, tmp_path / "plan.svg", scale=50)
    assert [lower.name, upper.name] == ["plan_s0.svg", "plan_s1.svg"]
    root = ET.parse(lower).getroot()
    width, height = (float(root.attrib[key].removesuffix("pt")) for key in ("width", "height"))
    assert root.attrib["viewBox"] == f"0 0 {width} {height}"
    face = root.find(f".//{SVG}g[@id='A-WALL-S0']/{SVG}g[@id='S0-F1']//{SVG}path")
    u1, v1, u2, _v2 = map(float, re.findall(r"[\d.]+", face.attrib["d"]))
    assert (u2 - u1) * POINT == pytest.approx(3.95 * 20, abs=1e-3)  # 1:50 is 20 mm to the metre
    assert 0 < u1 < width
    assert 0 < v1 < height
    told = next(element.text for element in root.iter() if element.tag.endswith("description"))
    x0, unit, y0 = map(float, re.search(r"x = (\S+) \+ (\S+) u, y = (\S+) - \S+ v", told).groups())
    np.testing.assert_allclose([x0 + unit * u1, y0 - unit * v1], plan.wall_faces[0].start, atol=1e-6)


def test_svg_ids_are_those_of_the_plan_and_stand_once(tmp_path):
    lower, _ = export(complete_plan(), tmp_path / "plan.svg")
    ids = [element.attrib["id"] for element in ET.parse(lower).iter() if "id" in element.attrib]
    assert len(ids) == len(set(ids))
    assert {"A-WALL-S0", "A-DOOR-S0", "S0-D1", "S0-G1", "S0-U1", "S0-R2", "S0-C1", "S0-T1"} <= set(ids)


def test_svg_keeps_text_as_text(tmp_path):
    lower, _ = export(complete_plan(), tmp_path / "plan.svg")
    texts = {element.text for element in ET.parse(lower).iter(f"{SVG}text")}
    assert {"001", "19.75 m²", "h 2.50 m", "3.95", "0.10", "Source: scan.e57", "y of the input"} <= texts


def test_svg_of_two_storeys_lie_over_each_other(tmp_path):
    lower, upper = (ET.parse(path).getroot() for path in export(complete_plan(), tmp_path / "plan.svg"))
    assert lower.attrib["viewBox"] == upper.attrib["viewBox"]
    first, second = (
        root.find(f".//{SVG}g[@id='S{i}-F1']//{SVG}path").attrib["d"] for i, root in enumerate((lower, upper))
    )
    assert first == second


# PDF


def page_sizes(path: Path) -> list[tuple[int, int]]:
    boxes = [page.mediabox for page in pypdf.PdfReader(path).pages]
    return [(round(float(box.width) * POINT), round(float(box.height) * POINT)) for box in boxes]


def test_pdf_has_a_page_a_storey_of_the_sheet_with_text(tmp_path):
    (path,) = export(complete_plan(), tmp_path / "plan.pdf", scale="1:50", sheet="A2", north=45.0)
    assert page_sizes(path) == [(594, 420), (594, 420)]
    for index, page in enumerate(pypdf.PdfReader(path).pages):
        text = page.extract_text()
        for expected in (f"Storey {index}", f"{index}01", "19.75 m²", "1:50", "A2", "Source: scan.e57", "8.00"):
            assert expected in text
    assert "CreationDate" not in str(pypdf.PdfReader(path).metadata)


def test_pdf_is_to_scale(tmp_path):
    """Rendered at 1 px to 0.1 mm, the only long vertical lines of the drawing area are 8 m and walls apart."""
    plan = one_storey(
        complete_plan(), walls=(), doors=(), windows=(), unknown_openings=(), rooms=(), stairs=(), columns=()
    )
    (path,) = export(plan, tmp_path / "plan.pdf", scale=50, sheet="A3")
    page = pypdfium2.PdfDocument(path)[0]
    image = np.asarray(page.render(scale=10 * POINT).to_pil().convert("L"))
    ink = image[:2500, 200:4000] < 120  # without frame and title block
    columns = np.flatnonzero(ink.sum(axis=0) > 800)
    assert columns[-1] - columns[0] == pytest.approx(8.0 * 20 * 10, abs=8)


def test_pdf_chooses_the_smallest_sheet_at_1_to_100_and_then_the_scale(tmp_path):
    cases = {1: ((297, 210), "1:100"), 8: ((420, 297), "1:100"), 60: ((594, 420), "1:500")}
    for count, (size, scale) in cases.items():
        (path,) = export(row_of_rooms(count), tmp_path / "plan.pdf")
        text = pypdf.PdfReader(path).pages[0].extract_text()
        if count < 60:
            assert page_sizes(path) == [size]
            assert scale in text
        else:  # 246 m: longer than A0 at 1:200
            assert page_sizes(path)[0][0] <= 1189
            assert "1:250" in text


@pytest.mark.parametrize("suffix", [".pdf", ".svg", ".dxf"])
def test_what_does_not_fit_is_one_line_that_says_what_would(suffix, tmp_path):
    with pytest.raises(ParameterError) as caught:
        export(row_of_rooms(8), tmp_path / f"plan{suffix}", scale="1:50", sheet="A4")
    message = str(caught.value)
    assert "\n" not in message
    assert re.search(r"too much for sheet A4; what fits: scale 1:200 or sheet A1$", message)
    assert list(tmp_path.iterdir()) == []
    export(row_of_rooms(8), tmp_path / f"plan{suffix}", scale="1:200", sheet="A4")
    export(row_of_rooms(8), tmp_path / f"plan{suffix}", scale="1:50", sheet="A1")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scale": 0}, "scale is 0"),
        ({"scale": -1}, "scale is -1"),
        ({"scale": float("nan")}, "scale is nan"),
        ({"scale": "2:1"}, "scale is 2:1"),
        ({"sheet": "A9"}, "sheet is 'A9', expected A4"),
        ({"sheet": "10x10"}, "sheet is 10x10, expected WIDTHxHEIGHT"),
        ({"north": float("inf")}, "north is inf"),
    ],
)
@pytest.mark.parametrize("suffix", [".pdf", ".svg", ".dxf"])
def test_options_that_mean_nothing_are_told(options, message, suffix, tmp_path):
    with pytest.raises(ParameterError, match=message):
        export(complete_plan(), tmp_path / f"plan{suffix}", **options)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", [".pdf", ".svg", ".dxf", ".png"])
@pytest.mark.parametrize(
    "plan",
    [
        FloorPlan(),
        FloorPlan((Storey(0, 0.0, 2.5),)),
        FloorPlan((Storey(0, 0.0, 2.5, None, (WallFace((0.0, 0.0), (3.0, 0.0)),)),)),
        FloorPlan((Storey(0, 0.0, 2.5, doors=(Door((0.0, 0.0), (1.0, 0.0)), Door((0.0, 0.0), (0.0, 0.0)))),)),
        FloorPlan((Storey(0, 0.0, 2.5, None, (WallFace((1.0, 1.0), (1.0, 1.0)),)),)),
        row_of_rooms(60, turn=0.3),
    ],
    ids=["none", "empty", "one face", "doors alone", "a face of no length", "60 rooms"],
)
def test_any_plan_can_be_drawn(plan, suffix, tmp_path):
    (path,) = export(plan, tmp_path / f"plan{suffix}")
    if suffix == ".dxf":
        auditor = ezdxf.readfile(path).audit()
        assert not auditor.errors + auditor.fixes
    if suffix == ".pdf":
        text = pypdf.PdfReader(path).pages[0].extract_text()
        assert ("No storey found" in text) == (not plan.storeys)


def test_room_tags_lie_in_their_rooms_clear_of_each_other(tmp_path):
    from shapely import Polygon, box

    from asbuilt.export.marks import tag_height, text_width

    plan = row_of_rooms(60)
    (storey,) = plan.storeys
    for metre in (20.0, 10.0, 5.0):
        for room, tag in zip(storey.rooms, room_tags(storey, metre), strict=True):
            width = max(text_width(line.text, line.height) for line in tag.lines) / metre
            height = tag_height(tag.lines) / metre
            across, up = (width, height) if tag.rotation == 0 else (height, width)
            x, y = tag.at
            assert Polygon(room.ring).contains(box(x - across / 2, y - up / 2, x + across / 2, y + up / 2))


def test_a_room_tag_finds_a_place_in_a_room_that_touches_itself_when_moved():
    """Two halls and a passage as wide as the tag: what they have in common with themselves, moved, has lines in it."""
    hall, passage = 3.0, 1.0
    ring = (
        *((0.0, 0.0), (hall, 0.0), (hall, 1.0), (hall + passage, 1.0), (hall + passage, 0.0)),
        *((2 * hall + passage, 0.0), (2 * hall + passage, hall), (hall + passage, hall), (hall + passage, 2.0)),
        *((hall, 2.0), (hall, hall), (0.0, hall)),
    )
    for step in range(1, 200):  # halves of the tag's sides by all sizes
        (tag,) = room_tags(Storey(0, 0.0, 2.5, rooms=(Room(ring, number="1"),)), step / 4)
        assert shapely.Polygon(ring).contains(shapely.Point(tag.at))
    flat = Room(((1.0, 1.0), (2.0, 1.0), (3.0, 1.0)), number="2")  # without area
    (tag,) = room_tags(Storey(0, 0.0, 2.5, rooms=(flat,)), 10.0)
    assert tag.at == (1.0, 1.0)


def test_dimensions_of_a_row_of_rooms_add_up_and_do_not_run_into_each_other():
    from asbuilt.export.dimensions import dimension_text, dimensions
    from asbuilt.export.marks import DIMENSION_TEXT, text_width

    (storey,) = row_of_rooms(6, turn=0.2).storeys
    found = list(dimensions(storey, 10.0))
    lengths = [math.dist(dimension.start, dimension.end) for dimension in found]
    assert sum(abs(length - 24.5) < 1e-6 for length in lengths) == 2  # both long sides
    assert sum(abs(length - 4.0) < 1e-6 for length in lengths) == 12
    assert sum(abs(length - 0.1) < 1e-6 for length in lengths) == 10
    along = np.array([math.cos(0.2), math.sin(0.2)])
    rows: dict[tuple[float, int], list[tuple[float, float]]] = {}
    for dimension, length in zip(found, lengths, strict=True):
        row = round(float(np.dot(dimension.base, (-along[1], along[0]))), 3), dimension.level
        middle = float((np.array(dimension.start) + dimension.end) @ along) / 2 * 10
        half = text_width(dimension_text(length), DIMENSION_TEXT) / 2
        rows.setdefault(row, []).append((middle - half, middle + half))
    for spans in rows.values():
        spans.sort()
        assert all(right < left for (_, right), (left, _) in itertools.pairwise(spans))


def test_dimensions_stand_clear_of_a_door_that_opens_outwards():
    """Its leaf of 1.2 m reaches over the place of the first chain at 1:100, which is 0.9 m from the wall."""
    from asbuilt.export.dimensions import dimension_line, dimensions
    from asbuilt.export.symbols import swept

    plan = row_of_rooms(3)
    wall = next(wall for wall in plan.storeys[0].walls if wall.start[1] < 0)
    door = Door((1.0, -0.05), (2.2, -0.05), wall.id, state="open", hinge="start", swing="right", id="D")
    (storey,) = one_storey(plan, doors=(door,)).storeys
    (sweep,) = swept(storey)
    assert sweep.bounds == pytest.approx((1.0, -1.3, 2.2, -0.1), abs=1e-6)
    below = [mark for mark in dimensions(storey, 10.0) if mark.base[1] < 0]
    assert {round(math.dist(mark.start, mark.end), 3) for mark in below} >= {1.2, 12.2, 4.0}  # all three chains
    assert not any(shapely.LineString(dimension_line(mark)).intersects(sweep) for mark in below)
    assert collisions((*storey_marks(storey), *dimensions(storey, 10.0)), 10.0) == []


def test_a_room_tag_stands_beside_what_stands_in_the_room():
    """A partition through the middle, where the tag would be; a stair, a column and a swing at three of the corners."""
    room = Room(((0.0, 0.0), (6.0, 0.0), (6.0, 5.0), (0.0, 5.0)), number="1", floor=0.0, ceiling=2.5)
    outline = ((2.5, 2.4), (3.5, 2.4), (3.5, 2.6), (2.5, 2.6))
    partition = Wall((2.5, 2.5), (3.5, 2.5), 0.2, 0.2, (), outline, id="W")
    west = Wall((-0.2, 0.0), (-0.2, 5.0), 0.4, 0.4, (), ((-0.4, 0.0), (-0.4, 5.0), (0.0, 5.0), (0.0, 0.0)), id="V")
    storey = Storey(
        0,
        0.0,
        2.5,
        walls=(partition, west),
        doors=(Door((-0.2, 0.5), (-0.2, 2.0), "V", state="open", hinge="start", swing="right", id="D"),),
        rooms=(room,),
        columns=(Column((1.0, 4.0), 1.2, 1.2),),
        stairs=(Stair(((4.0, 3.0), (6.0, 3.0), (6.0, 5.0), (4.0, 5.0))),),
    )
    (tag,) = room_tags(storey, 10.0)
    assert len(tag.lines) == 3
    assert collisions((*storey_marks(storey), tag), 10.0) == []


@pytest.mark.parametrize("suffix", [".svg", ".pdf", ".png"])
def test_what_a_user_has_set_for_plots_changes_nothing(suffix, tmp_path):
    import matplotlib as mpl

    (usual,) = export(row_of_rooms(2), tmp_path / f"usual{suffix}")
    settings = {"font.size": 30, "svg.fonttype": "path", "pdf.fonttype": 3, "savefig.bbox": "tight", "savefig.dpi": 30}
    with mpl.rc_context(settings):
        (other,) = export(row_of_rooms(2), tmp_path / f"other{suffix}")
        assert mpl.rcParams["font.size"] == 30
    assert usual.read_bytes() == other.read_bytes()


def test_steps_of_a_turning_stair_lie_across_its_path_and_do_not_meet():
    from shapely import LineString

    from asbuilt.export import marks

    turns = np.linspace(0, 1.5 * math.pi, 40)
    path, outer, inner = ([(r * math.cos(t), r * math.sin(t)) for t in turns] for r in (0.8, 1.3, 0.3))
    stair = Stair(tuple(outer + inner[::-1]), tuple(path), 2.8)
    found = [mark for mark in storey_marks(Storey(0, 0.0, 2.5, stairs=(stair,))) if mark.layer is marks.STAIR]
    steps = [LineString(mark.points) for mark in found if getattr(mark, "points", ()) and len(mark.points) == 2]
    assert len(steps) == round(2.8 / 0.175) - 1
    assert all(a.distance(b) > 0.05 for a, b in itertools.combinations(steps, 2))
    for step in steps:
        (x1, y1), (x2, y2) = step.coords
        assert abs(x1 * y2 - x2 * y1) / step.length < 0.01  # it points at the middle
        assert step.length == pytest.approx(1.0, abs=0.02)


def test_steps_of_a_stair_that_turns_sharply_do_not_meet():
    path = ((0.0, 0.5), (2.0, 0.5), (2.0, 2.5), (0.5, 2.5))
    ring = ((0.0, 0.0), (2.5, 0.0), (2.5, 3.0), (0.5, 3.0), (0.5, 2.0), (1.5, 2.0), (1.5, 1.0), (0.0, 1.0))
    found = storey_marks(Storey(0, 0.0, 2.5, stairs=(Stair(ring, path, 2.8),)))
    steps = [shapely.LineString(mark.points) for mark in found if len(getattr(mark, "points", ())) == 2]
    assert len(steps) >= 10
    assert not any(a.intersects(b) for a, b in itertools.combinations(steps, 2))


def test_accuracy_is_told_by_the_length_of_the_wall_faces():
    from asbuilt.export.title_block import accuracy

    faces = [((0.0, 0.0), (6.0, 0.0), 0.002), ((0.0, 1.0), (3.0, 1.0), 0.006), ((0.0, 2.0), (1.0, 2.0), None)]
    storey = Storey(0, 0.0, 2.5, None, tuple(WallFace(a, b, sigma=sigma) for a, b, sigma in faces))
    assert accuracy(storey) == "LOA40 60 %, LOA30 30 %"
