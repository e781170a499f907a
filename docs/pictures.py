"""The pictures of the stages' pages, made from the example house: ``python docs/pictures.py [NAME...]``.

Each function draws one picture, of its own name, into docs/stages. The same code and example give the same bytes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache
from io import BytesIO
from pathlib import Path

import made
import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

import asbuilt
from asbuilt import Parameters, evidence_from_points
from asbuilt.columns import find_columns
from asbuilt.corners import close_corners, drop_columns
from asbuilt.curves import find_curves
from asbuilt.doubtful_faces import drop_doubles
from asbuilt.elevations import MARGIN, ON_PLANE, Elevations, draw_elevations
from asbuilt.evidence import Evidence
from asbuilt.faces import Face, closed, cut_openings, find_faces, maximal_runs, score_steps, snap_to_jambs
from asbuilt.grid import FloatArray, Grid
from asbuilt.opening_boxes import find_boxes, look_behind
from asbuilt.openings import find_openings
from asbuilt.orientation import orientations
from asbuilt.partitions import find_partitions
from asbuilt.plan import FloorPlan
from asbuilt.profiles import StoreyVoxels, columns, storey_voxels
from asbuilt.room_faces import draw_room_faces
from asbuilt.rooms import find_rooms
from asbuilt.stairs import find_stairs, surfaces
from asbuilt.storeys import Level, drop_strays
from asbuilt.wall_lines import find_wall_lines
from asbuilt.wall_sides import LOWEST, unroll_sides

DOCS = Path(__file__).resolve().parent
EXAMPLE = DOCS.parent / "examples" / "small_house" / "scans.laz"
WIDTH = 8.0
"""Inches, of 100 pixels each."""
WALL, OTHER, FAINT = "#d6004f", "#0077b6", "#9a9a9a"
PAPER = Parameters.preset("paper")
DEFAULT = Parameters.preset("default")


# What is drawn, each stage computed once.


@cache
def evidence() -> Evidence:
    """The evidence of the example."""
    return asbuilt.gather_evidence(asbuilt.read(EXAMPLE))


@cache
def level() -> Level:
    """Its one storey."""
    return asbuilt.find_storeys(evidence())[0]


@cache
def paper_histogram() -> asbuilt.ground.GroundPlaneHistogram:
    """The ground-plane histogram of the paper's best setting."""
    voxel = PAPER.storeys.voxel
    occupied = drop_strays(evidence().occupied(voxel))
    chosen = asbuilt.select_cross_sections(occupied, voxel, level(), PAPER.storeys.slab, PAPER.cross_sections)
    return asbuilt.ground_plane_histogram(occupied[chosen], voxel)


@cache
def paper_segments() -> FloatArray:
    """The segments that its Hough transform finds."""
    return asbuilt.detect_lines(paper_histogram(), PAPER.lines)


@cache
def voxels() -> StoreyVoxels:
    """The voxels of the storey."""
    return storey_voxels(evidence(), level(), None)


@cache
def lines() -> FloatArray:
    """The lines on which walls may stand."""
    return find_wall_lines(columns(voxels()), voxels(), DEFAULT.walls)


@cache
def elevations() -> Elevations:
    """Their elevations."""
    return draw_elevations(*find_partitions(lines(), voxels()), voxels())


@cache
def scores() -> FloatArray:
    """The scores of their steps."""
    return score_steps(elevations(), DEFAULT.walls)


@cache
def loose_faces() -> list[Face]:
    """Faces before their corners are closed."""
    found = drop_doubles(find_faces(elevations(), scores(), DEFAULT.walls))
    found = snap_to_jambs(cut_openings(found, elevations(), scores(), voxels()), voxels())
    return find_curves(found, voxels())


def closed_faces() -> list[Face]:
    """Faces after it."""
    return drop_columns(close_corners(loose_faces(), elevations(), scores(), DEFAULT.walls))


@cache
def plan() -> FloorPlan:
    """The whole plan."""
    return asbuilt.extract_floor_plan(evidence())


# The pictures.


