"""How accurate plans are with default settings: the cases, and generated buildings that share none of their habits.

The buildings of the development seeds may be looked at and tuned on; those of the held-back seeds only ever show up in
these tables. `--worse` repeats everything with clouds that were turned, thinned, tilted and so on.

    python experiments/accuracy.py                       the table; exit status 1 if a figure fell below the kept ones
    python experiments/accuracy.py flat museum-3         some buildings alone
    python experiments/accuracy.py --keep                make these figures the ones to hold, and the tables of the docs
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import reduce
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

import asbuilt
from asbuilt import Parameters
from asbuilt.evaluate import WallTotals, evaluate
from asbuilt.evaluate.result import Scores, pool

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))  # the generator belongs to the tests

import buildings  # noqa: E402
from buildings import Building  # noqa: E402
from buildings.transform import SMALL, TRANSFORMS  # noqa: E402

KEPT = Path(__file__).resolve().parent / "results" / "accuracy.json"
CASES = Path(os.environ.get("ASBUILT_CASES", ROOT.parent / "shared" / "cases"))
SHARED, DEVELOPMENT, HELD_BACK = "shared cases", "development seeds", "held-back seeds"
#: The same scans again, coarser and as E57: in the table, but not pooled with the rest.
AGAIN = "shared cases as E57"
#: Figure, heading, digits, scale, and whether more is better.
FIGURES = (
    ("precision", "P", 3, 1, True),
    ("recall", "R", 3, 1, True),
    ("f", "F", 3, 1, True),
    ("distance_error", "E_D mm", 1, 1000, False),
    ("orientation_error_deg", "E_Th deg", 3, 1, False),
    ("over_segmentation", "E_OS", 3, 1, False),
    ("overlap", "E_OL", 4, 1, False),
    ("within_15mm", "<15mm", 3, 1, True),
    ("ends", "ends 5cm", 3, 1, True),
)
#: The same of what is drawn besides faces: kind and member of its `to_json`, then as above.
ELEMENTS = (
    ("doors", "precision", "doors P", 3, 1, True),
    ("doors", "recall", "R", 3, 1, True),
    ("doors", "median_width_error", "width mm", 1, 1000, False),
    ("windows", "precision", "windows P", 3, 1, True),
    ("windows", "recall", "R", 3, 1, True),
    ("windows", "median_width_error", "width mm", 1, 1000, False),
    ("rooms", "precision", "rooms P", 3, 1, True),
    ("rooms", "recall", "R", 3, 1, True),
    ("rooms", "median_area_error", "area %", 2, 100, False),
    ("thickness", "median_error", "thick mm", 1, 1000, False),
)
#: What a pooled figure may lose before the run fails: rounding on another machine, no more.
SLACK = 0.002


@dataclass(frozen=True)
class Run:
    """One building, planned and scored; `change` names what was done to its cloud before, "" for nothing."""

    name: str
    group: str
    change: str
    points: int
    seconds: float
    scores: Scores


def figures(walls: WallTotals) -> dict[str, float | None]:
    """The figures of one row."""
    values = {name: getattr(walls, name) for name, *_ in FIGURES if name != "ends"}
    return {**values, "ends": walls.end_points()["5cm"]["f"]}


def elements(scores: Scores) -> dict[str, float | None]:
    """The figures of one row of what is drawn besides faces; None where the truth says nothing about it."""
    totals = {kind: getattr(scores, kind) for kind, *_ in ELEMENTS}
    said = {kind: {} if total is None else total.to_json() for kind, total in totals.items()}
    return {f"{kind}_{member}": said[kind].get(member) for kind, member, *_ in ELEMENTS}


def jobs(wanted: list[str]) -> list[tuple[str, str]]:
    """(group, name) of the buildings, the large ones first so that no core waits for them at the end."""
    found: list[tuple[str, str]] = []
    if CASES.is_dir():
        folders = [folder for folder in CASES.iterdir() if (folder / "truth.json").exists()]
        folders.sort(key=lambda folder: -max(file.stat().st_size for file in folder.iterdir()))
        found = [(SHARED if (folder / "scans.laz").exists() else AGAIN, folder.name) for folder in folders]
    names = list(buildings.PRESETS)
    for group, seeds in ((DEVELOPMENT, buildings.DEVELOPMENT_SEEDS), (HELD_BACK, buildings.HELD_BACK_SEEDS)):
        found += [(group, f"{names[seed % len(names)]}-{seed}") for seed in seeds]
    return [job for job in found if not wanted or job[1] in wanted]


def run(job: tuple[str, str, list[str], str, Path | None]) -> list[Run]:
    """Plan and score one building, as it is and after each of some changes to its cloud; its plan goes to a folder."""
    group, name, changes, preset, plans = job
    parameters = Parameters.preset(preset)
    if group in (DEVELOPMENT, HELD_BACK):
        building = generate(name)
        runs = [_run(building, group, "", _evidence(building, parameters), parameters, plans)]
    else:
        folder = CASES / name
        evidence = asbuilt.gather_evidence(asbuilt.read(_scans(folder)), parameters.evidence, threads=1)
        truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
        unread = Building(name, *[np.empty(0)] * 3, truth)
        runs = [_run(unread, group, "", evidence, parameters, plans)]
        if changes:
            building = buildings.load_case(folder)
    for change in changes:
        changed = TRANSFORMS[change](building)
        runs.append(_run(changed, group, change, _evidence(changed, parameters), parameters))
    return runs


def _run(
    building: Building,
    group: str,
    change: str,
    evidence: asbuilt.Evidence,
    parameters: Parameters,
    plans: Path | None = None,
) -> Run:
    start = time.perf_counter()
    plan = asbuilt.extract_floor_plan(evidence, parameters)
    seconds = time.perf_counter() - start
    if plans is not None:
        (plans / f"{building.name}.geojson").write_text(json.dumps(plan.to_geojson()), encoding="utf-8")
    scores = evaluate(plan, building.truth).scores
    return Run(building.name, group, change, evidence.points, seconds, scores)


def generate(name: str) -> Building:
    """The generated building of a name such as "museum-3"."""
    preset, seed = name.rsplit("-", 1)
    return buildings.generate(int(seed), preset=preset)


def _scans(folder: Path) -> Path:
    return next(path for path in (folder / "scans.laz", folder / "scans.e57") if path.exists())


def _evidence(building: Building, parameters: Parameters) -> asbuilt.Evidence:
    """As from a LAS file: scans are told apart, their positions are not known."""
    scans = [
        asbuilt.evidence_from_points(building.points[building.scans == i], parameters.evidence, scan=f"source {i}")
        for i in range(int(building.scans.max()) + 1)
    ]
    return reduce(lambda first, second: first.merged(second), scans)


def table(runs: list[Run], headings: Sequence[str], cells: Callable[[list[Run]], list[str]]) -> list[list[str]]:
    """One row a building, then the pooled groups."""
    rows = [["", *headings]]
    for group in dict.fromkeys(run.group for run in runs):
        members = [run for run in runs if run.group == group]
        rows.append([group])
        rows += [[f"  {member.name}", *cells([member])] for member in sorted(members, key=lambda run: run.name)]
        rows.append(["  pooled", *cells(members)])
        rows.append([])
    return rows


def wall_cells(runs: list[Run]) -> list[str]:
    """Cells of the walls' table: million points, seconds, and `FIGURES`."""
    values = figures(pool([run.scores for run in runs]).walls["observed"])
    cells = [_cell(values[figure], digits, scale) for figure, _, digits, scale, _ in FIGURES]
    return [f"{sum(run.points for run in runs) / 1e6:.1f}", f"{sum(run.seconds for run in runs):.1f}", *cells]


