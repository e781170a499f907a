"""Section 5.4 of the paper: accuracy and conciseness beside the paper's figures, Nguyen's measure [6] beside the
paper's, what was missed and where (figure 11).
"""

from __future__ import annotations

import json
from collections import defaultdict
from typing import Any

import numpy as np
import shapely

import common
from asbuilt.evaluate import Face, associate, evaluate
from asbuilt.evaluate.drawing import TRUTH_SETS, TruthSet
from asbuilt.evaluate.figures import draw_evaluation
from asbuilt.evaluate.measures import covered_lengths
from asbuilt.grid import FloatArray
from common import CASES, REPORTED, load_case

#: A face with one room on both its sides, this far off, is part of a partition within the room, m.
BESIDE = 0.3
MEASURES = ("f", "distance_error", "orientation_error_deg", "over_segmentation", "overlap")


def main() -> None:
    plans = dict(zip(common.storeys_of(), common.in_parallel(_plan, common.storeys_of()), strict=True))
    no_limit = {key: _score(*key, segments, None) for key, segments in plans.items()}
    limited = {key: _score(*key, segments, 0.25) for key, segments in plans.items()}
    nguyen = {key: _nguyen(*key, segments) for key, segments in plans.items()}
    results = {
        "paper": REPORTED,
        "limit_of_0.25_m": common.by_storey(limited),
        "no_limit": common.by_storey(no_limit),
        "nguyen": {f"{name} {storey}": found for (name, storey), found in nguyen.items()},
        "missed": {name: _missed(name, plans) for name in CASES},
    }
    common.write_result("06_discussion", results)
    _write_tables(results)
    _draw_labels(plans)


def _plan(key: tuple[str, int]) -> FloatArray:
    case = load_case(key[0])
    return common.paper_segments(common.paper_histogram(case, case.levels[key[1]]))


def _score(name: str, storey: int, segments: FloatArray, max_distance: float | None) -> common.Totals:
    case = load_case(name)
    return common.score(case, case.levels[storey], segments, max_distance)


def _nguyen(name: str, storey: int, segments: FloatArray) -> dict[TruthSet, dict[str, float]]:
    """Nguyen's correctness and precision [6]: lines are counted, however much of them overlaps.

    A detected line matches the true one that the greatest part of it associates with; a true line matches once.
    Share of true lines matched, share of detected lines unmatched, and the standard deviations of the matched lines'
    distance (rho, at the middle of the overlap) and orientation (alpha).
    """
    case = load_case(name)
    truth = case.storey_of(case.levels[storey])
    lines = truth.truth_lines
    found = associate(segments, lines)
    table: dict[TruthSet, dict[str, float]] = {}
    for which in TRUTH_SETS:
        used = truth.in_use(which)
        best: dict[int, int] = {}
        taken: set[int] = set()
        for i in np.argsort(-found.length, kind="stable"):
            detected, true = int(found.detected[i]), int(found.truth[i])
            if used[true] and detected not in best and true not in taken:
                best[detected] = int(i)
                taken.add(true)
        # lines on truth that is not in use count neither way
        ignored = {int(d) for d, t in zip(found.detected, found.truth, strict=True) if not used[t]} - set(best)
        rows = np.array(list(best.values()), dtype=int)
        rho = (found.start_offset[rows] + found.end_offset[rows]) / 2
        table[which] = {
            "true_positives": round(len(best) / max(int(used.sum()), 1), 4),
            "false_positives": round(1 - len(best) / max(len(segments) - len(ignored), 1), 4),
            "sigma_rho": round(float(rho.std()), 4),
            "sigma_alpha_deg": round(float(np.degrees(np.sqrt(np.mean(found.angle[rows] ** 2)))), 3),
        }
    return table


