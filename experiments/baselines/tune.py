"""Tune the baselines that have a grid, on one case (`skewed`), by F of the observed truth; writes tuned.json.

One parameter after another from the middle of its values, twice round. The case is among those of the table, which
favours the baselines a little.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import asbuilt
import common
from baselines import BASELINES, TUNED
from points import storey_cloud

CASE = "skewed"


def main() -> None:
    wanted = sys.argv[1:] or [name for name, baseline in BASELINES.items() if baseline.grid]
    found = dict(zip(wanted, common.in_parallel(_tune, wanted), strict=True))
    before = json.loads(TUNED.read_text(encoding="utf-8")) if TUNED.exists() else {"parameters": {}, "f": {}}
    tuned = {
        "command": "python experiments/baselines/tune.py",
        "version": asbuilt.__version__,
        "data": common.load_case(CASE).input,
        "parameters": before["parameters"] | {name: parameters for name, (parameters, _) in found.items()},
        "f": before["f"] | {name: f for name, (_, f) in found.items()},
    }
    TUNED.write_text(json.dumps(tuned, indent=1) + "\n", encoding="utf-8")


def _tune(name: str) -> tuple[dict[str, Any], float]:
    baseline, case = BASELINES[name], common.load_case(CASE)
    tried: dict[tuple[Any, ...], float] = {}
    cloud = storey_cloud(case, case.levels[0])

    def f(parameters: dict[str, Any]) -> float:
        key = tuple(parameters.values())
        if key not in tried:
            segments = baseline.find(cloud, **parameters)
            tried[key] = common.score(case, case.levels[0], segments)["observed"].f or 0.0
        return tried[key]

    start = time.perf_counter()
    best = {parameter: values[len(values) // 2] for parameter, values in baseline.grid.items()}
    for _ in range(2):
        for parameter, values in baseline.grid.items():
            best = max(({**best, parameter: value} for value in values), key=f)
    print(f"{name}: F {f(best):.3f} at {best}, {len(tried)} runs in {time.perf_counter() - start:.0f} s", flush=True)
    return best, round(f(best), 4)


if __name__ == "__main__":
    main()
