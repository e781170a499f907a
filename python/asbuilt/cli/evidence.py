"""``asbuilt evidence`` and ``asbuilt merge``: what all points say, summed up in a file."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import click

from asbuilt.cli.options import (
    PATH,
    Command,
    argument,
    flag,
    inputs,
    open_cloud,
    option,
    progress_bar,
    say,
    skip_bad,
    threads,
    unit,
    up,
)
from asbuilt.errors import InputError, OutputError
from asbuilt.export.atomic import check_place

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence

_output = option("-o", "--output", metavar="OUT.evidence", type=PATH, required=True, help="Evidence file to write.")


@click.command("evidence", cls=Command, no_args_is_help=True)
@inputs
@_output
@option(
    "--add-to", metavar="OLD.evidence", type=PATH, multiple=True,
    help="Add the inputs to this evidence; its scans are not read.",
)  # fmt: skip
@option("--voxel", metavar="METRES", type=float, help="Side of a voxel. [default: 0.05, or that of OLD]")
@flag("--occupancy", text="Keep only which voxels hold points; enough for --preset paper.")
@flag("--preview", text="Of COPC read only points down to half a voxel's spacing.")
@option("--dask", metavar="tcp://HOST:8786", help="Let the workers of this dask scheduler read.")
@unit
@up
@skip_bad
@threads
def evidence_command(
    inputs: tuple[Path, ...],
    output: Path,
    add_to: tuple[Path, ...],
    voxel: float | None,
    occupancy: bool,
    preview: bool,
    dask: str | None,
    unit: str,
    up: str,
    skip_bad: bool,
    threads: int | None,
) -> None:
    """Sum up registered laser scans in an evidence file, from which plans are made without reading a point again.

    All scans of a building, then plans of it:

        asbuilt evidence scans/*.e57 -o school.evidence

        asbuilt plan school.evidence -o school.dxf

    The scans of another day, without those of yesterday:

        asbuilt evidence tuesday/*.e57 --add-to school.evidence -o school.evidence

    A campus, by the workers of a dask cluster that see the files under the same paths:

        asbuilt evidence /campus/**/*.e57 --dask tcp://scheduler:8786 -o campus.evidence

    Interrupted, it goes on where it was when the same command is given again:
    until all is read, what is done lies in OUT.evidence.parts.

    Exit codes: 0 done, 2 error, 3 done but --skip-bad left files out.
    """
    _check_output(output)
    import asbuilt
    from asbuilt.params import EvidenceParameters

    parameters = EvidenceParameters(occupancy=occupancy, preview=preview)
    if voxel is not None:
        parameters = EvidenceParameters(voxel, occupancy, preview)
    cloud = open_cloud([*inputs, *add_to], unit, up, skip_bad)
    parts = output.with_name(f"{output.name}.parts")
    with progress_bar("reading") as progress:
        if dask is not None:
            from asbuilt.cluster import gather_evidence_on_cluster

            evidence = gather_evidence_on_cluster(cloud, dask, parameters, progress=progress, skip_bad=skip_bad)
        else:
            if parts.is_dir() and any(parts.iterdir()):
                say(f"asbuilt: resuming from {parts}")
            evidence = asbuilt.gather_evidence(
                cloud, parameters, threads=threads, progress=progress, skip_bad=skip_bad, resume=parts
            )
    evidence.save(output)
    if dask is None and parts.is_dir():
        shutil.rmtree(parts)
    _print_summary(evidence, output)
    for error in evidence.errors:
        say(f"asbuilt: left out: {error}")
    if evidence.errors:
        raise click.exceptions.Exit(3)


@click.command("merge", cls=Command, no_args_is_help=True)
@argument("inputs", "EVIDENCE...", "Evidence files.", nargs=-1)
@_output
def merge_command(inputs: tuple[Path, ...], output: Path) -> None:
    """Put evidence files together: the same bytes as if all their scans had been read at once.

    Two days, or two halves of a campus:

        asbuilt merge monday.evidence tuesday.evidence -o school.evidence

        asbuilt merge campus/*.evidence -o campus.evidence

    Exit codes: 0 done, 2 error, such as a file given twice, or a scan that is in two of the files.
    """
    _check_output(output)
    twice = next((path for path in inputs if inputs.count(path) > 1), None)
    if twice is not None:
        raise InputError(f"{twice}: given twice, expected different files; was another one meant?")
    import asbuilt

    evidence = asbuilt.read_evidence(*inputs)
    evidence.save(output)
    _print_summary(evidence, output)


def _check_output(path: Path) -> None:
    """Before hours are spent on reading."""
    if path.suffix != ".evidence":
        raise OutputError(f"{path}: expected a name that ends in .evidence")
    check_place(path)


def _print_summary(evidence: Evidence, output: Path) -> None:
    files, scans = len(evidence.inputs), len(evidence.scans)
    print(
        f"{evidence.points:,} points in {files} {'file' if files == 1 else 'files'} and {scans} "
        f"{'scan' if scans == 1 else 'scans'}: {len(evidence.core):,} voxels of {evidence.voxel:g} m"
    )
    for note in evidence.skipped:
        say(f"asbuilt: note: {note}")
    print(f"wrote {output}")