def evidence_picture(figure: Figure) -> None:
    """Heights of the highest voxels below the ceiling, and a cut through the house."""
    above, cut = figure.subplots(2, 1, height_ratios=(2.6, 1))
    index, side = evidence().index, evidence().voxel
    place = index * side + evidence().mean
    inside = place[:, 2] < level().ceiling - 0.15
    grid = Grid.around(index[inside, :2], side)
    highest = np.full(grid.shape, np.nan)
    local = index[inside, :2] - grid.low
    highest[local[:, 0], local[:, 1]] = place[inside, 2]  # sorted: the highest of a cell comes last
    image = above.imshow(highest.T, extent=grid.extent, origin="lower", cmap="viridis", interpolation="nearest")
    figure.colorbar(image, ax=above, label="height, m", pad=0.01)
    y = -3.0
    above.axhline(y, color=WALL, lw=0.8)
    plan_axes(above, "The highest voxel of each cell below the ceiling")
    slab = np.abs(place[:, 1] - y) < 0.1
    cut.scatter(place[slab, 0], place[slab, 2], c=place[slab, 2], s=2, lw=0, cmap="viridis")
    plan_axes(cut, f"Cut along the line at y = {y:g} m, 20 cm deep: the means of the voxels' points")


def storeys_picture(figure: Figure) -> None:
    """The height histogram with floor and ceiling."""
    histogram = asbuilt.height_histogram(drop_strays(evidence().occupied(0.1)), 0.1)
    axes = figure.subplots()
    axes.barh(histogram.heights, histogram.counts, height=0.09, color=FAINT)
    axes.set_xscale("log")
    for z, name in ((level().floor, "floor"), (level().ceiling, "ceiling")):
        axes.axhline(z, color=WALL, lw=1.2)
        axes.text(histogram.counts.max(), z + 0.06, f"{name} {z:.2f} m", color=WALL, ha="right")
    axes.set(xlabel="occupied voxels of 10 cm", ylabel="height, m", title="Height histogram and the storey found in it")
    axes.set_ylim(histogram.heights[0] - 0.1, histogram.heights[-1] + 0.3)


def cross_sections_picture(figure: Figure) -> None:
    """The slices that hold least, and what they show from above."""
    occupied = drop_strays(evidence().occupied(0.1))
    chosen = asbuilt.select_cross_sections(occupied, 0.1, level(), PAPER.storeys.slab, PAPER.cross_sections)
    everything = asbuilt.select_cross_sections(
        occupied, 0.1, level(), PAPER.storeys.slab, PAPER.replace(cross_sections={"select": "all"}).cross_sections
    )
    whole = asbuilt.height_histogram(occupied[everything], 0.1)
    slices = np.unique(occupied[chosen, 2])
    is_chosen = np.isin(np.round(whole.heights / 0.1 - 0.5).astype(int), slices)
    parts = figure.subplot_mosaic("ab;ac", width_ratios=(1, 1.6))
    bars, maps = parts["a"], (parts["b"], parts["c"])
    bars.barh(whole.heights, whole.counts, height=0.09, color=np.where(is_chosen, OTHER, FAINT))
    bars.set(xlabel="occupied voxels", ylabel="height, m", title=f"The {len(slices)} lowest slices")
    for axes, mask, title in zip(maps, (everything, chosen), ("All heights", "The lowest slices"), strict=True):
        histogram = asbuilt.ground_plane_histogram(occupied[mask], 0.1)
        density(axes, histogram.counts.T.astype(float), histogram.grid.extent)
        plan_axes(axes, title)


def ground_picture(figure: Figure) -> None:
    """The ground-plane histogram, and its cells above the threshold."""
    top, bottom = figure.subplots(2, 1)
    histogram = paper_histogram()
    image = top.imshow(histogram.counts.T, extent=histogram.grid.extent, origin="lower", cmap="magma_r")
    figure.colorbar(image, ax=top, label="occupied voxels", pad=0.01)
    plan_axes(top, "Ground-plane histogram of the nine slices")
    cells = asbuilt.threshold_cells(histogram, PAPER.lines.sigmas)
    dense = np.zeros(histogram.counts.shape)
    dense[cells[:, 0], cells[:, 1]] = 1
    shown = bottom.imshow(dense.T, extent=histogram.grid.extent, origin="lower", cmap="Greys")
    figure.colorbar(shown, ax=bottom, pad=0.01).ax.set_visible(False)
    plan_axes(bottom, f"Cells above mean + {PAPER.lines.sigmas:g} standard deviations: {len(cells)}")


