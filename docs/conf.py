"""Settings of Sphinx; `make docs` builds into out/docs and fails on a warning."""

import os
import subprocess
import sys
from pathlib import Path

from asbuilt import __version__

project = "asbuilt"
author = "The asbuilt developers"
version = release = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
exclude_patterns = ["_build"]

myst_enable_extensions = ["dollarmath", "colon_fence", "attrs_inline"]
myst_heading_anchors = 3

napoleon_google_docstring = False
napoleon_use_ivar = True
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = f"asbuilt {__version__}"


def _write_help() -> None:
    """The help texts of the program itself, for docs/cli.md: they cannot be out of date."""
    folder = Path(__file__).parent / "_build" / "help"
    folder.mkdir(parents=True, exist_ok=True)
    program = Path(sys.executable).with_name("asbuilt")
    environment = {**os.environ, "COLUMNS": "100", "NO_COLOR": "1"}
    for command in ("plan", "export", "evidence", "merge", "info", "evaluate", "label"):
        text = subprocess.check_output([program, command, "--help"], text=True, env=environment)
        (folder / f"{command}.txt").write_text("\n".join(line.rstrip() for line in text.strip().splitlines()) + "\n")


_write_help()
