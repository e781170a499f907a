"""Storeys from the heights of horizontal surfaces (section 3.1 of the paper).

The paper marks the bottom-most and the top-most local maximum of the height histogram as floor and ceiling of one
floor of a building (`find_floor_and_ceiling`). A cloud of several storeys, with stair halls, dropped ceilings, tables
and strays, needs more (`find_storeys`, not in the paper): under each free height of a voxel column that a person could
stand in lies something to stand on. The heights of those surfaces, weighed by their area, peak at the floors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asbuilt.evidence import Evidence
from asbuilt.grid import BoolArray, FloatArray, IntArray
from asbuilt.indices import count_rows, in_company, rows_in, squeezed
from asbuilt.params import StoreyParameters

_RUN_GAPS = (1, 3)
"""Voxels of a column this far apart belong to one wall; the second in clouds most of whose voxels hold one point."""
_MIN_STOREY_HEIGHT = 2.0
"""Floors closer together than this are one storey with steps in it, m."""
_STEP, _STEP_SHARE = 0.4, 0.3
"""A step is at least so high (m), and has this share of the largest floor's area: more than a table or a stage."""
_FLOOR_IN_PATCHES = 0.2
"""At least this share of a floor's cells lies in patches, where the tops of walls make strips."""
_WALL, _REACH = 1.5, 20.0
"""What stands this high (m) may be a wall, and what has walls within this distance (m) on all four sides is indoors."""
SLAB = 0.12
"""A storey ends this far below the floor above it, m."""
_TAIL = 0.2
"""A bin with less than this share of what the one below holds shows no surface of its own."""
_OPEN = np.iinfo(np.int32).max
"""Gap over the highest voxel of a column."""


@dataclass(frozen=True)
class Level:
    """A storey's place in the height: index from the lowest, floor and ceiling, m.

    `steps` are heights (m) of other floors, too near to this one to be storeys: split levels, another building.
    """

    index: int
    floor: float
    ceiling: float
    steps: tuple[float, ...] = ()


@dataclass(frozen=True)
class HeightHistogram:
    """Occupied voxels by height.

    Attributes
    ----------
    low : height of the lower end of the first bin, m.
    step : height of a bin, m.
    counts : (n,) occupied voxels in each bin.
    """

    low: float
    step: float
    counts: IntArray

    @property
    def heights(self) -> FloatArray:
        """Middle of each bin (n,), m."""
        return self.low + (np.arange(len(self.counts), dtype=np.float64) + 0.5) * self.step


def height_histogram(occupied: IntArray, voxel: float) -> HeightHistogram:
    """Count occupied voxels (n, 3) of side `voxel` (m) by height; each counts once (section 3.1, figure 2).

    Without voxels the histogram has no bin.
    """
    if len(occupied) == 0:
        return HeightHistogram(0.0, voxel, np.zeros(0, np.int64))
    low = int(occupied[:, 2].min())
    return HeightHistogram(float(low * voxel), voxel, np.bincount(occupied[:, 2] - low))


def find_floor_and_ceiling(histogram: HeightHistogram) -> tuple[float, float] | None:
    """Heights (m) of the bottom-most and the top-most local maximum (section 3.1); None without two of them.

    The paper does not say how high a maximum must be; here, a fifth of the highest, so that clutter makes none.
    """
    counts = histogram.counts
    if len(counts) < 3:
        return None
    padded = np.pad(counts, 1)
    peaks = np.flatnonzero((counts >= padded[:-2]) & (counts > padded[2:]) & (counts >= counts.max() / 5))
    if len(peaks) < 2:
        return None
    return float(histogram.heights[peaks[0]]), float(histogram.heights[peaks[-1]])


