"""The evaluation as tables for a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from asbuilt.evaluate.drawing import TRUTH_SETS
from asbuilt.evaluate.result import Evaluation

if TYPE_CHECKING:
    from rich.console import Group

_NOTHING = "-"


def evaluation_tables(evaluation: Evaluation) -> Group:
    """Lay out an evaluation for rich: walls per storey and pooled, end points, then what else was scored.

    Parameters
    ----------
    evaluation : what `evaluate` gave; undefined values show as a dash.

    Returns
    -------
    rich.console.Group
        To be printed on a rich console.
    """
    from rich.console import Group

    report = evaluation.to_json()
    parts = [_walls(report), _end_points(report["pooled"])]
    openings = _openings_and_rooms(report["pooled"])
    if openings is not None:
        parts.append(openings)
    return Group(*parts)


def _table(title: str, *headings: str) -> Any:
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for i, heading in enumerate(headings):
        table.add_column(heading, justify="left" if i < 2 else "right", no_wrap=True)
    return table


def _walls(report: dict[str, Any]) -> Any:
    table = _table("Walls", "truth", "storey", "P", "R", "F", "E_D mm", "E_Θ °", "E_OS", "E_OL", "≤15mm", "LOA")
    for which in TRUTH_SETS:
        rows = [(_storey_name(storey), storey[which]) for storey in report["storeys"]]
        if len(rows) == 1:
            rows = []
        for name, measures in [*rows, ("pooled", report["pooled"][which])]:
            table.add_row(which, name, *_wall_cells(measures), style="bold" if name == "pooled" else None)
        table.add_section()
    return table


def _storey_name(storey: dict[str, Any]) -> str:
    if storey["index"] is None:
        return f"no truth ({storey['plan_index']})"
    return f"{storey['index']}" if storey["plan_index"] is not None else f"{storey['index']} missed"


def _wall_cells(measures: dict[str, Any]) -> list[str]:
    return [
        _number(measures["precision"]),
        _number(measures["recall"]),
        _number(measures["f"]),
        _number(measures["distance_error"], 1, 1000.0),
        _number(measures["orientation_error_deg"], 2),
        _number(measures["over_segmentation"], 2),
        _number(measures["overlap"]),
        _number(measures["within_15mm"]),
        (measures["loa"]["band"] or _NOTHING).removeprefix("LOA"),
    ]


def _end_points(pooled: dict[str, Any]) -> Any:
    table = _table("End points and topology, as the Scan-to-BIM challenge", "truth", "within", "P", "R", "F")
    for name in ("cosine", "room IoU", "Betti error"):
        table.add_column(name, justify="right")
    for which in TRUTH_SETS:
        challenge = pooled[which]["challenge"]
        more = [_number(challenge[key]) for key in ("mean_cosine", "room_iou", "betti_error")]
        for within, ends in pooled[which]["endpoints"].items():
            table.add_row(which, within, *(_number(ends[key]) for key in ("precision", "recall", "f")), *more)
            more = []
        table.add_section()
    return table


def _openings_and_rooms(pooled: dict[str, Any]) -> Any:
    """None where nothing of the kind was scored."""
    kinds = [kind for kind in ("doors", "windows", "rooms") if pooled[kind] is not None]
    if not kinds and pooled["thickness"] is None:
        return None
    table = _table("Openings, rooms, thickness", "kind", "true", "P", "R", "F", "median error")
    for kind in kinds:
        measures = pooled[kind]
        if kind == "rooms":
            error = _number(measures["median_area_error"], 2, 100.0, " % of area")
        else:
            error = _number(measures["median_width_error"], 1, 1000.0, " mm of width")
        cells = [_number(measures[key]) for key in ("precision", "recall", "f")]
        table.add_row(kind, str(measures["true"]), *cells, error)
    if pooled["thickness"] is not None:
        error = _number(pooled["thickness"]["median_error"], 1, 1000.0, " mm")
        table.add_row("thickness", str(pooled["thickness"]["scored"]), *[_NOTHING] * 3, error)
    return table


def _number(value: float | None, digits: int = 3, scale: float = 1.0, unit: str = "") -> str:
    return _NOTHING if value is None else f"{scale * value:.{digits}f}{unit}"