def element_cells(runs: list[Run]) -> list[str]:
    """Cells of the elements' table: `ELEMENTS`."""
    values = elements(pool([run.scores for run in runs]))
    return [_cell(values[f"{kind}_{member}"], digits, scale) for kind, member, _, digits, scale, _ in ELEMENTS]


def tables(runs: list[Run]) -> dict[str, list[list[str]]]:
    """The rows of both tables, by the name of the file that --keep writes them to."""
    return {
        "accuracy_walls": table(runs, ["M points", "s", *(heading for _, heading, *_ in FIGURES)], wall_cells),
        "accuracy_elements": table(runs, [heading for _, _, heading, *_ in ELEMENTS], element_cells),
    }


def markdown(rows: list[list[str]]) -> str:
    """The rows of a table for the documentation, the names of groups and what is pooled in bold."""
    heading, *rest = [row for row in rows if row]
    lines = ["| " + " | ".join(heading) + " |", "|---" + "|---:" * (len(heading) - 1) + "|"]
    for name, *cells in rest:
        shown = name.strip() if name.startswith("  ") and name != "  pooled" else f"**{name.strip()}**"
        lines.append("| " + " | ".join([shown, *(cells or [""] * (len(heading) - 1))]) + " |")
    return "\n".join(lines) + "\n"


