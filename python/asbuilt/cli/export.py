"""``asbuilt export``: a saved plan in, other formats out; no scan is read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from asbuilt.cli.options import say
from asbuilt.cli.outputs import Date, North, Outputs, Scale, SheetName, Title, check_outputs, write_outputs


def export_command(
    plan: Annotated[
        Path, typer.Argument(metavar="PLAN", help="A .geojson that asbuilt plan wrote.", show_default=False)
    ],
    output: Outputs,
    evidence: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="What the plan was made from, saved by asbuilt evidence, for outputs that show the points.",
            show_default=False,
        ),
    ] = None,
    scale: Scale = None,
    sheet: SheetName = None,
    north: North = None,
    date: Date = None,
    title: Title = None,
) -> None:
    """Write a saved plan in other formats, without reading the scans again.

    A drawing to scale, a page a storey:

        asbuilt export plan.geojson -o plan.pdf --scale 1:50 --sheet A1 --date 2026-11-22

    For CAD and for the screen:

        asbuilt export plan.geojson -o plan.dxf -o plan.svg --north 12.5

    A picture over the points, from evidence that asbuilt evidence saved:

        asbuilt export plan.geojson -o plan.png --evidence school.evidence
    """
    from asbuilt.evidence import Evidence
    from asbuilt.export import shows_points
    from asbuilt.plan import load_plan

    options = check_outputs(output, scale=scale, sheet=sheet, north=north, date=date, title=title)
    loaded = load_plan(plan)
    points = None if evidence is None else Evidence.load(evidence)
    for path in write_outputs(loaded, output, points, options):
        print(f"wrote {path}")
    blind = [path.name for path in output if shows_points(path)]
    if blind and points is None:
        say(f"asbuilt: note: {', '.join(blind)} cannot show the scans' points: --evidence FILE has them")
