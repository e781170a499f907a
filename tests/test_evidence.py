"""Evidence is the same for any order of points and files and any number of threads, and loses no millimetre."""

from __future__ import annotations

from functools import reduce
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

import asbuilt
from asbuilt import Evidence, InputError, ParameterError, _core, evidence_from_points, gather_evidence
from asbuilt.indices import in_company, rows_in, squeezed, unique_rows
from asbuilt.params import EvidenceParameters
from rooms import write_las

UTM = np.array([512_345.0, 5_403_210.0, 431.0])


def cloud(seed: int = 0, count: int = 4000) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-3, 3, (count, 3)).round(4)


def same(a: Evidence, b: Evidence) -> bool:
    return a.points == b.points and all(
        np.array_equal(getattr(a, name), getattr(b, name)) for name in ("index", "count", "mean", "covariance")
    )


def test_merging_in_any_order_gives_the_same() -> None:
    parts = [evidence_from_points(cloud(seed), scan=str(seed)) for seed in range(4)]
    whole = reduce(Evidence.merged, parts)
    for order in permutations(parts):
        merged = reduce(Evidence.merged, order)
        assert same(merged, whole)
        assert merged.scans == whole.scans
    # and grouped otherwise
    assert same(parts[0].merged(parts[1]).merged(parts[2].merged(parts[3])), whole)
    # and the same as of all points at once
    assert same(evidence_from_points(np.concatenate([cloud(seed) for seed in range(4)])), whole)


def test_the_order_of_points_does_not_matter() -> None:
    points = cloud()
    assert same(evidence_from_points(points), evidence_from_points(points[::-1]))
    assert same(evidence_from_points(points), evidence_from_points(np.random.default_rng(1).permutation(points)))


def test_threads_and_files_do_not_matter(tmp_path: Path) -> None:
    files = [write_las(tmp_path / f"{name}.las", cloud(seed), seed) for seed, name in enumerate("bca")]
    expected = gather_evidence(asbuilt.read(*files), threads=1)
    assert expected.points == 3 * len(cloud())
    for order in permutations(files):
        for threads in (1, 2, 7):
            found = gather_evidence(asbuilt.read(*order), threads=threads)
            assert same(found, expected)
            assert found.scans == expected.scans
            assert found.inputs == expected.inputs


def test_files_and_arrays_give_the_same(tmp_path: Path) -> None:
    points = cloud()
    assert same(gather_evidence(asbuilt.read(write_las(tmp_path / "a.las", points))), evidence_from_points(points))


def test_a_voxel_against_numpy() -> None:
    points = cloud(count=20_000)
    found = evidence_from_points(points, EvidenceParameters(voxel=0.5))
    index = np.floor(points / 0.5 + 1e-9).astype(int)
    rows, inverse, counts = np.unique(index, axis=0, return_inverse=True, return_counts=True)
    local = points - rows[inverse.ravel()] * 0.5
    assert np.array_equal(found.index, rows)
    assert np.array_equal(found.count, counts)
    mean = np.stack([np.bincount(inverse.ravel(), local[:, i]) / counts for i in range(3)], axis=1)
    # a tenth of a millimetre is what a coordinate is kept to
    assert np.allclose(found.mean, mean, atol=5e-5)
    for k, (i, j) in enumerate([(0, 0), (0, 1), (1, 1)]):
        product = np.bincount(inverse.ravel(), local[:, i] * local[:, j]) / counts
        assert np.allclose(found.covariance[:, k], product - mean[:, i] * mean[:, j], atol=5e-5)


@pytest.mark.parametrize("voxel", [0.05, 0.1, 0.2])
def test_occupied_against_numpy(voxel: float) -> None:
    # clear of the voxels' faces, where a float's last bit would decide
    points = (np.random.default_rng(2).integers(-400, 400, (5000, 3)) + 0.5) * 0.01
    twin = np.unique(np.floor(points / voxel).astype(int), axis=0)
    assert np.array_equal(evidence_from_points(points).occupied(voxel), twin)


