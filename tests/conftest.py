"""What several test files share."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from asbuilt.cli import main
from asbuilt.plan import FloorPlan, Storey, WallFace
from browser import started

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="session")
def example() -> Path:
    """The furnished house that comes with the project: scans.laz and truth.json."""
    return ROOT / "examples" / "small_house"


@pytest.fixture(scope="session")
def cases() -> Path:
    """The folder of the larger cases, which are not part of the project; a test that asks for them skips without."""
    folder = Path(os.environ.get("ASBUILT_CASES", ROOT.parent / "shared" / "cases"))
    if not folder.is_dir():
        pytest.skip(f"{folder} is absent: this test needs the cases (ASBUILT_CASES names another place)")
    return folder


@pytest.fixture
def run(capsys):
    """Run the command line in this process; gives the exit code, standard output and standard error."""

    def run_main(*arguments: object) -> tuple[int, str, str]:
        pipe = signal.getsignal(signal.SIGPIPE)
        try:
            with pytest.raises(SystemExit) as leaving:
                main([str(argument) for argument in arguments])
        finally:
            signal.signal(signal.SIGPIPE, pipe)
        printed = capsys.readouterr()
        return leaving.value.code, printed.out, printed.err

    return run_main


browser = pytest.fixture(scope="session")(started)


def room(index: int, floor: float, x0: float, y0: float, width: float, depth: float) -> Storey:
    """A storey that is one rectangular room, its faces seen from inside (the room on their left)."""
    corners = [(x0, y0), (x0 + width, y0), (x0 + width, y0 + depth), (x0, y0 + depth)]
    ends = zip(corners, [*corners[1:], corners[0]], strict=True)
    faces = (WallFace(a, b, id=f"S{index}-F{i}", seen=0.9, rms=0.002, voxels=100) for i, (a, b) in enumerate(ends))
    return Storey(index, floor, floor + 2.5, tuple(corners), tuple(faces))


@pytest.fixture
def plan() -> FloorPlan:
    """Two storeys in survey coordinates (UTM), where a format that keeps too few digits would show."""
    return FloorPlan(
        storeys=(room(0, 112.5, 500000.125, 5400000.25, 8.0, 5.0), room(1, 115.3, 500000.125, 5400000.25, 6.0, 5.0)),
        parameters={"voxels": {"size": 0.1}},
        inputs=({"name": "scan.las", "size": 1, "sha256": "00"},),
        crs="EPSG:25832",
    )


@pytest.fixture
def one_storey(plan: FloorPlan) -> FloorPlan:
    """The lower storey alone."""
    return FloorPlan(plan.storeys[:1], plan.parameters, plan.inputs, plan.crs)
