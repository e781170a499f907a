"""The experiments' baselines find the four walls of an empty room; their results are made by hand, not here."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "experiments"))

baselines = pytest.importorskip("baselines")
storey = pytest.importorskip("baselines.storey")

pytestmark = pytest.mark.slow

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


@pytest.mark.filterwarnings("default")  # of the libraries
@pytest.mark.parametrize("name", baselines.BASELINES)
def test_a_baseline_finds_the_walls_of_an_empty_room(name):
    from asbuilt.evaluate import associate, measure_walls

    baseline = baselines.BASELINES[name]
    for library in ("skimage", "cv2", "open3d"):
        pytest.importorskip(library, exc_type=ImportError)
    found = baseline.find(empty_room(), **baseline.parameters)
    walls = measure_walls(associate(found, ROOM), found, ROOM)
    # one wall of four may be lost to a method's chance or its cells; more is an error in the adapter
    assert walls.precision > 0.9
    assert walls.recall > 0.7
    assert walls.distance_error < 0.06
