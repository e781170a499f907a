"""Where the program starts: from here on Ctrl-C is one line, also in the half second that the library takes to load.

A package of its own, because any module of `asbuilt` loads the library first.
"""

from __future__ import annotations

import sys
from typing import NoReturn


def main() -> NoReturn:
    """`asbuilt.cli.main`."""
    try:
        from asbuilt.cli import main as run
    except KeyboardInterrupt:
        sys.stderr.write("asbuilt: interrupted\n")
        sys.exit(130)
    run()
