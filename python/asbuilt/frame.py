"""Whether a cloud stands upright and counts in metres, told from what it shows (not in the paper).

Scanners level themselves and survey in metres, but a mesh program puts y upward, a CAD program counts in millimetres
and some countries in feet, and few formats say so. Free height of 2 to 6 m between two planes is what floors and
ceilings have in common: over all rooms of a storey they share their planes, and the sides of rooms do not. On all our
buildings, real and made up, the largest pair of planes that face z has 2 to 50 times the area of those that face x or
y. Heights of doors and rooms tell feet. What is doubtful is said in a note; only a building that certainly lies on its
side is an error, and only where nobody said which axis is up (`check_upright`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from asbuilt import _core
from asbuilt.errors import InputError
from asbuilt.evidence import Evidence
from asbuilt.grid import FloatArray, IntArray
from asbuilt.indices import unique_rows
from asbuilt.plan import Storey
from asbuilt.read import UNITS

_CELL = 0.2
"""Voxels for this are about so large, m: planes of 5 cm would be split by tilt and noise."""
_FREE = (1.8, 6.0)
"""Floor and ceiling are this far apart, m."""
_SAMPLE = 200_000
"""Columns are left out so that about this many voxels remain."""
_CERTAIN, _DOUBTFUL = 5.0, 1.8
"""Areas this many times as large as those that face z are the floors; rooms alike in a row may reach 1.7."""
_WALLS = 1.0
"""Walls between floor and ceiling within a building are longer than this, in sides of a square of its area; between the
two sides of a lane is nothing."""
_ON_HEAD = 0.15
"""An opening that ends this near to floor or ceiling reaches it, m."""
_DOOR_HEIGHT, _DOOR_WIDTH = (1.85, 2.3), 2.0
"""Doors are so high, and less wide, m."""
_HANGING = 2
"""So many doors that hang from the ceiling are no windows."""
_LEAST_AREA = 10.0
"""Less tells nothing, m2."""


@dataclass(frozen=True)
class Upward:
    """The axis that a building's floors and ceilings face, where that is not z.

    Attributes
    ----------
    axis : of the files, as `read` takes it for `up`, such as "-y": from the plane with more standing on it to the other
        one.
    instead : the axis that was taken to point up.
    areas : of the largest pair of planes that face the one and the other, m2.
    certain : no building stands like that.
    """

    axis: str
    instead: str
    areas: tuple[float, float]
    certain: bool

    def __str__(self) -> str:
        area, other = self.areas
        return (
            f"up: the largest floor and ceiling, {area:.0f} m2, face {self.axis[-1]}, and of those that face "
            f"{self.instead[-1]} the largest have {other:.0f} m2; read the points with --up {self.axis} "
            f"(or {_reverse(self.axis)})"
        )


def find_upward(evidence: Evidence) -> Upward | None:
    """Which axis points up if not the one that was taken to; None where it does or nothing tells (no voxel)."""
    factor = max(round(_CELL / evidence.voxel), 1)
    cells = np.ascontiguousarray(_core.coarser(evidence.index.astype(np.int32, copy=False), factor).T)
    every = max(len(evidence.index) // _SAMPLE, 1)
    found = [_largest_pair(cells, axis, factor * evidence.voxel, every) for axis in range(3)]
    areas = np.array([pair.area for pair in found])
    best = int(areas.argmax())
    others = np.delete(areas, best)
    if best == 2 or areas[best] < _LEAST_AREA or areas[best] < _DOUBTFUL * others.max():
        return None
    certain = areas[best] >= _CERTAIN * areas[2] and areas[best] >= _CERTAIN / 2 * others.max()
    certain = certain and found[best].walls >= _WALLS * np.sqrt(areas[best])
    axis = _axis_of_files(evidence, best if found[best].stands else best - 3)
    return Upward(axis, _axis_of_files(evidence, 2), (float(areas[best]), float(areas[2])), bool(certain))


def doubt_up(evidence: Evidence) -> str | None:
    """A line where another axis than z seems to point up, or None."""
    upward = find_upward(evidence)
    return None if upward is None else str(upward)


def check_upright(evidence: Evidence) -> None:
    """For clouds of which nobody said which axis points up.

    Raises
    ------
    InputError : the building certainly lies on its side.
    """
    upward = find_upward(evidence)
    if upward is not None and upward.certain:
        raise InputError(f"{upward}, else with --up {upward.instead}")


def doubt_head(evidence: Evidence, storeys: Iterable[Storey]) -> str | None:
    """A line where a building seems to stand on its head, or None: no door stands on a floor, and some hang.

    On its head the lintel of a door lies on the floor, and its threshold at the ceiling; windows that reach so far down
    from a ceiling are seldom as high and as wide as doors. Heights tell nothing: as much hangs as stands.
    """
    levels = list(storeys)
    hanging = [
        hole
        for storey in levels
        for hole in storey.windows
        if hole.sill is not None and hole.head is not None and hole.sill > _ON_HEAD
        if storey.ceiling - storey.floor - hole.head < _ON_HEAD
        if _DOOR_HEIGHT[0] < hole.head - hole.sill < _DOOR_HEIGHT[1] and hole.width < _DOOR_WIDTH
    ]
    if len(hanging) < _HANGING or any(storey.doors for storey in levels):
        return None
    return (
        f"up: no door stands on a floor, and {len(hanging)} openings of a door's size hang from the ceiling; if the "
        f"building stands on its head, read the points with --up {_reverse(_axis_of_files(evidence, 2))}"
    )


def _axis_of_files(evidence: Evidence, axis: int) -> str:
    """Name of the files' axis that became x, y or z (0 to 2), or their reverse (-3 to -1)."""
    signed = evidence.axes[axis]
    return f"{'-' if (signed < 0) != (axis < 0) else ''}{'xyz'[abs(signed) - 1]}"


