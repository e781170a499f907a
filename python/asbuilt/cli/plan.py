"""``asbuilt plan``: scans in, plan out."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asbuilt.cli.options import Command, inputs, open_cloud, option, progress_bar, say, skip_bad, threads, unit
from asbuilt.cli.outputs import check_outputs, drawing, outputs, write_outputs
from asbuilt.errors import InputError, ParameterError
from asbuilt.export import known_suffixes

if TYPE_CHECKING:
    from asbuilt.params import Parameters
    from asbuilt.plan import FloorPlan


_PARAMETERS = "Parameters (default: the preset's)"


def _method(metavar: str, text: str, *names: str, kind: Any = str) -> Callable[[Any], Any]:
    """An option of the paper's method: without it the preset's value holds, so it has no default of its own."""
    heading = "Parameters that --preset paper alone reads, by the paper's section (default: its own)"
    return option(*names, metavar=metavar, type=kind, help=text, heading=heading)


@click.command("plan", cls=Command, no_args_is_help=True)
@inputs
@outputs
@option(
    "--preset", metavar="default|paper", default="default", show_default=True,
    help="All parameters at once; paper is the paper's best setting.",
)  # fmt: skip
@option("--storey", metavar="N", type=int, help="This storey only; 0 is the lowest.")
@unit
@option(
    "--up", metavar="z|y|x|-z|-y|-x", heading="Reading",
    help="Axis that points up. [default: z; a building that then lies on its side is refused]",
)  # fmt: skip
@option(
    "--crs", metavar="EPSG:n|WKT", heading="Reading",
    help="Coordinate reference system of the input; else what its headers say.",
)  # fmt: skip
@skip_bad
@threads
@drawing
@option("--voxel", metavar="METRES", type=float, heading=_PARAMETERS, help="Side of an evidence voxel (3.1).")
@option(
    "--unseen-thickness", metavar="METRES", type=float, heading=_PARAMETERS,
    help="Draw a wall of which one side was seen this thick (not in the paper, nor with --preset paper).",
)  # fmt: skip
@option(
    "--set", "settings", metavar="STAGE.NAME=VALUE", multiple=True, heading=_PARAMETERS,
    help="Any other parameter, such as walls.bridge=3.",
)  # fmt: skip
@_method("K", "Keep cells above mean + k sigma (3.3).", "-k", "--sigmas", kind=float)
@_method("incremental|batch", "Lines one at a time or all at once (5.2).", "--hough")
@_method("METRES", "Bridge gaps in a line up to this (3.3).", "--fill-gap", kind=float)
@_method("METRES", "Drop shorter segments (3.3).", "--min-length", kind=float)
@_method("N", "Stop after this many lines (3.3).", "--max-lines", kind=int)
@_method(
    "DEGREES", "Turn segments this close to a dominant orientation to it; 0: none (3.4).", "--snap-deg", kind=float
)
@_method("all|band|lowest", "Heights that count: all, a band, or the slices that hold least (5.3).", "--cross-sections")
@_method("N", "How many slices that hold least (5.3).", "--slices", kind=int)
@_method("LOW HIGH", "The band, metres above the floor (5.3).", "--band", kind=(float, float))
def plan_command(
    inputs: tuple[Path, ...],
    output: tuple[Path, ...],
    preset: str,
    storey: int | None,
    unit: str,
    up: str | None,
    crs: str | None,
    skip_bad: bool,
    threads: int | None,
    scale: str | None,
    sheet: str | None,
    north: float | None,
    date: str | None,
    title: str | None,
    voxel: float | None,
    sigmas: float | None,
    hough: str | None,
    fill_gap: float | None,
    min_length: float | None,
    max_lines: int | None,
    snap_deg: float | None,
    cross_sections: str | None,
    slices: int | None,
    band: tuple[float, float] | None,
    unseen_thickness: float | None,
    settings: tuple[str, ...],
) -> None:
    """Draw the floor plan of registered laser scans.

    One drawing for CAD, from all scans of a building:

        asbuilt plan scans/*.e57 -o school.dxf

    Several formats at once, of a folder; with several storeys the pictures become plan_s0.png, plan_s1.png...:

        asbuilt plan scans/ -o plan.geojson -o plan.dxf -o plan.png

    Of evidence, which is gathered once and planned as often as you like (see asbuilt evidence):

        asbuilt plan school.evidence -o school.dxf --set walls.bridge=3

    The second storey of a cloud in millimetres, y up:

        asbuilt plan house.ply --unit mm --up y --storey 1 -o upstairs.svg

    A drawing to scale, a page a storey, with a title block:

        asbuilt plan house.e57 -o house.pdf --scale 1:50 --sheet A2 --north 12.5

    Exactly as in the paper, and with one thing changed:

        asbuilt plan school.laz --preset paper -o plan.geojson

        asbuilt plan school.laz --preset paper --hough batch -k 2 -o plan.geojson

    Exit codes: 0 done, 1 nothing found (the files are written), 2 error, 3 done but --skip-bad left files out.
    """
    options = check_outputs(output, scale=scale, sheet=sheet, north=north, date=date, title=title)
    drawn = next((path for path in inputs if path.suffix.lower() in known_suffixes().keys() - {".csv"}), None)
    if drawn is not None:
        raise InputError(
            f"{drawn}: expected scans, found what is a plan by its name; each output takes an -o of its own, and saved "
            "plans are read by asbuilt export"
        )
    if band is not None and cross_sections is None:
        cross_sections = "band"
    changes: dict[str, dict[str, Any]] = {
        "evidence": {"voxel": voxel},
        "cross_sections": {"select": cross_sections, "count": slices, "band": band},
        "lines": {
            "sigmas": sigmas,
            "method": hough,
            "fill_gap": fill_gap,
            "min_length": min_length,
            "max_lines": max_lines,
        },
        "orientation": {"snap": None if snap_deg is None else math.radians(snap_deg)},
        "walls": {"unseen_thickness": unseen_thickness},
    }
    for setting in settings:
        stage, name, value = _split_setting(setting)
        changes.setdefault(stage, {})[name] = value
    parameters = _parameters(preset, changes)
    crs = _checked_crs(crs)

    import asbuilt
    from asbuilt.frame import check_upright

    cloud = open_cloud(inputs, unit, up or "z", skip_bad)
    with progress_bar("reading") as progress:
        evidence = asbuilt.gather_evidence(
            cloud, parameters.evidence, threads=threads, progress=progress, skip_bad=skip_bad
        )
    with progress_bar("finding storeys and walls"):
        if up is None:
            check_upright(evidence)
        plan = asbuilt.extract_floor_plan(evidence, parameters, storey=storey, crs=crs)
    written = write_outputs(plan, output, evidence, options)

    _print_summary(plan, evidence.points, len(evidence.inputs), written)
    for note in plan.notes:
        say(f"asbuilt: note: {note}")
    for error in evidence.errors:
        say(f"asbuilt: left out: {error}")
    if not plan.wall_faces:
        say("asbuilt: nothing found: the plan has no walls")
        raise click.exceptions.Exit(1)
    if evidence.errors:
        raise click.exceptions.Exit(3)


def _parameters(preset: str, changes: dict[str, dict[str, Any]]) -> Parameters:
    """The preset with what was said on the command line; defaults stay where they are, in `asbuilt.params`."""
    from asbuilt.params import Parameters

    said = {
        stage: {name: value for name, value in given.items() if value is not None} for stage, given in changes.items()
    }
    return Parameters.preset(preset).replace(**{stage: given for stage, given in said.items() if given})


def _split_setting(setting: str) -> tuple[str, str, Any]:
    """``lines.rho_step=0.5`` as its parts; the value as JSON reads it, else as text."""
    found = re.fullmatch(r"(\w+)\.(\w+)=(.+)", setting)
    if found is None:
        raise ParameterError(f"--set {setting!r}: expected STAGE.NAME=VALUE, such as lines.rho_step=0.5")
    stage, name, value = found.groups()
    try:
        return stage, name, json.loads(value)
    except ValueError:
        return stage, name, value


def _checked_crs(crs: str | None) -> str | None:
    if crs is not None and crs.lower().startswith("epsg:"):
        crs = crs.upper()
    if crs is not None and not re.fullmatch(r"EPSG:\d+|[A-Z_]+(CRS|CS)\s*\[.*\]\s*", crs, re.DOTALL):
        raise ParameterError(f"--crs {crs[:40]!r}: expected EPSG:n, such as EPSG:25832, or WKT")
    return crs


def _print_summary(plan: FloorPlan, points: int, files: int, written: list[Path]) -> None:
    print(f"{points:,} {'point' if points == 1 else 'points'} in {files} {'file' if files == 1 else 'files'}")
    for storey in plan:
        length = sum(face.length for face in storey.wall_faces)
        faces = len(storey.wall_faces)
        print(
            f"storey {storey.index}: floor {storey.floor:.2f} m, ceiling {storey.ceiling:.2f} m, "
            f"{faces} wall {'face' if faces == 1 else 'faces'}, {length:.1f} m"
            + "".join(
                f", {len(elements)} {name if len(elements) == 1 else f'{name}s'}"
                for name, elements in (("door", storey.doors), ("window", storey.windows), ("room", storey.rooms))
                if elements
            )
        )
    for path in written:
        print(f"wrote {path}")
