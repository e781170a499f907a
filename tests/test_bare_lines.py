"""Lines on which nothing stands as a wall does are left out, and no other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from asbuilt.bare_lines import drop_bare
from asbuilt.params import WallParameters
from asbuilt.profiles import StoreyVoxels, storey_voxels
from asbuilt.storeys import find_storeys
from rooms import box, box_room, evidence

PARAMETERS = WallParameters()
WALL, TABLE, NOTHING = (0.0, 0.0, 5.0, 0.0), (1.0, 2.0, 3.0, 2.0), (1.0, 1.0, 4.0, 1.0)


def scene() -> tuple[StoreyVoxels, np.ndarray]:
    cloud = evidence(box_room(0, 0, 5, 4), box(1.0, 2.0, 3.0, 3.0, 0.75))
    [level] = find_storeys(cloud)
    voxels = storey_voxels(cloud, level, None)
    return voxels, np.array([WALL, TABLE, NOTHING]) - np.tile(voxels.origin, 2)


def test_what_stands_to_the_ceiling_stays_and_a_table_does_not() -> None:
    voxels, lines = scene()
    assert np.array_equal(drop_bare(lines, voxels, PARAMETERS), lines[:1])


def test_a_wall_under_a_lower_ceiling_than_the_storeys_stays() -> None:
    voxels, lines = scene()
    higher = replace(voxels, height=voxels.height + 1.5)
    assert np.array_equal(drop_bare(lines, higher, PARAMETERS), lines[:1])


def test_a_screen_that_one_can_look_over_stays() -> None:
    cloud = evidence(box_room(0, 0, 5, 4), box(1.0, 2.0, 3.0, 2.1, 1.9))
    [level] = find_storeys(cloud)
    voxels = storey_voxels(cloud, level, None)
    lines = np.array([TABLE, NOTHING]) - np.tile(voxels.origin, 2)
    assert np.array_equal(drop_bare(lines, voxels, PARAMETERS), lines[:1])


def test_no_lines() -> None:
    voxels, lines = scene()
    assert drop_bare(lines[:0], voxels, PARAMETERS).shape == (0, 4)
