"""A picture of the points from above, for looking at plans against (figure 1b of the paper)."""

from __future__ import annotations

import numpy as np

from asbuilt.evidence import Evidence
from asbuilt.grid import FloatArray, Grid
from asbuilt.plan import Storey


def density_image(evidence: Evidence, storey: Storey) -> tuple[FloatArray, tuple[float, float, float, float]]:
    """Filled voxels above each ground cell between a storey's floor and ceiling.

    Returns
    -------
    image : (h, w) float64, the row at the least y first; as wide as an evidence voxel a pixel. Far strays are cut off.
    extent : x0, x1, y0, y1 of the image, m.
    """
    z = (evidence.index[:, 2] + 0.5) * evidence.voxel
    inside = evidence.index[(z > storey.floor + 0.15) & (z < storey.ceiling - 0.1), :2]
    if len(inside) == 0:
        return np.zeros((0, 0)), (0.0, 0.0, 0.0, 0.0)
    low, high = np.percentile(inside, [0.5, 99.5], axis=0)
    margin = 1.0 / evidence.voxel
    grid = Grid(
        evidence.voxel,
        (int(low[0] - margin), int(low[1] - margin)),
        (int(high[0] - low[0] + 2 * margin) + 1, int(high[1] - low[1] + 2 * margin) + 1),
    )
    return grid.count(inside).T.astype(np.float64), grid.extent
