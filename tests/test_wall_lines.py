"""Lines that walls may stand on: traced, joined, fitted to a millimetre."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt import _core
from asbuilt.params import WallParameters
from asbuilt.profiles import StoreyVoxels, columns
from asbuilt.wall_lines import find_wall_lines, fit_lines, join_collinear
from rooms import box_room, turned, voxels_of, without

WALLS = WallParameters()


def lines_of(*parts: np.ndarray) -> np.ndarray:
    """The lines of a one-storey cloud, in its own frame."""
    voxels = voxels_of(*parts)
    return find_wall_lines(columns(voxels), voxels, WALLS) + np.tile(voxels.origin, 2)


@pytest.mark.parametrize("degrees", [0.0, 17.0, 45.0, 88.0])
def test_the_planes_of_a_room_within_2_mm(degrees: float) -> None:
    ends = lines_of(turned(box_room(0, 0, 5, 4), degrees)).reshape(8, 2)
    found = turned(np.column_stack([ends, np.zeros(8)]), -degrees)
    x, y = found[:, 0].reshape(4, 2), found[:, 1].reshape(4, 2)
    upright = np.ptp(x, axis=1) < 0.1
    assert upright.sum() == 2
    # noise of 2 mm over thousands of points: what remains is the voxels' share, a millimetre
    assert x[upright][x[upright][:, 0].argsort()] == pytest.approx(np.array([[0, 0], [5, 5]]), abs=0.002)
    assert y[~upright][y[~upright][:, 0].argsort()] == pytest.approx(np.array([[0, 0], [4, 4]]), abs=0.002)
    # where a wall ends is for its face to say
    assert np.hypot(np.ptp(x, axis=1), np.ptp(y, axis=1))[upright] == pytest.approx(4, abs=0.25)


def test_two_faces_10_cm_apart_stay_two() -> None:
    found = lines_of(box_room(0, 0, 5, 4), box_room(5.1, 0, 9, 4))
    upright = found[np.abs(found[:, 0] - found[:, 2]) < 0.05]
    assert np.sort(upright[:, [0, 2]].mean(axis=1)) == pytest.approx([0, 5, 5.1, 9], abs=0.002)


def test_two_faces_4_cm_out_of_line_stay_two() -> None:
    room = without(box_room(0, 0, 8, 4), (3.9, -0.1, -0.1), (8.1, 0.04, 2.7))
    step = without(box_room(4, 0.04, 8, 3, 0, 2.6), (3.9, 0.05, -0.1), (8.1, 3.1, 2.7))
    found = lines_of(room, step)
    along_x = found[(np.abs(found[:, 1] - found[:, 3]) < 0.02) & (found[:, [1, 3]].mean(axis=1) < 1)]
    assert np.sort(along_x[:, [1, 3]].mean(axis=1)) == pytest.approx([0, 0.04], abs=0.003)


def test_no_voxels_no_lines() -> None:
    nothing = StoreyVoxels(np.zeros(2), *(np.zeros((0, n)) for n in (2, 2)), np.zeros(0), np.zeros((0, 3)), 0.05, 2.6)
    assert find_wall_lines(columns(nothing), nothing, WALLS).shape == (0, 4)


def joined(*lines: tuple[float, float, float, float]) -> np.ndarray:
    return join_collinear(np.array(lines, dtype=np.float64), np.arange(len(lines), 0, -1.0), WALLS)


def test_pieces_of_a_plane_are_joined() -> None:
    assert joined((0, 0, 3, 0), (3.5, 0.01, 5, 0.01), (9, 0, 7, 0)) == pytest.approx(np.array([[0, 0, 9, 0]]))
    assert len(joined((0, 0, 3, 0), (3.5, 0.05, 5, 0.05))) == 2  # another plane
    assert len(joined((0, 0, 3, 0), (8, 0, 12, 0))) == 2  # too far along
    assert len(joined((0, 0, 3, 0), (3.1, 0.0, 4, 0.05))) == 2  # turned


@pytest.mark.parametrize("boards", [0, 75])
def test_a_fit_stays_on_the_wall_though_boards_stand_before_it(boards: int) -> None:
    rng = np.random.default_rng(0)
    x = np.sort(rng.uniform(0, 6, 500))
    y = 0.01 + 0.002 * x + rng.normal(0, 0.003, 500)
    y[rng.permutation(500)[:boards]] += 0.025
    xy = np.column_stack([x, y])
    weights = rng.integers(1, 50, 500).astype(np.float64)
    places = _core.Places(xy, np.floor(xy).astype(np.int32), 1.0)
    found = fit_lines(np.array([[0.0, 0.0, 6.0, 0.0]]), places, weights, 0.03)
    # noise: 3 mm over the root of 425 points; plain least squares is 3.75 mm off
    assert found[0, [1, 3]] == pytest.approx(0.01 + 0.002 * found[0, [0, 2]], abs=0.0015)
