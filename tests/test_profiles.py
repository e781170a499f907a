"""The voxels of a storey, looked up by place: against searches through all of them."""

from __future__ import annotations

import numpy as np
import pytest

import rooms
from asbuilt import ParameterError, _core
from asbuilt.profiles import StoreyVoxels

ROOM = rooms.box_room(0, 0, 4, 3)


@pytest.fixture(scope="module")
def voxels() -> StoreyVoxels:
    return rooms.voxels_of(ROOM)


@pytest.mark.parametrize(
    "segment", [(0, 0, 4, 0), (3, 2.8, 0.2, -0.3), (2, 9, 2, -9), (1, 1, 1.01, 1), (50, 50, 51, 50)]
)
@pytest.mark.parametrize(("half_width", "margin"), [(0.03, 0.0), (0.35, 2.0)])
def test_strips_hold_what_lies_in_them(
    voxels: StoreyVoxels, segment: tuple[float, ...], half_width: float, margin: float
) -> None:
    ends = np.array(segment, dtype=np.float64)
    way = (ends[2:] - ends[:2]) / np.hypot(*(ends[2:] - ends[:2]))
    apart = voxels.xy - ends[:2]
    along, offset = apart @ way, apart @ np.array([-way[1], way[0]])
    length = np.hypot(*(ends[2:] - ends[:2]))
    inside = np.flatnonzero((np.abs(offset) <= half_width) & (along >= -margin) & (along <= length + margin))
    number, voxel, found_along, found_offset = voxels.strips(np.array([ends[[2, 3, 0, 1]], ends]), half_width, margin)
    assert np.array_equal(voxel[number == 1], inside)
    assert found_along[number == 1] == pytest.approx(along[inside], abs=1e-12)
    assert found_offset[number == 1] == pytest.approx(offset[inside], abs=1e-12)


def test_boxes_hold_what_lies_in_them(voxels: StoreyVoxels) -> None:
    low, high = np.array([0.5, -0.2]), np.array([1.7, 2.0])
    inside = ((voxels.xy >= low) & (voxels.xy <= high)).all(axis=1)
    assert np.array_equal(voxels.in_box(low, high), np.flatnonzero(inside))
    assert inside.any()
    assert len(voxels.in_box(high, low)) == 0
    between = inside & (voxels.z > 0.4) & (voxels.z < 1.1)
    assert 0 < between.sum() < inside.sum()
    assert np.array_equal(voxels.in_box(low, high, (0.4, 1.1)), np.flatnonzero(between))


def test_the_highest_voxel_over_each_cell(voxels: StoreyVoxels) -> None:
    low, tops = voxels.tops
    cell = np.floor(np.array([1.23, 1.68]) / 0.1).astype(int)
    here = (np.floor(voxels.xy / 0.1) == cell).all(axis=1)
    assert tops[tuple(cell - low)] == voxels.z[here].max()
    assert np.isneginf(tops[[0, -1]]).all()
    assert np.isneginf(tops[:, [0, -1]]).all()


def test_no_voxels() -> None:
    nothing = StoreyVoxels(np.zeros(2), *(np.zeros((0, 2)),) * 2, np.zeros(0), np.zeros((0, 3)), 0.05, 2.6)
    assert [len(column) for column in nothing.strips(np.array([[0.0, 0.0, 1.0, 1.0]]), 1.0)] == [0, 0, 0, 0]
    assert len(nothing.in_box((-1, -1), (1, 1))) == 0
    assert not np.isfinite(nothing.tops[1]).any()


def test_voxels_out_of_order_are_refused() -> None:
    with pytest.raises(ParameterError, match="sorted by their cells"):
        _core.Places(np.zeros((2, 2)), np.array([[1, 0], [0, 0]], dtype=np.int32), 0.05)


def test_hits_are_counted_by_step_depth_and_height(voxels: StoreyVoxels) -> None:
    lines, step, margin = np.array([(0.0, 0.0, 4.0, 0.0), (3.9, 2.5, 3.9, 0.5)]), 0.3, 0.2
    first = np.array([0, 15, 23])
    steps = int(first[-1])
    hits = voxels.hits(lines, 0.35, margin, step, first)
    line, voxel, along, offset = voxels.strips(lines, 0.35, margin)
    at = np.minimum(((along + margin) / step).astype(np.int64) + first[line], first[line + 1] - 1)
    z = voxels.z[voxel]
    assert hits.highest == z.max()
    random = np.random.default_rng(1)
    for side in (-1.0, 1.0):
        sides, depth = np.full(steps, side), (np.full(steps, -0.02), random.uniform(0.0, 0.4, steps))
        about, height = random.uniform(0.5, 2.0, steps), (np.full(steps, -0.4), np.full(steps, 0.3))
        inside = (side * offset > depth[0][at]) & (side * offset < depth[1][at])
        inside &= (z - about[at] > -0.4) & (z - about[at] < 0.3)
        assert inside.sum() > 50
        ranges = (sides, depth, about, height)
        counts, again = hits.counts([ranges, ranges])
        assert np.array_equal(counts, np.bincount(at[inside], minlength=steps))
        assert np.array_equal(counts, again)
        for found, values in (
            (hits.by_depth(ranges, 0.1, 3), side * offset),
            (hits.by_height(ranges, 0.1, 30), z),
        ):
            expected = np.zeros(found.shape)
            cell = (values[inside] / 0.1).astype(np.int64)
            within = cell < found.shape[1]
            np.add.at(expected, (at[inside][within], cell[within]), 1)
            assert np.array_equal(found, expected)


def test_heights_are_looked_up_about_places(voxels: StoreyVoxels) -> None:
    low, tops = voxels.tops
    random = np.random.default_rng(2)
    places, aside, along = random.uniform(-1.0, 5.0, (3, 50, 2))
    steps = np.array([(0.15, -0.2), (0.9, 0.0), (0.3, 0.1), (0.1, 0.1), (0.0, 0.2)])
    first = (int(low[0]), int(low[1]))
    found = _core.height_about(tops, first, 0.1, steps, places, aside, along, share=0.7, least=2)
    assert 10 < np.isfinite(found).sum() < 50
    for at, to_side, onward, height in zip(places, aside, along, found, strict=True):
        cell = np.floor((at + steps[:, :1] * to_side + steps[:, 1:] * onward) / 0.1).astype(np.int64) - low
        heights = tops[tuple(np.clip(cell, 0, np.array(tops.shape) - 1).T)]
        known = np.sort(heights[np.isfinite(heights)])
        assert np.isnan(height) if len(known) < 2 else height == known[round(0.7 * (len(known) - 1))]


def test_means_stay_within_their_lines() -> None:
    values = np.random.default_rng(3).uniform(size=(20, 2))
    first = np.array([0, 7, 7, 20])
    means = _core.means_along(values, first, 5)
    line = np.searchsorted(first, np.arange(20), side="right") - 1
    for step, mean in enumerate(means):
        about = slice(max(step - 2, first[line[step]]), min(step + 3, first[line[step] + 1]))
        assert mean == pytest.approx(values[about].mean(axis=0), abs=1e-12)
    with pytest.raises(ValueError, match="first"):
        _core.means_along(values, first[:-1], 5)
