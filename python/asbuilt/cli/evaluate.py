"""``asbuilt evaluate``: a plan and a truth in, the paper's measures out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer


def evaluate_command(
    plan: Annotated[
        Path,
        typer.Argument(
            metavar="PLAN",
            help="What to score: .geojson, .dxf, .ifc, truth.json, or the Scan-to-BIM challenge's .json.",
            show_default=False,
        ),
    ],
    truth: Annotated[
        Path, typer.Argument(metavar="TRUTH", help="What to score it against, in any of these.", show_default=False)
    ],
    json_output: Annotated[
        Path | None, typer.Option("--json", metavar="OUT", help="Write all measures as JSON.", show_default=False)
    ] = None,
    figure: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT",
            help="Draw what was found and what is false; the suffix chooses the format: .png .svg .pdf.",
            show_default=False,
        ),
    ] = None,
    figure_truth: Annotated[
        str, typer.Option(metavar="observed|all", help="The truth that counts in the figure.")
    ] = "observed",
    layer: Annotated[
        str, typer.Option(metavar="PATTERN", help="Layers of a DXF whose line work is walls; * and ? match anything.")
    ] = "*WALL*",
    cut_height: Annotated[
        float, typer.Option(metavar="METRES", help="Height above the floor at which an IFC's walls are cut.")
    ] = 0.5,
    storey: Annotated[
        list[int] | None,
        typer.Option(
            metavar="N",
            help="Score this storey of the truth only; 0 is the lowest. May be given several times.",
            show_default=False,
        ),
    ] = None,
    max_distance: Annotated[
        float, typer.Option(metavar="METRES", help="A detection farther than this from any true wall is false.")
    ] = 0.25,
    no_distance_limit: Annotated[
        bool, typer.Option("--no-distance-limit", metavar="", help="As the paper's text, which states no limit.")
    ] = False,
    max_angle: Annotated[
        float, typer.Option(metavar="DEGREES", help="Orientation threshold of the association (5.4).")
    ] = 36.0,
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
    result = evaluate(mine, other, None if no_distance_limit else max_distance, max_angle, storey)
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