def side_by_side(runs: list[Run]) -> str:
    """The pooled figures, a column for each group: a method that was tuned to one of them shows here."""
    groups = [group for group in (SHARED, DEVELOPMENT, HELD_BACK) if any(run.group == group for run in runs)]
    scores = [pool([run.scores for run in runs if run.group == group]) for group in groups]
    values = [figures(score.walls["observed"]) for score in scores]
    rows = [["pooled", *groups]]
    for name, heading, digits, scale, _ in FIGURES:
        rows.append([heading, *(_cell(value[name], digits, scale) for value in values)])
    for kind in ("doors", "windows", "rooms"):
        totals = [getattr(score, kind) for score in scores]
        if any(total is not None for total in totals):
            rows.append([f"{kind} F", *(_cell(None if t is None else t.to_json()["f"], 3, 1) for t in totals)])
    return _aligned(rows)


def losses(runs: list[Run], worse: list[Run]) -> str:
    """What the changes to the clouds cost: least F against the same building unchanged, and growth of E_D."""
    plain = {run.name: figures(run.scores.walls["observed"]) for run in runs}
    rows = [["change", "F pooled", "F lost at most", "by", "E_D times at most", "by"]]
    for change in dict.fromkeys(run.change for run in worse):
        members = [run for run in worse if run.change == change]
        lost, grown = [], []
        for member in members:
            now, before = figures(member.scores.walls["observed"]), plain[member.name]
            lost.append(((before["f"] or 0.0) - (now["f"] or 0.0), member.name))
            if now["distance_error"] is not None and before["distance_error"]:
                grown.append((now["distance_error"] / before["distance_error"], member.name))
        f = figures(pool([member.scores for member in members]).walls["observed"])["f"]
        more, by = max(grown, default=(float("nan"), ""))
        rows.append([change, _cell(f, 3, 1), f"{max(lost)[0]:.3f}", max(lost)[1], f"{more:.2f}", by])
    return _aligned(rows)


def _cell(value: float | None, digits: int, scale: float) -> str:
    return "-" if value is None else f"{value * scale:.{digits}f}"


def _aligned(rows: list[list[str]]) -> str:
    full = [row for row in rows if len(row) > 1]
    widths = [max(len(row[i]) for row in full) for i in range(len(full[0]))]
    lines = []
    for row in rows:
        cells = [
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=False))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def report(runs: list[Run], worse: list[Run], preset: str) -> dict[str, Any]:
    """All figures, for a file."""

    def pooled(choose: Callable[[Run], str], runs: list[Run] = runs) -> dict[str, Any]:
        keys = dict.fromkeys(choose(run) for run in runs)
        scores = {key: pool([run.scores for run in runs if choose(run) == key]) for key in keys}
        return {key: _rounded(figures(s.walls["observed"]) | elements(s)) for key, s in scores.items()}

    return {
        "command": "python experiments/accuracy.py",
        "version": asbuilt.__version__,
        "preset": preset,
        "pooled": pooled(lambda run: run.group),
        "worse": pooled(lambda run: run.change, worse),
        "buildings": pooled(lambda run: run.name),
    }


