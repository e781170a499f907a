"""Which files to read, and what they say of themselves; their points flow on in batches, never all at once."""

from __future__ import annotations

import glob
import hashlib
import math
import os
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from asbuilt import _core
from asbuilt.errors import InputError, ParameterError
from asbuilt.provenance import Provenance

if TYPE_CHECKING:  # opening files does not wait for numpy to load
    from asbuilt.grid import FloatArray

PathLike: TypeAlias = str | os.PathLike[str]

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "us-ft": 1200 / 3937, "in": 0.0254}
"""Metres in one unit."""

UP_AXES = {"z": (1, 2, 3), "y": (1, -3, 2), "x": (2, 3, 1), "-z": (1, -2, -3), "-y": (1, 3, -2), "-x": (-2, 3, -1)}
"""For each upward axis of a file: the signed axes (1 to 3) that become x, y, z. All are rotations, none a mirror."""

_TABLES = frozenset({".txt", ".csv", ".tsv", ".asc"})
"""In a folder these may also be notes, lists and schedules, such as ours."""

_LONGEST = 240
"""Characters of a message about a file, beside its name."""
_HASHED_WHOLE = 64 * 2**20
_BLOCK = 2**16


@dataclass(frozen=True)
class InputFile:
    """A file and its header.

    Attributes
    ----------
    path : as given or found.
    size : bytes.
    header : `format`, `points` or None, `bounds` ((3,), (3,)) or None, `crs` or None, `notes`, `scans`, a list
        of (number, key, position or None, points or None), in the file's own frame and unit; `parts`, into how many it
        falls that can be read alone; `scan_ends`, where its scans end (byte), if finding that took reading it, which is
        not done twice; and `evidence`, None, or of an evidence file its voxel (m), whether it keeps occupancy alone,
        and its provenance as text.
    error : why it cannot be read, else None; then the header is empty.
    """

    path: Path
    size: int
    header: dict[str, Any]
    error: InputError | None = None

    @property
    def name(self) -> str:
        """The last part of its path, as any format can hold it: what is no character that prints is told by its code.

        A file system takes bytes that no encoding explains, and line ends; JSON, XML and DXF do not.
        """
        name = self.path.name
        return "".join(ascii(c)[1:-1] if unicodedata.category(c)[0] == "C" else c for c in name)

    @property
    def is_evidence(self) -> bool:
        """Whether it holds evidence instead of points."""
        return self.header["evidence"] is not None

    def checksum(self) -> str:
        """``sha256:...`` of the content; of large files (over 64 MiB) of 256 blocks spread over it, and of its size."""
        digest = hashlib.sha256()
        with open(self.path, "rb") as stream:
            if self.size <= _HASHED_WHOLE:
                return f"sha256:{hashlib.file_digest(stream, 'sha256').hexdigest()}"
            digest.update(str(self.size).encode())
            last = self.size - _BLOCK
            for start in (*(int(i * (last / 255)) for i in range(255)), last):
                stream.seek(start)
                digest.update(stream.read(_BLOCK))
        return f"sha256-sampled:{digest.hexdigest()}"


