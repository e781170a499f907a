"""Put the tables of results/*.md into docs/experiments.md and docs/accuracy.md, between the comments that name them."""

from __future__ import annotations

import re
from pathlib import Path

from common import REPOSITORY, RESULTS


def main() -> None:
    for name in ("experiments", "accuracy"):
        fill(REPOSITORY / "docs" / f"{name}.md")


def fill(page: Path) -> None:
    """Put the tables into one page."""
    text = page.read_text(encoding="utf-8")
    for name in re.findall(r"<!-- begin (\S+) -->", text):
        table = (RESULTS / f"{name}.md").read_text(encoding="utf-8")
        marked = rf"(<!-- begin {name} -->\n).*?(<!-- end {name} -->)"
        text = re.sub(marked, lambda found, table=table: f"{found[1]}\n{table}\n{found[2]}", text, flags=re.DOTALL)
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