def lines_picture(figure: Figure) -> None:
    """The accumulator, and the segments found."""
    top, bottom = figure.subplots(2, 1, height_ratios=(1, 1.4))
    histogram = paper_histogram()
    cells = asbuilt.threshold_cells(histogram, PAPER.lines.sigmas)
    theta = np.arange(180)
    rho = cells @ np.stack([np.cos(np.radians(theta)), np.sin(np.radians(theta))])
    low = int(np.floor(rho.min()))
    bins = np.round(rho).astype(int) - low
    votes = np.zeros((bins.max() + 1, 180))
    np.add.at(votes, (bins.ravel(), np.tile(theta, len(cells))), 1)
    extent = (-0.5, 179.5, low * 0.1, (low + len(votes)) * 0.1)
    top.imshow(np.sqrt(votes), extent=extent, origin="lower", cmap="Greys", aspect="auto")
    strongest = paper_segments()[:12]
    normal = (orientations(strongest) + np.pi / 2) % np.pi
    middle = (strongest[:, :2] + strongest[:, 2:]) / 2 - histogram.grid.to_metres(np.zeros(2))
    distance = middle[:, 0] * np.cos(normal) + middle[:, 1] * np.sin(normal)
    top.plot(np.degrees(normal), distance, "o", color=WALL, mfc="none", ms=8)
    top.set(
        xlabel="theta, degrees",
        ylabel="rho, m",
        title="Accumulator: votes for each line; circles, the twelve strongest segments",
    )
    bottom.imshow(histogram.counts.T, extent=histogram.grid.extent, origin="lower", cmap="Greys", vmax=14)
    draw(bottom, paper_segments(), WALL)
    plan_axes(bottom, f"The {len(paper_segments())} segments of the incremental search")


def orientation_picture(figure: Figure) -> None:
    """Length by orientation, and the dominant ones."""
    distribution = asbuilt.orientation_distribution(paper_segments(), PAPER.orientation.bin)
    dominant = asbuilt.dominant_orientations(paper_segments(), PAPER.orientation)
    axes = figure.subplots()
    degrees = np.arange(len(distribution)) * 180 / len(distribution)
    axes.bar((degrees + 45) % 180 - 45, distribution, width=1, color=FAINT)  # the whole of each peak
    for angle, name in zip(dominant or (), ("dominant", "secondary"), strict=False):
        place = round((float(np.degrees(angle)) + 45) % 180 - 45, 1) + 0.0
        axes.axvline(place, color=WALL, lw=1)
        axes.text(place + 2, distribution.max(), f"{name}, {place:.1f}°", color=WALL)
    axes.set(xlabel="orientation, degrees", ylabel="length of segments, m", yscale="symlog", xlim=(-45, 135))
    axes.set_ylim(0, 2 * distribution.max())
    axes.set_title("Length of the segments by orientation (logarithmic)")


def refine_picture(figure: Figure) -> None:
    """Segments before and after snapping and clean-up."""
    dominant = asbuilt.dominant_orientations(paper_segments(), PAPER.orientation) or ()
    snapped = asbuilt.snap_to(paper_segments(), dominant, PAPER.orientation.snap)
    merged = asbuilt.merge_collinear(snapped, PAPER.refine)
    fitted = asbuilt.fit_to_cells(merged, paper_histogram(), PAPER.lines)
    histogram = paper_histogram()
    for axes, segments, title in zip(
        figure.subplots(2, 1), (paper_segments(), fitted), ("As found", "Snapped, merged and fitted"), strict=True
    ):
        axes.imshow(histogram.counts.T, extent=histogram.grid.extent, origin="lower", cmap="Greys", vmax=14)
        draw(axes, segments, WALL)
        axes.plot(*segments.reshape(-1, 2).T, ".", color=OTHER, ms=3)
        plan_axes(axes, f"{title}: {len(segments)} segments")


def profiles_picture(figure: Figure) -> None:
    """How much of its height each ground cell fills."""
    found = columns(voxels())
    axes = figure.subplots()
    order = np.argsort(found.filled, kind="stable")
    dots = axes.scatter(*found.xy[order].T, c=found.filled[order] * voxels().voxel, s=1.6, lw=0, cmap="magma_r")
    figure.colorbar(dots, ax=axes, label="height filled, m", shrink=0.6, pad=0.01)
    plan_axes(axes, "Height filled between floor and ceiling above each cell of 5 cm")


