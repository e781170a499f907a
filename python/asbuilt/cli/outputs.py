"""Options about what is written that ``plan`` and ``export`` share, and the writing itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from asbuilt.errors import AsBuiltError
from asbuilt.export import check_output, drawn_to_scale, export, known_suffixes
from asbuilt.export.sheet import SheetOptions

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence
    from asbuilt.plan import FloorPlan

_PANEL = "Drawings to scale (.dxf .svg .pdf)"

Outputs = Annotated[
    list[Path],
    typer.Option(
        "--output",
        "-o",
        metavar="OUT",
        help=f"File to write; its suffix chooses the format: {' '.join(known_suffixes())}. May be given several times.",
        show_default=False,
    ),
]
Scale = Annotated[
    str | None,
    typer.Option(
        metavar="1:N", help="Scale. \\[default: 1:100, or what fits]", show_default=False, rich_help_panel=_PANEL
    ),
]
SheetName = Annotated[
    str | None,
    typer.Option(
        "--sheet",
        metavar="A0..A4|WxH",
        help='Sheet of paper: A3, "A3 portrait", LETTER, TABLOID, ARCH-C to ARCH-E, or 594x420 in mm. '
        "\\[default: the smallest of A4 to A0 that fits; of .svg: as large as the drawing]",
        show_default=False,
        rich_help_panel=_PANEL,
    ),
]
North = Annotated[
    float | None,
    typer.Option(
        metavar="DEGREES",
        help="North of the plan, clockwise from the input's y axis. \\[default: the y axis is shown instead]",
        show_default=False,
        rich_help_panel=_PANEL,
    ),
]
Date = Annotated[
    str | None,
    typer.Option(metavar="TEXT", help="Date in the title block.", show_default=False, rich_help_panel=_PANEL),
]
Title = Annotated[
    str | None,
    typer.Option(metavar="TEXT", help="Project in the title block.", show_default=False, rich_help_panel=_PANEL),
]


def check_outputs(outputs: Sequence[Path], **options: Any) -> dict[str, Any]:
    """The options of drawings to scale; what is wrong with them or with an output is told before any work."""
    for path in outputs:
        check_output(path)
    SheetOptions(**options)
    return options


def write_outputs(
    plan: FloorPlan, outputs: Sequence[Path], evidence: Evidence | None, options: dict[str, Any]
) -> list[Path]:
    """Write all outputs, then raise the first error: a drawing too large for its sheet must not cost the plan file."""
    written: list[Path] = []
    errors: list[AsBuiltError] = []
    for path in outputs:
        try:
            written += export(plan, path, evidence, **(options if drawn_to_scale(path) else {}))
        except AsBuiltError as error:
            errors.append(error)
    if errors:
        for path in written:
            print(f"wrote {path}")
        raise errors[0]
    return written