def _rounded(values: dict[str, float | None]) -> dict[str, float | None]:
    return {name: None if value is None else round(value, 6) for name, value in values.items()}


def fallen(now: dict[str, Any], kept: dict[str, Any]) -> list[str]:
    """The pooled figures that are worse than the kept ones, a line each; groups that were not run are left out."""
    lines = []
    compared = [(name, heading, better) for name, heading, _, _, better in FIGURES]
    compared += [(f"{kind}_{member}", f"{kind} {member}", better) for kind, member, *_, better in ELEMENTS]
    was = kept["pooled"] | kept.get("worse", {})
    for group, figures_now in (now["pooled"] | now["worse"]).items():
        for name, heading, more_is_better in compared:
            new, old = figures_now[name], was.get(group, {}).get(name)
            if old is None:
                continue
            slack = SLACK if more_is_better or name == "overlap" else max(SLACK / 10, 0.05 * old)
            if new is None or (old - new if more_is_better else new - old) > slack:
                lines.append(f"{group}: {heading} was {old}, is {new}")
    return lines


def _changes(group: str, name: str, arguments: argparse.Namespace) -> list[str]:
    wanted = arguments.worse and group != AGAIN and (not arguments.small or name in SMALL)
    return list(TRANSFORMS) if wanted else []


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("buildings", nargs="*", help="names of cases and generated buildings; all if none")
    parser.add_argument("--preset", default="default", help="preset of the parameters: default or paper")
    parser.add_argument("--worse", action="store_true", help="also with turned, thinned, noisy ... clouds")
    parser.add_argument("--small", action="store_true", help="with --worse: only the buildings that tests use")
    parser.add_argument("--json", type=Path, metavar="OUT", help="write all figures to a file")
    parser.add_argument("--keep", action="store_true", help=f"write them to {KEPT.relative_to(ROOT)}")
    parser.add_argument("--plans", type=Path, metavar="FOLDER", help="write each building's plan there, as GeoJSON")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes")
    arguments = parser.parse_args()

    chosen = jobs(arguments.buildings)
    if not chosen:
        parser.error(f"no such building; there are {', '.join(name for _, name in jobs([]))}")
    if not CASES.is_dir():
        print(f"{CASES} is absent (ASBUILT_CASES names another place): generated buildings only", file=sys.stderr)
    if arguments.plans:
        arguments.plans.mkdir(parents=True, exist_ok=True)
    work = [
        (group, name, _changes(group, name, arguments), arguments.preset, arguments.plans) for group, name in chosen
    ]
    results: list[Run] = []
    with ProcessPoolExecutor(arguments.jobs, mp_context=get_context("spawn")) as processes:
        for done in processes.map(run, work):
            results += done
            print(f"{len(results)} plans, last of {done[0].name}", file=sys.stderr)
    runs = [run for run in results if not run.change]
    worse = [run for run in results if run.change]
    order = [SHARED, AGAIN, DEVELOPMENT, HELD_BACK]
    runs.sort(key=lambda run: order.index(run.group))
    for rows in tables(runs).values():
        print(_aligned(rows))
    print(side_by_side(runs))
    if worse:
        print("\n" + losses(runs, worse))

    figures_now = report(runs, worse, arguments.preset)
    if arguments.json:
        arguments.json.write_text(json.dumps(figures_now, indent=1) + "\n", encoding="utf-8")
    if arguments.keep:
        KEPT.parent.mkdir(exist_ok=True)
        KEPT.write_text(json.dumps(figures_now, indent=1) + "\n", encoding="utf-8")
        for name, rows in tables(runs).items():
            (KEPT.parent / f"{name}.md").write_text(markdown(rows), encoding="utf-8")
    elif KEPT.exists() and not (arguments.buildings or arguments.small) and arguments.preset == "default":
        lines = fallen(figures_now, json.loads(KEPT.read_text(encoding="utf-8")))
        print("\n".join(["", "worse than the figures kept:", *lines]) if lines else "\nno figure fell")
        return 1 if lines else 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
