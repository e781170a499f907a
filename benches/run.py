"""Measure what the evidence pass costs against peers on the same files, and write the table of docs/benchmarks.md.

    python benches/run.py out/bench --points 50000000 --repeat 5

Each repetition runs the evidence, the occupancy and the peer one after the other on the same file, its pages in the
cache; a ratio is taken within a repetition, and the table shows its median and its spread. Cost is the CPU seconds of
the whole process, start-up included, on one thread.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "benchmarks.md"
START, END = "<!-- table -->", "<!-- end of table -->"
ASBUILT = [sys.executable, "-c", "from asbuilt.cli import main; main()"]


@dataclass(frozen=True)
class Case:
    """A file, its peer, and what evidence and occupancy may cost at most, in the peer's cost."""

    name: str
    file: str
    peer: str
    evidence: float | None
    occupancy: float | None
    options: tuple[str, ...] = ()


CASES = (
    Case("LAS", "floor.las", "laspy", 0.75, 0.45),
    Case("PLY, binary", "floor.ply", "open3d", 0.20, 0.15),
    Case("E57, float64", "floor_float64.e57", "e57 crate", 0.40, 0.25),
    Case("E57, float32", "floor_float32.e57", "e57 crate", 0.40, 0.25),
    Case("E57, scaled integers", "floor_scaled.e57", "e57 crate", 0.40, 0.25),
    Case("LAZ, point format 7", "floor_7.laz", "laspy", 1.15, 1.0),
    Case("LAZ, point format 3", "floor_3.laz", "laz crate", 1.15, 1.1),
    Case("XYZ", "floor.xyz", "polars", 0.4, 0.4),
    Case("PTS", "floor.pts", "polars", 0.4, 0.4),
    Case("PTX", "floor.ptx", "polars", 0.4, 0.4),
    Case("COPC `--preview`, 10 cm", "floor.copc.laz", "itself in full", 0.15, 0.15, ("--voxel", "0.1")),
)


@dataclass(frozen=True)
class Cost:
    """Of a whole process: CPU seconds, wall seconds, peak memory (bytes)."""

    cpu: float
    wall: float
    memory: int


# compiled once, as an installed package is
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def measure(command: list[str]) -> Cost:
    """Run a command that must succeed."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=ENVIRONMENT)
    said = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise RuntimeError(f"{command} failed: {said.decode()}")
    return Cost(usage.ru_utime + usage.ru_stime, time.perf_counter() - start, usage.ru_maxrss * 1024)


def evidence(path: Path, *options: str, threads: int = 1) -> list[str]:
    out = Path(tempfile.gettempdir()) / f"bench_{os.getpid()}.evidence"
    return [*ASBUILT, "evidence", str(path), "-o", str(out), "--threads", str(threads), *options]


def peer(case: Case, path: Path, peers: Path) -> list[str]:
    if case.peer == "itself in full":
        return evidence(path, *case.options)
    if case.peer.endswith("crate"):
        return [str(peers), case.peer.split()[0], str(path)]
    return [sys.executable, str(ROOT / "benches" / "peers.py"), case.peer, str(path)]


def run(case: Case, folder: Path, peers: Path, repeat: int) -> str:
    """A row of the table."""
    path = folder / case.file
    options = (*case.options, "--preview") if case.peer == "itself in full" else case.options
    commands = [evidence(path, *options), evidence(path, "--occupancy", *options), peer(case, path, peers)]
    with path.open("rb") as file:  # into the cache
        while file.read(1 << 20):
            pass
    costs = [[measure(command) for command in commands] for _ in range(repeat)]
    cells = [case.name, case.peer]
    for which, most in ((0, case.evidence), (1, case.occupancy)):
        ratios = sorted(row[which].cpu / row[2].cpu for row in costs)
        median = statistics.median(ratios)
        met = "" if most is None or median <= most else " **missed**"
        cells.append(f"{median:.2f} ({ratios[0]:.2f}-{ratios[-1]:.2f}){met}")
        cells.append("" if most is None else f"{most:.2f}")
    cells.append(" / ".join(f"{statistics.median(row[i].cpu for row in costs):.2f}" for i in range(3)))
    cells.append(" / ".join(f"{max(row[i].memory for row in costs) / 1e6:.0f}" for i in range(3)))
    print(*cells, sep=" | ", file=sys.stderr)
    return f"| {' | '.join(cells)} |"


def two_threads(folder: Path, repeat: int) -> str:
    path = folder / "floor_7.laz"
    gains = sorted(
        measure(evidence(path, threads=1)).wall / measure(evidence(path, threads=2)).wall for _ in range(repeat)
    )
    spread = f"({gains[0]:.2f}-{gains[-1]:.2f})"
    return f"LAZ on two threads instead of one: {statistics.median(gains):.2f} times as fast {spread}."


def processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    names = [line.split(":")[1].strip() for line in cpuinfo.read_text().splitlines() if line.startswith("model name")]
    return names[0] if names else platform.processor()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--points", type=int, default=50_000_000)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--peers", type=Path, default=ROOT / "target/release/examples/peers")
    parser.add_argument("--only", default="", help="cases whose name contains this; the page is left as it is")
    given = parser.parse_args()
    # in a process of its own: what this one holds would count as the memory of those it starts
    made = [sys.executable, ROOT / "benches" / "generate.py", given.folder, "--points", given.points]
    subprocess.run([*map(str, made), "--peers", str(given.peers)], check=True)
    cases = [case for case in CASES if given.only.lower() in case.name.lower()]
    load = os.getloadavg()[0]
    rows = [run(case, given.folder, given.peers, given.repeat) for case in cases]
    if given.only:
        return
    versions = ", ".join(
        f"{name} {importlib.metadata.version(name)}" for name in ("laspy", "lazrs", "open3d", "polars")
    )
    locked = {package["name"]: package for package in tomllib.loads((ROOT / "Cargo.lock").read_text())["package"]}
    crates = ", ".join(f"{name} {locked[name]['version']}" for name in ("e57", "laz"))
    gain = two_threads(given.folder, given.repeat)
    start = min(measure([*ASBUILT, "--version"]).cpu for _ in range(8))
    busy = f" Other work ran beside it (load {load:.1f}): wall times mean little." if load > 0.5 else ""
    table = f"""\
{given.points:,} points, medians of {given.repeat} (smallest to largest), on {processor()} with {os.cpu_count()} cores,
{platform.system()}, Python {platform.python_version()}; {versions}; crates {crates}.{busy}

| input | peer | evidence / peer | at most | occupancy / peer | at most | CPU s | peak MB |
|---|---|---|---|---|---|---|---|
{chr(10).join(rows)}

CPU seconds and peak memory are those of evidence / occupancy / peer; of the first two
{start:.2f} s or more are the start of the program, whatever the file. {gain}
"""
    before, rest = PAGE.read_text().split(START)
    PAGE.write_text(f"{before}{START}\n\n{table}\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    main()
