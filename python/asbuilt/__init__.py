"""As-built floor plans from registered laser scans.

The method is that of Okorn, Xiong, Akinci and Huber, "Toward Automated Modeling of Floor Plans" (2010), and what was
added to it. `extract_floor_plan` goes all the way; each stage is a function of its own, in the order of the paper's
section 3.
"""

import importlib
from typing import TYPE_CHECKING, Any

from asbuilt.errors import AsBuiltError, InputError, MissingExtraError, OutputError, ParameterError
from asbuilt.evidence import Evidence, evidence_from_points
from asbuilt.gather import gather_evidence, read_evidence
from asbuilt.params import Parameters
from asbuilt.read import PointCloud, read

if TYPE_CHECKING:
    from asbuilt.cross_sections import select_cross_sections
    from asbuilt.density import density_image
    from asbuilt.ground import ground_plane_histogram, threshold_cells
    from asbuilt.lines import detect_lines
    from asbuilt.orientation import dominant_orientations, orientation_distribution, snap_to
    from asbuilt.pipeline import extract_floor_plan
    from asbuilt.plan import FloorPlan, Storey, WallFace, load_plan
    from asbuilt.refine import fit_to_cells, merge_collinear
    from asbuilt.storeys import (
        find_floor_and_ceiling,
        find_floor_and_ceiling_by_scan,
        find_storeys,
        height_histogram,
    )

__version__ = "0.1.0"

__all__ = [
    "AsBuiltError",
    "Evidence",
    "FloorPlan",
    "InputError",
    "MissingExtraError",
    "OutputError",
    "ParameterError",
    "Parameters",
    "PointCloud",
    "Storey",
    "WallFace",
    "density_image",
    "detect_lines",
    "dominant_orientations",
    "evidence_from_points",
    "extract_floor_plan",
    "find_floor_and_ceiling",
    "find_floor_and_ceiling_by_scan",
    "find_storeys",
    "fit_to_cells",
    "gather_evidence",
    "ground_plane_histogram",
    "height_histogram",
    "load_plan",
    "merge_collinear",
    "orientation_distribution",
    "read",
    "read_evidence",
    "select_cross_sections",
    "snap_to",
    "threshold_cells",
]

# take numpy and geometry libraries, which files, help and errors do not wait for
_LATER = {
    "cross_sections": ("select_cross_sections",),
    "density": ("density_image",),
    "ground": ("ground_plane_histogram", "threshold_cells"),
    "lines": ("detect_lines",),
    "orientation": ("dominant_orientations", "orientation_distribution", "snap_to"),
    "pipeline": ("extract_floor_plan",),
    "plan": ("FloorPlan", "Storey", "WallFace", "load_plan"),
    "refine": ("fit_to_cells", "merge_collinear"),
    "storeys": ("find_floor_and_ceiling", "find_floor_and_ceiling_by_scan", "find_storeys", "height_histogram"),
}


def __getattr__(name: str) -> Any:
    for module, names in _LATER.items():
        if name in names:
            return getattr(importlib.import_module(f"asbuilt.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
