"""Evidence gathered by many machines: parts of files are read by dask workers, which hand on evidence, never points.

The evidence is the same, byte for byte, as that of one machine (not in the paper).
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from asbuilt import _core
from asbuilt.errors import AsBuiltError, InputError, MissingExtraError, ParameterError
from asbuilt.evidence import Evidence
from asbuilt.gather import ScanFile, begin, core_options, finish
from asbuilt.params import EvidenceParameters
from asbuilt.read import PointCloud

if TYPE_CHECKING:
    from distributed import Client, Future

TASK_POINTS = 4_000_000
"""Points a task reads, about: a second of work, which the scheduler's milliseconds do not slow down."""

TASK_PARTS = 16
"""Parts a task reads of a file that does not say how many points it holds."""

FAN_IN = 8
"""Evidences that a task merges."""

SECONDS_TO_ANSWER = 20
_COUNTED_BY_OPENING = ("PTX", "PLY, ascii")
"""Formats whose lines must be counted to find their parts: read by one task a file, they are counted once."""


def gather_evidence_on_cluster(
    cloud: PointCloud,
    address: str,
    parameters: EvidenceParameters | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
    skip_bad: bool = False,
) -> Evidence:
    """As `gather_evidence`, by the workers of a dask cluster, each of which must see the files under the same paths.

    Parameters
    ----------
    address : of the scheduler, such as ``tcp://scheduler:8786``.
    progress, skip_bad : see `gather_evidence`.

    Raises
    ------
    InputError : a file is bad, comes twice, or is missing on a worker, which is named.
    ParameterError : no scheduler or no worker answers, or a worker runs another version of asbuilt.
    MissingExtraError : dask is not installed.
    """
    parameters, stored, scans, errors = begin(cloud, parameters, skip_bad)
    if scans:
        with _connect(address) as client, client.as_current():
            stored.append(_run(client, scans, core_options(cloud, parameters), progress, skip_bad))
    whole = stored[0].merged(*stored[1:])
    return finish(cloud, whole, [*errors, *sorted(whole.errors, key=str)])


def _run(
    client: Client,
    scans: Sequence[ScanFile],
    options: dict[str, Any],
    progress: Callable[[int, int], None] | None,
    skip_bad: bool,
) -> Evidence:
    """Read all parts, merge those of each file, then the files; only the last evidence leaves the cluster."""
    from distributed import KilledWorker, as_completed

    reads: dict[Future[Any], int] = {}
    files: list[Future[Any]] = []
    for scan in scans:
        path, step = os.path.abspath(scan.file.path), _parts_of_task(scan)
        pieces = []
        for first in range(0, max(scan.parts, 1), step):
            end = min(first + step, max(scan.parts, 1))
            pieces.append(client.submit(_read, path, first, end, options, skip_bad, pure=False))
            reads[pieces[-1]] = scan.points * (end - first) // max(scan.parts, 1)
        files.append(client.submit(_close, _tree(client, _join, pieces), scan, skip_bad, pure=False))
        del pieces
    whole = _tree(client, _merge, files)
    del files  # the cluster forgets what nobody waits for
    done, promised = 0, sum(scan.points for scan in scans)
    for future in as_completed(list(reads)):
        done += reads.pop(future)
        if future.status == "error":
            break
        if progress is not None:
            progress(done, promised)
    try:
        evidence: Evidence = whole.result()
    except KilledWorker as error:
        raise AsBuiltError(
            f"several workers died of one task ({error.task}); the files may need workers with more memory"
        ) from error
    return evidence


def _tree(client: Client, merge: Callable[..., Any], futures: Sequence[Future[Any]]) -> Future[Any]:
    """One future of all, merged a few at a time."""
    while len(futures) > 1:
        groups = [futures[i : i + FAN_IN] for i in range(0, len(futures), FAN_IN)]
        futures = [client.submit(merge, *group, pure=False) if len(group) > 1 else group[0] for group in groups]
    return futures[0]


def _parts_of_task(scan: ScanFile) -> int:
    if scan.file.header["format"] in _COUNTED_BY_OPENING:
        return max(scan.parts, 1)
    return max(1, TASK_POINTS * scan.parts // scan.points) if scan.points else TASK_PARTS


@dataclasses.dataclass(frozen=True)
class _Piece:
    """What some parts of a file gave; `seen` are the points that came in or were left out."""

    evidence: Evidence
    seen: int
    not_finite: int


def _read(path: str, first: int, end: int, options: dict[str, Any], skip_bad: bool) -> _Piece:
    """On a worker: some parts of a file."""
    from distributed import get_worker

    try:
        core, invalid, not_finite = _core.Evidence.gather_parts(path, first, end, **options)
    except InputError as error:
        named = InputError(f"{error} (on worker {get_worker().address})")
        if not skip_bad:
            raise named from error
        return _Piece(_nothing(options["voxel"], options["occupancy"], named), 0, 0)
    return _Piece(Evidence(core), core.points + invalid + not_finite, not_finite)


def _join(*pieces: _Piece) -> _Piece:
    """On a worker: what pieces of one file gave."""
    evidence = _merge(*(piece.evidence for piece in pieces))
    return _Piece(evidence, sum(piece.seen for piece in pieces), sum(piece.not_finite for piece in pieces))


def _close(piece: _Piece, scan: ScanFile, skip_bad: bool) -> Evidence:
    """On a worker: a file's evidence if the file is whole, else the error alone."""
    errors = piece.evidence.errors[:1]
    if not errors and piece.seen < scan.points:
        message = f"the header promises {scan.points} points, the file holds {piece.seen}; it is cut short"
        errors = (InputError(f"{scan.file.path}: {message}"),)
        if not skip_bad:
            raise errors[0]
    if errors:
        return _nothing(piece.evidence.voxel, piece.evidence.occupancy, errors[0])
    return scan.evidence(piece.evidence.core, piece.not_finite)


def _nothing(voxel: float, occupancy: bool, error: InputError) -> Evidence:
    """No evidence, and why."""
    core, _ = _core.Evidence.gather([], voxel=voxel, unit=1.0, axes=(1, 2, 3), threads=1, occupancy=occupancy)
    return Evidence(core, errors=(error,))


def _merge(*evidences: Evidence) -> Evidence:
    """On a worker: the evidence of several together."""
    return evidences[0].merged(*evidences[1:])


def _connect(address: str) -> Client:
    """A client whose workers are there and run this version."""
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingExtraError("dask is not installed: pip install 'asbuilt[dask]'") from error
    try:
        client = Client(address, timeout=SECONDS_TO_ANSWER, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ParameterError(f"{address}: no dask scheduler answers there; expected tcp://HOST:8786") from error
    try:
        client.wait_for_workers(1, timeout=SECONDS_TO_ANSWER)
        versions = client.run(_version)
    except TimeoutError as error:
        client.close()
        raise ParameterError(
            f"{address}: its scheduler has no workers; start some with: dask worker {address}"
        ) from error
    except ImportError as error:
        client.close()
        raise ParameterError(f"{address}: asbuilt is not installed on its workers") from error
    for worker, version in versions.items():
        if version != _core.VERSION:
            client.close()
            raise ParameterError(f"worker {worker} runs asbuilt {version}, expected {_core.VERSION} as here")
    return client


def _version() -> str:
    """On a worker: its version of asbuilt."""
    return _core.VERSION
