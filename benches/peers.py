"""Peers in Python: read every point's x, y, z in chunks, and nothing more.

python benches/peers.py laspy|open3d|polars FILE
"""

from __future__ import annotations

import sys
from pathlib import Path

CHUNK = 1_000_000


def read_laspy(path: Path) -> int:
    import laspy
    import numpy as np

    wanted = laspy.DecompressionSelection.base() | laspy.DecompressionSelection.Z
    points = 0
    with laspy.open(path, decompression_selection=wanted, laz_backend=laspy.LazBackend.Lazrs) as file:
        for chunk in file.chunk_iterator(CHUNK):
            points += len(np.asarray(chunk.x)) + len(np.asarray(chunk.y)) + len(np.asarray(chunk.z))
    return points // 3


def read_open3d(path: Path) -> int:
    import open3d

    return len(open3d.io.read_point_cloud(str(path)).points)


def read_polars(path: Path) -> int:
    import polars

    skipped = {".xyz": 0, ".pts": 1, ".ptx": 10}[path.suffix]
    columns = ["column_0", "column_1", "column_2"]
    frame = polars.read_csv(path, has_header=False, separator=" ", skip_rows=skipped, columns=columns)
    return frame.cast(polars.Float64).height


if __name__ == "__main__":
    read = {"laspy": read_laspy, "open3d": read_open3d, "polars": read_polars}[sys.argv[1]]
    print(read(Path(sys.argv[2])))
