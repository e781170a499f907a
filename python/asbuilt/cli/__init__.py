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
from typing import NoReturn

import click

import asbuilt
from asbuilt.cli.evaluate import evaluate_command
from asbuilt.cli.evidence import evidence_command, merge_command
from asbuilt.cli.export import export_command
from asbuilt.cli.info import info_command
from asbuilt.cli.label import label_command
from asbuilt.cli.plan import plan_command
from asbuilt.errors import AsBuiltError

_CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


class _InOrder(click.Group):
    """Lists its commands as they are used, not by their letters."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)


@click.group("asbuilt", cls=_InOrder, context_settings=_CONTEXT)
@click.version_option(asbuilt.__version__, message="asbuilt %(version)s", help="Print the version.")
def _asbuilt() -> None:
    """As-built floor plans from registered laser scans.

    asbuilt plan scans/*.e57 -o school.dxf

    asbuilt export school.geojson -o school.pdf --scale 1:100 --sheet A1

    asbuilt info scans/

    asbuilt evaluate plan.geojson truth.json

    asbuilt label scans/*.laz --plan school.geojson -o school_classes.laz
    """


for _command in (
    plan_command,
    export_command,
    evidence_command,
    merge_command,
    info_command,
    evaluate_command,
    label_command,
):
    _asbuilt.add_command(_command)


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
            with _asbuilt.make_context("asbuilt", sys.argv[1:] if arguments is None else arguments) as context:
                _asbuilt.invoke(context)
        finally:
            sys.stdout.flush()  # here, where a full disk can be told
        code = 0
    except click.exceptions.Exit as leaving:
        code = leaving.exit_code
    except click.exceptions.NoArgsIsHelpError as error:
        print(error.format_message())
        code = 2
    except click.UsageError as error:
        told = error.ctx.command_path if error.ctx else "asbuilt"
        code = _fail(2, f"{error.format_message()} ({told} -h tells how)")
    except KeyboardInterrupt:
        code = _fail(130, "interrupted")
    except AsBuiltError as error:
        code = _fail(2, str(error))
    except BrokenPipeError:  # where there is no SIGPIPE
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        code = 1
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
    sys.exit(code)


def _fail(code: int, message: str) -> int:
    print(f"asbuilt: {' '.join(message.split())}", file=sys.stderr)
    return code
