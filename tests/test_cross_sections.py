"""Which heights take part, against counts made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt import ParameterError, select_cross_sections
from asbuilt.params import CrossSectionParameters
from asbuilt.storeys import Level

#: Off the voxels' faces and middles, where a float's last bit would decide.
LEVEL = Level(0, 0.01, 2.61)
VOXEL, SLAB = 0.1, 0.1


def stack(counts: dict[int, int]) -> np.ndarray:
    """Voxels: `counts[iz]` of them at height iz."""
    return np.array([(i, 0, iz) for iz, count in counts.items() for i in range(count)])


def heights(counts: dict[int, int], slab: float = SLAB, **parameters: object) -> list[int]:
    occupied = stack(counts)
    mask = select_cross_sections(occupied, VOXEL, LEVEL, slab, CrossSectionParameters(**parameters))
    assert mask.shape == (len(occupied),)
    # a slice takes part as a whole or not at all
    chosen = set(occupied[mask, 2].tolist())
    assert not chosen & set(occupied[~mask, 2].tolist())
    return sorted(chosen)


def test_all_but_floor_and_ceiling() -> None:
    everywhere = dict.fromkeys(range(-3, 30), 2)
    # a voxel's middle is more than the slab and half a voxel over the floor, and more than the slab under the ceiling
    assert heights(everywhere, select="all") == list(range(2, 25))
    assert heights(everywhere, slab=0.3, select="all") == list(range(4, 23))


def test_a_band_is_above_the_floor() -> None:
    everywhere = dict.fromkeys(range(30), 2)
    assert heights(everywhere, select="band", band=(1.0, 1.5)) == [10, 11, 12, 13, 14]


def test_the_lowest_slices() -> None:
    counts = dict.fromkeys(range(26), 9)
    counts |= {4: 1, 12: 2, 20: 3}
    assert heights(counts, select="lowest", count=3) == [4, 12, 20]
    assert heights(counts, select="lowest", count=2) == [4, 12]
    # of equal ones the lower
    assert heights(counts, select="lowest", count=5) == [2, 3, 4, 12, 20]
    assert heights(counts, select="lowest", count=100) == list(range(2, 25))


def test_a_slice_may_be_several_voxels() -> None:
    counts = dict.fromkeys(range(26), 5) | {8: 1, 9: 1, 14: 2, 15: 1}
    assert heights(counts, select="lowest", count=2, slice=0.2) == [8, 9, 14, 15]
    with pytest.raises(ParameterError, match=r"cross_sections\.slice"):
        heights(counts, slice=0.15)


def test_height_of_the_storey_does_not_matter() -> None:
    occupied = stack(dict.fromkeys(range(26), 4) | {7: 1})
    parameters = CrossSectionParameters(count=1)
    low = select_cross_sections(occupied, VOXEL, LEVEL, SLAB, parameters)
    lifted = Level(3, 12.01, 14.61)
    assert np.array_equal(low, select_cross_sections(occupied + np.array([0, 0, 120]), VOXEL, lifted, SLAB, parameters))


def test_no_voxels() -> None:
    for select in ("all", "band", "lowest"):
        nothing = np.zeros((0, 3), dtype=np.int64)
        mask = select_cross_sections(nothing, VOXEL, LEVEL, SLAB, CrossSectionParameters(select=select))
        assert mask.shape == (0,)
