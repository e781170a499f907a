"""Evidence: a small, mergeable summary of all points (section 3.1 of the paper, with moments added).

Each occupied voxel keeps its number of points, their mean and their horizontal covariance. Evidence of two clouds
merges into exactly the evidence of both, in any order, so that it is the same for any number of threads, any order
of files, and whether it was gathered at once, merged, or resumed. The paper's voxels of 10 cm, each counted once, come
out of it by `Evidence.occupied`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from asbuilt import _core
from asbuilt.errors import InputError, ParameterError
from asbuilt.params import EvidenceParameters
from asbuilt.provenance import Provenance
from asbuilt.read import PathLike

if TYPE_CHECKING:  # gathering evidence from files does not wait for numpy to load
    from asbuilt.grid import FloatArray, IntArray


@dataclass(frozen=True)
class Evidence:
    """Occupied voxels and what is known of the scans.

    Attributes
    ----------
    core : the voxels in their mergeable form.
    provenance : the files behind it.
    errors : the bad files that were left out.
    axes : signed axes of the files that became x, y, z, as `PointCloud.axes`; evidence files do not tell them.
    """

    core: _core.Evidence
    provenance: Provenance = field(default=Provenance())
    errors: tuple[InputError, ...] = ()
    axes: tuple[int, int, int] = (1, 2, 3)

    @classmethod
    def load(cls, path: PathLike) -> Evidence:
        """Read an evidence file.

        Raises
        ------
        InputError : it is none, is damaged, or of a newer version of asbuilt. Voxels that belie a right checksum are
            told when they are first asked for.
        """
        core, text = _core.Evidence.load(path)
        try:
            return cls(core, Provenance.from_text(text))
        except ValueError as error:
            raise InputError(f"{path}: expected its inputs, found other text; the evidence file is damaged") from error

    def save(self, path: PathLike) -> None:
        """Write an evidence file: the same bytes for the same evidence. An old file stays until the new one is whole.

        Raises
        ------
        OutputError : it cannot be written.
        """
        self.core.save(path, self.provenance.to_text())

    def __reduce__(self) -> tuple[Callable[..., Evidence], tuple[bytes, tuple[InputError, ...]]]:
        # between processes evidence travels as the bytes of its file
        return _unpickle, (self.core.to_bytes(self.provenance.to_text()), self.errors)

    @property
    def crs(self) -> str | None:
        """Coordinate reference system of the cloud, or None."""
        return self.provenance.crs

    @property
    def inputs(self) -> tuple[dict[str, Any], ...]:
        """Name, size and checksum of each file that came in."""
        return self.provenance.inputs

    @property
    def skipped(self) -> tuple[str, ...]:
        """What was left out, one line each."""
        return self.provenance.skipped

    @property
    def occupancy(self) -> bool:
        """Whether only occupancy is kept: then `count` and `covariance` are 0, and `mean` is the voxel's centre."""
        return self.core.occupancy

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
        """Points of each voxel (n,); 0 where only occupancy is kept."""
        return self._arrays["count"]

    @property
    def mean(self) -> FloatArray:
        """Mean of each voxel's points (n, 3), m from the voxel's lower corner."""
        mean = self._arrays["mean"]
        return 0 * mean + self.voxel / 2 if self.occupancy else mean

    @cached_property
    def height(self) -> FloatArray:
        """Mean height of each voxel's points (n,), m."""
        return self.index[:, 2] * self.voxel + self.mean[:, 2]

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
            raise ParameterError(f"voxel {voxel:g} m: expected a multiple of the evidence's {self.voxel:g} m")
        return _core.coarser(self.index.astype("int32", copy=False), factor)

    def merged(self, *others: Evidence) -> Evidence:
        """The evidence of all these clouds together.

        Raises
        ------
        ParameterError : the voxel sizes differ, or only some keep occupancy alone.
        InputError : a file is in two of them.
        """
        provenance = Provenance.of_all(evidence.provenance for evidence in (self, *others))
        errors = tuple(error for evidence in (self, *others) for error in evidence.errors)
        return Evidence(self.core.merged(*(other.core for other in others)), provenance, errors)


def _unpickle(data: bytes, errors: tuple[InputError, ...]) -> Evidence:
    core, text = _core.Evidence.from_bytes(data)
    return Evidence(core, Provenance.from_text(text), errors)


def evidence_from_points(points: FloatArray, parameters: EvidenceParameters | None = None, scan: str = "") -> Evidence:
    """The evidence of points (n, 3), m, z up, as one scan; for clouds that are made in memory."""
    import numpy as np

    parameters = parameters or EvidenceParameters()
    points = np.ascontiguousarray(points, dtype=np.float64)
    core = _core.Evidence.from_points(points, voxel=parameters.voxel, scan=scan, occupancy=parameters.occupancy)
    return Evidence(core)
