"""From points to a plan: the paper's section 3, in its order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from asbuilt import _core
from asbuilt.bare_lines import drop_bare
from asbuilt.columns import drop_sides, find_columns
from asbuilt.corners import close_corners, drop_columns
from asbuilt.cross_sections import select_cross_sections
from asbuilt.curves import find_curves
from asbuilt.doubtful_faces import drop_doubles, drop_leaves, drop_unmet, turn_backs
from asbuilt.elevations import draw_elevations
from asbuilt.errors import ParameterError
from asbuilt.evidence import Evidence
from asbuilt.faces import cut_openings, find_faces, measure_faces, score_steps, snap_to_jambs
from asbuilt.final_pass import finish_faces
from asbuilt.frame import doubt_extent, doubt_head, doubt_unit, doubt_up
from asbuilt.gather import gather_evidence
from asbuilt.grid import FloatArray, IntArray
from asbuilt.ground import ground_plane_histogram
from asbuilt.lines import detect_lines
from asbuilt.openings import find_openings
from asbuilt.orientation import dominant_orientations, snap_to
from asbuilt.params import Parameters
from asbuilt.partitions import draw_backs, find_partitions
from asbuilt.plan import FloorPlan, Storey, WallFace
from asbuilt.profiles import columns, storey_voxels
from asbuilt.read import PathLike, PointCloud, read
from asbuilt.refine import fit_to_cells, merge_collinear
from asbuilt.room_faces import draw_room_faces
from asbuilt.rooms import find_outline, find_rooms, measure_rooms
from asbuilt.stairs import find_stairs
from asbuilt.storeys import Level, drop_strays, find_storeys
from asbuilt.trust import drop_unlikely, trust_elements, trust_faces
from asbuilt.wall_lines import find_wall_lines
from asbuilt.walls import attach, find_walls

Source: TypeAlias = Evidence | PointCloud | PathLike | Sequence[PathLike]


def extract_floor_plan(
    source: Source,
    parameters: Parameters | None = None,
    *,
    storey: int | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    crs: str | None = None,
) -> FloorPlan:
    """The floor plan of a building.

    Parameters
    ----------
    source : evidence, or an opened cloud, or paths of files, folders or patterns (in metres, z up).
    storey : index of the one storey to plan (0 = lowest); None plans all.
    threads, progress : see `gather_evidence`.
    crs : coordinate reference system, where the cloud's own headers carry none or a wrong one.

    Returns
    -------
    FloorPlan : empty storeys, or none, where nothing was found; `notes` names the stage that came up empty.

    Raises
    ------
    InputError : a file is bad or holds no point.
    ParameterError : there is no storey of that index.
    """
    parameters = parameters or Parameters()
    if not isinstance(source, Evidence):
        cloud = source if isinstance(source, PointCloud) else read(source)
        source = gather_evidence(cloud, parameters.evidence, threads=threads, progress=progress)
    parameters = parameters.replace(evidence={"voxel": source.voxel, "occupancy": source.occupancy})
    by_paper = parameters.method == "paper"
    if source.occupancy and not by_paper:
        raise ParameterError(
            "the evidence keeps occupancy alone, and the default preset needs moments: take --preset paper, "
            "or gather it without --occupancy"
        )
    levels = find_storeys(source, parameters.storeys)
    notes = [*source.skipped, *filter(None, [doubt_up(source), None if levels else doubt_extent(source)])]
    if not levels:
        notes.append(
            "storeys: no floor found; nothing in the cloud has free height above it and walls around it; "
            "if it should, see by asbuilt info whether it is in metres with z up (--unit, --up)"
        )
    elif storey is not None and not 0 <= storey < len(levels):
        expected = (
            "0, the only one found" if len(levels) == 1 else f"0 to {len(levels) - 1}, the storeys that were found"
        )
        raise ParameterError(f"storey {storey}: expected {expected}")
    notes += [
        f"storeys: floors at {level.floor:.2f} and about {step:.1f} m are taken for one storey with a step; "
        "if they are those of two buildings, plan each from its own scans"
        for level in levels
        for step in level.steps
    ]
    wanted = [
        (level, levels[level.index + 1] if level.index + 1 < len(levels) else None)
        for level in levels
        if storey is None or level.index == storey
    ]
    storeys = [
        _plan_by_the_paper(source, level, parameters, notes)
        if by_paper
        else _plan_by_profiles(source, level, above, parameters, notes)
        for level, above in wanted
    ]
    notes += filter(None, [doubt_unit(storeys), doubt_head(source, storeys)])
    return FloorPlan(tuple(storeys), parameters.as_dict(), source.inputs, crs or source.crs, tuple(notes))


def _plan_by_profiles(
    evidence: Evidence, level: Level, above: Level | None, parameters: Parameters, notes: list[str]
) -> Storey:
    """Not in the paper: walls by what stands from floor to ceiling, fitted to the points."""
    voxels = storey_voxels(evidence, level, above)
    lines = find_wall_lines(columns(voxels), voxels, parameters.walls)
    lines = drop_bare(lines, voxels, parameters.walls)
    elevations = draw_elevations(*find_partitions(lines, voxels), voxels)
    scores = score_steps(elevations, parameters.walls)
    faces = turn_backs(find_faces(elevations, scores, parameters.walls), elevations)
    faces = drop_unmet(drop_leaves(drop_doubles(faces)), elevations)
    faces = snap_to_jambs(cut_openings(faces, elevations, scores, voxels), voxels)
    faces = find_curves(faces, voxels)
    faces = drop_columns(close_corners(faces, elevations, scores, parameters.walls))
    standing = find_columns(voxels, level.index)
    faces = drop_sides(faces, standing, voxels)
    if not faces:
        notes.append(f"faces: no wall found on storey {level.index}; nothing stands there from floor to ceiling")
    openings = find_openings(faces, elevations, scores, voxels, level.index)
    enclosed = find_rooms(faces, openings.to_floor, elevations, voxels)
    faces = finish_faces(draw_room_faces(faces, enclosed, openings.doors, openings.windows, elevations, scores, voxels))
    faces = draw_backs(drop_unlikely(faces, enclosed, elevations, voxels), enclosed, elevations)
    wall_faces = trust_faces(measure_faces(faces, voxels, level.index), faces, elevations, voxels)
    rooms = measure_rooms(enclosed, voxels, level, evidence.scans)
    walls = find_walls(wall_faces, openings.all, level.index, parameters.walls.unseen_thickness)
    planned = Storey(
        level.index,
        level.floor,
        level.ceiling,
        find_outline(rooms, walls),
        wall_faces,
        walls,
        attach(openings.doors, walls),
        attach(openings.windows, walls),
        attach(openings.unknown, walls),
        rooms=rooms,
        columns=standing,
        stairs=find_stairs(voxels, level.index),
    )
    return trust_elements(planned)


def _plan_by_the_paper(evidence: Evidence, level: Level, parameters: Parameters, notes: list[str]) -> Storey:
    voxel = parameters.storeys.voxel
    occupied = drop_strays(evidence.occupied(voxel))  # 3.1
    selected = select_cross_sections(occupied, voxel, level, parameters.storeys.slab, parameters.cross_sections)  # 5.3
    histogram = ground_plane_histogram(occupied[selected], voxel)  # 3.2
    segments = detect_lines(histogram, parameters.lines)  # 3.3
    if len(segments) == 0:
        notes.append(f"lines: no line found on storey {level.index}; its ground-plane histogram has no dense cells")
    dominant = dominant_orientations(segments, parameters.orientation) or ()  # 3.4
    segments = snap_to(segments, dominant, parameters.orientation.snap)
    if parameters.refine.merge:
        segments = fit_to_cells(merge_collinear(segments, parameters.refine), histogram, parameters.lines)
    return Storey(level.index, level.floor, level.ceiling, None, _faces(segments, occupied[selected], voxel, level))


def _faces(segments: FloatArray, occupied: IntArray, voxel: float, level: Level) -> tuple[WallFace, ...]:
    """Segments (n, 4), m, as wall faces, with the voxels within one voxel of each counted and measured."""
    centres = (occupied[:, :2].astype(np.float64) + 0.5) * voxel
    # A segment ends at its last cell: a hair more, so that rounding does not decide whether that cell counts.
    places = _core.Places(centres, occupied[:, :2].astype(np.int32, copy=False), voxel)
    face_of, _, along, offset = places.strips(segments, voxel, 1e-9)
    first = np.searchsorted(face_of, np.arange(len(segments) + 1))
    faces = []
    for number, (x1, y1, x2, y2) in enumerate(segments.tolist()):
        near = slice(first[number], first[number + 1])
        steps = max(int(np.ceil(np.hypot(x2 - x1, y2 - y1) / voxel)), 1)
        seen = len(np.unique((along[near] / voxel).astype(np.int64))) / steps
        voxels = len(offset[near])
        rms = float(np.sqrt(np.mean(offset[near] ** 2))) if voxels else None
        face_id = f"S{level.index}-F{number + 1}"
        faces.append(WallFace((x1, y1), (x2, y2), id=face_id, seen=min(seen, 1.0), rms=rms, voxels=voxels))
    return tuple(faces)
