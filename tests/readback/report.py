"""The report by Python's HTML parser, its pictures by Pillow."""

from __future__ import annotations

import base64
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
from PIL import Image

from asbuilt import FloorPlan
from readback.tables import KINDS, elements

MM = 0.001


class Page(HTMLParser):
    """The tags of a page with their attributes, the text of its scripts, and what it points to."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.scripts: list[str] = []
        self.targets: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    @property
    def tags(self) -> list[str]:
        """The names of its tags."""
        return [tag for tag, _ in self.elements]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        self.targets += [value or "" for name, value in attrs if name in ("href", "src", "xlink:href")]
        if tag == "script":
            self.scripts.append("")

    def handle_data(self, data: str) -> None:
        if self.elements and self.elements[-1][0] == "script":
            self.scripts[-1] += data


def check_html(plan: FloorPlan, written: tuple[Path, ...]) -> None:
    (path,) = written
    page = Page(path)
    assert all(target.startswith(("#", "data:image/png;base64,")) for target in page.targets)
    figures = json.loads(page.scripts[0])
    kinds = [attributes.get("class", "").split()[:2] for _, attributes in page.elements]
    for kind in KINDS:
        name = kind.removesuffix("s").replace("_", "")
        assert kinds.count(["element", name]) == len(elements(plan, kind)), kind
    pointed = [attributes["data-i"] for _, attributes in page.elements if "data-i" in attributes]
    assert sorted(map(int, pointed)) == list(range(len(figures)))
    titles = [title for title, _ in figures]
    for _, room in elements(plan, "rooms"):
        said = dict(figures[titles.index(f"Room {room.number}")][1])
        assert said["Area"] == f"{room.area:.2f} m²"
    # faces lie to each other as in the plan, in centimetres
    drawn = [
        [float(value) for value in re.findall(r"-?[\d.]+", attributes["d"])]
        for (_, attributes), (_, before) in zip(page.elements[1:], page.elements, strict=False)
        if before.get("class", "").startswith("element wallface")
    ]
    faces = np.array([(face.start, face.end) for face in plan.wall_faces]).reshape(-1, 2, 2)
    found = np.array(drawn).reshape(-1, 2, 2) * (0.01, -0.01)
    if len(faces):
        np.testing.assert_allclose(found - found[0, 0], faces - faces[0, 0], atol=1.1 * MM)
    for target in page.targets:
        if target.startswith("data:"):
            with Image.open(io.BytesIO(base64.b64decode(target.partition(",")[2]))) as image:
                image.verify()