def _reverse(axis: str) -> str:
    return axis[1:] if axis.startswith("-") else f"-{axis}"


def doubt_unit(storeys: Iterable[Storey]) -> str | None:
    """A line where rooms and doors are those of a cloud in feet or smaller units that was read as metres, or None.

    Half of the doors end above 5 m, as gates do in a hall without other doors; or no door is found and a storey is
    higher than 6.5 m.
    """
    levels = list(storeys)
    heads = [door.head for storey in levels for door in storey.doors if door.head is not None]
    height = max((storey.ceiling - storey.floor for storey in levels), default=0.0)
    if heads:
        head = float(np.median(heads))
        return None if head < 5.0 else f"unit: doors {head:.1f} m high: {_ask(head / 2.05)}"
    return None if height < 6.5 else f"unit: a storey {height:.1f} m high: {_ask(height / 2.7)}"


def doubt_extent(evidence: Evidence) -> str | None:
    """A line on how high a cloud without storeys is, where that is not the height of a building, or None."""
    if evidence.points == 0:
        return None
    z = np.sort(evidence.index[:, 2] * evidence.voxel)
    low, high = z[int(0.02 * len(z))], z[-1 - int(0.02 * len(z))]
    height = float(high - low)
    if 1.5 <= height <= 60.0:
        return None
    if height < 1.5:
        return f"unit: from bottom to top the points reach {height:.2f} m; they may be in a larger unit, or flat"
    return f"unit: from bottom to top the points reach {height:,.0f} m: {_ask(height / 3.0)}"


def _ask(factor: float) -> str:
    """The question for things that are too large by a factor."""
    units = {name: 1 / size for name, size in UNITS.items() if size < 1.0 and name != "us-ft"}
    nearest = min(units, key=lambda name: abs(np.log(factor * UNITS[name])))
    return f"if the points are in {nearest}, read them with --unit {nearest}"


class _Pair(NamedTuple):
    """Two planes across an axis with nothing between them over an area (m2).

    `stands`: more stands on the first than hangs from the second; `walls`: length (m) of what reaches from one to the
    other, those all around left out.
    """

    area: float
    stands: bool
    walls: float


def _largest_pair(cells: IntArray, axis: int, cell: float, every: int) -> _Pair:
    """The pair of the largest area, of `cells` (3: x, y, z; n) of `cell` metres, in one column of so many."""
    nothing = _Pair(0.0, True, 0.0)
    a, b = (cells[other] for other in range(3) if other != axis)
    mixed = a + 3 * b
    chosen = np.flatnonzero(mixed == mixed // every * every)
    along, a, b = (column[chosen].astype(np.int64) for column in (cells[axis], a, b))
    if len(along) == 0:
        return nothing
    along, a, b = along - along.min(), a - a.min(), b - b.min()
    span, wide = int(along.max()) + 1, int(b.max()) + 1
    if float(a.max() + 1) * wide * span > 2**62:
        return nothing  # strays a world apart
    keys = unique_rows(((a * wide + b) * span + along)[:, None])[:, 0]
    gap, start = np.diff(keys), keys[:-1]
    low, high = (round(free / cell) for free in _FREE)
    free = (gap >= low) & (gap <= high) & (start // span == keys[1:] // span)
    if not free.any():
        return nothing
    width = high + 2
    pairs, counts = np.unique((start[free] % span) * width + gap[free], return_counts=True)
    # a plane may lie in two layers of voxels
    total = np.sum([_counts_at(pairs, counts, pairs + step) for step in (0, 1, width, width + 1)], axis=0)
    best = int(np.argmax(total))
    first, apart = divmod(int(pairs[best]), width)
    reach, place = round(1.2 / cell), keys % span
    standing = np.count_nonzero((place > first + 1) & (place <= first + 1 + reach))
    hanging = np.count_nonzero((place < first + apart) & (place >= first + apart - reach))
    columns, filled = np.unique(keys[(place > first) & (place < first + apart)] // span, return_counts=True)
    ground = np.column_stack(np.divmod(columns[filled >= 0.8 * (apart - 1)], wide))
    around = np.quantile(ground, (0.02, 0.98), axis=0) if len(ground) else np.zeros((2, 2))
    inner = ((ground > around[0] + 0.6 / cell) & (ground < around[1] - 0.6 / cell)).all(axis=1)
    walls = float(np.count_nonzero(inner)) * every * cell
    return _Pair(float(total[best]) * every * cell**2, bool(standing >= hanging), walls)


def _counts_at(pairs: IntArray, counts: IntArray, wanted: IntArray) -> FloatArray:
    """The count of each wanted pair, 0 where there is none."""
    place = np.minimum(np.searchsorted(pairs, wanted), len(pairs) - 1)
    return np.where(pairs[place] == wanted, counts[place], 0).astype(np.float64)
