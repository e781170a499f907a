"""Files that are either whole or not there."""

from __future__ import annotations

import contextlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from asbuilt.errors import OutputError


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path to write to; when the block ends well, it takes the place of `path`.

    The temporary file is in the same folder, so that the renaming is one step of the file system. When the block
    fails or is interrupted, it is removed and what was at `path` is still there, unharmed.

    Raises
    ------
    OutputError : the folder may not be written to, or the disk is full.
    """
    target = Path(os.path.realpath(path))  # a link goes on pointing to the file that it names
    temporary = target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")
    try:
        try:
            # a new file that is ours, with the mode that the user's umask gives
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            yield temporary
            with open(temporary, "rb+") as stream:
                os.fsync(stream.fileno())  # else a crash could leave the new name with no content
            os.replace(temporary, target)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{path}: cannot write: {error.strerror or error}") from error
