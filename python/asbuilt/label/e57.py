"""Labelled clouds as E57 through libE57 (pye57): each scan apart, with its pose and all that its points carry.

The E57 standard knows no classes. As its way of adding to it is, ours are an extension with a prefix: `asbuilt:class`,
`asbuilt:wall` and `asbuilt:room` of each point, and `asbuilt:names` of the file, the ids that the numbers stand for.
Pictures are left out.
"""

from __future__ import annotations

import json
import uuid
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asbuilt import _core
from asbuilt.errors import InputError, MissingExtraError
from asbuilt.grid import FloatArray
from asbuilt.label.classes import PointClass
from asbuilt.label.lookup import PlanLookup
from asbuilt.read import InputFile, PointCloud

try:
    from pye57 import libe57
except ImportError as error:
    raise MissingExtraError("labelling E57 needs pye57: pip install 'asbuilt[label]'") from error

_CHUNK = 2**18  # points in memory at a time
_SCALE = 0.0001  # m, of the coordinates of other formats
_PREFIX, _URI = "asbuilt", "asbuilt:point-labels:1"
_CLASS, _WALL, _ROOM = _LABELS = tuple(f"{_PREFIX}:{name}" for name in ("class", "wall", "room"))
_Kind = libe57.NodeType


def write(cloud: PointCloud, lookup: PlanLookup, path: Path) -> Iterator[int]:
    """Write the points of `cloud` with their labels. Yields how many are done.

    Raises
    ------
    InputError : the points of a file are damaged.
    """
    done = 0
    image = libe57.ImageFile(str(path), "w")
    try:
        target = _Target(image, cloud, lookup)
        for file in cloud.files:
            of_e57 = file.header["format"].startswith("E57")
            for points in _copied(file, target) if of_e57 else _made(file, target):
                done += points
                yield done
        image.close()
    except libe57.E57Exception as error:
        raise OSError(_told(error)) from error
    finally:
        if image.isOpen():
            image.cancel()


@dataclass
class _Target:
    """The file to write, and by what its points are told."""

    image: Any
    cloud: PointCloud
    lookup: PlanLookup
    prefixes: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        root, cloud = self.image.root(), self.cloud
        self.extend("", libe57.E57_V1_0_URI)
        self.extend(_PREFIX, _URI)
        names = json.dumps({"wall": self.lookup.walls, "room": self.lookup.rooms}, ensure_ascii=False)
        # the same points and the same plan are the same file, and have the same GUID
        contents = json.dumps([[file.name, file.size, repr(file.header["scans"])] for file in cloud.files])
        guid = uuid.uuid5(uuid.NAMESPACE_URL, _URI + contents + names)
        texts = {"formatName": "ASTM E57 3D Imaging Data File", "guid": f"{{{guid}}}", "coordinateMetadata": cloud.crs}
        for name, text in {**texts, "e57LibraryVersion": libe57.E57_LIBRARY_ID, f"{_PREFIX}:names": names}.items():
            root.set(name, self.text(text or ""))
        root.set("versionMajor", libe57.IntegerNode(self.image, libe57.E57_FORMAT_MAJOR))
        root.set("versionMinor", libe57.IntegerNode(self.image, libe57.E57_FORMAT_MINOR))
        self.scans = libe57.VectorNode(self.image, True)
        root.set("data3D", self.scans)

    def extend(self, prefix: str, uri: str) -> None:
        if prefix not in self.prefixes:
            self.image.extensionsAdd(prefix, uri)
            self.prefixes.add(prefix)

    def text(self, text: str) -> Any:
        return libe57.StringNode(self.image, text)

    def add_labels(self, prototype: Any) -> None:
        for name, most in zip(_LABELS, (255, len(self.lookup.walls), len(self.lookup.rooms)), strict=True):
            prototype.set(name, libe57.IntegerNode(self.image, 0, 0, most))

    def add_scan(self, scan: Any, prototype: Any, buffers: _Buffers) -> Any:
        """Hang a scan into the file; gives the writer of its points."""
        points = libe57.CompressedVectorNode(self.image, prototype, libe57.VectorNode(self.image, True))
        scan.set("points", points)
        self.scans.append(scan)
        return points.writer(buffers.of(self.image))

    def label(self, arrays: dict[str, NDArray[Any]], count: int, places: FloatArray, valid: NDArray[np.bool_]) -> None:
        """Set the labels of the first `count` points; those that are no returns are outside."""
        labels = self.lookup.labels(*self.cloud.to_metres(*places[valid].T))
        for name, numbers in zip(_LABELS, (labels.classes, labels.walls, labels.rooms), strict=True):
            arrays[name][:count] = PointClass.OUTSIDE if name == _CLASS else 0
            arrays[name][:count][valid] = numbers


