"""What the marks of a drawing cover on paper: none of its texts may lie on another or on a line."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import Any

import shapely
from shapely.affinity import rotate

from asbuilt.export.dimensions import dimension_line, dimension_number
from asbuilt.export.marks import Arc, Dimension, Mark, Stroke, Tag, Text, text_width


def text_boxes(found: Iterable[Mark], metre: float) -> Iterator[tuple[str, Any]]:
    """Each text with the box (m) that its capitals take, on paper where a metre takes `metre` mm."""
    for mark in found:
        texts = [mark] if isinstance(mark, Text) else mark.texts(metre) if isinstance(mark, Tag) else []
        for text in [dimension_number(mark, metre)] if isinstance(mark, Dimension) else texts:
            width = text_width(text.text, text.height, text.bold) / metre
            x, y = text.at
            left = x - {"left": 0.0, "centre": width / 2, "right": width}[text.align]
            box = shapely.box(left, y, left + width, y + text.height / metre)
            yield text.text, rotate(box, text.rotation, origin=text.at, use_radians=True)


def collisions(found: Iterable[Mark], metre: float) -> list[tuple[str, str]]:
    """The texts that lie on others, or on lines, by what is written and on what layer."""
    found = [mark for mark in found if mark.layer.shown]
    boxes = list(text_boxes(found, metre))
    lines = [(mark.layer.name, shapely.LineString(mark.points)) for mark in found if isinstance(mark, Stroke | Arc)]
    lines += [
        (mark.layer.name, shapely.LineString(dimension_line(mark))) for mark in found if isinstance(mark, Dimension)
    ]
    on_text = [
        (one[0], other[0])
        for one, other in itertools.combinations(boxes, 2)
        if one[1].intersection(other[1]).area > 0.01 / metre**2  # of a square millimetre; rounding
    ]
    return on_text + [(text, layer) for text, box in boxes for layer, line in lines if box.intersects(line)]
