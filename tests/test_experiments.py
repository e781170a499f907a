"""The experiments' own methods find the walls of rooms of known size; their results are made by hand, not here."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "experiments"))

import baselines
import uncertain_hough
from asbuilt import evidence_from_points
from asbuilt.evaluate import associate, measure_walls
from baselines import storey

ROOM = np.array([[0.0, 0.0, 6.0, 0.0], [6.0, 0.0, 6.0, 4.5], [6.0, 4.5, 0.0, 4.5], [0.0, 4.5, 0.0, 0.0]])


def empty_room():
    """A room of 6 by 4.5 m and 3 m height, 2 cm between points, seen from its middle."""
    height = np.arange(0.0, 3.0, 0.02)
    parts = []
    for x1, y1, x2, y2 in ROOM:
        share = np.arange(0.0, 1.0, 0.02 / np.hypot(x2 - x1, y2 - y1))
        along, z = (grid.ravel() for grid in np.meshgrid(share, height))
        parts.append(np.column_stack([x1 + along * (x2 - x1), y1 + along * (y2 - y1), z]))
    points = np.concatenate(parts) + np.random.default_rng(1).normal(0, 0.002, (sum(map(len, parts)), 3))
    scan = np.zeros(len(points), dtype=np.int64)
    return storey.StoreyCloud(points, scan, np.array([[3.0, 2.2, 1.5]]), 0.0, 3.0)


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the libraries
@pytest.mark.parametrize("name", baselines.BASELINES)
def test_a_baseline_finds_the_walls_of_an_empty_room(name):
    baseline = baselines.BASELINES[name]
    for library in ("skimage", "cv2", "open3d"):
        pytest.importorskip(library, exc_type=ImportError)
    found = baseline.find(empty_room(), **baseline.parameters)
    walls = measure_walls(associate(found, ROOM), found, ROOM)
    # one wall of four may be lost to a method's chance or its cells; more is an error in the adapter
    assert walls.precision > 0.9
    assert walls.recall > 0.7
    assert walls.distance_error < 0.06


# --- the Hough transform that takes uncertainty into account ---


def cells_of(points):
    evidence = evidence_from_points(points)
    inside = evidence.index[(evidence.index[:, 2] >= 2) & (evidence.index[:, 2] < 60)]
    return uncertain_hough.cells_of_points(evidence, np.unique(inside // 2, axis=0), 0.1)


def wall(rng, x1, y1, x2, y2, top=3.0, noise=0.003):
    """Points of a wall from floor to `top`, 1.5 cm apart."""
    along = np.arange(0, np.hypot(x2 - x1, y2 - y1), 0.015)
    share, z = (grid.ravel() for grid in np.meshgrid(along / along[-1], np.arange(0, top, 0.015)))
    points = np.column_stack([x1 + share * (x2 - x1), y1 + share * (y2 - y1), z])
    return points + rng.normal(0, noise, points.shape)


@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_points_vote_for_lines_finer_than_their_cells(turn):
    rng = np.random.default_rng(2)
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    lines = (ROOM.reshape(-1, 2) @ rotation).reshape(-1, 4)
    table = wall(rng, 2.0, 1.0, 4.0, 1.0, top=0.75)
    table[:, :2] = table[:, :2] @ rotation
    cells = cells_of(np.concatenate([*(wall(rng, *line) for line in lines), table]))
    weight = uncertain_hough.filled_share(cells)
    found = uncertain_hough.fit_to_points(uncertain_hough.detect_lines(cells, weight), cells, weight)
    walls = measure_walls(associate(found, lines), found, lines)
    assert len(found) == 4  # the table is none
    assert walls.precision > 0.98
    assert walls.recall > 0.98
    assert walls.distance_error < 0.001  # cells are 5 cm
    assert walls.orientation_error_deg < 0.05


def test_both_faces_of_a_thin_wall_have_their_line():
    rng = np.random.default_rng(3)
    faces = np.array([[0.03, 0.02, 4.0, 0.02], [0.03, 0.10, 4.0, 0.10]])
    cells = cells_of(np.concatenate([wall(rng, *face) for face in faces]))
    found = uncertain_hough.detect_lines(cells, uncertain_hough.filled_share(cells))
    np.testing.assert_allclose(sorted((found[:, 1] + found[:, 3]) / 2), [0.02, 0.10], atol=0.002)


def test_the_probability_of_wall_is_learned_from_the_counts():
    rng = np.random.default_rng(4)
    height = 28
    filled = np.concatenate([rng.binomial(height, 0.07, 5000), rng.binomial(height, 0.8, 600)])
    cells = uncertain_hough.Cells(np.zeros((5600, 2)), np.zeros((5600, 3)), filled, height, 0.1)
    probability = uncertain_hough.wall_probability(cells)
    assert probability[:5000].max() < 0.01
    assert probability[5000:].min() > 0.9


def test_without_cells_there_is_no_line():
    none = cells_of(np.zeros((0, 3)))
    assert uncertain_hough.detect_lines(none, uncertain_hough.filled_share(none)).shape == (0, 4)
