"""HTML and SVG elements, made so that text stays text: names of files and scans come from strangers."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from typing import TypeAlias

Content: TypeAlias = "ET.Element | str | None"


def tag(name: str, *content: Content, **attributes: str | float | None) -> ET.Element:
    """An element with its content.

    An attribute that is None is left out; ``class_`` and ``data_i`` stand for ``class`` and ``data-i``.

    >>> render(tag("p", "1 < 2 ", tag("b", "really"), class_="note"))
    '<p class="note">1 &lt; 2 <b>really</b></p>'
    """
    element = ET.Element(name)
    for key, value in attributes.items():
        if value is not None:
            element.set(key.rstrip("_").replace("_", "-"), value if isinstance(value, str) else number(value))
    last: ET.Element | None = None
    for part in content:
        if isinstance(part, ET.Element):
            element.append(part)
            last = part
        elif part and last is None:
            element.text = (element.text or "") + part
        elif part and last is not None:
            last.tail = (last.tail or "") + part
    return element


def render(*elements: ET.Element) -> str:
    """The elements as HTML."""
    return "".join(ET.tostring(element, encoding="unicode", method="html") for element in elements)


def table(headers: Sequence[str], rows: Iterable[Sequence[Content]], caption: str | None = None) -> ET.Element:
    """A table; a cell that reads as a number stands on the right."""
    head = tag("tr", *(tag("th", header, scope="col") for header in headers))
    body = [tag("tr", *(_cell(cell) for cell in row)) for row in rows]
    name = None if caption is None else tag("caption", caption)
    return tag("div", tag("table", name, tag("thead", head), tag("tbody", *body)), class_="table", tabindex="0")


def _cell(content: Content) -> ET.Element:
    numeric = isinstance(content, str) and content[:1] in set("0123456789-+±") and content != ""
    return tag("td", content, class_="number" if numeric else None)


def number(value: float, digits: int = 1) -> str:
    """A number with at most so many digits, without zeros that say nothing.

    >>> number(12.0), number(0.25, 2), number(-0.01)
    ('12', '0.25', '0')
    """
    text = f"{value:.{digits}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text
