"""Labelled clouds: LAS and LAZ by laspy, E57 by libE57 (pye57)."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pye57
import shapely
from numpy.typing import NDArray
from pye57 import libe57

from asbuilt import FloorPlan, Storey
from asbuilt.label import PointClass

Array = NDArray[np.float64]
NEAR = 0.02
MOST = 30_000
"""Points of a cloud that are compared with the plan: each n-th."""


@dataclasses.dataclass
class Scan:
    """A scan as libE57 reads it: what its header says, and all fields of its points, ours too."""

    name: str
    guid: str
    rotation: np.ndarray
    translation: np.ndarray
    fields: dict[str, np.ndarray]

    @property
    def xyz(self) -> Array:
        """Coordinates (n, 3) in the frame of the file."""
        w, x, y, z = self.rotation
        turn = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        own: Array = np.column_stack([self.fields[f"cartesian{axis}"] for axis in "XYZ"])
        return own @ turn.T + self.translation


def read_e57(path: Path) -> list[Scan]:
    scans = []
    with pye57.E57(str(path)) as source:
        for i in range(source.scan_count):
            header = source.get_header(i)
            buffers, fields = libe57.VectorSourceDestBuffer(), {}
            for name in header.point_fields:
                fields[name] = np.zeros(header.point_count)
                to = (source.image_file, name, fields[name], header.point_count, True, True)
                buffers.append(libe57.SourceDestBuffer(*to))
            header.points.reader(buffers).read()
            about = header["name"].value(), header["guid"].value(), header.rotation, header.translation
            scans.append(Scan(*about, fields))
    return scans


@dataclasses.dataclass(frozen=True)
class Labelled:
    """The points (n, 3) of a cloud with what they were told to be, and the ids of walls and rooms."""

    xyz: Array
    classes: NDArray[np.integer[Any]]
    walls: NDArray[np.integer[Any]]
    rooms: NDArray[np.integer[Any]]
    names: dict[str, list[str]]


def positions(path: Path) -> Array:
    """The points (n, 3) of a file in their order."""
    if path.suffix == ".e57":
        return np.concatenate([scan.xyz for scan in read_e57(path)])
    return np.asarray(laspy.read(path).xyz)


def labelled(path: Path) -> Labelled:
    """A labelled cloud as others read it."""
    if path.suffix == ".e57":
        scans = read_e57(path)
        labels = [
            np.concatenate([scan.fields[f"asbuilt:{name}"] for scan in scans]).astype(int)
            for name in ("class", "wall", "room")
        ]
        with pye57.E57(str(path)) as source:
            names = json.loads(source.root["asbuilt:names"].value())
        return Labelled(np.concatenate([scan.xyz for scan in scans]), *labels, names)
    las = laspy.read(path)
    pieces = sorted((vlr.record_id, vlr.record_data) for vlr in las.header.vlrs if vlr.user_id == "asbuilt")
    names = json.loads(b"".join(data for _, data in pieces))
    labels = [np.asarray(las[name]).astype(int) for name in ("classification", "wall", "room")]
    return Labelled(np.asarray(las.xyz), *labels, names)


def check_cloud(plan: FloorPlan, scans: Path, written: Path, counts: dict[PointClass, int]) -> None:
    """All points are there, where they were, and told as the plan says."""
    cloud, before = labelled(written), positions(scans)
    assert cloud.xyz.shape == before.shape
    # what was no integer is written to a tenth of a millimetre
    np.testing.assert_allclose(cloud.xyz, before, atol=0.00006 if scans.suffix != written.suffix else 1e-9, rtol=0)
    assert counts == {kind: int((cloud.classes == kind).sum()) for kind in PointClass}
    assert cloud.names["wall"][: len(plan.storeys[0].walls)] == [wall.id for wall in plan.storeys[0].walls]
    every = slice(None, None, max(len(before) // MOST, 1))
    cloud = Labelled(cloud.xyz[every], cloud.classes[every], cloud.walls[every], cloud.rooms[every], cloud.names)
    for storey in plan:
        within = (cloud.xyz[:, 2] > storey.floor + 0.3) & (cloud.xyz[:, 2] < storey.ceiling - 0.3)
        _check_walls(storey, Labelled(*(values[within] for values in _columns(cloud)), cloud.names))
    _check_rooms(plan, cloud)


def _columns(cloud: Labelled) -> tuple[Any, ...]:
    return cloud.xyz, cloud.classes, cloud.walls, cloud.rooms


def _check_walls(storey: Storey, cloud: Labelled) -> None:
    """Between floor and ceiling: walls are where the faces are, and what is on a face is wall."""
    points = shapely.points(cloud.xyz[:, :2])
    faces = shapely.STRtree([shapely.LineString([face.start, face.end]) for face in storey.wall_faces])
    near = np.zeros(len(points), dtype=bool)
    near[faces.query(points, predicate="dwithin", distance=NEAR)[0]] = True
    is_wall = cloud.classes == PointClass.WALL
    # shelves and skirting boards stand in front of some; and a camera's scan wobbles by centimetres
    wobbles = bool(np.median([face.rms or 0.0 for face in storey.wall_faces]) > 0.01)
    assert near[is_wall].mean() > (0.5 if wobbles else 0.8)
    openings = [
        shapely.LineString([o.start, o.end]) for o in (*storey.doors, *storey.windows, *storey.unknown_openings)
    ]
    ways = shapely.STRtree([line.buffer(0.4, cap_style="square") for line in openings])
    others = (*storey.columns, *storey.stairs)
    bodies = shapely.STRtree([shapely.Polygon(other.ring).buffer(0.1) for other in others])
    near[ways.query(points, predicate="within")[0]] = False
    near[bodies.query(points, predicate="within")[0]] = False
    if all(wall.height is None for wall in storey.walls):  # else some end below
        assert is_wall[near].mean() > (0.9 if wobbles else 0.95)


def _check_rooms(plan: FloorPlan, cloud: Labelled) -> None:
    """What is told to be in a room is within its walls; its floor is at its height."""
    rooms = {room.id: (room, storey) for storey in plan for room in storey.rooms}
    for number, name in enumerate(cloud.names["room"], 1):
        room, storey = rooms[name]
        own = cloud.rooms == number
        area = shapely.Polygon(room.ring, room.holes).buffer(0.03)
        assert shapely.contains_xy(area, cloud.xyz[own, :2]).all()
        floor = cloud.xyz[own & (cloud.classes == PointClass.FLOOR), 2]
        assert np.abs(floor - (storey.floor if room.floor is None else room.floor)).max(initial=0.0) < 0.06
