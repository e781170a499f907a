"""How well the report's offsets of scans (asbuilt.report.registration) are those that were put in.

Made-up buildings (tests/buildings) whose scans are moved by 3 mm in x and in y, one standard deviation, each at random.
An offset is compared with what it stands for: the scan's own, less the mean of those that it was compared with.

    python experiments/registration.py            # ten buildings, some ten minutes
    python experiments/registration.py 4 7        # these seeds
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import asbuilt
from asbuilt import Evidence, _core
from asbuilt.report.registration import scan_offsets

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from buildings import DEVELOPMENT_SEEDS, Scanner, generate

SHIFT = 0.003


def row(seed: int) -> str:
    """The line of the table for one building."""
    building = generate(seed, scanner=Scanner(step_deg=0.6, shift=0.0))
    offsets = np.random.default_rng(seed + 1000).normal(0, SHIFT, (len(building.positions), 2))
    cores = [
        _core.Evidence.from_points(
            np.ascontiguousarray(building.points[building.scans == i] + np.append(offset, 0.0)),
            voxel=0.05,
            scan=f"{i:03d}",
            position=tuple(building.positions[i].tolist()),
        )
        for i, offset in enumerate(offsets)
    ]
    evidence = Evidence(cores[0].merged(*cores[1:]))
    scans = scan_offsets(asbuilt.extract_floor_plan(evidence), evidence)
    told = [scan for scan in scans if scan.offset is not None]
    truth = np.array([offsets[int(s.key)] - sum(part * offsets[int(key)] for key, part in s.against) for s in told])
    found, error = np.array([s.offset for s in told]), np.array([s.error for s in told])
    off = found - truth
    figures = [np.sqrt(np.mean(truth**2)), np.sqrt(np.mean(off**2)), np.median(np.abs(off)), np.median(error)]
    ratio = np.sqrt(np.mean((off / error) ** 2))
    correlation = np.corrcoef(found.ravel(), truth.ravel())[0, 1]
    millimetres = " | ".join(f"{1000 * figure:.1f}" for figure in figures)
    return f"| {building.name} | {len(told)} of {len(scans)} | {millimetres} | {ratio:.2f} | {correlation:.2f} |"


if __name__ == "__main__":
    print("| building | told | true offset, mm rms | error, mm rms | median | standard error, mm | ratio | r |")
    print("|---|---:|---:|---:|---:|---:|---:|---:|")
    for seed in [int(argument) for argument in sys.argv[1:]] or DEVELOPMENT_SEEDS:
        print(row(seed), flush=True)
