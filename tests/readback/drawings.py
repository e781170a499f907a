"""Drawings: DXF by ezdxf and GDAL, PDF by pypdf and PDFium, SVG by an XML parser, PNG by Pillow."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import ezdxf
import ezdxf.path
import numpy as np
import pyogrio.raw
import pypdf
import pypdfium2
import pytest
import shapely
from PIL import Image

from asbuilt import FloorPlan, Storey
from asbuilt.export.drawing import make_drawing
from asbuilt.export.sheet import SHEETS, SheetOptions

MM = 0.001
POINT = 25.4 / 72  # mm
WALL_COLOUR = (0xD6, 0x00, 0x4F)
SVG = "{http://www.w3.org/2000/svg}"


def openings_of(storey: Storey) -> tuple[Any, ...]:
    return (*storey.doors, *storey.windows, *storey.unknown_openings)


def check_dxf(plan: FloorPlan, written: tuple[Path, ...]) -> None:
    (path,) = written
    document = ezdxf.readfile(path)
    auditor = document.audit()
    assert auditor.errors + auditor.fixes == []
    space = document.modelspace()
    about, _, _, columns = pyogrio.raw.read(path, columns=["Layer"], read_geometry=False)
    layers = columns[list(about["fields"]).index("Layer")]
    for storey in plan:
        suffix = f"-S{storey.index}"
        faces = [(line.dxf.start.vec2, line.dxf.end.vec2) for line in space.query(f'*[layer=="A-WALL{suffix}"]')]
        assert faces == [(face.start, face.end) for face in storey.wall_faces]
        assert (layers == f"A-WALL{suffix}").sum() == len(faces)  # as GDAL, hence QGIS, reads it
        rings = [list(ring.vertices()) for ring in space.query(f'LWPOLYLINE[layer=="A-AREA{suffix}"]')]
        assert rings == [list(ring) for room in storey.rooms for ring in (room.ring, *room.holes)]
        tags = space.query(f'INSERT[layer=="A-AREA-IDEN{suffix}"]')
        for tag, room in zip(tags, storey.rooms, strict=True):
            told = {attribute.dxf.tag: attribute.dxf.text for attribute in tag.attribs}
            assert told.get("NUMBER", "") == room.number
            assert abs(float(told["AREA"].removesuffix(" m2")) - room.area) < 0.0051
            assert shapely.Polygon(room.ring, room.holes).contains(shapely.Point(tag.dxf.insert.vec2))
        swings = [round(arc.dxf.radius, 6) for arc in space.query(f'ARC[layer=="A-DOOR-SWNG{suffix}"]')]
        leaves = [door for door in storey.doors if door.swing and door.hinge and door.state in ("open", "shut")]
        assert swings == [round(door.width, 6) for door in leaves]
        for kind, found in (("DOOR", storey.doors), ("GLAZ", storey.windows), ("OPNG", storey.unknown_openings)):
            ink = _ink(space.query(f'LINE LWPOLYLINE ARC[layer ? "A-{kind}.*{suffix}"]'))
            assert [o.id for o in found if not _is_drawn(o, ink)] == []
        drawn = space.query(f'CIRCLE LWPOLYLINE[layer=="A-COLS{suffix}"]')
        assert len(drawn) == len(storey.columns)
        stations = [end for line in (*storey.wall_faces, *openings_of(storey)) for end in (line.start, line.end)]
        for dimension in space.query(f'DIMENSION[layer=="A-ANNO-DIMS{suffix}"]'):
            _check_dimension(document, dimension, np.array(stations))


def _ink(entities: Iterable[Any]) -> Any:
    lines = [shapely.LineString([p.vec2 for p in ezdxf.path.make_path(e).flattening(MM / 10)]) for e in entities]
    return shapely.union_all(lines)


def _is_drawn(opening: Any, ink: Any) -> bool:
    """Whether there is ink at both ends of an opening, or beside them across it: jambs lie within the wall as drawn."""
    ends = np.array([opening.start, opening.end])
    across = (ends[1] - ends[0])[::-1] * (-0.3, 0.3) / opening.width
    jambs = [shapely.LineString([end - across, end + across]).buffer(MM) for end in ends]
    seen = [ink.intersection(jamb).length > 20 * MM for jamb in jambs]
    return all(seen) or bool((shapely.distance(ink, shapely.points(ends)) < MM).all())


def _check_dimension(document: Any, dimension: Any, stations: Any) -> None:
    """Its number is the distance that it measures, and it measures between ends of faces and jambs."""
    measured = dimension.get_measurement()
    texts = [text.plain_text() for text in document.blocks.get(dimension.dxf.geometry).query("MTEXT")]
    assert texts == [f"{measured:.2f}"]
    angle = np.radians(dimension.dxf.angle)
    along = np.array([np.cos(angle), np.sin(angle)])
    for end in (dimension.dxf.defpoint2, dimension.dxf.defpoint3):
        assert np.abs((stations - end.vec2) @ along).min() < 0.025  # those within 2 cm of each other are one


def check_svg(plan: FloorPlan, written: tuple[Path, ...]) -> None:
    for storey, path in zip(plan, written, strict=True):
        root = ET.parse(path).getroot()
        told = next(element.text for element in root.iter() if element.tag.endswith("description"))
        x0, unit, y0 = map(float, re.search(r"x = (\S+) \+ (\S+) u, y = (\S+) - \S+ v", told).groups())
        groups = {element.attrib["id"]: element for element in root.iter(f"{SVG}g") if "id" in element.attrib}
        ids = {element.attrib.get("id") for element in groups[f"A-WALL-S{storey.index}"]}
        assert ids == {face.id for face in storey.wall_faces}
        for face in storey.wall_faces:
            numbers = map(float, re.findall(r"-?[\d.]+", next(groups[face.id].iter(f"{SVG}path")).attrib["d"]))
            ends = np.array(list(numbers)).reshape(2, 2) * (unit, -unit) + (x0, y0)
            np.testing.assert_allclose(ends, [face.start, face.end], atol=MM)
        others = (*openings_of(storey), *storey.columns, *storey.stairs, *storey.rooms)
        assert {element.id for element in others if element.id} <= groups.keys()
        width, height = map(float, root.attrib["viewBox"].split()[2:])
        for u, v in re.findall(r"[ML] (-?[\d.]+) (-?[\d.]+)", ET.tostring(root, encoding="unicode")):
            assert -1 <= float(u) <= width + 1
            assert -1 <= float(v) <= height + 1
        texts = {text.text for text in root.iter(f"{SVG}text")}
        assert {said for room in storey.rooms for said in (room.number, f"{room.area:.2f} m²")} <= texts


def check_pdf(plan: FloorPlan, written: tuple[Path, ...]) -> None:
    (path,) = written
    drawing = make_drawing(plan, SheetOptions())
    mm = drawing.sheet.metre / 1000  # of paper to the millimetre of building
    document = pypdfium2.PdfDocument(path)
    for storey, page, shown in zip(plan, pypdf.PdfReader(path).pages, document, strict=True):
        size = sorted((float(page.mediabox.width) * POINT, float(page.mediabox.height) * POINT), reverse=True)
        assert any(np.allclose(size, known, atol=0.1) for known in SHEETS.values())
        text = page.extract_text()
        assert f"1:{drawing.sheet.scale:g}" in text
        assert text.count(" m²") == len(storey.rooms) + bool(storey.rooms)  # and that of all of them
        for room in storey.rooms:
            assert room.number in text
            assert f"{room.area:.2f} m²" in text
        paths = shown.get_objects(filter=[pypdfium2.raw.FPDF_PAGEOBJ_PATH])
        boxes = np.array([np.array(path.get_bounds()).reshape(2, 2) * POINT for path in paths])
        middles, sizes = boxes.mean(axis=1), np.ptp(boxes, axis=1)
        for face in storey.wall_faces:
            ends = np.array([drawing.page(face.start), drawing.page(face.end)])
            pens = sizes - np.ptp(ends, axis=0)  # a box goes round the ink
            like = (pens[:, 0] > 0) & (pens[:, 0] < 1.0) & (np.abs(np.diff(pens)[:, 0]) < 2 * mm)
            assert (np.abs(middles[like] - ends.mean(axis=0)) < mm).all(axis=1).any(), face.id


def check_png(plan: FloorPlan, written: tuple[Path, ...]) -> None:
    """Every face is seen in its place, which the outermost of the walls' colour tells: a pixel is some centimetres."""
    for storey, path in zip(plan, written, strict=True):
        with Image.open(path) as image:
            pixels = np.asarray(image.convert("RGB")).astype(int)
        assert max(pixels.shape) == pytest.approx(1800, abs=100)
        ends = np.array([(face.start, face.end) for face in storey.wall_faces]).reshape(-1, 2, 2)
        held = np.concatenate([ends.reshape(-1, 2), *(np.reshape(wall.outline, (-1, 2)) for wall in storey.walls)])
        rows, columns = np.nonzero(np.abs(pixels - WALL_COLOUR).max(axis=2) < 60)
        scales = np.array([np.ptp(columns), -np.ptp(rows)]) / np.ptp(held, axis=0)
        assert abs(scales[0] / scales[1] + 1) < 0.01
        ink = shapely.points(*np.nonzero(np.ptp(pixels, axis=2) > 60)[::-1])  # doors and windows cover faces
        steps = np.linspace(0.1, 0.9, 9)[:, None]
        places = (ends[:, None, 0] + steps * (ends[:, 1] - ends[:, 0])[:, None]).reshape(-1, 2)
        u, v = ((places - held.min(axis=0)) * scales + (columns.min(), rows.max())).T
        near = shapely.STRtree(ink).query(shapely.points(u, v), predicate="dwithin", distance=3.0)[0]
        assert len(np.unique(near)) == len(places)
