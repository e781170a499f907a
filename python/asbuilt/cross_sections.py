"""Selective cross-sections (section 5.3 of the paper): which heights go into the ground-plane histogram.

Walls fill every height about equally; clutter does not. The slices of the height histogram that hold least are those
with the least clutter, so the paper takes the lowest N of them.
"""

from __future__ import annotations

import numpy as np

from asbuilt.errors import ParameterError
from asbuilt.grid import BoolArray, IntArray
from asbuilt.params import CrossSectionParameters
from asbuilt.storeys import Level


def select_cross_sections(
    occupied: IntArray, voxel: float, level: Level, slab: float, parameters: CrossSectionParameters | None = None
) -> BoolArray:
    """Which occupied voxels (n, 3) of side `voxel` (m) take part: a mask (n,).

    Voxels within `slab` (m) of the storey's floor or ceiling, or beyond, are its floor and ceiling (section 3.1) and
    never take part. Of the others, `parameters.select` decides. Without voxels the mask is empty.

    Raises
    ------
    ParameterError : the slice is not a multiple of the voxel.
    """
    parameters = parameters or CrossSectionParameters()
    per_slice = round(parameters.slice / voxel)
    if per_slice < 1 or abs(per_slice * voxel - parameters.slice) > 1e-9:
        raise ParameterError(f"cross_sections.slice = {parameters.slice}: expected a multiple of the {voxel} m voxel")
    low = (occupied[:, 2] + 0.5) * voxel
    inside = (low > level.floor + slab + voxel / 2) & (low < level.ceiling - slab)
    if parameters.select == "all" or not inside.any():
        return inside
    if parameters.select == "band":
        return inside & (low >= level.floor + parameters.band[0]) & (low < level.floor + parameters.band[1])
    slices = occupied[:, 2] // per_slice
    first = int(slices[inside].min())
    counts = np.bincount(slices[inside] - first)
    lowest = first + np.argsort(counts, kind="stable")[: parameters.count]
    return inside & np.isin(slices, lowest)