def wall_lines_picture(figure: Figure) -> None:
    """The lines that were traced."""
    axes = figure.subplots()
    background(axes)
    draw(axes, lines(), WALL, 1.0)
    axes.plot(*lines().reshape(-1, 2).T, ".", color=WALL, ms=3)
    plan_axes(axes, f"The {len(lines())} lines on which walls may stand; furniture has lines, too")


def partitions_picture(figure: Figure) -> None:
    """The free-standing partition: seen from above, and how its voxels' moments give two planes."""
    whole, detail = figure.subplots(2, 1)
    found, marked = find_partitions(lines(), voxels())
    background(whole)
    draw(whole, found[~marked], FAINT, 0.8)
    draw(whole, found[marked], WALL, 1.6)
    plan_axes(whole, "Lines of a free-standing partition among all lines")
    v = voxels()
    standing = (v.z > 0.3) & (v.z < 1.6)
    detail.scatter(*v.xy[standing].T, s=1.5, lw=0, color="k")
    on_floor = np.abs(v.z) < 0.08
    detail.scatter(*v.xy[on_floor].T, s=1.5, lw=0, color="#7fb77e")
    draw(detail, found[marked], WALL, 1.4)
    ends = found[marked].reshape(-1, 2)
    if len(ends):
        (x0, y0), (_, y1) = ends.min(axis=0), ends.max(axis=0)
        detail.set(xlim=(x0 - 0.4, x0 + 2.2), ylim=(y0 - 0.4, y1 + 0.4))
    detail.set_aspect("equal", adjustable="box")
    detail.set(
        xlabel="m", ylabel="m", title="One end of it: its voxels (black), the floor (green) comes close on both sides"
    )


def elevations_picture(figure: Figure) -> None:
    """The drawings of two walls, their scores and their runs."""
    parts = figure.subplots(4, 1, height_ratios=(1, 0.7, 1, 0.7))
    # The southern wall holds the house's door, the eastern one its windows.
    for (drawn, scored), (name, point) in zip(
        (parts[:2], parts[2:]), (("southern", (0.0, -5.5)), ("eastern", (9.3, -1.0))), strict=True
    ):
        draw_wall(drawn, scored, line_at(point))
        drawn.set_title(f"Elevation of the {name} wall: the voxels on its plane", fontsize=9)
    parts[-1].set_xlabel("along the wall, m")


def draw_wall(drawn: Axes, scored: Axes, line: int) -> None:
    """The voxels on the plane of a line, and what its steps score."""
    e, v = elevations(), voxels()
    first, last = e.first[line], e.first[line + 1]
    position, score = e.position(line), scores()[first:last]
    start, end = e.lines[line, :2], e.lines[line, 2:]
    along = (end - start) / np.hypot(*(end - start))
    relative = v.xy - start
    place, offset = relative @ along, relative @ np.array([-along[1], along[0]])
    on = (np.abs(offset) < ON_PLANE) & (place > -MARGIN) & (place < position[-1] + e.step)
    drawn.scatter(place[on], v.z[on], s=1.2, lw=0, color="k")
    drawn.axhline(v.height, color=FAINT, lw=0.6)
    drawn.set(ylabel="height, m")
    scored.fill_between(position, 0, score, where=score > 0, step="mid", color="#7fb77e", lw=0)
    scored.fill_between(position, 0, score, where=score < 0, step="mid", color="#d98080", lw=0)
    upper = closed(e, "upper", DEFAULT.walls)[first:last]
    scored.plot(position, upper, color=OTHER, lw=0.8, label="filled under the ceiling")
    behind = (e.floor_behind + e.low_behind)[first:last]
    scored.plot(position, behind, color="#e08a00", lw=0.8, label="floor or low things behind")
    for low, high, _ in maximal_runs(score, DEFAULT.walls.min_score, DEFAULT.walls.drop):
        scored.plot([position[low], position[high - 1]], [2.6, 2.6], color=WALL, lw=3, solid_capstyle="butt")
    scored.text(position[0], 2.6, "runs", color=WALL, va="center")
    scored.set(ylabel="score", ylim=(-2.3, 3))
    scored.legend(loc="lower right", fontsize=7, ncols=2)
    for axes in (drawn, scored):
        axes.set_xlim(position[0] - 0.1, position[-1] + 0.1)


