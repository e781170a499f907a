"""Score a floor plan against a truth by the measures of the paper's section 4, and by those that came after it.

>>> from asbuilt.evaluate import evaluate
>>> evaluate("plan.geojson", "truth.json").pooled("observed").f  # doctest: +SKIP
"""

from asbuilt.evaluate.association import Associations, associate
from asbuilt.evaluate.drawing import Drawing, DrawingStorey, Face, Opening, Room, Wall
from asbuilt.evaluate.measures import WallTotals, measure_walls
from asbuilt.evaluate.read import as_drawing, read_drawing
from asbuilt.evaluate.result import Evaluation, StoreyEvaluation
from asbuilt.evaluate.score import evaluate

__all__ = [
    "Associations",
    "Drawing",
    "DrawingStorey",
    "Evaluation",
    "Face",
    "Opening",
    "Room",
    "StoreyEvaluation",
    "Wall",
    "WallTotals",
    "as_drawing",
    "associate",
    "evaluate",
    "measure_walls",
    "read_drawing",
]