class _Buffers:
    """An array for each field of points, that libE57 fills from one file and empties into another.

    Scaled integers stay the integers that they are.
    """

    def __init__(self, prototype: Any) -> None:
        self.fields = {child.elementName(): child for child in _children(prototype)}
        self.arrays = {name: np.zeros(_CHUNK, _dtype(child)) for name, child in self.fields.items()}

    def of(self, image: Any) -> Any:
        buffers = libe57.VectorSourceDestBuffer()
        for name, array in self.arrays.items():
            if name in self.fields:
                buffers.append(libe57.SourceDestBuffer(image, name, array, _CHUNK, False, False))
        return buffers

    def values(self, name: str, count: int) -> FloatArray:
        """What the first `count` values of a field stand for."""
        values = self.arrays[name][:count].astype(np.float64)
        if self.fields[name].type() != _Kind.E57_SCALED_INTEGER:
            return values
        scaled = libe57.ScaledIntegerNode(self.fields[name])
        found: FloatArray = values * scaled.scale() + scaled.offset()
        return found

    def places(self, count: int) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Coordinates (count, 3) in the scan's own frame, and which of them are returns."""
        kind = "cartesian" if "cartesianX" in self.fields else "spherical"
        if kind == "cartesian":
            places = np.column_stack([self.values(f"cartesian{axis}", count) for axis in "XYZ"])
        else:
            away, azimuth, elevation = (
                self.values(f"spherical{name}", count) for name in ("Range", "Azimuth", "Elevation")
            )
            level = away * np.cos(elevation)
            places = np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), away * np.sin(elevation)])
        valid = np.isfinite(places).all(axis=1)
        if f"{kind}InvalidState" in self.fields:
            valid = valid & (self.arrays[f"{kind}InvalidState"][:count] == 0)
        return places, np.asarray(valid)


def _copied(file: InputFile, target: _Target) -> Iterator[int]:
    """The scans of an E57 file, with all that is in them; yields how many points each chunk has."""
    source = _reading(file, lambda: libe57.ImageFile(str(file.path), "r"))
    try:
        for i in range(source.extensionsCount()):
            target.extend(source.extensionsPrefix(i), source.extensionsUri(i))
        for scan in _reading(file, lambda: _children(libe57.VectorNode(source.root().get("data3D")))):
            yield from _copied_scan(file, libe57.StructureNode(scan), target)
    finally:
        source.close()


def _copied_scan(file: InputFile, scan: Any, target: _Target) -> Iterator[int]:
    copied = libe57.StructureNode(target.image)
    for child in _children(scan):
        if child.type() not in (_Kind.E57_COMPRESSED_VECTOR, _Kind.E57_BLOB):
            copied.set(child.elementName(), _copy(child, target.image))
    points = libe57.CompressedVectorNode(scan.get("points"))
    # text has no place in arrays; labels of an earlier run give way
    kept = [
        child
        for child in _children(libe57.StructureNode(points.prototype()))
        if child.type() != _Kind.E57_STRING and child.elementName() not in _LABELS
    ]
    prototype = libe57.StructureNode(target.image)
    for child in kept:
        prototype.set(child.elementName(), _copy(child, target.image))
    buffers = _Buffers(prototype)
    incoming = buffers.of(scan.destImageFile())
    target.add_labels(prototype)
    both = _Buffers(prototype)
    both.arrays.update(buffers.arrays)
    writer = target.add_scan(copied, prototype, both)
    rotation, translation = _pose(scan)
    seen = 0
    try:
        reader = _reading(file, lambda: points.reader(incoming))
        while count := _reading(file, reader.read):
            places, valid = both.places(count)
            target.label(both.arrays, count, places @ rotation.T + translation, valid)
            writer.write(count)
            seen += count
            yield count
        reader.close()
    finally:
        writer.close()
    if seen < points.childCount():
        raise InputError(f"{file.path}: a scan promises {points.childCount()} points and holds {seen}; it is cut short")


def _reading(file: InputFile, step: Callable[[], Any]) -> Any:
    """What `step` reads from a file, whose damage is an error of the file."""
    try:
        return step()
    except libe57.E57Exception as error:
        raise InputError(f"{file.path}: cannot be read as E57: {_told(error)}") from error


