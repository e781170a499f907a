"""Files that are either whole or not there."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from asbuilt.errors import OutputError

_FULL = 2**16
"""Bytes left on a disk that is full: less than any library asks for at once."""


def check_place(path: Path) -> None:
    """Find out before any work whether a file could be written at `path`.

    Raises
    ------
    OutputError : the folder is missing or may not be written to, or `path` is a folder, a device or a pipe.
    """
    _check_file(path)
    if not path.parent.is_dir():
        raise OutputError(f"{path}: the folder {path.parent} does not exist; create it first")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise OutputError(f"{path}: no permission to write in the folder {path.parent}")


def _check_file(path: Path) -> None:
    """That nothing is at `path` which a file must not take the place of."""
    if path.exists() and not path.is_file():
        what = "a folder" if path.is_dir() else "a device or a pipe"
        raise OutputError(f"{path}: is {what}, expected a file to write to")


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path to write to; when the block ends well, it takes the place of `path`.

    The temporary file is in a folder of its own beside `path`, so that the renaming is one step of the file system.
    When the block fails or is interrupted, the folder is removed with all that a library left in it, and what was at
    `path` is still there, unharmed.

    Raises
    ------
    OutputError : `path` is a folder, a device or a pipe; the folder may not be written to, its name is no text, or the
        disk is full.
    """
    _check_file(path)
    target = Path(os.path.realpath(path))  # a link goes on pointing to the file that it names
    try:
        with tempfile.TemporaryDirectory(prefix=".asbuilt-", dir=target.parent) as folder:
            # the name is ours: libraries take no name that is not text
            temporary = Path(folder) / f"new{target.suffix}"
            # a new file, with the mode that the user's umask gives
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            try:
                yield temporary
            except Exception as error:  # libraries have many words for what follows, some of them none
                if shutil.disk_usage(folder).free < _FULL:
                    raise OutputError(f"{path}: cannot write: no space left on the disk") from error
                if folder != folder.encode(errors="replace").decode():
                    raise OutputError(
                        f"{path}: cannot write: the name of its folder is no text; try another"
                    ) from error
                raise
            with open(temporary, "rb+") as stream:
                os.fsync(stream.fileno())  # else a crash could leave the new name with no content
            os.replace(temporary, target)
    except OSError as error:
        raise OutputError(f"{path}: cannot write: {error.strerror or error}") from error
    except UnicodeEncodeError as error:
        raise OutputError(f"{path}: cannot write: a name in the plan is no text ({error})") from error