def find_floor_and_ceiling_by_scan(evidence: Evidence, voxel: float = 0.1) -> dict[str, tuple[float, float] | None]:
    """Floor and ceiling about each scan, by its key: heights (m), or None where its histogram has no two maxima.

    The per-room reading of section 3.1, with a scan for a room: the histogram counts the voxels of side `voxel` (m) in
    the bricks that the scan hit. A scan also sees into other rooms, but most of all its own.

    Raises
    ------
    ParameterError : `voxel` is not a multiple of the evidence's.
    """
    hits = evidence.core.brick_scans()
    occupied = evidence.occupied(voxel)
    if len(occupied) == 0:
        return {}
    lower_corner = np.round(occupied * (voxel / evidence.voxel)).astype(np.int64)
    bricks, brick_of, _ = count_rows(np.concatenate([lower_corner // hits["side"], hits["brick"]]))
    of_voxel, of_hit = brick_of[: len(occupied)], brick_of[len(occupied) :]
    found = {}
    for number, (key, _, _) in enumerate(evidence.scans):
        seen = np.zeros(len(bricks), dtype=np.bool_)
        seen[of_hit[hits["scan"] == number]] = True
        found[key] = find_floor_and_ceiling(height_histogram(occupied[seen[of_voxel]], voxel))
    return found


def find_storeys(evidence: Evidence, parameters: StoreyParameters | None = None) -> list[Level]:
    """The storeys of a cloud, lowest first; none where nothing can be stood on (not in the paper).

    Floors are the peaks of the area that lies under free height, at least 2 m apart, with walls above them. A
    storey's ceiling is the highest surface over its floor that covers a fair share of it; where nothing was scanned
    there, the height to which most of what stands on the floor reaches.
    """
    parameters = parameters or StoreyParameters()
    voxel = parameters.voxel
    occupied = drop_strays(evidence.occupied(voxel))
    if len(occupied) < 2:
        return []
    headroom = int(np.ceil(parameters.headroom / voxel))
    gap = _gaps(occupied)
    stood_on = gap > headroom
    base = int(occupied[:, 2].min())
    thin = float(np.mean(evidence.count == 1)) > 0.5
    foot, length = _runs(occupied, gap, _RUN_GAPS[thin])
    tall = length >= round(_WALL / voxel)
    walls = foot[tall], length[tall]
    floors = _find_floors(occupied, gap, stood_on, walls, parameters)

    levels: list[Level] = []
    heights = list(floors)
    for number, floor in enumerate(heights):
        below = levels[-1].ceiling if levels else -np.inf
        z = _surface_height(evidence, occupied[stood_on], base + floor, voxel, below)
        above = (base + heights[number + 1]) * voxel if number + 1 < len(heights) else None
        ceiling = _ceiling_height(occupied, gap, stood_on, z, above, voxel, headroom, walls)
        levels.append(Level(number, z, ceiling, tuple((base + step + 0.5) * voxel for step in floors[floor])))
    return levels


def _gaps(occupied: IntArray) -> IntArray:
    """How far above each voxel (n, 3) the next one of its column lies, in voxels; `_OPEN` for the highest."""
    x, y, z = np.ascontiguousarray(occupied.T)
    gap = np.full(len(occupied), _OPEN)
    same = (x[1:] == x[:-1]) & (y[1:] == y[:-1])
    gap[:-1][same] = np.diff(z)[same]
    return gap


def _find_floors(
    occupied: IntArray,
    gap: IntArray,
    stood_on: BoolArray,
    walls: tuple[IntArray, IntArray],
    parameters: StoreyParameters,
) -> dict[int, list[int]]:
    """Heights of the floors, in voxels above the lowest, lowest first; and of the steps in each.

    `walls` are runs that may be walls: where each starts among the voxels, and how high it is.
    """
    voxel, base = parameters.voxel, int(occupied[:, 2].min())
    bins = int(np.ptp(occupied[:, 2])) + 1
    covered = stood_on & (gap < _OPEN)
    foot, length = walls
    indoors = covered.copy()
    bare = np.flatnonzero(stood_on & ~covered)
    indoors[bare] = _enclosed(occupied[bare, :2], occupied[foot, :2], round(_REACH / voxel))
    area = _spread(np.bincount(occupied[covered, 2] - base, minlength=bins) / 2)
    area += _spread(np.bincount(occupied[indoors, 2] - base, minlength=bins) / 2)
    wall_cells = _wall_cells(occupied[foot, 2] - base, length, bins, round(_WALL / voxel))

    floors: dict[int, list[int]] = {}
    apart = int(_MIN_STOREY_HEIGHT / voxel)
    summit = area == np.lib.stride_tricks.sliding_window_view(np.pad(area, 2), 5).max(axis=1)
    for peak in np.argsort(-area, kind="stable"):
        if area[peak] == 0 or area[peak] < parameters.min_area_share * area.max():
            break
        # Walls around an area take cells that grow with its perimeter.
        enclosed = wall_cells[peak] >= 2 * np.sqrt(area[peak])
        if not (summit[peak] and enclosed):
            continue
        near = stood_on & (np.abs(occupied[:, 2] - base - peak) <= 1)
        if _patch_share(occupied[near, :2]) < _FLOOR_IN_PATCHES:
            continue  # the tops of walls
        nearest = min(floors, key=lambda floor: abs(peak - floor), default=None)
        if nearest is None or abs(peak - nearest) >= apart:
            floors[int(peak)] = []
        elif abs(peak - nearest) >= _STEP / voxel and area[peak] >= _STEP_SHARE * area.max():
            floors[nearest].append(int(peak))
    return {floor: sorted(floors[floor]) for floor in sorted(floors)}


def _patch_share(cells: IntArray) -> float:
    """Share of ground cells (n, 2) about which half of the 24 others within two cells are among them, too."""
    cells = squeezed(cells, 4)
    about = np.zeros(cells.max(axis=0) + 6, dtype=np.int64)
    about[tuple(cells.T + 3)] = 1
    for _ in ("rows", "columns"):
        sums = np.cumsum(about, axis=0)
        about = (sums[5:] - sums[:-5]).T
    return float((about[tuple(cells.T)] > 12).mean())


def _spread(counts: FloatArray) -> FloatArray:
    """Counts by height, with half of what lies in the next bins: a floor on a voxel's face falls into two."""
    padded = np.pad(counts, 1)
    return padded[1:-1] + 0.5 * (padded[:-2] + padded[2:])


def _runs(occupied: IntArray, gap: IntArray, bridged: int) -> tuple[IntArray, IntArray]:
    """Where each vertical run of voxels (n, 3) starts among them, and how high it is, over gaps of up to `bridged`."""
    last = np.flatnonzero(gap > bridged)
    first = np.concatenate([[0], last[:-1] + 1])
    return first, occupied[last, 2] - occupied[first, 2] + 1


def _enclosed(cells: IntArray, tall: IntArray, reach: int) -> BoolArray:
    """Which cells (n, 2) have one of the `tall` cells (m, 2) within `reach` on each of their four sides.

    So the floor of a room without a ceiling is told from the ground outside.
    """
    enclosed = np.ones(len(cells), dtype=np.bool_)
    for axis in (0, 1):
        across, along = cells[:, 1 - axis].astype(np.int64), cells[:, axis].astype(np.int64)
        wide = 2**32
        walls = np.sort(tall[:, 1 - axis].astype(np.int64) * wide + tall[:, axis])
        if len(walls) == 0:
            return np.zeros(len(cells), dtype=np.bool_)
        place = across * wide + along
        after = np.minimum(np.searchsorted(walls, place), len(walls) - 1)
        before = np.maximum(np.searchsorted(walls, place, side="right") - 1, 0)
        enclosed &= (walls[after] >= place) & (walls[after] - place <= reach)
        enclosed &= (walls[before] <= place) & (place - walls[before] <= reach)
    return enclosed


def _wall_cells(low: IntArray, length: IntArray, bins: int, reach: int) -> IntArray:
    """For each height bin: how many runs, from `low` and `length` bins long, fill the `reach` bins above it.

    A run may start up to three bins higher: what is hidden at its foot.
    """
    steps = np.zeros(bins + 1, np.int64)
    np.add.at(steps, np.maximum(low - 3, 0), 1)
    np.add.at(steps, np.minimum(low + length - reach + 1, bins), -1)
    return np.cumsum(steps)[:bins]


def _surface_height(evidence: Evidence, stood_on: IntArray, floor: int, voxel: float, below: float) -> float:
    """The height (m) that most of what can be stood on shares, in the bin of the floor and next to it.

    Where a thin cloud misses the floor, the ceiling `below` (m) it seems one.
    """
    near = stood_on[np.abs(stood_on[:, 2] - floor) <= 1]
    factor = round(voxel / evidence.voxel)
    layer = evidence.index[:, 2]
    within = np.flatnonzero((layer >= (floor - 1) * factor) & (layer < (floor + 2) * factor))
    z = evidence.height[within[rows_in(evidence.index[within] // factor, near)]]
    low = (floor - 1) * voxel
    counts, edges = np.histogram(z, bins=np.arange(low, low + 3 * voxel + 0.005, 0.005))
    shared = np.convolve(counts, [1, 1, 1], mode="same")
    best = int(np.argmax(shared))
    higher = np.where(edges[:-1] > edges[best] + voxel, shared, 0)
    if abs(edges[best] - below) < voxel and higher.max() > shared[best] / 2:
        best = int(np.argmax(higher))
    middle = edges[best] + 0.0025
    return float(np.median(z[np.abs(z - middle) <= 0.02]))


def _ceiling_height(
    occupied: IntArray,
    gap: IntArray,
    stood_on: BoolArray,
    floor: float,
    above: float | None,
    voxel: float,
    headroom: int,
    walls: tuple[IntArray, IntArray],
) -> float:
    """The highest fair peak of the surfaces over free height that rises from near the floor, as high as walls reach.

    Over a ceiling that was not scanned a roof may show. `walls` as in `_find_floors`.
    """
    z = occupied[:, 2]
    floor_bin = int(np.floor(floor / voxel))
    limit = int(np.ceil((above - SLAB) / voxel)) if above is not None else int(z.max()) + 1
    near = (z <= floor_bin + headroom // 2) & (z >= floor_bin - 2)
    over = np.flatnonzero(near & stood_on & (gap < _OPEN))
    tops = z[over] + gap[over]
    foot, length = walls
    wall_tops = (z[foot] + length)[near[foot]]
    limit = min(limit, int(np.percentile(wall_tops, 98)) + 4) if len(wall_tops) else limit
    tops, wall_tops = tops[tops < limit], wall_tops[wall_tops < limit]
    if len(tops) > 0:
        counts = np.pad(np.bincount(tops - floor_bin), (1, 1))
        # A surface falls into two bins; what is left of it in a third is none.
        pairs = counts[:-1] + counts[1:]
        pairs[counts[1:] < _TAIL * counts[:-1]] = 0
        fair = np.flatnonzero(pairs >= 0.05 * max(len(over), 1))
        if len(fair) > 0:
            best = max(fair[-1], fair[-1] + 1, key=lambda i: int(counts[i]))
            return float((floor_bin + best - 0.5) * voxel)
    if len(wall_tops) > 0:
        return float((floor_bin + np.bincount(wall_tops - floor_bin).argmax()) * voxel)
    within = z[(z > floor_bin) & (z < limit)]
    return float((np.percentile(within, 99) + 1) * voxel) if len(within) else floor


def drop_strays(occupied: IntArray) -> IntArray:
    """Voxels (n, 3) without those that stand alone."""
    return occupied[in_company(occupied)]
