"""Dominant orientations and snapping, on segments whose directions are known."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt import dominant_orientations, orientation_distribution, snap_to
from asbuilt.orientation import angle_between, lengths, orientations


def fan(degrees: list[float], length: list[float] | float = 2.0) -> np.ndarray:
    """Segments of the given directions about places of their own."""
    angle = np.radians(degrees)
    half = np.broadcast_to(length, angle.shape)[:, None] / 2 * np.column_stack([np.cos(angle), np.sin(angle)])
    centre = np.random.default_rng(0).uniform(-20, 20, (len(angle), 2))
    return np.hstack([centre - half, centre + half])


def test_orientations_have_no_direction() -> None:
    segments = fan([0, 30, 90, 179, 180, 210, -1])
    assert np.degrees(orientations(segments)) % 180 == pytest.approx([0, 30, 90, 179, 0, 30, 179], abs=1e-9)
    turned = segments[:, [2, 3, 0, 1]]
    assert angle_between(orientations(segments), 0.3) == pytest.approx(angle_between(orientations(turned), 0.3))
    assert lengths(segments) == pytest.approx(2.0)


def test_the_short_way_round() -> None:
    assert np.degrees(angle_between(np.radians([1.0, 179.0, 100.0]), np.radians(179.0))) == pytest.approx([2, 0, -79])


def test_distribution_is_weighed_by_length() -> None:
    distribution = orientation_distribution(fan([10, 10, 100], [3.0, 1.0, 7.0]), np.radians(1))
    assert distribution.shape == (180,)
    assert distribution[[10, 100]] == pytest.approx([4.0, 7.0])
    # over three bins, half of it in the next ones
    assert distribution.sum() == pytest.approx(2 * 11.0)


@pytest.mark.parametrize("turn", [0.0, 0.4, 17.0, 44.7, 89.6, 90.2, 133.0, 179.8])
def test_dominant_and_secondary(turn: float) -> None:
    rng = np.random.default_rng(1)
    degrees = np.concatenate([rng.normal(turn, 0.2, 40), rng.normal(turn + 93, 0.2, 20), rng.uniform(0, 180, 10)])
    found = dominant_orientations(fan(degrees.tolist(), [2.0] * 60 + [0.5] * 10))
    assert found is not None
    # a mean of forty that scatter by 0.2 degrees
    off = angle_between(np.array(found), np.radians(turn))
    assert np.degrees(off[0]) == pytest.approx(0, abs=0.15)
    assert np.degrees(off[1]) % 180 == pytest.approx(93, abs=0.15)


def test_without_a_second_direction_it_is_the_perpendicular() -> None:
    found = dominant_orientations(fan([20.0, 20.0]))
    assert found is not None
    assert np.degrees(found) == pytest.approx([20, 110])
    assert dominant_orientations(np.zeros((0, 4))) is None


def test_snapping_turns_about_the_centre() -> None:
    segments = fan([1.0, 4.0, 6.0, 88.0, 45.0, 178.0], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    snapped = snap_to(segments, (0.0, np.pi / 2), np.radians(5))
    assert np.degrees(orientations(snapped)) % 179.999999 == pytest.approx([0, 0, 6, 90, 45, 0], abs=1e-5)
    assert lengths(snapped) == pytest.approx(lengths(segments))
    assert snapped[:, :2] + snapped[:, 2:] == pytest.approx(segments[:, :2] + segments[:, 2:])
    # none is turned round
    assert ((snapped[:, 2:] - snapped[:, :2]) * (segments[:, 2:] - segments[:, :2])).sum(axis=1).min() > 0
    # once is enough
    assert snap_to(snapped, (0.0, np.pi / 2), np.radians(5)) == pytest.approx(snapped)


def test_snapping_nothing() -> None:
    segments = fan([3.0])
    before = segments.copy()
    assert np.array_equal(snap_to(segments, (), 0.1), segments)
    assert np.array_equal(snap_to(segments, (0.0,), 0.0), snap_to(segments, (1.5,), 0.1))
    assert np.array_equal(segments, before)
    assert snap_to(np.zeros((0, 4)), (0.0,), 0.1).shape == (0, 4)