def line_at(point: tuple[float, float]) -> int:
    """The longest line that passes within 5 cm of a point, in the example's frame."""
    e = elevations()
    start, way = e.lines[:, :2], e.lines[:, 2:] - e.lines[:, :2]
    length = np.hypot(*way.T)
    relative = np.array(point) - voxels().origin - start
    along = (relative * way).sum(axis=1) / length
    aside = np.abs(relative[:, 0] * way[:, 1] - relative[:, 1] * way[:, 0]) / length
    return int(np.argmax(np.where((aside < 0.05) & (along > 0) & (along < length), length, 0)))


def faces_picture(figure: Figure) -> None:
    """Stretches of lines that are faces."""
    axes = figure.subplots()
    background(axes)
    draw(axes, lines(), OTHER, 0.6)
    faces = loose_faces()
    draw(axes, ends_of(faces), WALL, 1.8)
    for face in faces:
        middle = (face.start + face.end) / 2
        axes.plot(*np.stack([middle, middle + 0.35 * face.normal]).T, color=WALL, lw=1)
    plan_axes(axes, f"{len(faces)} faces (red, a tick towards their room) on the lines (blue)")


def corners_picture(figure: Figure) -> None:
    """Faces before and after their corners are closed."""
    for axes, faces, title in zip(
        figure.subplots(2, 1), (loose_faces(), closed_faces()), ("Before", "After"), strict=True
    ):
        background(axes)
        draw(axes, ends_of(faces), WALL, 1.4)
        tips = ends_of(faces).reshape(-1, 2)
        joined = np.array([np.hypot(*(tips - tip).T).argsort()[1] for tip in tips])
        meets = np.hypot(*(tips - tips[joined]).T) < 1e-6
        axes.plot(*tips[~meets].T, "o", color=WALL, ms=4, mfc="white")
        axes.plot(*tips[meets].T, "o", color=OTHER, ms=4)
        plan_axes(axes, f"{title}: {int(meets.sum())} of {len(tips)} ends meet (blue)")


def curves_picture(figure: Figure) -> None:
    """A round room of 3 m radius, made for the picture: chords before, an arc after."""
    v, loose, curved = round_room()
    left, right = figure.subplots(1, 2)
    for axes, faces, title in ((left, loose, "Faces on traced lines"), (right, curved, "One curve")):
        found = columns(v)
        axes.scatter(*found.xy.T, s=1, lw=0, color=FAINT)
        draw(axes, ends_of(faces), WALL, 1.4)
        axes.plot(*ends_of(faces).reshape(-1, 2).T, ".", color=OTHER, ms=5)
        plan_axes(axes, f"{title}: {len(faces)} chords")


def round_room() -> tuple[StoreyVoxels, list[Face], list[Face]]:
    """Its voxels, and its faces before and after curves are found; the points are those of a scan without clutter."""
    rng = np.random.default_rng(0)
    angle = rng.uniform(0, 2 * np.pi, 60_000)
    wall = np.column_stack([3 * np.cos(angle), 3 * np.sin(angle), rng.uniform(0, 2.7, len(angle))])
    wall[:, :2] *= 1 + rng.normal(0, 0.001, (len(wall), 1))
    flat = rng.uniform(-3, 3, (120_000, 2))
    flat = flat[np.hypot(*flat.T) < 3]
    heights = np.where(np.arange(len(flat)) % 2 == 0, 0.0, 2.7)
    points = np.vstack([wall, np.column_stack([flat, heights])]) + np.array([0.3, 0.2, 0.02])
    cloud = evidence_from_points(points)
    v = storey_voxels(cloud, asbuilt.find_storeys(cloud)[0], None)
    found = find_wall_lines(columns(v), v, DEFAULT.walls)
    drawn = draw_elevations(*find_partitions(found, v), v)
    loose = snap_to_jambs(drop_doubles(find_faces(drawn, score_steps(drawn, DEFAULT.walls), DEFAULT.walls)), v)
    return v, loose, find_curves(loose, v)


