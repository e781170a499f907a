"""Measure what a plan costs, and how that grows with the floor area; write the table of docs/benchmarks.md.

    python benches/plan.py school.laz --tiles 1 4 16
    python benches/plan.py school.laz --voxel 0.2 --tiles 1 4 16 100

The evidence of a building is laid out again and again beside itself, a lane of 25 m between, and planned. Each size is
planned in a process of its own; cost is its CPU seconds without start-up, reading and tiling. The first figure is that
of the whole command `asbuilt plan` on the evidence file, start-up included.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib.metadata
import math
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from run import ASBUILT, ROOT, measure, processor

import asbuilt
from asbuilt.params import EvidenceParameters

PAGE = ROOT / "docs" / "benchmarks.md"
LANE = 25.0
"""Between tiles, m; of the building, strays further than this from most of its voxels are left out."""


class Tiles:
    """What a plan asks of evidence, for a building `count` times beside itself, in rows of a square."""

    def __init__(self, evidence: asbuilt.Evidence, count: int) -> None:
        self.occupancy, self.voxel = evidence.occupancy, evidence.voxel
        self.points = evidence.points * count
        low, high = np.percentile(evidence.index, (0.1, 99.9), axis=0).astype(np.int64)
        lane = int(LANE / self.voxel)
        kept = ((evidence.index > low - lane // 3) & (evidence.index < high + lane // 3)).all(axis=1)
        apart = (high - low + lane) * (1, 1, 0)
        side = math.isqrt(count - 1) + 1
        shifts = np.array([(*divmod(i, side), 0) for i in range(count)]) * apart
        one = evidence.index[kept]
        index = np.concatenate([one + shift.astype(np.int32) for shift in shifts])
        keys = np.ravel_multi_index(tuple((index - index.min(axis=0)).T), tuple(np.ptp(index, axis=0) + 1))
        order = np.argsort(keys, kind="stable")
        arrays = {"count": evidence.count, "mean": evidence.mean, "covariance": evidence.covariance}
        self._voxels = {name: array[kept][order % len(one)] for name, array in arrays.items()}
        self._voxels["index"] = index[order]
        self._scans = [
            (f"{i}/{key}", None if position is None else tuple(position + shift * self.voxel), points)
            for i, shift in enumerate(shifts)
            for key, position, points in evidence.scans
        ]

    def voxels(self) -> dict[str, np.ndarray]:
        return self._voxels

    def scans(self) -> list[tuple[str, tuple[float, float, float] | None, int]]:
        return self._scans


def plan_tiles(path: Path, count: int) -> None:
    """Plan so many tiles and print voxels, faces, rooms, CPU seconds and peak memory."""
    evidence = asbuilt.read_evidence(path)
    tiles = dataclasses.replace(evidence, core=Tiles(evidence, count))
    del evidence
    start = time.process_time()
    plan = asbuilt.extract_floor_plan(
        tiles, asbuilt.Parameters().replace(storeys={"voxel": storeys_voxel(tiles.voxel)})
    )
    cost = time.process_time() - start
    rooms = sum(len(storey.rooms) for storey in plan)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    print(len(tiles.index), len(plan.wall_faces), rooms, cost, memory)


def storeys_voxel(voxel: float) -> float:
    """The voxel in which storeys are looked for: no smaller than the evidence's, m."""
    return max(voxel, asbuilt.Parameters().storeys.voxel)


def row(path: Path, count: int, one: tuple[float, float] | None) -> tuple[str, tuple[float, float]]:
    """A row of the table, and the voxels and the cost of it; `one` are those of a single tile."""
    command = [sys.executable, __file__, str(path), "--only", str(count)]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    voxels, faces, rooms, cost, memory = (float(word) for word in said)
    first_voxels, first_cost = one or (voxels, cost)
    growth = cost / first_cost
    bound = voxels * math.log(voxels) / (first_voxels * math.log(first_voxels))
    cells = [f"{count}", f"{voxels / 1e6:.1f}", f"{faces:.0f}", f"{rooms:.0f}", f"{cost:.1f}", f"{growth:.1f}"]
    cells += [f"{bound:.1f}", f"{memory / 1e9:.1f}"]
    print(*cells, sep=" | ", file=sys.stderr)
    return f"| {' | '.join(cells)} |", (first_voxels, first_cost)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scans", type=Path, help="of a building, or its evidence")
    parser.add_argument("--voxel", type=float, default=0.05, help="of the evidence, m")
    parser.add_argument("--tiles", type=int, nargs="+", default=[1, 4, 16])
    parser.add_argument("--repeat", type=int, default=5, help="of the whole command; the least counts")
    parser.add_argument("--only", type=int, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.only is not None:
        plan_tiles(given.scans, given.only)
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "one.evidence"
        gathered = EvidenceParameters(given.voxel)
        asbuilt.gather_evidence(asbuilt.read(given.scans), gathered).save(path)
        command = [*ASBUILT, "plan", str(path), "-o", str(Path(folder) / "plan.geojson")]
        command += ["--set", f"storeys.voxel={storeys_voxel(given.voxel)}"]
        whole = min(measure(command).cpu for _ in range(given.repeat))
        load = os.getloadavg()[0]
        rows, one = [], None
        for count in given.tiles:
            text, one = row(path, count, one)
            rows.append(text)
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("numpy", "scipy", "shapely"))
    name = given.scans.stem if given.scans.suffix == ".evidence" else given.scans.parent.name
    about = (
        f"`asbuilt plan {name}.evidence`, voxels of {100 * given.voxel:g} cm, start-up included: {whole:.1f} s of CPU "
        f"(the least of {given.repeat}), on {processor()} with {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, {versions}."
    )
    if load > 1:
        about += f" Other work ran beside it (load {load:.1f}), which makes CPU seconds longer, too."
    head = (
        "| tiles | million voxels | wall faces | rooms | CPU s | times one | n log n | peak GB |\n" + "|---" * 8 + "|"
    )
    text = PAGE.read_text(encoding="utf-8")
    begin, end = (f"<!-- {word}plan, {given.voxel:g} m -->" for word in ("", "end of "))
    before, _, rest = text.partition(begin)
    _, _, after = rest.partition(end)
    table = "\n".join([about, "", head, *rows])
    PAGE.write_text(f"{before}{begin}\n\n{table}\n\n{end}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
