"""Put the tables of results/*.md into docs/experiments.md, between the comments that name them."""

from __future__ import annotations

import re

from common import REPOSITORY, RESULTS


def main() -> None:
    page = REPOSITORY / "docs" / "experiments.md"
    text = page.read_text(encoding="utf-8")
    for name in re.findall(r"<!-- begin (\S+) -->", text):
        table = (RESULTS / f"{name}.md").read_text(encoding="utf-8")
        marked = rf"(<!-- begin {name} -->\n).*?(<!-- end {name} -->)"
        text = re.sub(marked, lambda found, table=table: f"{found[1]}\n{table}\n{found[2]}", text, flags=re.DOTALL)
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
