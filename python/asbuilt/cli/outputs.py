"""Options about what is written that ``plan`` and ``export`` share, and the writing itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asbuilt.cli.options import PATH, option
from asbuilt.errors import AsBuiltError, ParameterError
from asbuilt.export import check_output, drawn_to_scale, export, known_suffixes
from asbuilt.export.sheet import SheetOptions

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence
    from asbuilt.plan import FloorPlan

_TO_SCALE = "Drawings to scale (.dxf .svg .pdf)"

outputs = option(
    "-o", "--output", metavar="OUT", type=PATH, multiple=True, required=True,
    help=f"File to write; its suffix chooses the format: {' '.join(known_suffixes())}. May be given several times.",
)  # fmt: skip


def drawing(command: Any) -> Any:
    """Options of drawings to scale: `scale`, `sheet`, `north`, `date` and `title`."""
    for add in reversed(
        (
            option("--scale", metavar="1:N", heading=_TO_SCALE, help="Scale. [default: 1:100, or what fits]"),
            option(
                "--sheet",
                metavar="A0..A4|WxH",
                heading=_TO_SCALE,
                help='Sheet of paper: A3, "A3 portrait", LETTER, TABLOID, ARCH-C to ARCH-E, or 594x420 in mm. '
                "[default: the smallest of A4 to A0 that fits; of .svg: as large as the drawing]",
            ),
            option(
                "--north",
                metavar="DEGREES",
                type=float,
                heading=_TO_SCALE,
                help="North of the plan, clockwise from the input's y axis. [default: the y axis is shown instead]",
            ),
            option("--date", metavar="TEXT", heading=_TO_SCALE, help="Date in the title block."),
            option("--title", metavar="TEXT", heading=_TO_SCALE, help="Project in the title block."),
        )
    ):
        command = add(command)
    return command


def check_outputs(outputs: Sequence[Path], **options: Any) -> dict[str, Any]:
    """The options of drawings to scale; what is wrong with them or with an output is told before any work."""
    for path in outputs:
        check_output(path)
    SheetOptions(**options)
    given = [f"--{name}" for name, value in options.items() if value is not None]
    if given and not any(map(drawn_to_scale, outputs)):
        raise ParameterError(f"{', '.join(given)}: none of the outputs is a drawing to scale (.dxf .svg .pdf)")
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