def openings_picture(figure: Figure) -> None:
    """The unrolled sides with the most in their walls' bodies, and the openings found in them."""
    sides = unroll_sides(closed_faces(), elevations(), voxels())
    seen = look_behind(sides)
    boxes = find_boxes(sides, seen)
    found = find_openings(closed_faces(), elevations(), scores(), voxels(), 0)
    drawn = sorted({box.side for box in boxes}, key=lambda side: -sum(b.cells for b in boxes if b.side == side))[:3]
    *above, plan = figure.subplots(4, 1, height_ratios=[1, 1, 1, 2.6])
    for axes, side in zip(above, drawn, strict=True):
        low, high = sides.first[side], sides.first[side + 1]
        image = np.ones((*sides.wall[low:high].T.shape, 3))
        for cells, colour in ((sides.wall, FAINT), (seen, WALL)):
            image[cells[low:high].T] = to_rgb(colour)
        top = LOWEST + image.shape[0] * sides.step
        axes.imshow(image, extent=(0, (high - low) * sides.step, LOWEST, top), origin="lower", interpolation="nearest")
        plan_axes(axes, "A wall seen from its room: its plane (grey), and what shows behind it (red)")
    background(plan)
    draw(plan, ends_of(closed_faces()), FAINT, 1.0)
    for openings, colour in ((found.doors, WALL), (found.windows, OTHER), (found.unknown, "black")):
        lines = np.array([[*o.start, *o.end] for o in openings]).reshape(-1, 4)
        draw(plan, lines - np.tile(voxels().origin, 2), colour, 3.0)
    plan_axes(
        plan, f"doors: {len(found.doors)} (red), windows: {len(found.windows)} (blue), unknown: {len(found.unknown)}"
    )


def rooms_picture(figure: Figure) -> None:
    """The rooms of a flat made for the picture, with their numbers, areas and clear heights."""
    axes = figure.subplots()
    v = flat_voxels()
    backdrop(axes, v)
    storey = flat_plan().storeys[0]
    rooms = storey.rooms
    for room, colour in zip(rooms, ("#cfe3f1", "#f6dcc6", "#d6ecd2"), strict=True):
        axes.fill(*(np.array(room.ring) - v.origin).T, fc=colour, ec="none", alpha=0.75)
        middle = np.array(shapely.Polygon(room.ring).centroid.coords[0]) - v.origin
        text = f"{room.number}\n{room.area:.2f} m²\n{room.height:.2f} m high"
        axes.text(*middle, text, ha="center", va="center", fontsize=8)
    faces = np.array([(*face.start, *face.end) for face in storey.wall_faces])
    draw(axes, faces - np.tile(v.origin, 2), WALL, 1.4)
    plan_axes(axes, f"{len(rooms)} rooms, and the faces (red) that enclose them")


def room_faces_picture(figure: Figure) -> None:
    """Faces before and after the sides of rooms are drawn, and the end of a wall from near."""
    loose = closed_faces()
    openings = find_openings(loose, elevations(), scores(), voxels(), 0)
    rooms = find_rooms(loose, openings.to_floor, elevations(), voxels())
    drawn = draw_room_faces(loose, rooms, openings.doors, openings.windows, elevations(), scores(), voxels())
    new = shapely.difference(segments_of(drawn), shapely.union_all(segments_of(loose)).buffer(0.03))
    added = [shapely.get_coordinates(line) for line in shapely.get_parts(new) if line.length > 0.05]
    whole, *near = figure.subplot_mosaic("AA;BC", height_ratios=(1.5, 1)).values()
    for axes, faces in ((whole, drawn), (near[0], loose), (near[1], drawn)):
        background(axes)
        for room in rooms:
            axes.fill(*room.exterior.xy, fc="#e6eff6", ec="none", zorder=0)
        draw(axes, ends_of(faces), WALL, 1.6)
        if faces is drawn:
            axes.add_collection(LineCollection(added, colors=OTHER, linewidths=3.0))
    plan_axes(whole, f"{len(rooms)} room and {len(drawn)} faces; in blue what its sides add")
    x, y = np.concatenate(added)[np.concatenate(added)[:, 1].argmin()]
    for axes, title in zip(near, ("The end of a wall before", "The same after"), strict=True):
        axes.set(xlim=(x - 1.6, x + 1.4), ylim=(y - 0.9, y + 1.1))
        plan_axes(axes, title)


