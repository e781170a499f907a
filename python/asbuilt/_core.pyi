from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Self, TypeAlias, TypedDict, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "VERSION",
    "Evidence",
    "Hits",
    "Places",
    "PointReader",
    "close_gaps",
    "close_sparse",
    "coarser",
    "formats",
    "from_box_sides",
    "groups",
    "height_about",
    "hough_lines",
    "in_company",
    "layer_of",
    "means_along",
    "patches_of",
    "read_header",
]

VERSION: str

class _Voxels(TypedDict):
    index: NDArray[np.int32]
    count: NDArray[np.uint64]
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]

class _Layer(TypedDict):
    kept: NDArray[np.int64]
    origin: NDArray[np.float64]
    cells: NDArray[np.int32]
    xy: NDArray[np.float64]

class _BrickScans(TypedDict):
    brick: NDArray[np.int32]
    scan: NDArray[np.uint32]
    side: int

@final
class Evidence:
    @staticmethod
    def gather(
        files: Sequence[tuple[str | PathLike[str], Sequence[int]]],
        *,
        voxel: float,
        unit: float,
        axes: Sequence[int],
        threads: int,
        occupancy: bool = False,
        preview: bool = False,
        progress: Callable[[int], object] | None = None,
        on_file: Callable[[int, Evidence, int, int], object] | None = None,
    ) -> tuple[Evidence, list[tuple[Path, int, int, Any]]]: ...
    @staticmethod
    def gather_parts(
        path: str | PathLike[str],
        first: int,
        end: int,
        *,
        voxel: float,
        unit: float,
        axes: Sequence[int],
        occupancy: bool = False,
        preview: bool = False,
    ) -> tuple[Evidence, int, int]: ...
    @staticmethod
    def from_points(
        points: NDArray[np.float64],
        *,
        voxel: float,
        scan: str,
        position: Sequence[float] | None = None,
        occupancy: bool = False,
    ) -> Evidence: ...
    @staticmethod
    def load(path: str | PathLike[str]) -> tuple[Evidence, str]: ...
    def save(self, path: str | PathLike[str], about: str) -> None: ...
    @staticmethod
    def from_bytes(data: bytes) -> tuple[Evidence, str]: ...
    def to_bytes(self, about: str) -> bytes: ...
    def merged(self, *others: Evidence) -> Evidence: ...
    @property
    def occupancy(self) -> bool: ...
    @property
    def voxel(self) -> float: ...
    @property
    def points(self) -> int: ...
    def __len__(self) -> int: ...
    def scans(self) -> list[tuple[str, tuple[float, float, float] | None, int]]: ...
    def voxels(self) -> _Voxels: ...
    def brick_scans(self) -> _BrickScans: ...

@final
class PointReader:
    def __new__(cls, path: str | PathLike[str]) -> Self: ...
    def __iter__(self) -> Self: ...
    def __next__(self) -> tuple[NDArray[np.float64], NDArray[np.uint32]]: ...

@final
class Places:
    def __new__(cls, points: NDArray[np.float64], index: NDArray[np.int32], cell: float) -> Self: ...
    def in_box(
        self,
        low: tuple[float, float],
        high: tuple[float, float],
        heights: NDArray[np.float64] | None = None,
        between: tuple[float, float] | None = None,
    ) -> NDArray[np.int64]: ...
    def strips(
        self,
        segments: NDArray[np.float64],
        half_width: float,
        margin: float,
        heights: NDArray[np.float64] | None = None,
        between: tuple[float, float] | None = None,
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]: ...
    def trace_lines(
        self,
        weights: NDArray[np.float64],
        *,
        band: float,
        reach: float,
        gap: float,
        min_weight: float,
        min_length: float,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
    def hits(
        self,
        heights: NDArray[np.float64],
        lines: NDArray[np.float64],
        half_width: float,
        margin: float,
        step: float,
        first: NDArray[np.int64],
    ) -> Hits: ...

_Ranges: TypeAlias = tuple[
    NDArray[np.float64],
    tuple[NDArray[np.float64], NDArray[np.float64]],
    NDArray[np.float64],
    tuple[NDArray[np.float64], NDArray[np.float64]],
]

@final
class Hits:
    @property
    def highest(self) -> float: ...
    def counts(self, ranges: Sequence[_Ranges]) -> list[NDArray[np.uint32]]: ...
    def by_depth(self, ranges: _Ranges, cell: float, cells: int) -> NDArray[np.uint32]: ...
    def by_height(self, ranges: _Ranges, cell: float, cells: int) -> NDArray[np.uint32]: ...

def coarser(index: NDArray[np.int32], factor: int) -> NDArray[np.int64]: ...
def groups(count: int, first: NDArray[np.integer], second: NDArray[np.integer]) -> NDArray[np.uint32]: ...
def height_about(
    grid: NDArray[np.float64],
    low: tuple[int, int],
    cell: float,
    steps: NDArray[np.float64],
    places: NDArray[np.float64],
    aside: NDArray[np.float64],
    along: NDArray[np.float64],
    *,
    share: float,
    least: int,
    level: float = 0.0,
) -> NDArray[np.float64]: ...
def in_company(index: NDArray[np.int32], factor: int, least: int) -> NDArray[np.bool_]: ...
def from_box_sides(
    points: NDArray[np.float64], directions: NDArray[np.float64], shares: tuple[float, float]
) -> NDArray[np.float64]: ...
def layer_of(
    index: NDArray[np.int32],
    mean: NDArray[np.float64],
    height: NDArray[np.float64],
    voxel: float,
    *,
    floor: float,
    between: tuple[float, float],
    factor: int,
    least: int,
) -> _Layer: ...
def formats() -> list[tuple[str, list[str]]]: ...
def read_header(path: str | PathLike[str], *, spacing: float | None = None) -> dict[str, Any]: ...
def close_gaps(values: NDArray[np.float64], first: NDArray[np.int64], width: int) -> NDArray[np.float64]: ...
def close_sparse(
    filled: NDArray[np.bool_], first: NDArray[np.int64], *, around: int, share: float, width: int
) -> NDArray[np.bool_]: ...
def means_along(values: NDArray[np.float64], first: NDArray[np.int64], width: int) -> NDArray[np.float64]: ...
def patches_of(filled: NDArray[np.bool_]) -> NDArray[np.uint32]: ...
def hough_lines(
    cells: NDArray[np.int32],
    *,
    incremental: bool,
    orientations: int,
    rho_step: float,
    fill_gap: float,
    min_length: float,
    min_votes: int,
    max_lines: int,
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]: ...