def test_survey_coordinates_lose_no_millimetre(tmp_path: Path) -> None:
    # a whole number of voxels away, so that the voxels are the same ones
    points = cloud()
    near = evidence_from_points(points)
    far = gather_evidence(asbuilt.read(write_las(tmp_path / "utm.las", points + UTM)))
    assert np.array_equal(far.index, near.index + np.round(UTM / 0.05).astype(int))
    assert np.array_equal(far.count, near.count)
    # the coordinate's own rounding in float64 at 5,000 km, nothing more
    assert np.allclose(far.mean, near.mean, atol=1e-4)


def test_strays_neither_hurt_nor_vanish() -> None:
    strays = np.array([[90_000.0, -90_000.0, 5_000.0], [-1e4, 2e4, -900.0]])
    found = evidence_from_points(np.concatenate([cloud(), strays]))
    assert found.points == len(cloud()) + 2
    assert {tuple(row) for row in np.floor(strays / 0.05).astype(int)} <= {tuple(row) for row in found.index}


def test_points_that_are_not_finite_are_left_out_and_named(tmp_path: Path) -> None:
    lines = ["1.0 2.0 3.0", "nan 2.0 3.0", "1.0 inf 3.0", "1.5 2.0 3.0"]
    path = tmp_path / "holes.xyz"
    path.write_text("\n".join(lines) + "\n")
    found = gather_evidence(asbuilt.read(path))
    assert found.points == 2
    assert len(found.skipped) == 1
    assert "holes.xyz: 2 points" in found.skipped[0]


def test_a_file_without_a_usable_point_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "none.xyz"
    path.write_text("nan nan nan\n" * 3)
    with pytest.raises(InputError, match=r"none\.xyz"):
        gather_evidence(asbuilt.read(path))


def test_nothing_in_nothing_out() -> None:
    found = evidence_from_points(np.zeros((0, 3)))
    assert found.points == 0
    assert found.index.shape == (0, 3)
    assert found.occupied(0.1).shape == (0, 3)


def test_voxels_that_do_not_fit_are_refused() -> None:
    found = evidence_from_points(cloud())
    with pytest.raises(ParameterError, match=r"multiple of the evidence's 0\.05"):
        found.occupied(0.12)
    with pytest.raises(ParameterError, match=r"evidence\.voxel"):
        EvidenceParameters(voxel=0.0)
    with pytest.raises(ParameterError, match="voxel"):
        found.merged(evidence_from_points(cloud(), EvidenceParameters(voxel=0.1)))


def test_rows_against_numpy() -> None:
    rng = np.random.default_rng(3)
    a, b = rng.integers(-5, 5, (400, 3)), rng.integers(-5, 5, (100, 3))
    assert np.array_equal(unique_rows(a), np.unique(a, axis=0))
    assert np.array_equal(rows_in(a, b), (a[:, None] == b[None]).all(axis=2).any(axis=1))
    assert not rows_in(a, b[:0]).any()
    assert len(rows_in(a[:0], b)) == 0


def test_coarser_voxels_and_company_against_numpy() -> None:
    index = unique_rows(np.random.default_rng(4).normal(0, 12, (600, 3)).astype(np.int64))
    for factor, least in ((1, 8), (2, 20)):
        coarse = np.unique(index // factor, axis=0)
        assert np.array_equal(_core.coarser(index.astype(np.int32), factor), coarse)
        apart = np.abs((index // factor // 4)[:, None] - coarse // 4).max(axis=2)
        together = (apart <= 1).sum(axis=1) >= least
        assert 0 < together.sum() < len(index)
        assert np.array_equal(in_company(index, factor, least), together)


def test_squeezed_cells_keep_what_is_near_and_lose_what_lies_between() -> None:
    rng = np.random.default_rng(0)
    cells = rng.integers(0, 9, (100, 2)) + np.repeat([(0, 0), (-70_000, 90_000)], 50, axis=0)
    found = squeezed(cells, 3)
    assert found.min(axis=0).tolist() == [0, 0]
    assert found.max() < 2 * 9 + 3
    before, after = (np.abs(part[:, None] - part).astype(int) for part in (cells, found))
    np.testing.assert_array_equal(np.minimum(after, 4), np.minimum(before, 4))
    assert (np.sign(found[:, None] - found) == np.sign(cells[:, None] - cells)).all()
