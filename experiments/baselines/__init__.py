"""The systems that the paper names, as baselines: name -> function(storey's points) -> wall segments (n, 4), m.

`BASELINES` lists them. Those with a `grid` were tuned by ``python experiments/baselines/tune.py``, which writes
`tuned.json`. Of the others RANSAC planes have published defaults, as far as those carry over to a building; for plane
sweep, Hough planes and EM the papers leave no set of values that does, so theirs were chosen here, once, and not tuned.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from asbuilt.grid import FloatArray
from baselines import images, planes, scan_lines

TUNED = Path(__file__).with_name("tuned.json")


@dataclass(frozen=True)
class Baseline:
    """A system, the paper's reference to it, and the library that does the work.

    Attributes
    ----------
    grid : the values that its parameters are tuned over.
    untuned : where the values come from if there is no grid.
    """

    name: str
    reference: str
    find: Callable[..., FloatArray]
    library: str
    grid: dict[str, list[Any]] = field(default_factory=dict)
    untuned: str = ""

    @property
    def setting(self) -> str:
        """Where the parameters come from, in a word."""
        return "tuned" if self.grid else self.untuned

    @property
    def parameters(self) -> dict[str, Any]:
        """All parameters: the tuned ones, and the others' defaults."""
        signature = inspect.signature(self.find).parameters.values()
        defaults = {p.name: p.default for p in signature if p.default is not inspect.Parameter.empty}
        tuned = json.loads(TUNED.read_text(encoding="utf-8"))["parameters"][self.name] if self.grid else {}
        return {**defaults, **tuned}


# 2.4 m lies below the ceilings of all rooms but the lowest; higher was better on one building and lost rooms on others
_SCAN = {"height": [1.5, 1.95, 2.4], "tolerance": [0.03, 0.06, 0.1], "min_length": [0.2, 0.4, 0.8]}
BASELINES = {
    baseline.name: baseline
    for baseline in (
        Baseline(
            "batch Hough of a slice",
            "[4]",
            images.batch_hough,
            "scikit-image",
            {"height": [1.5, 1.95, 2.4], "votes": [30, 60, 120], "gap": [0.3, 0.7], "min_length": [0.8, 1.2]},
        ),
        Baseline("iterative end-point fit", "[2]", scan_lines.iterative_end_point_fit, "scikit-image", _SCAN),
        Baseline("split and merge", "[7]", scan_lines.split_and_merge, "numpy", _SCAN),
        Baseline("RANSAC lines", "[6]", scan_lines.ransac_lines, "numpy", {**_SCAN, "least": [8, 12, 30]}),
        Baseline(
            "line scanner at 30 cm",
            "[6, 7]",
            scan_lines.line_scanner,
            "numpy",
            {"tolerance": [0.03, 0.06, 0.1], "min_length": [0.2, 0.4, 0.8]},
        ),
        Baseline(
            "farthest points",
            "[12]",
            scan_lines.farthest_points,
            "numpy",
            {"tolerance": [0.03, 0.06, 0.1], "min_length": [0.2, 0.3, 0.6]},
        ),
        Baseline(
            "RANSAC planes", "[8]", planes.ransac_planes, "numpy, Open3D's normals", untuned="published, lengths ours"
        ),
        Baseline(
            "region growing",
            "[3]",
            planes.planar_patches,
            "Open3D",
            {"normal_variance_deg": [15, 30, 60], "coplanarity_deg": [75, 85], "least": [60, 200]},
        ),
        Baseline("plane sweep", "[1, 5]", planes.plane_sweep, "scipy", untuned="ours, not tuned"),
        Baseline("Hough planes", "[10]", planes.hough_planes, "numpy", untuned="ours, not tuned"),
        Baseline("EM planes", "[11]", planes.em_planes, "numpy", untuned="ours, not tuned"),
        Baseline(
            "probabilistic Hough, 2 cm image",
            "-",
            images.probabilistic_hough,
            "OpenCV",
            {"share": [0.1, 0.2, 0.4], "votes": [40, 80], "gap": [0.5, 0.8], "min_length": [0.4, 0.6, 1.0]},
        ),
        Baseline(
            "LSD, 2 cm image",
            "-",
            images.line_segment_detector,
            "OpenCV",
            {"share": [0.02, 0.05, 0.1, 0.2], "gap": [0.5, 0.8], "min_length": [0.1, 0.2, 0.4]},
        ),
    )
}
