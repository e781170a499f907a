"""``asbuilt export``: a saved plan in, other formats out; no scan is read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from asbuilt.cli.options import PATH, Command, argument, option, say
from asbuilt.cli.outputs import check_outputs, drawing, outputs, write_outputs


@click.command("export", cls=Command, no_args_is_help=True)
@argument("plan", "PLAN", "A .geojson that asbuilt plan wrote.")
@outputs
@option(
    "--evidence", metavar="FILE", type=PATH,
    help="What the plan was made from, saved by asbuilt evidence, for outputs that show the points.",
)  # fmt: skip
@drawing
def export_command(plan: Path, output: tuple[Path, ...], evidence: Path | None, **drawn: Any) -> None:
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

    options = check_outputs(output, **drawn)
    loaded = load_plan(plan)
    points = None if evidence is None else Evidence.load(evidence)
    for path in write_outputs(loaded, output, points, options):
        print(f"wrote {path}")
    blind = [path.name for path in output if shows_points(path)]
    if blind and points is None:
        say(f"asbuilt: note: {', '.join(blind)} cannot show the scans' points: --evidence FILE has them")
