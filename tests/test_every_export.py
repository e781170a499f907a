"""Every export of every case is written, read back by programs that are not ours, and compared with its plan."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pytest
import shapely

import asbuilt
from asbuilt import Evidence, FloorPlan
from asbuilt.evaluate import evaluate
from asbuilt.export import export, known_suffixes
from asbuilt.export.drawing import make_drawing
from asbuilt.export.sheet import SheetOptions
from asbuilt.label import _WRITERS as LABEL_SUFFIXES
from asbuilt.label import label_cloud
from browser import opened, requested
from plans import EAST, complete_plan, mapped
from readback import CHECKS
from readback.clouds import check_cloud
from readback.drawings import openings_of
from readback.ink import collisions

#: The example, in survey coordinates, and cases that take seconds.
SMALL = ("example", "flat_e57", "fzk_haus", "niedriha")
LARGE = ("flat", "small_house_e57", "real_room", "real_house", "skewed", "rotunda", "school")
LABELLED = (".laz", ".e57")
WHEN_ASKED = pytest.mark.skipif("ASBUILT_LARGE_CASES" not in os.environ, reason="minutes: `make bench-accuracy` has it")
MM = 0.001
UTM = (
    'PROJCS["ETRS89 / UTM zone 32N",GEOGCS["ETRS89",DATUM["European_Terrestrial_Reference_System_1989",'
    'SPHEROID["GRS 1980",6378137,298.257222101]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],'
    'PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",9],'
    'PARAMETER["scale_factor",0.9996],PARAMETER["false_easting",500000],PARAMETER["false_northing",0],UNIT["metre",1]]'
)


@dataclass(frozen=True)
class Case:
    """A cloud, its evidence, its plan, and its truth where there is one."""

    scans: Path
    evidence: Evidence
    plan: FloorPlan
    truth: Path | None


def on_the_map(scans: Path, folder: Path) -> Path:
    """The same points in UTM zone 32, as their header says."""
    las = laspy.read(scans)
    las.points.offsets = las.header.offsets = las.header.offsets + np.array((512_000.0, 5_403_000.0, 117.0))
    las.header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(UTM))
    las.header.global_encoding.wkt = True
    las.write(folder / "scans.laz")
    return folder / "scans.laz"


@pytest.fixture(
    scope="module",
    params=[*SMALL, *(pytest.param(name, marks=[WHEN_ASKED, pytest.mark.slow]) for name in LARGE)],
)
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Case:
    """Each case is planned once, and forgotten before the next."""
    if request.param == "example":
        scans = on_the_map(request.getfixturevalue("example") / "scans.laz", tmp_path_factory.mktemp("map"))
        truth = None  # it is where the example was
    else:
        folder = request.getfixturevalue("cases") / request.param
        (scans,), truth = folder.glob("scans.*"), folder / "truth.json"
    evidence = asbuilt.gather_evidence(asbuilt.read(scans))
    plan = asbuilt.extract_floor_plan(evidence)
    return Case(scans, evidence, plan, truth if truth and truth.exists() else None)


def test_a_format_without_a_check_is_noticed() -> None:
    assert CHECKS.keys() == known_suffixes().keys()
    assert {*LABELLED, ".las"} == LABEL_SUFFIXES.keys()  # .las is .laz, not compressed


@pytest.mark.parametrize("suffix", known_suffixes())
def test_a_check_notices_that_the_plan_was_another(suffix: str, tmp_path: Path) -> None:
    """Stretched by a twentieth, or without its rooms, or without its walls, whichever the format has."""
    plan = complete_plan()
    written = export(plan, tmp_path / f"plan{suffix}")
    CHECKS[suffix](plan, written)
    others = [mapped(plan, lambda point: (EAST + 1.05 * (point[0] - EAST), point[1]))]
    nothing = {"rooms": ()} if suffix in (".csv", ".xlsx", ".pdf") else {"walls": (), "wall_faces": ()}
    others.append(replace(plan, storeys=tuple(replace(storey, **nothing) for storey in plan)))
    for other in others:
        with pytest.raises((AssertionError, ValueError)):
            CHECKS[suffix](other, written)


def test_every_wall_stands_on_a_ring_that_does_not_cross_itself(case: Case) -> None:
    rings = [shapely.Polygon(wall.outline) for storey in case.plan for wall in storey.walls]
    assert all(ring.is_valid and ring.area > 0 and ring.exterior.is_ccw for ring in rings)


def test_openings_lie_within_their_walls(case: Case) -> None:
    for storey in case.plan:
        walls = {wall.id: wall for wall in storey.walls}
        bodies = {name: shapely.Polygon(wall.outline) for name, wall in walls.items()}
        attached = [opening for opening in openings_of(storey) if opening.wall is not None]
        assert len(attached) >= 0.8 * len(openings_of(storey))
        for opening in attached:
            wall, line = walls[opening.wall], shapely.LineString([opening.start, opening.end])
            x, y = np.subtract(wall.end, wall.start) / wall.length
            assert np.abs(np.subtract([opening.start, opening.end], wall.start) @ (-y, x)).max() < 1e-6
            # At a corner it may begin in the wall that its own meets, or, where one face of that was seen and it is
            # drawn thinner than it is, a little behind.
            met = shapely.union_all([body for body in bodies.values() if body.distance(bodies[wall.id]) < MM])
            assert line.difference(met.buffer(20 * MM)).length == 0
            assert line.intersection(bodies[wall.id]).length > 0.5 * line.length


@pytest.mark.parametrize("suffix", known_suffixes())
def test_what_is_written_is_what_was_planned(suffix: str, case: Case, tmp_path: Path) -> None:
    CHECKS[suffix](case.plan, export(case.plan, tmp_path / f"plan{suffix}", case.evidence))


def test_the_drawing_scores_as_the_plan_does(case: Case, tmp_path: Path) -> None:
    """Against the truth, or where there is none against the plan itself."""
    written = [export(case.plan, tmp_path / f"plan{suffix}")[0] for suffix in (".geojson", ".dxf")]
    from_plan, from_dxf = (evaluate(path, case.truth or case.plan).to_json()["pooled"]["all"] for path in written)
    # the challenge's own measure counts doors as well, which line work does not tell
    assert {**from_plan, "challenge": None} == {**from_dxf, "challenge": None}


def test_no_text_of_the_drawing_lies_on_lines_or_on_other_text(case: Case) -> None:
    drawing = make_drawing(case.plan, SheetOptions())
    for storey, found in drawing.storeys:
        assert collisions(found, drawing.sheet.metre) == [], storey.index


@pytest.mark.parametrize("suffix", LABELLED)
def test_labelled_points_are_all_there_and_lie_where_they_say(suffix: str, case: Case, tmp_path: Path) -> None:
    counts = label_cloud(asbuilt.read(case.scans), case.plan, tmp_path / f"labelled{suffix}")
    check_cloud(case.plan, case.scans, tmp_path / f"labelled{suffix}", counts)


def test_the_report_opens_in_a_browser(case: Case, browser: Any, tmp_path: Path) -> None:
    (written,) = export(case.plan, tmp_path / "plan.html", case.evidence)
    opened(browser, written)
    assert browser.get_log("browser") == []
    assert requested(browser) == []
    boxes = browser.execute_script(
        "return [...document.querySelectorAll('figure:not([hidden]) .wallface .shape')]"
        ".map(shape => shape.getBoundingClientRect()).map(box => [box.x, box.y, box.right, box.bottom])"
    )
    faces = case.plan.storeys[0].wall_faces
    assert len(boxes) == len(faces)
    # all within the drawing, in the proportions of the building
    spans = np.ptp(np.reshape(boxes, (-1, 2)), axis=0), np.ptp([(f.start, f.end) for f in faces], axis=(0, 1))
    assert np.divide(*spans[0]) == pytest.approx(np.divide(*spans[1]), rel=0.02)