def walls_picture(figure: Figure) -> None:
    """The walls of the same flat: those seen from both sides, and those of which the other side was not seen."""
    axes = figure.subplots()
    v = flat_voxels()
    backdrop(axes, v)
    storey = flat_plan().storeys[0]
    for wall in storey.walls:
        ring = np.array([*wall.outline, wall.outline[0]]) - v.origin
        seen = wall.thickness is not None
        axes.fill(*ring.T, fc="#8c8c8c" if seen else "none", ec="k", lw=0.7, ls="-" if seen else "--")
        if wall.thickness is not None:
            middle = (np.array(wall.start) + wall.end) / 2 - v.origin
            axes.annotate(f"{1000 * wall.thickness:.0f} mm", middle, (9, 9), textcoords="offset points", fontsize=8)
    for elements, colour, width in ((storey.walls, WALL, 0.9), (storey.doors, "#f2b705", 4.0)):
        ends = np.array([(*element.start, *element.end) for element in elements])
        draw(axes, ends - np.tile(v.origin, 2), colour, width)
    plan_axes(axes, "Thickness measured (grey) and not observed (dashed); centrelines red, doors yellow")


@cache
def flat_plan() -> FloorPlan:
    """The plan of the flat."""
    return asbuilt.extract_floor_plan(made.flat())


@cache
def flat_voxels() -> StoreyVoxels:
    """The voxels of the flat."""
    return storey_voxels(made.flat(), asbuilt.find_storeys(made.flat())[0], None)


def segments_of(faces: list[Face]) -> NDArray[np.object_]:
    """Faces as lines of shapely."""
    lines: NDArray[np.object_] = shapely.linestrings(ends_of(faces).reshape(-1, 2, 2))
    return lines


def columns_picture(figure: Figure) -> None:
    """A hall made for the picture: the voxels of its columns and of a cupboard, and the columns found."""
    v = made.hall()
    found = find_columns(v, 0)
    above, below = figure.subplots(2, 1, height_ratios=(1, 1.5))
    tall = columns(v)
    above.scatter(*tall.xy[tall.filled > 3].T, s=2, lw=0, color=FAINT)
    plan_axes(above, f"{len(found)} columns; the cupboard on the right ends at 2.1 m")
    standing = (v.z > 0.3) & (v.z < v.height - 0.15)
    below.scatter(*v.xy[standing].T, s=1, lw=0, color=FAINT)
    for axes in (above, below):
        for column in found:
            ring = np.array([*column.ring, column.ring[0]]) - v.origin
            axes.plot(*ring.T, color=WALL, lw=1.4)
    x0, x1 = min(c.centre[0] for c in found), max(c.centre[0] for c in found)
    middle = np.mean([c.centre[1] for c in found]) - v.origin[1]
    below.set(xlim=(x0 - v.origin[0] - 0.5, x1 - v.origin[0] + 0.5), ylim=(middle - 0.6, middle + 0.6))
    plan_axes(below, "Means of the voxels between floor and ceiling, and the outlines fitted to them")


def stairs_picture(figure: Figure) -> None:
    """A flight made for the picture: its surfaces by their heights, the outline and the way up."""
    v = made.staircase()
    (stair,) = find_stairs(v, 0)
    xy, z = surfaces(v)
    axes = figure.subplots()
    image = axes.scatter(*xy.T, c=z, s=9, lw=0, marker="s", cmap="viridis")
    figure.colorbar(image, ax=axes, label="height, m", pad=0.01)
    axes.plot(*(np.array([*stair.ring, stair.ring[0]]) - v.origin).T, color=WALL, lw=1.6)
    (x0, y0), (x1, y1) = np.array(stair.path) - v.origin
    axes.annotate("", (x1, y1), (x0, y0), arrowprops={"arrowstyle": "->", "color": WALL})
    plan_axes(axes, f"Surfaces with room over them, and a flight that rises by {stair.rise:.2f} m")


def trust_picture(figure: Figure) -> None:
    """The faces of the example by how likely they are real, and by how far off they may be."""
    faces = plan().wall_faces
    ends = np.array([(*face.start, *face.end) for face in faces]) - np.tile(voxels().origin, 2)
    sigma = np.array([np.nan if face.sigma is None else 1960 * face.sigma for face in faces])
    confidence = np.array([face.confidence for face in faces])
    shown = ((confidence, (0.5, 1.0), "Confidence"), (sigma, (0.0, 15.0), "Error that 95 % keep within, mm"))
    for axes, (values, limits, title) in zip(figure.subplots(2, 1), shown, strict=True):
        background(axes)
        found = LineCollection(list(ends.reshape(-1, 2, 2)), array=values, cmap="plasma", clim=limits, linewidths=2.2)
        figure.colorbar(axes.add_collection(found), ax=axes, pad=0.01)
        plan_axes(axes, title)