def _missed(name: str, plans: dict[tuple[str, int], FloatArray]) -> dict[str, Any]:
    """Truth length by what its face belongs to, and the share that was missed: the paper's three categories."""
    case = load_case(name)
    storeys = json.loads((common.case_folder(name) / "truth.json").read_text(encoding="utf-8"))["storeys"]
    length: defaultdict[str, float] = defaultdict(float)
    missed: defaultdict[str, float] = defaultdict(float)
    for level, raw in zip(case.levels, storeys, strict=True):
        truth = case.storey_of(level)
        lines = truth.truth_lines
        found = associate(plans[name, level.index], lines)
        covered, _ = covered_lengths(found, np.ones(len(found), dtype=bool), len(lines))
        for i, face in enumerate(truth.faces):
            whole = float(np.hypot(lines[i, 2] - lines[i, 0], lines[i, 3] - lines[i, 1]))
            kind = _category(face, raw["rooms"])
            length[kind] += whole
            missed[kind] += whole - float(covered[i])
    total = sum(missed.values())
    return {
        kind: {
            "length": round(length[kind], 1),
            "missed": round(missed[kind] / length[kind], 3),
            "share_of_all_missed": round(missed[kind] / total, 3),
        }
        for kind in sorted(length)
    }


def _category(face: Face, rooms: list[dict[str, Any]]) -> str:
    if face.side == "exterior":
        return "external walls"
    if face.observed < 0.3:
        return "faces no scan saw"
    line = shapely.LineString(np.array(face.line).reshape(2, 2))
    polygons = [shapely.Polygon(room["polygon"]) for room in rooms]
    room = rooms[int(np.argmin([shapely.distance(polygon.exterior, line.centroid) for polygon in polygons]))]
    if line.length < 0.5:
        return "faces shorter than 0.5 m"
    to_both_sides = shapely.MultiPoint([line.offset_curve(side).centroid for side in (-BESIDE, BESIDE)])
    if any(polygon.contains(to_both_sides) for polygon in polygons):
        return "partitions within a room"
    return "stores and lavatories" if room["kind"] in ("store", "wc") else "other rooms"


def _write_tables(results: dict[str, Any]) -> None:
    rows: list[tuple[Any, ...]] = [("paper: first floor (F), whole school", *(REPORTED[m] for m in MEASURES))]
    for label, key in (("limit 0.25 m", "limit_of_0.25_m"), ("no limit", "no_limit")):
        found = results[key]
        entries = {
            "school, first floor": found["cases"]["school"]["storeys"][1],
            **{case: found["cases"][case]["pooled"] for case in CASES},
            "pooled": found["pooled"],
        }
        for name, measures in entries.items():
            rows += [(f"{name}, {which}, {label}", *(measures[which][m] for m in MEASURES)) for which in TRUTH_SETS]
    common.write_table("06_discussion", ["plan", "F", "E_D, m", "E_Theta, °", "E_OS", "E_OL"], rows)
    limited = results["limit_of_0.25_m"]["cases"]
    rows = []
    for name, storey in common.storeys_of():
        ours, theirs = limited[name]["storeys"][storey]["observed"], results["nguyen"][f"{name} {storey}"]["observed"]
        rows.append((f"{name} {storey}", ours["recall"], 1 - ours["precision"], *theirs.values()))
    heading = [
        "length found (R)",
        "false length (1 - P)",
        "lines found",
        "false lines",
        "sigma rho, m",
        "sigma alpha, °",
    ]
    common.write_table("06_nguyen", ["storey", *heading], rows)
    kinds = sorted({kind for found in results["missed"].values() for kind in found})
    rows = []
    for kind in kinds:
        parts = [results["missed"][case].get(kind, {}) for case in CASES]
        rows.append((kind, *(part.get(key) for part in parts for key in ("missed", "share_of_all_missed"))))
    heading = [f"{case}: {text}" for case in CASES for text in ("missed", "share of all missed")]
    common.write_table("06_missed", ["truth", *heading], rows)


def _draw_labels(plans: dict[tuple[str, int], FloatArray]) -> None:
    """Figure 11: the school's truth by how it was found."""
    for name in CASES:
        case = load_case(name)
        plan = common.drawing(case, [plans[name, level.index] for level in case.levels])
        common.write_picture(f"figure_11_{name}", draw_evaluation(evaluate(plan, case.truth), "all"), dpi=60)


if __name__ == "__main__":
    main()
