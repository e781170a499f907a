"""One pass over the points of a cloud: scans in, evidence out (section 3.1)."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from asbuilt import _core
from asbuilt.errors import InputError, OutputError, ParameterError
from asbuilt.evidence import Evidence
from asbuilt.params import EvidenceParameters
from asbuilt.provenance import Provenance
from asbuilt.read import InputFile, PathLike, PointCloud, read


def gather_evidence(
    cloud: PointCloud,
    parameters: EvidenceParameters | None = None,
    *,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    skip_bad: bool = False,
    resume: PathLike | None = None,
) -> Evidence:
    """One pass over the points of a cloud; evidence files in it are merged with what the points give.

    Parameters
    ----------
    threads : to decode on; None takes all cores. The evidence is the same for any number.
    progress : called with points read and points promised, some ten times a second.
    skip_bad : leave bad files out whole, and name them in `Evidence.errors`, instead of raising.
    resume : folder in which the evidence of each file is kept as soon as it is read; what it holds already is not read
        again. It is made if need be, and left for the caller to remove unless it stayed empty.

    Raises
    ------
    InputError : a file is bad, comes twice, or none of them holds a usable point.
    ParameterError : evidence files of another voxel than asked for, or with a unit or an upward axis.
    OutputError : `resume` cannot be written to.
    """
    parameters, stored, scans, errors = begin(cloud, parameters, skip_bad)
    # A file alone is done when all is done.
    folder = None if resume is None or len(scans) < 2 else _make_folder(Path(resume))
    known = [] if folder is None else [scan for scan in scans if scan.part(folder).exists()]
    resumed = [Evidence.load(scan.part(folder)) for scan in known if folder is not None]
    unread = [scan for scan in scans if scan not in known]
    promised = sum(scan.points for scan in scans)
    before = sum(evidence.points for evidence in resumed)

    def keep(number: int, core: _core.Evidence, _invalid: int, not_finite: int) -> None:
        if folder is not None:
            unread[number].evidence(core, not_finite).save(unread[number].part(folder))

    try:
        core, reports = _core.Evidence.gather(
            [(scan.file.path, scan.file.header["scan_ends"]) for scan in unread],
            **core_options(cloud, parameters),
            threads=threads or os.cpu_count() or 1,
            progress=None if progress is None else lambda done: progress(before + done, promised),
            on_file=None if folder is None else keep,
        )
    finally:
        if folder is not None:
            with contextlib.suppress(OSError):  # it holds something
                folder.rmdir()
    bad = [error for *_, error in reports if error is not None]
    if bad and not skip_bad:
        raise bad[0]
    good = [(scan, lost) for scan, (_, _, lost, error) in zip(unread, reports, strict=True) if error is None]
    provenance = Provenance.of_all(scan.evidence(core, lost).provenance for scan, lost in good)
    return finish(cloud, Evidence(core, provenance).merged(*stored, *resumed), [*errors, *bad])


def read_evidence(*paths: PathLike) -> Evidence:
    """The evidence in one file, or in several together; see `Evidence.save`.

    Raises
    ------
    InputError : a file is no evidence, is damaged or of a newer version; or a scan is in two of them.
    ParameterError : the voxel sizes differ, or only some keep occupancy alone.
    """
    cloud = read(*paths)
    for file in cloud.files:
        if not file.is_evidence:
            raise InputError(f"{file.path}: expected an evidence file, found {file.header['format']}")
    return gather_evidence(cloud)


@dataclasses.dataclass(frozen=True)
class ScanFile:
    """A file of points that is to be read.

    Attributes
    ----------
    points : that its header promises, of those that will be read.
    provenance : its own.
    key : changes with whatever would change its evidence.
    """

    file: InputFile
    points: int
    parts: int
    provenance: Provenance
    key: str

    def part(self, folder: Path) -> Path:
        """Where its evidence is kept until that of all is complete."""
        return folder / f"{self.key}.evidence"

    def evidence(self, core: _core.Evidence, not_finite: int) -> Evidence:
        """Its evidence, with a line for points that were left out."""
        if not not_finite:
            return Evidence(core, self.provenance)
        why = "their coordinates are not finite or beyond 100,000 km"
        skipped = (*self.provenance.skipped, f"{self.file.name}: {not_finite} points left out, {why}")
        return Evidence(core, dataclasses.replace(self.provenance, skipped=tuple(sorted(skipped))))


def begin(
    cloud: PointCloud, parameters: EvidenceParameters | None, skip_bad: bool
) -> tuple[EvidenceParameters, list[Evidence], list[ScanFile], list[InputError]]:
    """What is known before any point is read: parameters that all agree on, stored evidence, files to read, bad files.

    Raises
    ------
    InputError : a file is bad, unless `skip_bad`; or comes twice.
    ParameterError : see `gather_evidence`.
    """
    stored, errors = _load_stored(cloud, check=skip_bad)
    parameters = _agree(parameters or EvidenceParameters(), cloud, stored)
    scans = _scan_files(cloud, parameters)
    if errors and not skip_bad:
        raise errors[0]
    # before hours are spent on reading: the same file must not come twice
    Provenance.of_all([*(evidence.provenance for evidence in stored), *(scan.provenance for scan in scans)])
    return parameters, stored, scans, errors


def _scan_files(cloud: PointCloud, parameters: EvidenceParameters) -> list[ScanFile]:
    """The files of points of a cloud that can be read."""
    found = []
    for file in cloud.files:
        if file.error is not None or file.is_evidence:
            continue
        header = file.header
        if parameters.preview:
            header = _core.read_header(file.path, spacing=parameters.voxel / 2 / cloud.unit)
        skipped = tuple(f"{file.name}: {note}" for note in header["notes"] if note.startswith("preview"))
        entry = {"name": file.name, "size": file.size, "checksum": file.checksum()}
        systems = (header["crs"],) if header["crs"] else ()
        if systems and (cloud.unit, cloud.axes) != (1.0, (1, 2, 3)):
            # A plan in metres that says it counts in the feet of its files lies somewhere else on the map.
            skipped, systems = (*skipped, _crs_left_out(header["crs"])), ()
        digest = hashlib.sha256(json.dumps([_core.VERSION, core_options(cloud, parameters), entry]).encode())
        provenance = Provenance((entry,), systems, skipped)
        found.append(ScanFile(file, header["points"] or 0, header["parts"], provenance, digest.hexdigest()[:32]))
    return found


def _crs_left_out(crs: str) -> str:
    name = re.search(r'"([^"]*)"', crs)  # of WKT
    return (
        f"crs: {name[1] if name else crs} is that of the coordinates before --unit and --up; "
        "the plan, in metres with z up, does not carry it, but that of --crs"
    )


def _load_stored(cloud: PointCloud, check: bool) -> tuple[list[Evidence], list[InputError]]:
    """The evidence files of a cloud, and what is wrong with files so far; `check` looks at their voxels, too."""
    stored, errors = [], [file.error for file in cloud.files if file.error is not None]
    for file in cloud.files:
        if file.error is None and file.is_evidence:
            try:
                evidence = Evidence.load(file.path)
                if check:
                    len(evidence.core)  # which reads what the checksum does not tell
                stored.append(evidence)
            except InputError as error:
                errors.append(error)
    return stored, errors


def _agree(parameters: EvidenceParameters, cloud: PointCloud, stored: Sequence[Evidence]) -> EvidenceParameters:
    """Parameters that suit the evidence files: their voxel, and what they keep.

    Raises
    ------
    ParameterError : another voxel, a unit or an upward axis was asked for.
    """
    if not stored:
        return parameters
    names = [str(file.path) for file in cloud.files if file.is_evidence]
    if len(stored) == len(cloud.files) and (cloud.unit, cloud.axes) != (1.0, (1, 2, 3)):
        raise ParameterError(f"{names[0]}: evidence is in metres with z up; expected no other unit or upward axis")
    voxel = stored[0].voxel
    if parameters.voxel not in (voxel, EvidenceParameters().voxel):
        raise ParameterError(
            f"{names[0]}: its voxels are {voxel:g} m and stay so; expected no voxel of {parameters.voxel:g} m"
        )
    return dataclasses.replace(parameters, voxel=voxel, occupancy=stored[0].occupancy)


def core_options(cloud: PointCloud, parameters: EvidenceParameters) -> dict[str, Any]:
    """What decides what a file's points become."""
    return {
        "voxel": parameters.voxel,
        "unit": cloud.unit,
        "axes": cloud.axes,
        "occupancy": parameters.occupancy,
        "preview": parameters.preview,
    }


def finish(cloud: PointCloud, evidence: Evidence, errors: Sequence[InputError]) -> Evidence:
    """Evidence and what was left out of it; none at all is an error.

    Raises
    ------
    InputError : there is no point.
    """
    if evidence.points == 0:
        names = ", ".join(str(file.path) for file in cloud.files[:3])
        raise errors[0] if errors else InputError(f"{names}: no usable point found, expected at least one")
    return dataclasses.replace(evidence, errors=tuple(errors), axes=cloud.axes)


def _make_folder(folder: Path) -> Path:
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: {error.strerror}; expected a folder for what is read so far") from error
    return folder
