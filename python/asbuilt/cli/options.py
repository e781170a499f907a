"""Options and habits that commands share."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asbuilt.errors import InputError

if TYPE_CHECKING:
    from asbuilt.read import PointCloud

_SCANS = "Files, folders and glob patterns: LAS, LAZ, COPC, E57, PLY, PTS, PTX, PCD, XYZ, TXT, CSV"

_ALIKE = 0.75
"""An option that is less like the one that was given is not suggested; 1 is the same."""

PATH = click.Path(path_type=Path)


class Option(click.Option):
    """An option that the help shows under a heading."""

    def __init__(self, *arguments: Any, heading: str = "Options", **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.heading = heading


class Command(click.Command):
    """A command whose help tells its options under their headings."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse them; errors know which command's help tells how."""
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            known = [name for parameter in self.params for name in parameter.opts]
            alike = get_close_matches(error.option_name, known, 1, _ALIKE)
            raise click.NoSuchOption(error.option_name, possibilities=alike, ctx=ctx) from error
        except click.UsageError as error:
            error.ctx = error.ctx or ctx
            raise

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write them, each heading where its first option stands."""
        headings: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            told = None if isinstance(parameter, click.Argument) else parameter.get_help_record(ctx)
            if told is not None:
                headings.setdefault(getattr(parameter, "heading", "Options"), []).append(told)
        for heading, options in headings.items():
            with formatter.section(heading):
                formatter.write_dl(options)

    def get_short_help_str(self, limit: int = 45) -> str:
        """What the list of commands says of it: the first sentence, whole."""
        return super().get_short_help_str(1000)


def option(*names: str, heading: str = "Options", **options: Any) -> Callable[[Any], Any]:
    """An option of a command."""
    return click.option(*names, cls=Option, heading=heading, **options)


def flag(name: str, *names: str, text: str, heading: str = "Options") -> Callable[[Any], Any]:
    """An option that takes no value."""
    return option(name, *names, is_flag=True, help=text, heading=heading)


def argument(name: str, metavar: str, text: str, nargs: int = 1) -> Callable[[Any], Any]:
    """One path that must be given, or (`nargs` -1) one or more."""
    return click.argument(name, metavar=metavar, type=PATH, nargs=nargs, required=True, help=text)


scans = argument("inputs", "INPUT...", f"{_SCANS}.", nargs=-1)
inputs = argument(
    "inputs", "INPUT...", f"{_SCANS}; and evidence files, which asbuilt evidence makes of them.", nargs=-1
)
unit = option(
    "--unit", metavar="m|dm|cm|mm|ft|us-ft|in", default="m", show_default=True, heading="Reading",
    help="Unit of the coordinates.",
)  # fmt: skip
up = option(
    "--up", metavar="z|y|x|-z|-y|-x", default="z", show_default=True, heading="Reading", help="Axis that points up.",
)  # fmt: skip
skip_bad = flag("--skip-bad", text="Leave bad files out, list them at the end, exit 3.", heading="Reading")
threads = option(
    "--threads", metavar="N", type=click.IntRange(min=1), heading="Reading",
    help="Threads to read with. The result is the same for any number. [default: all cores]",
)  # fmt: skip


def open_cloud(inputs: Sequence[Path], unit: str, up: str, skip_bad: bool) -> PointCloud:
    """`asbuilt.read`; what it passes over in folders is said."""
    import asbuilt
    from asbuilt.read import find_files

    try:
        cloud = asbuilt.read(*inputs, unit=unit, up=up, skip_bad=skip_bad)
    except InputError as error:
        if skip_bad or len(find_files(inputs)) < 2:
            raise
        raise InputError(f"{error}; --skip-bad goes on without it") from error
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
