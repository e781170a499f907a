"""The pictures of figures 5 and 11 of the paper: what of the truth was found, and which detections are true."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asbuilt.errors import OutputError
from asbuilt.evaluate.association import Associations
from asbuilt.evaluate.drawing import DrawingStorey, Flags, Floats, TruthSet
from asbuilt.evaluate.result import Evaluation, StoreyEvaluation

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FIGURE_SUFFIXES = (".png", ".svg", ".pdf")

_FOUND, _TWICE, _MISSED, _IGNORED, _PALE = "#1a9850", "#2b6cd4", "#d6202a", "#9a9a9a", "#d9d9d9"
_PANEL = 7.0  # inches, the longer side of a panel
_DPI = 150


def draw_evaluation(evaluation: Evaluation, which: TruthSet = "observed") -> Figure:
    """Draw each storey twice: the truth by how it was found, and the detections by whether they are true.

    Parameters
    ----------
    evaluation : what `evaluate` gave.
    which : the truth that counts; the rest is shown in grey.

    Returns
    -------
    matplotlib.figure.Figure
        One row a storey: on the left figure 11 (green found, blue found more than once, red missed), on the right
        figure 5b (green true, red false). Both have a scale bar and a legend. Of no storeys, an empty figure.
    """
    from matplotlib.figure import Figure

    rows = max(len(evaluation.storeys), 1)
    x0, y0, x1, y1 = _bounds(evaluation)
    scale = _PANEL / max(x1 - x0, y1 - y0)
    size = (max((x1 - x0) * scale, 4.0), max((y1 - y0) * scale, 2.0) + 0.9)
    figure = Figure(figsize=(2 * size[0], rows * size[1]), dpi=_DPI, facecolor="white", layout="constrained")
    panels = figure.subplots(rows, 2, squeeze=False)
    for axes in panels.ravel():
        axes.set_axis_off()
    for (left, right), storey in zip(panels, evaluation.storeys, strict=False):
        _draw_truth(left, storey, which)
        _draw_detections(right, storey, which)
        for axes in (left, right):
            axes.set_xlim(x0, x1)
            axes.set_ylim(y0, y1)
            axes.set_aspect("equal")
            _scale_bar(axes, x0, y0, x1 - x0)
    return figure


def write_figure(evaluation: Evaluation, path: str | os.PathLike[str], which: TruthSet = "observed") -> None:
    """Write the picture of `draw_evaluation`; the suffix chooses the format: .png, .svg or .pdf.

    Raises
    ------
    OutputError : another suffix.
    """
    file = Path(path)
    check_figure(file)
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = draw_evaluation(evaluation, which)
    FigureCanvasAgg(figure).print_figure(file, format=file.suffix[1:].lower(), dpi=_DPI)


def check_figure(path: Path) -> None:
    """Refuse a suffix that `write_figure` cannot write.

    Raises
    ------
    OutputError : another suffix than .png, .svg or .pdf.
    """
    if path.suffix.lower() not in FIGURE_SUFFIXES:
        raise OutputError(f"{path}: no figure format has the suffix {path.suffix!r}; use {', '.join(FIGURE_SUFFIXES)}")


def truth_stretches(
    associations: Associations, counted: Flags, row: int, length: float
) -> Iterator[tuple[float, float, int]]:
    """Cut one truth segment where its cover changes: (start, end, number of associations), m from its start."""
    mine = counted & (associations.truth == row)
    starts, ends = np.sort(associations.truth_start[mine]), np.sort(associations.truth_end[mine])
    cuts = np.unique(np.concatenate([[0.0, length], starts, ends]))
    for low, high in itertools.pairwise(cuts.tolist()):
        middle = (low + high) / 2
        yield low, high, int((starts <= middle).sum() - (ends <= middle).sum())


def _draw_truth(axes: Axes, storey: StoreyEvaluation, which: TruthSet) -> None:
    truth = storey.truth or DrawingStorey(0, None)
    lines, used = truth.truth_lines, truth.in_use(which)
    counted = used[storey.associations.truth]
    drawn: dict[str, list[Floats]] = {_IGNORED: [], _FOUND: [], _TWICE: [], _MISSED: []}
    for row, line in enumerate(lines):
        length = math.hypot(line[2] - line[0], line[3] - line[1])
        if not used[row]:
            drawn[_IGNORED].append(line)
        elif length > 0:
            for low, high, depth in truth_stretches(storey.associations, counted, row, length):
                drawn[(_MISSED, _FOUND, _TWICE)[min(depth, 2)]].append(_part(line, low / length, high / length))
    labels = {_FOUND: "found", _TWICE: "found more than once", _MISSED: "missed", _IGNORED: "not scored"}
    _draw_lines(axes, drawn, labels)
    name = "no truth here" if storey.truth is None else f"storey {storey.truth.index}: {which} truth"
    recall = storey.scores.walls[which].recall
    axes.set_title(name + ("" if recall is None else f", recall {recall:.3f}"), fontsize=9)


def _draw_detections(axes: Axes, storey: StoreyEvaluation, which: TruthSet) -> None:
    plan, truth = storey.plan or DrawingStorey(0, None), storey.truth or DrawingStorey(0, None)
    lines, found = plan.lines, storey.associations
    length = np.hypot(lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1])
    used = truth.in_use(which)
    drawn: dict[str, list[Floats]] = {_PALE: list(truth.truth_lines), _IGNORED: [], _FOUND: [], _MISSED: []}
    for i, j, start, end in zip(found.detected, found.truth, found.start, found.end, strict=True):
        drawn[_FOUND if used[j] else _IGNORED].append(_part(lines[i], start / length[i], end / length[i]))
    for i, start, end in zip(found.left_detected, found.left_start, found.left_end, strict=True):
        if length[i] > 0:
            drawn[_MISSED].append(_part(lines[i], start / length[i], end / length[i]))
    _draw_lines(axes, drawn, {_FOUND: "true", _MISSED: "false", _IGNORED: "on truth not scored", _PALE: "truth"})
    name = "not in the plan" if storey.plan is None else f"plan's storey {storey.plan.index}: detections"
    precision = storey.scores.walls[which].precision
    axes.set_title(name + ("" if precision is None else f", precision {precision:.3f}"), fontsize=9)


def _draw_lines(axes: Axes, drawn: dict[str, list[Floats]], labels: dict[str, str]) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

    for colour, lines in drawn.items():
        segments = np.array(lines, dtype=float).reshape(-1, 2, 2)
        wide = 3.0 if colour == _PALE else 1.4
        axes.add_collection(LineCollection(list(segments), colors=colour, linewidths=wide, capstyle="butt"))
    handles = [Line2D([], [], color=colour, linewidth=2, label=label) for colour, label in labels.items()]
    options: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0), "ncols": len(handles)}
    axes.legend(handles=handles, fontsize=7, frameon=False, **options)


def _part(line: Floats, low: float, high: float) -> Floats:
    step = line[2:] - line[:2]
    return np.concatenate([line[:2] + low * step, line[:2] + high * step])


def _bounds(evaluation: Evaluation) -> tuple[float, float, float, float]:
    """The rectangle around all storeys, so that the panels lie over each other, with a margin, m."""
    drawings = [part for storey in evaluation.storeys for part in (storey.plan, storey.truth) if part is not None]
    lines = [part.truth_lines.reshape(-1, 2) for part in drawings]
    ends = np.concatenate([*lines, np.zeros((0, 2))])
    if not len(ends):
        return 0.0, 0.0, 10.0, 10.0
    low, high = ends.min(axis=0), ends.max(axis=0)
    margin = 0.04 * max(float((high - low).max()), 1.0)
    return float(low[0] - margin), float(low[1] - 2 * margin), float(high[0] + margin), float(high[1] + margin)


def _scale_bar(axes: Axes, x0: float, y0: float, width: float) -> None:
    wanted = width / 5.0
    power = 10.0 ** math.floor(math.log10(wanted))
    bar = max(step * power for step in (1.0, 2.0, 5.0) if step * power <= wanted)
    x, y = x0 + 0.02 * width, y0 + 0.02 * width
    axes.plot([x, x + bar], [y, y], color="black", linewidth=2.5, solid_capstyle="butt")
    axes.text(x + bar + 0.01 * width, y, f"{bar:g} m", fontsize=7, va="center")
