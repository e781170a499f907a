"""The systems that the paper names, and asbuilt, on the same storeys through the same scorer: one table.

Each runs in a process of its own. Its time is the processor's, of all threads, from points in memory to segments;
asbuilt's is from the file, decoding included. Memory is the peak of the whole process, points and libraries included.
All get the storeys that `find_storeys` found. ``python experiments/10_baselines.py NAME ...`` runs some and keeps the
other rows; so does a library that is not installed, or does not start (Open3D needs Debian's libusb-1.0-0).
"""

from __future__ import annotations

import contextlib
import json
import resource
import sys
import time
from importlib import metadata
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

import asbuilt
import common
from asbuilt import FloorPlan
from asbuilt.evaluate import Drawing, evaluate
from baselines import BASELINES
from common import CASES, load_case
from points import storey_cloud

PRESETS = ("paper", "default")
LIBRARIES = ("numpy", "scipy", "scikit-image", "opencv-python-headless", "open3d")
#: What an import raises where a library, or a library of the system that it needs, is not there.
MISSING = (ImportError, OSError)
STORED = common.RESULTS / "10_baselines.json"


def main() -> None:
    names = [*BASELINES, *(f"asbuilt, {preset}" for preset in PRESETS)]
    wanted = sys.argv[1:] or names
    unknown = sorted(set(wanted) - set(names))
    if unknown:
        sys.exit(f"{unknown[0]!r}: expected one of {', '.join(names)}")
    stored = json.loads(STORED.read_text(encoding="utf-8"))["results"] if STORED.exists() else {}
    if set(wanted) & set(BASELINES):  # read before anything is timed
        for case in CASES:
            for level in load_case(case).levels:
                storey_cloud(load_case(case), level)
    load_case.cache_clear()
    rows = {name: (_row(name) if name in wanted else None) or stored.get(name) for name in names}
    results = {name: row for name, row in rows.items() if row is not None}
    common.write_result(
        "10_baselines",
        results,
        {
            "baselines": {name: baseline.parameters for name, baseline in BASELINES.items()},
            "asbuilt": {preset: asbuilt.Parameters.preset(preset).as_dict() for preset in PRESETS},
        },
    )
    _write_table(results)


def _versions() -> dict[str, str]:
    found = {}
    for name in LIBRARIES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


def _row(name: str) -> dict[str, Any] | None:
    """Scores, time and memory; None, saying so, where a library is missing."""
    try:
        runs = {case: _in_own_process(name, case) for case in CASES}
    except MISSING as error:
        print(f"{name}: {error}; pip install 'asbuilt[baselines]'; its stored row is kept", file=sys.stderr)
        return None
    scores = {(case, i): totals for case, (all_totals, _, _) in runs.items() for i, totals in enumerate(all_totals)}
    row = {
        **common.by_storey(scores),
        "seconds": {case: round(seconds, 2) for case, (_, seconds, _) in runs.items()},
        "megabytes": {case: round(megabytes) for case, (_, _, megabytes) in runs.items()},
        "libraries": _versions(),
    }
    pooled = row["pooled"]["observed"]
    print(f"{name}: F {pooled['f']:.3f}, E_D {pooled['distance_error']}, {row['seconds']}", flush=True)
    return row


def _in_own_process(name: str, case: str) -> tuple[list[common.Totals], float, float]:
    context = get_context("fork")
    ours, theirs = context.Pipe()
    process = context.Process(target=_run, args=(name, case, theirs))
    process.start()
    theirs.close()
    result = ours.recv()
    process.join()
    if isinstance(result, MISSING):
        raise result
    return result  # type: ignore[no-any-return]


def _run(name: str, case_name: str, connection: Connection) -> None:
    run = _run_baseline if name in BASELINES else _run_asbuilt
    try:
        plan, seconds = run(name, case_name)
    except MISSING as error:
        connection.send(error)
        return
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)
    scored = evaluate(plan, load_case(case_name).truth)
    connection.send(([storey.scores.walls for storey in scored.storeys], seconds, peak))


def _run_baseline(name: str, case_name: str) -> tuple[Drawing, float]:
    baseline, case = BASELINES[name], load_case(case_name)
    parameters, seconds, found = baseline.parameters, 0.0, []
    for level in case.levels:
        cloud = storey_cloud(case, level)
        start = time.process_time()
        found.append(baseline.find(cloud, **parameters))
        seconds += time.process_time() - start
    return common.drawing(case, found), seconds


def _run_asbuilt(name: str, case_name: str) -> tuple[FloorPlan, float]:
    parameters = asbuilt.Parameters.preset(name.removeprefix("asbuilt, "))
    start = time.process_time()
    plan = asbuilt.extract_floor_plan(common.case_folder(case_name) / "scans.laz", parameters)
    return plan, time.process_time() - start


def _write_table(results: dict[str, Any]) -> None:
    rows = []
    for name, row in results.items():
        observed, everything = row["pooled"]["observed"], row["pooled"]["all"]
        baseline = BASELINES.get(name)
        ours = "Okorn et al." if name.endswith("paper") else "-"
        rows.append(
            (
                name,
                baseline.reference if baseline else ours,
                baseline.setting if baseline else "defaults",
                observed["precision"],
                observed["recall"],
                observed["f"],
                everything["f"],
                *(f"{row['cases'][case]['pooled']['observed']['f']:.3f}" for case in CASES),
                None if observed["distance_error"] is None else f"{1000 * observed['distance_error']:.1f}",
                None if observed["orientation_error_deg"] is None else f"{observed['orientation_error_deg']:.2f}",
                None if observed["over_segmentation"] is None else f"{observed['over_segmentation']:.2f}",
                observed["overlap"],
                f"{sum(row['seconds'].values()):.0f}",
                f"{max(row['megabytes'].values()):,}",
            )
        )
    heading = ["system", "paper's reference", "parameters", "P", "R", "F observed", "F all"]
    heading += [f"F {case}" for case in CASES]
    heading += ["E_D, mm", "E_Theta, °", "E_OS", "E_OL", "CPU time, s", "peak memory, MB"]
    common.write_table("10_baselines", heading, rows)


if __name__ == "__main__":
    main()