@dataclass(frozen=True)
class PointCloud:
    """Files that belong together, opened but not read.

    Attributes
    ----------
    files : in the order of their paths.
    unit : metres in one unit of the files.
    axes : signed axes of the files that become x, y, z; see `UP_AXES`.
    passed_over : files in folders that are no scans: texts without points, what `label` wrote; a line each, with why.
    """

    files: tuple[InputFile, ...]
    unit: float = 1.0
    axes: tuple[int, int, int] = (1, 2, 3)
    passed_over: tuple[str, ...] = ()

    def __iter__(self) -> Iterator[FloatArray]:
        """The points, m, z up, in batches of shape (n, 3)."""
        import numpy as np

        for file in self.files:
            for points, _ in _core.PointReader(file.path):
                yield np.column_stack(self.to_metres(*points.T))

    def to_metres(self, x: FloatArray, y: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Coordinates of the files as x, y, z in metres, z up."""
        given = (x, y, z)
        if self.unit == 1.0 and self.axes == (1, 2, 3):
            return given
        a, b, c = (given[abs(axis) - 1] * math.copysign(self.unit, axis) for axis in self.axes)
        return a, b, c

    @property
    def points(self) -> int:
        """Points that the headers promise."""
        return sum(file.header.get("points") or 0 for file in self.files)

    @property
    def crs(self) -> str | None:
        """The coordinate reference system that the headers carry, if they agree on one."""
        found = {file.header["crs"] for file in self.files if file.header.get("crs")}
        return found.pop() if len(found) == 1 else None


def read(
    *inputs: PathLike | Sequence[PathLike], unit: str | float = "m", up: str = "z", skip_bad: bool = False
) -> PointCloud:
    """Open files, folders (with all they hold) and glob patterns as one cloud; points are not read yet.

    Evidence files may be among them (but are not looked for in folders): they are in metres, z up, whatever `unit` and
    `up` say. Of what lies in folders, texts and tables without points are passed over, and so are labelled points: they
    are those of the scans once more. By its own name any of them is an input.

    Parameters
    ----------
    unit : of the coordinates: m, dm, cm, mm, ft, us-ft, in, or metres in one unit.
    up : axis that points up: z, y, x, -z, -y, -x.
    skip_bad : keep files that cannot be opened, with their `error`, instead of raising it.

    Raises
    ------
    InputError : an input does not exist, matches nothing, or (unless `skip_bad`) is no cloud that we can read.
    ParameterError : an unknown unit or axis.
    """
    if isinstance(unit, str) and unit not in UNITS:
        raise ParameterError(f"unit {unit!r}: expected {', '.join(UNITS)}")
    if up not in UP_AXES:
        raise ParameterError(f"up {up!r}: expected {', '.join(UP_AXES)}")
    metres, axes = UNITS[unit] if isinstance(unit, str) else float(unit), UP_AXES[up]
    paths: list[PathLike] = []
    for given in inputs:
        paths.extend(given if isinstance(given, Sequence) and not isinstance(given, str) else [given])
    files, passed_over = [], []
    for path, is_named in find_files(paths).items():
        file = _open(path)
        if file.error is not None and not is_named and path.suffix.lower() in _TABLES:
            passed_over.append(str(file.error))
        elif file.error is not None and not skip_bad:
            raise file.error
        elif file.error is None and not is_named and _is_labelled(file):
            passed_over.append(f"{path}: points that asbuilt label wrote; to read them, name the file itself")
        else:
            files.append(file)
    if not files:
        raise InputError(f"no input holds points: {passed_over[0]}")
    return PointCloud(tuple(files), metres, axes, tuple(passed_over))


def find_files(inputs: Sequence[PathLike]) -> dict[Path, bool]:
    """The files that inputs (files, folders, globs) name, sorted, and of each whether it was named, not its folder.

    Hidden files in folders are left alone.

    Raises
    ------
    InputError : an input does not exist, or matches or holds no cloud.
    """
    found: dict[Path, bool] = {}
    suffixes = {f".{suffix}" for _, known in _core.formats() for suffix in known}
    for given in inputs:
        path = Path(given)
        if path.is_dir():
            every = (p for p in path.rglob("*") if p.suffix.lower() in suffixes and not p.name.startswith("."))
            within = [p for p in every if p.is_file()]
            if not within:
                raise InputError(f"{path}: the folder holds no cloud; expected files of {', '.join(sorted(suffixes))}")
        elif path.exists():
            within = [path]
        else:
            within = [Path(match) for match in glob.glob(str(given), recursive=True) if not os.path.isdir(match)]
            if not within:
                raise InputError(f"{given}: no such file or folder, and as a pattern it matches nothing")
        found |= {file: found.get(file, False) or not path.is_dir() for file in within}
    if not found:
        raise InputError("no input given; expected files, folders or patterns")
    return dict(sorted(found.items()))


def _is_labelled(file: InputFile) -> bool:
    """Whether `asbuilt label` wrote a file: LAS names its program, E57 what it holds beyond the standard."""
    with open(file.path, "rb") as stream:
        head = stream.read(90)
        if head.startswith(b"LASF"):
            return head[58:].startswith(b"asbuilt ")
        if not head.startswith(b"ASTM-E57"):
            return False
        place = int.from_bytes(head[24:32], "little")  # of the XML, the names of what it holds first
        stream.seek(place - place % 1024)
        pages = stream.read(3 * 1024)  # the last four bytes of each are a checksum
    return b'"asbuilt:point-labels' in b"".join(pages[start : start + 1020] for start in range(0, len(pages), 1024))


def _open(path: Path) -> InputFile:
    try:
        header = _core.read_header(path)
        if header["evidence"] is not None:
            header["crs"] = Provenance.from_text(header["evidence"][2]).crs
        return InputFile(path, path.stat().st_size, header)
    except OSError as error:
        bad = InputError(f"{path}: {error.strerror}")
    except InputError as error:
        told = str(error)  # what a damaged header holds has no end
        cut = len(str(path)) + _LONGEST
        bad = error if len(told) <= cut else InputError(f"{told[:cut]}...")
    except ValueError:
        bad = InputError(f"{path}: expected its inputs in the evidence file, found other text; it is damaged")
    unknown = dict.fromkeys(("points", "bounds", "crs", "evidence"))
    nothing: dict[str, Any] = {"format": "unreadable", "scans": [], "notes": [], "parts": 0, "scan_ends": []}
    return InputFile(path, 0, nothing | unknown, bad)
