"""The command line: one file a command, and what all commands share.

A command parses, calls the library, prints. Results go to standard output, everything else to standard error. Heavy
imports wait inside the commands until their arguments are good.

=========  ==========================================================================
exit code  meaning
=========  ==========================================================================
0          done
1          nothing found: the outputs are written, and a message names the empty stage
2          an error, told in one line
3          done without the inputs that ``--skip-bad`` left out; they are listed
70         a bug of ours
130        interrupted
=========  ==========================================================================
"""

from __future__ import annotations

import errno
import io
import os
import signal
import sys
import warnings
from typing import Annotated, NoReturn

import typer

from asbuilt.cli.evaluate import evaluate_command
from asbuilt.cli.evidence import evidence_command, merge_command
from asbuilt.cli.export import export_command
from asbuilt.cli.info import info_command
from asbuilt.cli.label import label_command
from asbuilt.cli.plan import plan_command
from asbuilt.errors import AsBuiltError

app = typer.Typer(
    name="asbuilt",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("plan", no_args_is_help=True)(plan_command)
app.command("export", no_args_is_help=True)(export_command)
app.command("evidence", no_args_is_help=True)(evidence_command)
app.command("merge", no_args_is_help=True)(merge_command)
app.command("info", no_args_is_help=True)(info_command)
app.command("evaluate", no_args_is_help=True)(evaluate_command)
app.command("label", no_args_is_help=True)(label_command)


def _version(wanted: bool) -> None:
    if wanted:
        from asbuilt import __version__

        typer.echo(f"asbuilt {__version__}")
        raise typer.Exit


@app.callback()
def _asbuilt(
    version: Annotated[
        bool, typer.Option("--version", metavar="", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """As-built floor plans from registered laser scans.

    asbuilt plan scans/*.e57 -o school.dxf

    asbuilt export school.geojson -o school.pdf --scale 1:100 --sheet A1

    asbuilt info scans/

    asbuilt evaluate plan.geojson truth.json

    asbuilt label scans/*.laz --plan school.geojson -o school_classes.laz
    """


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the command line and leave with its exit code; errors are one line, never a traceback."""
    if hasattr(signal, "SIGPIPE"):
        # asbuilt info ... | head: end quietly as other programs do; no output file is being written while we print
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a file's name may be more than a terminal can show
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    try:
        try:
            typer.main.get_command(app)(arguments, prog_name="asbuilt")
        finally:
            sys.stdout.flush()  # here, where a full disk can be told
        code = 0
    except SystemExit as leaving:
        code = leaving.code if isinstance(leaving.code, int) else 0
    except KeyboardInterrupt:
        code = 130
    except AsBuiltError as error:
        code = _fail(2, str(error))
    except MemoryError:
        code = _fail(2, "out of memory; a larger --voxel needs less")
    except Exception as error:
        if os.environ.get("ASBUILT_TRACEBACK"):
            raise
        if isinstance(error, OSError) and error.errno == errno.ENOSPC:  # files of ours say so as an OutputError
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # Python would try again as it leaves
            sys.exit(_fail(2, "standard output: no space left on the disk"))
        where = f"{type(error).__name__}: {error}"
        code = _fail(70, f"this is a bug of asbuilt, please report it: {where} (ASBUILT_TRACEBACK=1 shows where)")
    if code == 130:
        _fail(130, "interrupted")
    sys.exit(code)


def _fail(code: int, message: str) -> int:
    print(f"asbuilt: {' '.join(message.split())}", file=sys.stderr)
    return code
