"""Wall segments from the ground-plane histogram by the Hough transform (section 3.3 of the paper)."""

from __future__ import annotations

import numpy as np

from asbuilt import _core
from asbuilt.grid import FloatArray
from asbuilt.ground import GroundPlaneHistogram, threshold_cells
from asbuilt.params import LineParameters


def detect_lines(histogram: GroundPlaneHistogram, parameters: LineParameters | None = None) -> FloatArray:
    """Line segments (n, 4: x1, y1, x2, y2), m, strongest first.

    The cells above the threshold vote, each once, for the lines through them. The incremental search takes the
    strongest line, cuts it to the longest run of its cells, removes that run from the histogram and its votes from
    the accumulator, and repeats; the batch search takes all local peaks at once. Both stop at `max_lines` lines or
    below `min_votes` votes. Without a dense cell there is no segment.
    """
    parameters = parameters or LineParameters()
    cells = threshold_cells(histogram, parameters.sigmas, parameters.statistics_over)
    cell = histogram.grid.cell
    ends, _ = _core.hough_lines(
        cells,
        incremental=parameters.method == "incremental",
        orientations=max(round(np.pi / parameters.theta_step), 1),
        rho_step=parameters.rho_step,
        fill_gap=parameters.fill_gap / cell,
        min_length=parameters.min_length / cell,
        min_votes=parameters.min_votes,
        max_lines=parameters.max_lines,
    )
    return histogram.grid.to_metres(ends.reshape(-1, 2, 2)).reshape(-1, 4)
