"""Options and habits that commands share."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from asbuilt.read import PointCloud

_SCANS = "Files, folders and glob patterns: LAS, LAZ, COPC, E57, PLY, PTS, PTX, PCD, XYZ, TXT, CSV"

Scans = Annotated[list[Path], typer.Argument(metavar="INPUT", help=f"{_SCANS}.", show_default=False)]
Inputs = Annotated[
    list[Path],
    typer.Argument(
        metavar="INPUT", help=f"{_SCANS}; and evidence files, which asbuilt evidence makes of them.", show_default=False
    ),
]
Unit = Annotated[
    str, typer.Option(metavar="m|dm|cm|mm|ft|us-ft|in", help="Unit of the coordinates.", rich_help_panel="Reading")
]
Up = Annotated[str, typer.Option(metavar="z|y|x|-z|-y|-x", help="Axis that points up.", rich_help_panel="Reading")]
SkipBad = Annotated[
    bool,
    typer.Option(
        "--skip-bad", metavar="", help="Leave bad files out, list them at the end, exit 3.", rich_help_panel="Reading"
    ),
]
Threads = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Threads to read with. The result is the same for any number. \\[default: all cores]",
        show_default=False,
        rich_help_panel="Reading",
    ),
]


def open_cloud(inputs: Sequence[Path], unit: str, up: str, skip_bad: bool) -> PointCloud:
    """`asbuilt.read`; what it passes over in folders is said."""
    import asbuilt

    cloud = asbuilt.read(*inputs, unit=unit, up=up, skip_bad=skip_bad)
    for reason in cloud.passed_over:
        say(f"asbuilt: note: passed over: {reason}")
    return cloud


@contextlib.contextmanager
def progress_bar(label: str) -> Iterator[Callable[[int, int], None] | None]:
    """A bar on standard error for the library's ``progress(done, total)``; None where that is not a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn(label), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total or None)


def say(message: str) -> None:
    """A line for the person who runs the command; standard output is for results."""
    print(message, file=sys.stderr)
