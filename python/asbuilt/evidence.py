"""Evidence: a small, mergeable summary of all points (section 3.1 of the paper, with moments added).

Each occupied voxel keeps its number of points, their mean and their horizontal covariance. Evidence of two clouds
merges into exactly the evidence of both, in any order, so that it is the same for any number of threads and any order
of files. The paper's voxels of 10 cm, each counted once, come out of it by `Evidence.occupied`.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asbuilt import _core
from asbuilt.errors import InputError, ParameterError
from asbuilt.grid import FloatArray, IntArray
from asbuilt.params import EvidenceParameters
from asbuilt.read import PointCloud


@dataclass(frozen=True)
class Evidence:
    """Occupied voxels and what is known of the scans.

    Attributes
    ----------
    core : the voxels in their mergeable form.
    crs : coordinate reference system of the cloud, or None.
    inputs : name, size and checksum of each file that came in.
    skipped : what was left out, one line each.
    """

    core: _core.Evidence
    crs: str | None = None
    inputs: tuple[dict[str, Any], ...] = ()
    skipped: tuple[str, ...] = ()
    errors: tuple[InputError, ...] = field(default=())

    @property
    def voxel(self) -> float:
        """Side of a voxel, m."""
        return self.core.voxel

    @property
    def points(self) -> int:
        """Points that came in."""
        return self.core.points

    @property
    def scans(self) -> list[tuple[str, tuple[float, float, float] | None, int]]:
        """Key, position (m) or None, and points of each scan, sorted by key."""
        return self.core.scans()

    @cached_property
    def _arrays(self) -> _core._Voxels:
        return self.core.voxels()

    @property
    def index(self) -> IntArray:
        """Index of each occupied voxel (n, 3) int32, sorted; voxel i spans [i, i + 1) * voxel metres."""
        return self._arrays["index"]

    @property
    def count(self) -> IntArray:
        """Points of each voxel (n,)."""
        return self._arrays["count"]

    @property
    def mean(self) -> FloatArray:
        """Mean of each voxel's points (n, 3), m from the voxel's lower corner."""
        return self._arrays["mean"]

    @property
    def covariance(self) -> FloatArray:
        """Covariance of each voxel's points (n, 3: xx, xy, yy), m^2."""
        return self._arrays["covariance"]

    def occupied(self, voxel: float) -> IntArray:
        """Index (n, 3) of each occupied voxel of a coarser size, sorted (section 3.1).

        Raises
        ------
        ParameterError : `voxel` is not a multiple of the evidence's voxel.
        """
        factor = round(voxel / self.voxel)
        if factor < 1 or abs(factor * self.voxel - voxel) > 1e-9:
            raise ParameterError(f"voxel {voxel} m: expected a multiple of the evidence's {self.voxel} m")
        return unique_rows(self.index // factor)

    def merged(self, other: Evidence) -> Evidence:
        """The evidence of both clouds.

        Raises
        ------
        ParameterError : the voxel sizes differ.
        """
        inputs = tuple(sorted((*self.inputs, *other.inputs), key=lambda entry: (entry["name"], entry["checksum"])))
        crs = self.crs if self.crs == other.crs else None
        core = self.core.merged(other.core)
        return Evidence(core, crs, inputs, self.skipped + other.skipped, self.errors + other.errors)


def gather_evidence(
    cloud: PointCloud,
    parameters: EvidenceParameters | None = None,
    *,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    skip_bad: bool = False,
) -> Evidence:
    """One pass over the points of a cloud.

    Parameters
    ----------
    threads : to decode on; None takes all cores. The evidence is the same for any number.
    progress : called with points read and points promised, some ten times a second.
    skip_bad : leave bad files out whole, and name them in `Evidence.errors`, instead of raising.

    Raises
    ------
    InputError : a file is bad, or none of them holds a usable point.
    """
    parameters = parameters or EvidenceParameters()
    usable = [file for file in cloud.files if file.error is None]
    errors = [file.error for file in cloud.files if file.error is not None]
    promised = cloud.points
    core, reports = _core.Evidence.gather(
        [file.path for file in usable],
        voxel=parameters.voxel,
        unit=cloud.unit,
        axes=cloud.axes,
        threads=threads or os.cpu_count() or 1,
        progress=None if progress is None else lambda done: progress(done, promised),
    )
    errors += [error for *_, error in reports if error is not None]
    if errors and not skip_bad:
        raise errors[0]
    skipped = [
        f"{path.name}: {not_finite} points left out, their coordinates are not finite or beyond 100,000 km"
        for path, _, not_finite, _ in reports
        if not_finite
    ]
    if core.points == 0:
        names = ", ".join(str(file.path) for file in cloud.files[:3])
        raise errors[0] if errors else InputError(f"{names}: no usable point found, expected at least one")
    good = {path for path, *_, error in reports if error is None}
    inputs = tuple(
        {"name": file.path.name, "size": file.size, "checksum": file.checksum()} for file in usable if file.path in good
    )
    return Evidence(core, cloud.crs, inputs, tuple(skipped), tuple(errors))


def evidence_from_points(points: FloatArray, parameters: EvidenceParameters | None = None, scan: str = "") -> Evidence:
    """The evidence of points (n, 3), m, z up, as one scan; for clouds that are made in memory."""
    parameters = parameters or EvidenceParameters()
    points = np.ascontiguousarray(points, dtype=np.float64)
    return Evidence(_core.Evidence.from_points(points, voxel=parameters.voxel, scan=scan))


def unique_rows(index: IntArray) -> IntArray:
    """The different rows of (n, 3) integer indices, sorted by their columns."""
    return count_rows(index)[0]


def count_rows(index: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """The different rows (m, 3) of (n, 3) integer indices, sorted; which of them each row is (n,); how often (m,)."""
    if len(index) == 0:
        nothing = np.zeros(0, dtype=np.int64)
        return index, nothing, nothing
    low, span = index.min(axis=0).astype(np.int64), np.ptp(index, axis=0).astype(np.int64) + 1
    keys, inverse, counts = np.unique(_keys(index, low, span), return_inverse=True, return_counts=True)
    rows, z = np.divmod(keys, span[2])
    x, y = np.divmod(rows, span[1])
    return np.column_stack([x, y, z]) + low, inverse, counts


def rows_in(index: IntArray, among: IntArray) -> NDArray[np.bool_]:
    """Which rows of (n, 3) integer indices are also rows of `among` (m, 3)."""
    if len(index) == 0 or len(among) == 0:
        return np.zeros(len(index), dtype=np.bool_)
    both = np.concatenate([index, among])
    low, span = both.min(axis=0).astype(np.int64), np.ptp(both, axis=0).astype(np.int64) + 1
    return np.isin(_keys(index, low, span), _keys(among, low, span))


def _keys(index: IntArray, low: IntArray, span: IntArray) -> IntArray:
    """One integer for each row. Indices fit: a kilometre of strays each way, at 1 cm, takes 51 of 63 bits."""
    local = index - low
    keys: IntArray = (local[:, 0] * span[1] + local[:, 1]) * span[2] + local[:, 2]
    return keys