def plan_picture(figure: Figure) -> None:
    """What a user gets: the plan over the density of the points."""
    axes = figure.subplots()
    image, extent = asbuilt.density_image(evidence(), plan().storeys[0])
    density(axes, image, extent)
    draw(axes, np.array([(*face.start, *face.end) for face in plan().wall_faces]), WALL, 1.8)
    x0, x1, y0, y1 = extent
    axes.set(xlim=(x0 + 0.6, x1 - 0.6), ylim=(y0 + 0.4, y1 - 0.4))
    axes.set_aspect("equal")
    axes.plot([x0 + 1, x0 + 3], [y1 - 1, y1 - 1], color="k", lw=2, solid_capstyle="butt")
    axes.text(x0 + 3.15, y1 - 1, "2 m", va="center")
    axes.set_axis_off()


PICTURES: dict[str, tuple[Callable[[Figure], None], float]] = {
    "evidence": (evidence_picture, 7.0),
    "storeys": (storeys_picture, 4.0),
    "cross_sections": (cross_sections_picture, 5.4),
    "ground": (ground_picture, 8.6),
    "lines": (lines_picture, 8.6),
    "orientation": (orientation_picture, 3.4),
    "refine": (refine_picture, 9.4),
    "profiles": (profiles_picture, 4.6),
    "wall_lines": (wall_lines_picture, 5.2),
    "partitions": (partitions_picture, 7.6),
    "elevations": (elevations_picture, 9.0),
    "faces": (faces_picture, 5.2),
    "curves": (curves_picture, 4.2),
    "corners": (corners_picture, 9.6),
    "openings": (openings_picture, 9.6),
    "rooms": (rooms_picture, 5.6),
    "room_faces": (room_faces_picture, 7.6),
    "walls": (walls_picture, 5.6),
    "columns": (columns_picture, 5.6),
    "stairs": (stairs_picture, 3.4),
    "trust": (trust_picture, 9.6),
    "plan": (plan_picture, 5.0),
}


# How it is drawn.


def ends_of(faces: list[Face]) -> FloatArray:
    """Faces as segments (n, 4), m."""
    return np.array([np.concatenate([face.start, face.end]) for face in faces]).reshape(-1, 4)


def draw(axes: Axes, segments: FloatArray, colour: str, width: float = 1.4) -> None:
    """Segments (n, 4)."""
    axes.add_collection(LineCollection(list(segments.reshape(-1, 2, 2)), colors=colour, linewidths=width))


def background(axes: Axes) -> None:
    """Cells of the example that fill some height, in grey."""
    backdrop(axes, voxels())


def backdrop(axes: Axes, v: StoreyVoxels) -> None:
    """Cells that fill some height, in grey."""
    found = columns(v)
    tall = found.filled > 4
    axes.scatter(*found.xy[tall].T, s=0.8, lw=0, color="#c4c4c4")


def density(axes: Axes, image: FloatArray, extent: tuple[float, float, float, float]) -> None:
    """Grey by the logarithm."""
    grey = np.log1p(image)
    axes.imshow(grey, extent=extent, origin="lower", cmap="Greys", vmin=0, vmax=1.3 * np.quantile(grey[grey > 0], 0.99))


def plan_axes(axes: Axes, title: str) -> None:
    """Metres both ways."""
    axes.set_aspect("equal", adjustable="box")
    axes.set_title(title, fontsize=9)
    axes.tick_params(labelsize=7)


def save(name: str) -> None:
    """Draw one picture and write it with few colours, without date or version."""
    picture, height = PICTURES[name]
    figure = Figure(figsize=(WIDTH, height), dpi=100, facecolor="white", layout="constrained")
    picture(figure)
    buffer = BytesIO()
    FigureCanvasAgg(figure).print_figure(buffer, format="png", dpi=100)
    image = Image.open(buffer).convert("RGB").quantize(96, dither=Image.Dither.NONE)
    image.save(DOCS / "stages" / f"{name}.png", optimize=True)


if __name__ == "__main__":
    for wanted in sys.argv[1:] or PICTURES:
        save(wanted)
