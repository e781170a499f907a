"""``asbuilt label``: scans and their plan in, scans with a class for each point out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from asbuilt.cli.options import PATH, Command, open_cloud, option, progress_bar, say, scans, skip_bad, unit, up

if TYPE_CHECKING:
    from asbuilt.plan import FloorPlan
    from asbuilt.read import PointCloud


_DOUBTFUL, _CERTAIN = 0.3, 0.9
"""More points than these shares of them are seldom, and never, outside of their own building."""


@click.command("label", cls=Command, no_args_is_help=True)
@scans
@option("-p", "--plan", metavar="PLAN", type=PATH, required=True, help="The plan.geojson made from them.")
@option("-o", "--output", metavar="OUT", type=PATH, required=True, help="File to write: .laz .las .e57.")
@option(
    "--tolerance", metavar="METRES", type=float, default=0.05, show_default=True,
    help="A point this near to a surface of the plan is on it.",
)  # fmt: skip
@unit
@up
@skip_bad
def label_command(
    inputs: tuple[Path, ...], plan: Path, output: Path, tolerance: float, unit: str, up: str, skip_bad: bool
) -> None:
    """Give every point a class by the plan: wall, floor, ceiling, door, window, column, stair, clutter or outside.

    Each point also gets the numbers of its wall and of its room.
    LAS and E57 inputs keep all else they carry:

        asbuilt plan scans/*.laz -o school.geojson

        asbuilt label scans/*.laz --plan school.geojson -o school_classes.laz

    E57 keeps the scans apart, with their poses:

        asbuilt label school.e57 --plan school.geojson -o school_classes.e57

    The classes are numbers of LAS: 1 outside, 2 floor, 6 wall, 64 ceiling,
    65 door, 66 window, 67 column, 68 stair, 69 clutter.

    Exit codes: 0 done, 2 error, 3 done but --skip-bad left files out.
    """
    from asbuilt.label import PointClass, check_output, label_cloud

    check_output(output)

    import asbuilt

    cloud = open_cloud(inputs, unit, up, skip_bad)
    drawn = asbuilt.load_plan(plan)
    with progress_bar("labelling") as progress:
        counts = label_cloud(cloud, drawn, output, tolerance=tolerance, progress=progress)
    total = sum(counts.values())
    print(f"{total:,} points")
    for known, count in counts.items():
        print(f"  {known.title:8} {count:>14,}  {count / max(total, 1):6.1%}")
    print(f"wrote {output}")
    outside = counts[PointClass.OUTSIDE] / max(total, 1)
    if outside > (_CERTAIN if _made_from(drawn, cloud) else _DOUBTFUL):
        say(
            f"asbuilt: note: {outside:.0%} of the points are outside: is the plan that of these scans, read with the "
            "same --unit and --up?"
        )
    errors = [file.error for file in cloud.files if file.error is not None]
    for error in errors:
        say(f"asbuilt: left out: {error}")
    if errors:
        raise click.exceptions.Exit(3)


def _made_from(plan: FloorPlan, cloud: PointCloud) -> bool:
    """Whether a plan was made from any of the files."""
    known = {source.get("checksum") for source in plan.inputs}
    return any(file.checksum() in known for file in cloud.files if file.error is None)
