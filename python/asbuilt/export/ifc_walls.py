"""Walls of an IFC model. The pieces of a curved wall become one IfcWall, for a door may reach over several of them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import shapely

from asbuilt.export.ifc_file import Frame, Placed, Property
from asbuilt.export.ifc_level import Level, area_in
from asbuilt.plan import Wall


@dataclass(frozen=True)
class Host:
    """A wall that openings are in: its entity, the piece that an opening names, all pieces, and its height (m)."""

    made: Placed
    piece: Wall
    pieces: tuple[Wall, ...]
    height: float

    def body(self, frame: Frame) -> Any:
        """What the wall stands on, as a polygon in `frame`."""
        return _body(self.pieces, frame)


def add_walls(level: Level) -> dict[str, Host]:
    """Add the walls of a storey, or its wall faces where the plan has these alone; the walls by their pieces' ids."""
    hosts = {}
    for pieces in _walls(level.storey.walls):
        wall = _joined(pieces)
        made = _add_wall(level, wall, pieces)
        hosts.update({piece.id: Host(made, piece, pieces, _height(level, wall)) for piece in pieces if piece.id})
    _add_faces(level)
    return hosts


def _walls(walls: tuple[Wall, ...]) -> Iterator[tuple[Wall, ...]]:
    """Each straight wall alone, the pieces of each curved one together, in the plan's order."""
    curves: dict[int, list[Wall]] = {}
    for wall in walls:
        if wall.curve is not None:
            curves.setdefault(wall.curve, []).append(wall)
    for wall in walls:
        if wall.curve is None:
            yield (wall,)
        elif wall is curves[wall.curve][0]:
            yield tuple(curves[wall.curve])


def _add_wall(level: Level, wall: Wall, pieces: tuple[Wall, ...]) -> Placed:
    model = level.model
    frame = Frame.between(wall.start, pieces[0].end, level.floor)
    axis = [frame.local(point) for piece in pieces for point in (piece.start, piece.end)]
    shape = model.shapes(
        model.lines("Axis", axis),
        model.prism(_body(pieces, frame), _height(level, wall)),
    )
    properties: list[Property] = [
        ("ThicknessObserved", "IfcBoolean", wall.thickness is not None),
        ("Thickness", "IfcLengthMeasure", wall.thickness),
        ("DrawnThickness", "IfcLengthMeasure", wall.drawn_thickness),
        ("SeenSide", "IfcLabel", _seen_side(level, pieces) if wall.thickness is None else None),
        ("Faces", "IfcText", ", ".join(wall.faces) or None),
        ("Pieces", "IfcText", ", ".join(piece.id for piece in pieces) if len(pieces) > 1 else None),
    ]
    layer = "A-WALL-UNSN" if wall.thickness is None else "A-WALL"
    made = level.add("IfcWall", wall, frame, shape, layer, properties, Tag=wall.id, PredefinedType="STANDARD")
    level.contents.append(made.entity)
    length = sum(piece.length for piece in pieces)
    model.measure(
        made.entity, "Qto_WallBaseQuantities", Length=length, Height=_height(level, wall), Width=wall.thickness
    )
    if wall.thickness is not None:
        model.layer(made.entity, wall.thickness)
    return made


def _joined(pieces: tuple[Wall, ...]) -> Wall:
    """One wall for the pieces of a curved one: what they have by the metre is averaged, what limits them is not."""
    if len(pieces) == 1:
        return pieces[0]
    total = sum(piece.length for piece in pieces) or 1.0

    def mean(values: list[float] | None) -> float | None:
        if values is None:
            return None
        return sum(value * piece.length for value, piece in zip(values, pieces, strict=True)) / total

    def known(name: str) -> list[float] | None:
        values = [getattr(piece, name) for piece in pieces]
        return None if None in values else values

    squares = [rms**2 for rms in known("rms") or ()]
    sigmas, heights, confidences = known("sigma"), known("height"), known("confidence")
    return Wall(
        pieces[0].start,
        pieces[-1].end,
        mean(known("thickness")),
        mean(known("drawn_thickness")) or 0.0,
        tuple(dict.fromkeys(face for piece in pieces for face in piece.faces)),
        height=max(heights) if heights else None,
        curve=pieces[0].curve,
        id=pieces[0].id,
        seen=mean(known("seen")),
        rms=math.sqrt(mean(squares) or 0.0) if squares else None,
        voxels=sum(piece.voxels for piece in pieces),
        sigma=max(sigmas) if sigmas else None,
        confidence=min(confidences) if confidences else None,
    )


def _add_faces(level: Level) -> None:
    """The wall faces as lines on the floor where the plan has no walls, as those of the paper's preset."""
    if level.storey.walls or not level.storey.wall_faces:
        return
    faces = [
        [level.placed.frame.local(face.start), level.placed.frame.local(face.end)] for face in level.storey.wall_faces
    ]
    name = f"S{level.storey.index} wall faces"
    shape = level.model.shapes(level.model.lines("FootPrint", *faces))
    level.draw_on("A-WALL", shape)
    made = level.model.product("IfcAnnotation", name, level.placed.frame, level.placed, Name=name, Representation=shape)
    level.contents.append(made.entity)


def _seen_side(level: Level, pieces: tuple[Wall, ...]) -> str | None:
    """LEFT or RIGHT of the axis, on which all of the wall's faces are; None where they are on both, or not known."""
    left = set()
    for piece in pieces:
        frame = Frame.between(piece.start, piece.end, 0.0)
        for face in (level.faces[name] for name in piece.faces if name in level.faces):
            left.add(frame.local(face.start)[1] + frame.local(face.end)[1] > 0)
    return None if len(left) != 1 else "LEFT" if left.pop() else "RIGHT"


def _height(level: Level, wall: Wall) -> float:
    return level.height if wall.height is None else wall.height


def _body(pieces: tuple[Wall, ...], frame: Frame) -> Any:
    """What the pieces stand on, as a polygon in `frame`; several where they do not touch."""
    areas = [area_in(frame, piece.outline) for piece in pieces]
    return areas[0] if len(areas) == 1 else shapely.union_all(areas, grid_size=1e-6)
