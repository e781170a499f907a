"""The points of a case for the baselines, which need more than the evidence: read once, and kept."""

from __future__ import annotations

import json

import numpy as np

import common
from asbuilt import _core
from asbuilt.storeys import Level
from baselines.storey import StoreyCloud


def storey_cloud(case: common.Case, level: Level) -> StoreyCloud:
    """The points between a storey's floor and ceiling, and the scanners' positions from the truth."""
    cached = common.cache_file(case.input["checksum"], f"storey_{level.index}.npz")
    if not cached.exists():
        _read(case)
    with np.load(cached) as arrays:
        return StoreyCloud(arrays["points"], arrays["scan"], arrays["positions"], level.floor, level.ceiling)


def _read(case: common.Case) -> None:
    folder = common.case_folder(case.name)
    scans = json.loads((folder / "truth.json").read_text(encoding="utf-8"))["scans"]
    positions = np.zeros((max(scan["id"] for scan in scans) + 1, 3))
    for scan in scans:
        positions[scan["id"]] = scan["position"]
    parts: list[list[tuple[np.ndarray, np.ndarray]]] = [[] for _ in case.levels]
    for points, scan in _core.PointReader(folder / "scans.laz"):
        for level, kept in zip(case.levels, parts, strict=True):
            inside = (points[:, 2] > level.floor - 0.1) & (points[:, 2] < level.ceiling + 0.1)
            # the cases lie near the origin: single precision keeps a hundredth of a millimetre
            kept.append((points[inside].astype(np.float32), scan[inside].astype(np.int32)))
    for level, kept in zip(case.levels, parts, strict=True):
        cached = common.cache_file(case.input["checksum"], f"storey_{level.index}.npz")
        points, scan = (np.concatenate(column) for column in zip(*kept, strict=True))
        np.savez(cached, points=points, scan=scan, positions=positions)
