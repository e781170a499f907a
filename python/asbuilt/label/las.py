"""Labelled clouds as LAS and LAZ through laspy: all that the input's points carry, their class, wall and room.

The class is LAS's own classification, with its names in the standard's lookup record. The wall and the room are extra
dimensions of 16 bits, 0 for none; a record of user "asbuilt" holds the ids they stand for. Files are LAS 1.4, point
formats 6 to 8, for older ones have no room for classes beyond 31.
"""

from __future__ import annotations

import copy
import datetime
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from asbuilt import _core
from asbuilt.errors import InputError, MissingExtraError
from asbuilt.grid import FloatArray
from asbuilt.label.classes import PointClass
from asbuilt.label.lookup import PlanLookup
from asbuilt.read import InputFile, PointCloud

try:
    import laspy
    import lazrs
except ImportError as error:
    raise MissingExtraError("labelling needs laspy and lazrs: pip install 'asbuilt[label]'") from error

_CHUNK = 2**19  # points in memory at a time
_SCALE = 0.0001  # m, of coordinates that were no integers before
_NEW_FORMAT = (6, 6, 7, 7, 6, 7, 6, 7, 8, 6, 8)  # of 1.4, that holds what the old format does but its waveforms
_OURS = ("wall", "room")
_DAY = datetime.date(2000, 1, 1)  # the same input gives the same bytes: no day of its own
_NAMES_RECORD = 1


def write(cloud: PointCloud, lookup: PlanLookup, path: Path) -> Iterator[int]:
    """Write the points of `cloud` with their labels; the suffix .laz compresses them. Yields how many are done.

    Raises
    ------
    InputError : the points of a file are damaged, or so far from the others that LAS cannot hold both.
    """
    headers = {file.path: _las_header(file) for file in cloud.files if file.header["format"].startswith("LAS")}
    header = _header(cloud, list(headers.values()), lookup)
    done = scans = 0
    with laspy.open(str(path), mode="w", header=header, do_compress=path.suffix.lower() == ".laz") as writer:
        for file in cloud.files:
            if file.path in headers:
                records = _las_records(file, header)
            else:
                records = _records(file, header, scans)
                scans += max(len(file.header["scans"]), 1)
            for record in records:
                labels = lookup.labels(
                    *cloud.to_metres(np.asarray(record.x), np.asarray(record.y), np.asarray(record.z))
                )
                record.array["classification"] = labels.classes
                record.array["wall"] = labels.walls
                record.array["room"] = labels.rooms
                writer.write_points(record)
                done += len(record)
                yield done


def _las_header(file: InputFile) -> Any:
    with laspy.open(file.path, read_evlrs=False) as reader:
        return reader.header


def _header(cloud: PointCloud, sources: list[Any], lookup: PlanLookup) -> Any:
    """A header that holds what all sources do."""
    from asbuilt import __version__

    formats = {_NEW_FORMAT[source.point_format.id] for source in sources} or {6}
    header = laspy.LasHeader(version="1.4", point_format=max(formats))
    kept: dict[str, Any] = {}
    for source in sources:
        for extra in source.point_format.extra_dimensions:
            kept.setdefault(extra.name, extra)
    about = [
        laspy.ExtraBytesParams(e.name, e.type_str(), e.description, e.offsets, e.scales, e.no_data)
        for name, e in kept.items()
        if name not in _OURS
    ]
    about += [laspy.ExtraBytesParams(name, "uint16", "number, see VLR asbuilt") for name in _OURS]
    header.add_extra_dims(about)
    header.scales, header.offsets = _scaling(cloud, sources)
    header.creation_date = min((s.creation_date for s in sources if s.creation_date is not None), default=_DAY)
    header.system_identifier, header.generating_software = "MODIFICATION", f"asbuilt {__version__}"
    if sources:
        header.file_source_id = sources[0].file_source_id if len(sources) == 1 else 0
        header.global_encoding.gps_time_type = sources[0].global_encoding.gps_time_type
    _describe(header, cloud, sources, lookup)
    return header


def _scaling(cloud: PointCloud, sources: list[Any]) -> tuple[FloatArray, FloatArray]:
    """The finest scales, and the offsets that all sources share, else those of whole units near the first."""
    scales = [np.asarray(source.scales) for source in sources]
    offsets = [np.asarray(source.offsets) for source in sources]
    if len(sources) < len(cloud.files):
        scales.append(np.full(3, _SCALE / cloud.unit))
        other = next(file for file in cloud.files if not file.header["format"].startswith("LAS"))
        # where its points are, not where its header says they are
        offsets.append(np.floor(next((batch[0] for batch, _ in _core.PointReader(other.path)), np.zeros(3))))
    same = all((offset == offsets[0]).all() for offset in offsets)
    return np.min(scales, axis=0), offsets[0] if same else np.floor(offsets[0])