def _made(file: InputFile, target: _Target) -> Iterator[int]:
    """The points of any other file, a scan of E57 for each scan that comes; all of LAS, where they mix, is one."""
    positions = {number: (key, position) for number, key, position, _ in file.header["scans"]}
    writer: Any = None
    current: int | None = None
    origin = np.zeros(3)
    for batch, numbers in _core.PointReader(file.path):
        for part in np.split(np.arange(len(batch)), np.flatnonzero(np.diff(numbers)) + 1 if positions else []):
            number = int(numbers[part[0]]) if positions else 0
            if number != current:
                if writer is not None:
                    writer.close()
                key, position = positions.get(number, (file.name, None))
                origin = np.floor(batch[part[0]]) if position is None else np.array(position)
                scan, prototype = _new_scan(key, origin, target)
                buffers = _Buffers(prototype)
                writer, current = target.add_scan(scan, prototype, buffers), number
            for axis, name in enumerate(("cartesianX", "cartesianY", "cartesianZ")):
                whole = np.rint((batch[part, axis] - origin[axis]) / (_SCALE / target.cloud.unit))
                buffers.arrays[name][: len(part)] = whole
            target.label(buffers.arrays, len(part), batch[part], np.ones(len(part), dtype=np.bool_))
            writer.write(len(part))
            yield len(part)
    if writer is not None:
        writer.close()


def _new_scan(key: str, origin: FloatArray, target: _Target) -> tuple[Any, Any]:
    """A scan without points that stands at `origin`, and the prototype of its points."""
    image = target.image
    scan, pose, prototype = (libe57.StructureNode(image) for _ in range(3))
    scan.set("guid", target.text(f"{{{uuid.uuid5(uuid.NAMESPACE_URL, f'{_URI}/{key}')}}}"))
    scan.set("name", target.text(key))
    for name, values in (("rotation", dict(zip("wxyz", (1, 0, 0, 0), strict=True))), ("translation", None)):
        part = libe57.StructureNode(image)
        for axis, value in (values or dict(zip("xyz", origin, strict=True))).items():
            part.set(axis, libe57.FloatNode(image, float(value)))
        pose.set(name, part)
    scan.set("pose", pose)
    scale = _SCALE / target.cloud.unit
    for name in ("cartesianX", "cartesianY", "cartesianZ"):
        prototype.set(name, libe57.ScaledIntegerNode(image, 0, -(2**31), 2**31 - 1, scale, 0.0))
    target.add_labels(prototype)
    return scan, prototype


def _pose(scan: Any) -> tuple[FloatArray, FloatArray]:
    """Rotation (3, 3) and translation (3,) from the scan's frame to the file's."""

    def numbers(name: str, axes: str, otherwise: tuple[float, ...]) -> FloatArray:
        if not scan.isDefined(f"pose/{name}"):
            return np.array(otherwise)
        part = libe57.StructureNode(scan.get(f"pose/{name}"))
        return np.array([libe57.FloatNode(part.get(axis)).value() for axis in axes])

    w, x, y, z = numbers("rotation", "wxyz", (1.0, 0.0, 0.0, 0.0))
    rotation = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    return rotation, numbers("translation", "xyz", (0.0, 0.0, 0.0))


def _copy(node: Any, image: Any) -> Any:
    """A node and all below it, for another file."""
    kind = node.type()
    if kind == _Kind.E57_STRUCTURE:
        structure = libe57.StructureNode(image)
        for child in _children(libe57.StructureNode(node)):
            structure.set(child.elementName(), _copy(child, image))
        return structure
    if kind == _Kind.E57_VECTOR:
        vector = libe57.VectorNode(image, libe57.VectorNode(node).allowHeteroChildren())
        for child in _children(libe57.VectorNode(node)):
            vector.append(_copy(child, image))
        return vector
    if kind == _Kind.E57_INTEGER:
        whole = libe57.IntegerNode(node)
        return libe57.IntegerNode(image, whole.value(), whole.minimum(), whole.maximum())
    if kind == _Kind.E57_SCALED_INTEGER:
        scaled = libe57.ScaledIntegerNode(node)
        limits = scaled.rawValue(), scaled.minimum(), scaled.maximum()
        return libe57.ScaledIntegerNode(image, *limits, scaled.scale(), scaled.offset())
    if kind == _Kind.E57_FLOAT:
        number = libe57.FloatNode(node)
        return libe57.FloatNode(image, number.value(), number.precision(), number.minimum(), number.maximum())
    return libe57.StringNode(image, libe57.StringNode(node).value())


def _children(node: Any) -> list[Any]:
    return [node.get(i) for i in range(node.childCount())]


def _dtype(child: Any) -> type[np.generic]:
    if child.type() != _Kind.E57_FLOAT:
        return np.longlong  # of eight bytes, as int64 is; but pye57 takes that one's letter, l, for four
    single = libe57.FloatNode(child).precision() == libe57.FloatPrecision.E57_SINGLE
    return np.float32 if single else np.float64


def _told(error: Any) -> str:
    return str(error).strip().splitlines()[0]  # below it libE57 tells where in its sources it was
