"""The class of every point of a cloud, by its plan (the paper's figure 12)."""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from asbuilt.errors import InputError, OutputError
from asbuilt.export.atomic import check_place, replacing
from asbuilt.grid import FloatArray
from asbuilt.label.classes import PointClass
from asbuilt.label.lookup import TOLERANCE, Labels, PlanLookup
from asbuilt.plan import FloorPlan
from asbuilt.read import PointCloud

__all__ = ["Labels", "PlanLookup", "PointClass", "check_output", "label_cloud"]

_WRITERS = {".las": "asbuilt.label.las", ".laz": "asbuilt.label.las", ".e57": "asbuilt.label.e57"}


def check_output(path: str | os.PathLike[str]) -> None:
    """Find out before any work whether `label_cloud` could write to `path`.

    Raises
    ------
    OutputError : the suffix is none of .las, .laz and .e57, or the folder is missing or may not be written to.
    MissingExtraError : the format needs a library that is not installed.
    """
    path = Path(path)
    _writer(path)
    check_place(path)


def label_cloud(
    cloud: PointCloud,
    plan: FloorPlan,
    path: str | os.PathLike[str],
    *,
    tolerance: float = TOLERANCE,
    progress: Callable[[int, int], None] | None = None,
) -> dict[PointClass, int]:
    """Write all points of a cloud, each with its class, its wall and its room.

    The points stay in the frame and unit of their files, in their order; they are read and written in chunks, never
    held as a whole. The file is whole or not there, and the same input gives the same bytes.

    Parameters
    ----------
    cloud : what the plan was made from.
    plan : in metres, z up.
    path : .las, .laz or .e57. LAS keeps all that LAS inputs carry, and the coordinates and scans of others; E57 keeps
        all that E57 inputs carry, scans and poses included, and the coordinates of others.
    tolerance : how far from a surface of the plan a point may lie to be on it, m; see `PlanLookup`.
    progress : called with points done and points promised.

    Returns
    -------
    How many points each class got.

    Raises
    ------
    InputError : the points of a file are damaged.
    OutputError : see `check_output`; or `path` is one of the inputs, or the disk is full.
    ParameterError : `tolerance` is out of its range.
    """
    path = Path(path)
    write = _writer(path)
    if any(path.exists() and path.samefile(file.path) for file in cloud.files):
        raise OutputError(f"{path}: is one of the inputs; name another file")
    usable = PointCloud(tuple(file for file in cloud.files if file.error is None), cloud.unit, cloud.axes)
    if not usable.files:
        raise cloud.files[0].error or InputError("no input given; expected files, folders or patterns")
    lookup = _Counting(plan, tolerance)
    with replacing(path) as temporary:
        for done in write(usable, lookup, temporary):
            if progress is not None:
                progress(done, usable.points)
    return lookup.counts


class _Counting(PlanLookup):
    """A lookup that keeps count of what it found."""

    def __init__(self, plan: FloorPlan, tolerance: float) -> None:
        super().__init__(plan, tolerance)
        self._found = np.zeros(256, dtype=np.int64)

    @property
    def counts(self) -> dict[PointClass, int]:
        return {known: int(self._found[known]) for known in PointClass}

    def labels(self, x: FloatArray, y: FloatArray, z: FloatArray) -> Labels:
        found = super().labels(x, y, z)
        self._found += np.bincount(found.classes, minlength=256)
        return found


def _writer(path: Path) -> Callable[[PointCloud, PlanLookup, Path], Iterator[int]]:
    module = _WRITERS.get(path.suffix.lower())
    if module is None:
        raise OutputError(
            f"{path}: no labelled cloud has the suffix {path.suffix or '(none)'}; known are .las .laz .e57"
        )
    writer: Callable[[PointCloud, PlanLookup, Path], Iterator[int]] = importlib.import_module(module).write
    return writer
