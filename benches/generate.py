"""A scanned floor of 50 million points in every format that is measured: rooms of 8 m x 7.5 m x 3 m, a setup in each.

    python benches/generate.py out/bench --points 50000000

The points of a setup come as a scanner gives them: column after column of rising rays, with 2 mm of noise in
range and 0.1 mrad in direction. Twenty rooms
make the floor of 40 m x 30 m; fewer points are fewer rooms, so that the density stays. Files that are there already
are left as they are. Needs the dependency group `bench`, and `peers` (see benches/peers.rs) for E57.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import copclib
import laspy
import numpy as np
import polars

ROOM = np.array([8.0, 7.5, 3.0])
ROOMS_ALONG = 5
COLUMNS, RAYS = 2000, 1250
SETUP = COLUMNS * RAYS


def setups(points: int, rooms: int | None = None) -> Iterator[np.ndarray]:
    """The points (n, 3) of each setup, m, in scan order; in no more than so many rooms, one after the other."""
    azimuth, elevation = np.meshgrid(
        np.linspace(0, 2 * np.pi, COLUMNS, endpoint=False), np.linspace(-1.2, 1.5, RAYS), indexing="ij"
    )
    across = np.cos(elevation)
    rays = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), np.sin(elevation)], axis=-1).reshape(-1, 3)
    for number in range(-(-points // SETUP)):
        room = number if rooms is None else number % rooms
        low = np.array([room % ROOMS_ALONG, room // ROOMS_ALONG, 0]) * ROOM
        rng = np.random.default_rng(number)
        shaken = rays + rng.normal(0, 1e-4, rays.shape)
        scanner = np.array([3.0, 4.5, 1.6]) + rng.uniform(-1, 1, 3) * [1, 1, 0.2]
        faces = np.where(shaken > 0, ROOM - 0.1 - scanner, 0.1 - scanner)
        reach = np.min(faces / shaken, axis=1) + rng.normal(0, 0.002, len(rays))
        yield np.round(low + scanner + shaken * reach[:, None], 4)


def write_raw(path: Path, points: int) -> None:
    with path.open("wb") as out:
        for setup in setups(points):
            setup.tofile(out)


def write_las(path: Path, raw: np.ndarray, point_format: int) -> None:
    header = laspy.LasHeader(point_format=point_format, version="1.4" if point_format > 5 else "1.2")
    header.scales = np.full(3, 1e-4)
    with laspy.open(path, "w", header=header) as out:
        for first in range(0, len(raw), SETUP):
            setup = raw[first : first + SETUP]
            record = laspy.ScaleAwarePointRecord.zeros(len(setup), header=header)
            record.x, record.y, record.z = setup.T
            record.intensity = (np.arange(len(setup)) * 7919) % 4096
            record.point_source_id = np.full(len(setup), first // SETUP + 1, dtype=np.uint16)
            out.write_points(record)


def write_ply(path: Path, points: int, parts: Iterable[np.ndarray]) -> None:
    names = "".join(f"property float {name}\n" for name in "xyz")
    with path.open("wb") as out:
        out.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {points}\n{names}end_header\n".encode())
        for part in parts:
            part.astype("<f4").tofile(out)


def write_text(path: Path, raw: np.ndarray, head: str = "", more: int = 0) -> None:
    """Columns x, y, z and, if `more`, intensity and colour, between blanks."""
    with path.open("wb") as out:
        out.write(head.encode())
        for first in range(0, len(raw), SETUP):
            frame = polars.DataFrame(raw[first : first + SETUP].round(3), schema=["x", "y", "z"])
            extra = [polars.lit(value).alias(name) for name, value in zip("irgb", (-1200, 90, 91, 92), strict=True)]
            frame.with_columns(extra[:more]).write_csv(out, separator=" ", include_header=False, float_precision=3)


def write_ptx(path: Path, raw: np.ndarray) -> None:
    columns, rest = divmod(len(raw), RAYS)
    assert rest == 0
    identity = "1 0 0\n0 1 0\n0 0 1\n"
    head = f"{columns}\n{RAYS}\n0 0 0\n{identity}1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
    write_text(path, raw, head, more=1)


def write_copc(path: Path, raw: np.ndarray) -> None:
    """An octree of 40 m whose root has a point each 31 cm, and each level a point where those above leave a gap."""
    side, cells, levels = 40.0, 128, 7
    config = copclib.CopcConfigWriter(7, copclib.Vector3(1e-4, 1e-4, 1e-4), copclib.Vector3(0, 0, 0))
    config.las_header.min, config.las_header.max = copclib.Vector3(0, 0, 0), copclib.Vector3(side, side, side)
    config.copc_info.spacing = side / cells
    config.copc_info.halfsize = side / 2
    config.copc_info.center_x = config.copc_info.center_y = config.copc_info.center_z = side / 2
    writer = copclib.FileWriter(str(path), config)
    left = np.arange(len(raw))
    for level in range(levels):
        last = level == levels - 1
        if last:
            taken = left
        else:
            cell = (raw[left] * (cells * 2**level / side)).astype(np.int64)
            _, first = np.unique(_key(cell), return_index=True)
            taken = left[first]
            left = np.delete(left, first)
        node = (raw[taken] * (2**level / side)).astype(np.int64)
        order = np.argsort(_key(node), kind="stable")
        taken, node = taken[order], node[order]
        starts = np.flatnonzero(np.append(True, np.any(node[1:] != node[:-1], axis=1)))
        for start, end in zip(starts, [*starts[1:], len(taken)], strict=True):
            records = np.zeros(end - start, dtype=laspy.PointFormat(7).dtype())
            records["X"], records["Y"], records["Z"] = np.round(raw[np.sort(taken[start:end])] * 1e4).astype(np.int32).T
            x, y, z = (int(i) for i in node[start])
            writer.AddNode(copclib.VoxelKey(level, x, y, z), copclib.VectorChar(records.view(np.int8)))
        if len(left) == 0:
            break
    writer.Close()


def _key(index: np.ndarray) -> np.ndarray:
    return (index[:, 0] << 42) | (index[:, 1] << 21) | index[:, 2]


def generate(folder: Path, points: int, peers: Path) -> None:
    """Write what is not there yet."""
    folder.mkdir(parents=True, exist_ok=True)
    raw_path = folder / "floor.raw"
    _make(raw_path, lambda path: write_raw(path, points))
    raw = np.memmap(raw_path, dtype="<f8", mode="r").reshape(-1, 3)

    def write_e57(kind: str) -> Callable[[Path], None]:
        return lambda path: subprocess.run(
            [peers, "write", kind, raw_path, path], check=True, stdout=subprocess.DEVNULL
        )

    _make(folder / "floor.las", lambda path: write_las(path, raw, 3))
    _make(folder / "floor_7.laz", lambda path: write_las(path, raw, 7))
    _make(folder / "floor_3.laz", lambda path: write_las(path, raw, 3))
    _make(folder / "floor.ply", lambda path: write_ply(path, len(raw), np.split(raw, range(SETUP, len(raw), SETUP))))
    for kind in ("float64", "float32", "scaled"):
        _make(folder / f"floor_{kind}.e57", write_e57(kind))
    _make(folder / "floor.xyz", lambda path: write_text(path, raw))
    _make(folder / "floor.pts", lambda path: write_text(path, raw, f"{len(raw)}\n", more=4))
    _make(folder / "floor.ptx", lambda path: write_ptx(path, raw))
    _make(folder / "floor.copc.laz", lambda path: write_copc(path, raw))


def _make(path: Path, write: Callable[[Path], object]) -> None:
    if path.exists():
        return
    unfinished = path.with_name(f"unfinished_{path.name}")
    write(unfinished)
    unfinished.rename(path)
    print(f"{path}: {path.stat().st_size / 1e6:,.0f} MB", file=sys.stderr)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--points", type=int, default=50_000_000)
    parser.add_argument("--peers", type=Path, default=Path("target/release/examples/peers"))
    parser.add_argument("--same-rooms", action="store_true", help="only floor.ply, all points in twenty rooms")
    given = parser.parse_args()
    if given.same_rooms:
        given.folder.mkdir(parents=True, exist_ok=True)
        _make(given.folder / "floor.ply", lambda path: write_ply(path, given.points, setups(given.points, 20)))
        sys.exit()
    generate(given.folder, given.points, given.peers)
