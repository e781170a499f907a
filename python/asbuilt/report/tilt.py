"""Whether the cloud stands upright: the slope of each storey's floor and the lean of its walls (not in the paper).

Both are given as what a plumb line would show: how far the top lies off the foot along x and y, m per metre of height.
A cloud that was levelled badly tilts floor and walls alike. Where only one of the two is off, the building is.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from asbuilt.evidence import Evidence
from asbuilt.grid import FloatArray
from asbuilt.indices import count_rows
from asbuilt.plan import FloorPlan, Storey
from asbuilt.report.patches import Patches, cut_faces, is_clean, median, straight_faces

_NEAR_FLOOR = 0.1
"""Voxels this near to the height of a floor may be of it, m."""
_FLAT = 0.01
"""A patch is floor where more than half of it lies this close to its middle height, m."""
_ALIKE = 2.0
"""Floor within a square of this side errs alike, m: its scans' offsets in height, and the screed."""
_REACH = 1.0
"""A face's lean is measured over at least this height, m."""
_LEAST_PATCHES = 8
_UNEVEN = 0.001
"""Walls are out of plumb by about this much each, m/m."""
_ROUNDS = 8
Pair = tuple[float, float]


@dataclass(frozen=True)
class Tilt:
    """The tilt of one storey.

    Attributes
    ----------
    storey : its index.
    floor, floor_error : tilt by the plane fitted to the floor, along x and y, m/m, and its standard error; None without
        enough floor.
    floor_rms : root mean square distance of the floor from that plane, m.
    walls, walls_error : tilt by the walls' lean, likewise; None unless walls of two directions were seen.
    leans : lean towards those who see it, m/m, of each face on which it could be measured, and its standard error.
    """

    storey: int
    floor: Pair | None = None
    floor_error: Pair | None = None
    floor_rms: float = 0.0
    walls: Pair | None = None
    walls_error: Pair | None = None
    leans: dict[str, Pair] = field(default_factory=dict)


def measure_tilt(plan: FloorPlan, evidence: Evidence) -> tuple[Tilt, ...]:
    """The tilt of each storey; none for a plan without storeys."""
    patches = cut_faces(plan, evidence)
    patches = patches.kept(is_clean(patches))
    faces = straight_faces(plan)
    found = []
    for storey in plan:
        floor = _fit_floor(storey, evidence)
        leans = {
            number: lean
            for number, (_, of) in enumerate(faces)
            if of is storey and (lean := _lean(patches, number)) is not None
        }
        walls = _common_lean(patches, leans)
        tilt = Tilt(storey.index, leans={faces[number][0].id: lean for number, lean in leans.items()})
        if floor is not None:
            tilt = Tilt(storey.index, *floor, leans=tilt.leans)
        if walls is not None:
            tilt = Tilt(storey.index, tilt.floor, tilt.floor_error, tilt.floor_rms, *walls, tilt.leans)
        found.append(tilt)
    return tuple(found)


def _fit_floor(storey: Storey, evidence: Evidence) -> tuple[Pair, Pair, float] | None:
    """Tilt, standard error and residual of the floor, by patches as wide as a brick of the evidence."""
    z = evidence.index[:, 2] * evidence.voxel + evidence.mean[:, 2] - storey.floor
    near = np.abs(z) < _NEAR_FLOOR
    side = evidence.core.brick_scans()["side"]
    z = z[near]
    cells, patch, _ = count_rows(evidence.index[near] * (1, 1, 0) // side)
    order = np.lexsort((z, patch))
    first = np.searchsorted(patch[order], np.arange(len(cells) + 1))
    height = z[order][(first[:-1] + first[1:]) // 2]  # the median of each patch
    flat = np.bincount(patch, np.abs(z - height[patch]) < _FLAT, minlength=len(cells)) > side * side / 2
    cells, height = cells[flat], height[flat]
    if len(cells) < _LEAST_PATCHES:
        return None
    xy = cells[:, :2] * side * evidence.voxel
    fit = _fit(np.column_stack([np.ones(len(xy)), xy - xy.mean(axis=0)]), height)
    if fit is None:
        return None
    (_, sx, sy), (_, ex, ey), scale = fit
    alike = _ALIKE / (side * evidence.voxel)  # side of that square in patches: so much less is known
    return (-sx, -sy), (alike * ex, alike * ey), scale


def _lean(patches: Patches, face: int) -> Pair | None:
    """Lean of a face and its standard error, m/m; its own place and direction are fitted along."""
    own = patches.face == face
    z = patches.place[own, 2]
    if own.sum() < _LEAST_PATCHES or np.ptp(z) < _REACH:
        return None
    fit = _fit(np.column_stack([z - z.mean(), np.ones(len(z)), patches.along[own]]), patches.offset[own])
    return None if fit is None else (fit[0][0], fit[1][0])


def _common_lean(patches: Patches, leans: dict[int, Pair]) -> tuple[Pair, Pair] | None:
    """The tilt that the leans of walls of different directions have in common, and its standard error."""
    if len(leans) < 3:
        return None
    normal = np.array([patches.normal[patches.face == face][0] for face in leans])
    lean, error = np.array(list(leans.values())).T
    sigma = np.hypot(error, _UNEVEN)
    fit = _fit(normal / sigma[:, None], lean / sigma)
    if fit is None or max(fit[1]) > _UNEVEN:
        return None
    (x, y), (ex, ey), _ = fit
    return (x, y), (ex, ey)


def _fit(design: FloatArray, values: FloatArray) -> tuple[list[float], list[float], float] | None:
    """Robust least squares: the unknowns, their standard errors, and the residuals' standard deviation.

    None where the design does not tell all unknowns, or has no rows to spare.
    """
    rows, unknowns = design.shape
    if rows <= unknowns or np.linalg.matrix_rank(design, tol=1e-6) < unknowns:
        return None
    weight = np.ones(rows)
    for _ in range(_ROUNDS):
        root = np.sqrt(weight)[:, None]
        found = np.linalg.lstsq(root * design, root[:, 0] * values, rcond=None)[0]
        residual = np.abs(values - design @ found)
        scale = max(1.4826 * median(residual), 1e-9)
        weight = 1.0 / np.maximum(residual / (2.0 * scale), 1.0)
    scale *= np.sqrt(rows / (rows - unknowns))
    normal = design.T @ (weight[:, None] * design)
    errors = scale * np.sqrt(np.diag(np.linalg.inv(normal)))
    return found.tolist(), errors.tolist(), float(scale)
