"""``asbuilt evaluate``: a plan and a truth in, the paper's measures out."""

from __future__ import annotations

import json
from pathlib import Path

import click

from asbuilt.cli.options import PATH, Command, argument, flag, option


@click.command("evaluate", cls=Command, no_args_is_help=True)
@argument("plan", "PLAN", "What to score: .geojson, .dxf, .ifc, truth.json, or the Scan-to-BIM challenge's .json.")
@argument("truth", "TRUTH", "What to score it against, in any of these.")
@option("--json", "json_output", metavar="OUT", type=PATH, help="Write all measures as JSON.")
@option(
    "--figure", metavar="OUT", type=PATH,
    help="Draw what was found and what is false; the suffix chooses the format: .png .svg .pdf.",
)  # fmt: skip
@option(
    "--figure-truth", metavar="observed|all", default="observed", show_default=True,
    help="The truth that counts in the figure.",
)  # fmt: skip
@option(
    "--layer", metavar="PATTERN", default="*WALL*", show_default=True,
    help="Layers of a DXF whose line work is walls; * and ? match anything.",
)  # fmt: skip
@option(
    "--cut-height", metavar="METRES", type=float, default=0.5, show_default=True,
    help="Height above the floor at which an IFC's walls are cut.",
)  # fmt: skip
@option(
    "--storey", metavar="N", type=int, multiple=True,
    help="Score this storey of the truth only; 0 is the lowest. May be given several times.",
)  # fmt: skip
@option(
    "--max-distance", metavar="METRES", type=float, default=0.25, show_default=True,
    help="A detection farther than this from any true wall is false.",
)  # fmt: skip
@flag("--no-distance-limit", text="As the paper's text, which states no limit.")
@option(
    "--max-angle", metavar="DEGREES", type=float, default=36.0, show_default=True,
    help="Orientation threshold of the association (5.4).",
)  # fmt: skip
def evaluate_command(
    plan: Path,
    truth: Path,
    json_output: Path | None,
    figure: Path | None,
    figure_truth: str,
    layer: str,
    cut_height: float,
    storey: tuple[int, ...],
    max_distance: float,
    no_distance_limit: bool,
    max_angle: float,
) -> None:
    """Score a plan against a truth by the measures of the paper's section 4.

    Precision, recall, F, distance and orientation error, over-segmentation and overlap, per storey and pooled:

        asbuilt evaluate plan.geojson truth.json

    The same as JSON, and a picture with the missed walls in red:

        asbuilt evaluate plan.geojson truth.json --json scores.json --figure scores.png

    Another program's drawing, whose walls are on a layer of another name:

        asbuilt evaluate other.dxf truth.json --layer 'WAENDE*'

    Two plans against each other, the second storey alone:

        asbuilt evaluate mine.geojson theirs.ifc --storey 1
    """
    from asbuilt.errors import ParameterError
    from asbuilt.evaluate.drawing import TRUTH_SETS
    from asbuilt.evaluate.figures import check_figure

    which = next((name for name in TRUTH_SETS if name == figure_truth), None)
    if which is None:
        raise ParameterError(f"--figure-truth is {figure_truth!r}; expected observed or all")
    if figure is not None:
        check_figure(figure)

    from rich.console import Console

    from asbuilt.evaluate import evaluate, read_drawing
    from asbuilt.evaluate.figures import write_figure
    from asbuilt.evaluate.table import evaluation_tables
    from asbuilt.export.atomic import replacing

    mine, other = (read_drawing(path, layer=layer, cut_height=cut_height) for path in (plan, truth))
    result = evaluate(mine, other, None if no_distance_limit else max_distance, max_angle, list(storey) or None)
    if json_output is not None:
        with replacing(json_output) as temporary:
            temporary.write_text(json.dumps(result.to_json(), indent=2) + "\n", encoding="utf-8")
    if figure is not None:
        with replacing(figure) as temporary:
            write_figure(result, temporary, which)
    console = Console()
    if not console.is_terminal:  # a pipe has no width of its own, and numbers must not be cut
        console.width = max(console.width, 100)
    console.print(evaluation_tables(result))
