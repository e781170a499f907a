"""``asbuilt info``: what the files hold, before any plan is made of them."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asbuilt.cli.options import (
    Command,
    flag,
    inputs,
    open_cloud,
    progress_bar,
    say,
    skip_bad,
    threads,
    unit,
    up,
)

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence
    from asbuilt.read import PointCloud

_LISTED = 12
"""Scans listed unless all are asked for."""


@click.command("info", cls=Command, no_args_is_help=True)
@inputs
@flag("--headers", text="Only what the headers say; points are not read, no histogram.")
@flag("--all", "every", text=f"List all scans, not only the first {_LISTED}.")
@unit
@up
@skip_bad
@threads
def info_command(
    inputs: tuple[Path, ...], headers: bool, every: bool, unit: str, up: str, skip_bad: bool, threads: int | None
) -> None:
    """Print formats, point counts, bounds, scans and poses, and draw the height histogram with the storeys in it.

    Everything about a folder of scans:

        asbuilt info scans/

    Only the headers, which takes no time even for a billion points:

        asbuilt info --headers campus/**/*.e57

    Exit codes: 0 done, 2 error, 3 done but --skip-bad left files out.
    """
    import asbuilt
    from asbuilt.frame import doubt_extent, doubt_up

    cloud = open_cloud(inputs, unit, up, skip_bad)
    _print_files(cloud)
    errors = tuple(file.error for file in cloud.files if file.error is not None)
    if headers:
        scans = [scan for file in cloud.files for scan in _header_scans(file.header)]
        if scans:
            _print_scans(scans, every)
        else:
            print("scans: not in the headers")  # LAS has them point by point
    else:
        with progress_bar("reading") as progress:
            evidence = asbuilt.gather_evidence(cloud, threads=threads, progress=progress, skip_bad=skip_bad)
        _print_scans(evidence.scans, every)
        found = _print_heights(evidence)
        for note in (*evidence.skipped, *filter(None, [doubt_up(evidence), None if found else doubt_extent(evidence)])):
            say(f"asbuilt: note: {note}")
        errors = evidence.errors
    for error in errors:
        say(f"asbuilt: left out: {error}")
    if errors:
        raise click.exceptions.Exit(3)


def _print_files(cloud: PointCloud) -> None:
    for file in cloud.files:
        header = file.header
        print(file.path)
        print(f"  format  {header['format']}, {file.size:,} bytes")
        if file.error is not None:
            continue
        print(f"  points  {'not in the header' if header['points'] is None else format(header['points'], ',')}")
        if header["bounds"] is not None:
            low, high = header["bounds"]
            print("  bounds  " + ", ".join(f"{n} {a:.3f} to {b:.3f}" for n, a, b in zip("xyz", low, high, strict=True)))
        print(f"  CRS     {_one_line(header['crs'] or 'not in the header')}")
        for note in header["notes"]:
            print(f"  note    {note}")
    if len(cloud.files) > 1:
        print(f"{len(cloud.files)} files, {cloud.points:,} points")


def _header_scans(header: dict[str, Any]) -> list[tuple[str, tuple[float, float, float] | None, int | None]]:
    return [(key, position, points) for _, key, position, points in header["scans"]]


def _print_scans(scans: list[Any], every: bool) -> None:
    """Each scan as (key, position or None, points or None)."""
    scans = sorted(scans, key=lambda scan: [int(p) if p.isdigit() else p for p in re.split(r"(\d+)", scan[0])])  # 2, 10
    posed = sum(position is not None for _, position, _ in scans)
    print(f"{len(scans)} {'scan' if len(scans) == 1 else 'scans'}, {posed} with the scanner's position")
    for key, position, points in scans if every else scans[:_LISTED]:
        place = "no position" if position is None else "at " + ", ".join(f"{value:.3f}" for value in position)
        count = "" if points is None else f"  {points:,} points"
        print(f"  {key}  {place}{count}")
    if not every and len(scans) > _LISTED:
        print(f"  and {len(scans) - _LISTED} more; --all lists them")


def _print_heights(evidence: Evidence) -> int:
    """How many storeys were found in them."""
    from asbuilt.cli.histogram import draw_heights
    from asbuilt.params import StoreyParameters
    from asbuilt.storeys import find_storeys, height_histogram

    voxel = StoreyParameters().voxel
    levels = find_storeys(evidence)
    histogram = height_histogram(evidence.occupied(voxel), voxel)
    columns, rows = shutil.get_terminal_size()
    storeys = f"{len(levels)} {'storey' if len(levels) == 1 else 'storeys'}"
    print(f"{storeys}; how many voxels of {voxel:g} m hold points between each two heights (z in m)")
    for line in draw_heights(histogram, levels, columns, max(rows - 4, 40)):
        print(line)
    return len(levels)


def _one_line(text: str, width: int = 80) -> str:
    text = " ".join(text.split())
    return text if len(text) <= width else f"{text[: width - 3]}..."