def _describe(header: Any, cloud: PointCloud, sources: list[Any], lookup: PlanLookup) -> None:
    """Records that say the CRS, the names of the classes, and which walls and rooms the numbers stand for."""
    if cloud.crs is not None and not cloud.crs.startswith("EPSG:"):
        header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(cloud.crs))
        header.global_encoding.wkt = True
    elif cloud.crs is not None:
        # the file says it by GeoTIFF keys
        keys = (vlr for source in sources for vlr in source.vlrs if vlr.user_id == "LASF_Projection")
        found = {vlr.record_id: copy.deepcopy(vlr) for vlr in keys}
        header.vlrs.extend(found[number] for number in sorted(found))
    classes = laspy.vlrs.known.ClassificationLookupVlr()
    for known in PointClass:
        classes[int(known)] = known.title
    header.vlrs.append(classes)
    names = json.dumps({"wall": lookup.walls, "room": lookup.rooms}, ensure_ascii=False).encode()
    # a record holds 64 KiB; of a longer table, the pieces follow each other by number
    for piece, start in enumerate(range(0, len(names), 60_000)):
        data = names[start : start + 60_000]
        header.vlrs.append(laspy.VLR("asbuilt", _NAMES_RECORD + piece, "ids of walls and rooms", data))


def _las_records(file: InputFile, header: Any) -> Iterator[Any]:
    """The points of a LAS file as they are to be written, but for their labels."""
    seen = 0
    try:
        with laspy.open(file.path, read_evlrs=False) as reader:
            exact = (reader.header.scales == header.scales).all() and (reader.header.offsets == header.offsets).all()
            for points in reader.chunk_iterator(_CHUNK):
                seen += len(points)
                if len(points) == 0:
                    break
                record = _converted(points, header)
                if not exact:
                    for axis, (name, values) in enumerate(zip("XYZ", (points.x, points.y, points.z), strict=True)):
                        record.array[name] = _quantised(np.asarray(values), header, axis, file)
                yield record
            promised = reader.header.point_count
    except (laspy.LaspyException, lazrs.LazrsError, ValueError, EOFError) as error:
        raise InputError(f"{file.path}: its points cannot be read: {error}") from error
    if seen < promised:
        raise InputError(f"{file.path}: the header promises {promised} points, the file holds {seen}; it is cut short")


def _converted(points: Any, header: Any) -> Any:
    """Points in the new format, with all that it has a place for."""
    record = laspy.ScaleAwarePointRecord.zeros(len(points), header=header)
    old, new = points.array.dtype, record.array.dtype
    if new.descr[: len(old.descr)] == old.descr:
        # nearly always: the old record is the head of the new, and is copied at once
        whole = np.dtype({"names": ["old"], "formats": [f"V{old.itemsize}"], "itemsize": new.itemsize})
        record.array.view(whole)["old"] = points.array.view(f"V{old.itemsize}")
        return record
    if points.point_format.id >= 6:
        for name in record.array.dtype.names:
            if name in points.array.dtype.names:
                record.array[name] = points.array[name]
        return record
    known = set(points.point_format.dimension_names)
    for name in record.point_format.dimension_names:
        if name in known:
            record[name] = np.asarray(points[name])
    record.array["scan_angle"] = np.rint(np.asarray(points.scan_angle_rank) / 0.006).astype(np.int16)  # whole degrees
    return record


def _records(file: InputFile, header: Any, scans: int) -> Iterator[Any]:
    """The points of any other file: its coordinates, and as point source the scan, after `scans` of earlier files."""
    for batch, numbers in _chunks(file):
        record = laspy.ScaleAwarePointRecord.zeros(len(batch), header=header)
        for axis, name in enumerate("XYZ"):
            record.array[name] = _quantised(batch[:, axis], header, axis, file)
        record.array["point_source_id"] = np.minimum(numbers.astype(np.int64) + scans + 1, 2**16 - 1)
        record["return_number"] = np.ones(len(batch), dtype=np.uint8)
        record["number_of_returns"] = np.ones(len(batch), dtype=np.uint8)
        yield record


def _chunks(file: InputFile) -> Iterator[tuple[FloatArray, Any]]:
    """Batches as the reader gives them, gathered to chunks: each costs laspy some milliseconds."""
    batches: list[tuple[FloatArray, Any]] = []
    held = 0
    for batch in _core.PointReader(file.path):
        batches.append(batch)
        held += len(batch[0])
        if held >= _CHUNK:
            yield np.concatenate([b for b, _ in batches]), np.concatenate([n for _, n in batches])
            batches, held = [], 0
    if batches:
        yield np.concatenate([b for b, _ in batches]), np.concatenate([n for _, n in batches])


def _quantised(values: FloatArray, header: Any, axis: int, file: InputFile) -> Any:
    whole = np.rint((values - header.offsets[axis]) / header.scales[axis])
    if np.abs(whole).max(initial=0.0) >= 2**31:
        raise InputError(
            f"{file.path}: points {np.abs(values - header.offsets[axis]).max():.0f} from the others, "
            f"which is more than LAS holds at {header.scales[axis]:g}; label it by itself"
        )
    return whole.astype(np.int32)
