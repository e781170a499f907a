"""The report: what it measures against what is known, and its page in a browser."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import asbuilt
from asbuilt import Evidence, FloorPlan, _core
from asbuilt.export import export
from asbuilt.plan import Storey
from asbuilt.report.picture import density_picture
from asbuilt.report.registration import ScanOffset, scan_offsets
from asbuilt.report.tilt import measure_tilt
from browser import opened, requested
from buildings import Scanner, generate
from plans import complete_plan
from readback.report import Page
from rooms import box, box_room, noisy

Array = NDArray[np.float64]
EVIL = "</script><script>document.title='gone'</script><img src=x onerror=\"document.title='gone'\"> & 'q'"
UNDECODABLE = "scan \udcff.e57"


def scanned(points: list[Array], positions: list[tuple[float, float, float] | None]) -> Evidence:
    """The evidence of scans, the points of each in an array of its own."""
    pairs = zip(points, positions, strict=True)
    cores = [
        _core.Evidence.from_points(np.ascontiguousarray(cloud), voxel=0.05, scan=f"scan {i:02d}", position=position)
        for i, (cloud, position) in enumerate(pairs)
    ]
    return Evidence(cores[0].merged(*cores[1:]))


@dataclasses.dataclass(frozen=True)
class Scans:
    """A scanned flat: the points of each scan where they truly are, the scanners' positions, and a plan of it."""

    points: list[Array]
    positions: list[tuple[float, float, float]]
    plan: FloorPlan

    def offset_by(self, offsets: Array) -> Evidence:
        """The evidence of the scans, each moved by its offset (x, y), m."""
        moved = [points + np.append(offset, 0.0) for points, offset in zip(self.points, offsets, strict=True)]
        return scanned(moved, list(self.positions))


@pytest.fixture(scope="module")
def scans() -> Scans:
    """A flat of eight rooms in which every scan is where it says it is."""
    building = generate(1, preset="flat", scanner=Scanner(step_deg=0.7, shift=0.0))
    points = [building.points[building.scans == i] for i in range(len(building.positions))]
    positions = [(float(x), float(y), float(z)) for x, y, z in building.positions]
    return Scans(points, positions, asbuilt.extract_floor_plan(scanned(points, list(positions))))


def told(found: tuple[ScanOffset, ...]) -> tuple[list[int], Array, Array]:
    """Which scans have an offset, the offsets and their standard errors (n, 2)."""
    which = [i for i, scan in enumerate(found) if scan.offset is not None]
    return which, np.array([found[i].offset for i in which]), np.array([found[i].error for i in which])


def test_offsets_of_scans_are_found_within_their_standard_errors(scans: Scans) -> None:
    """3 mm of registration error for each scan: what is told correlates with it, and its error is as said."""
    offsets = np.random.default_rng(3).normal(0, 0.003, (len(scans.points), 2))
    evidence = scans.offset_by(offsets)
    scan_by_scan = scan_offsets(scans.plan, evidence)
    which, found, error = told(scan_by_scan)
    assert len(which) >= len(offsets) / 2
    index = {scan.key: i for i, scan in enumerate(scan_by_scan)}
    truth = np.array(
        [offsets[i] - sum(weight * offsets[index[key]] for key, weight in scan_by_scan[i].against) for i in which]
    )
    assert np.corrcoef(found.ravel(), truth.ravel())[0, 1] > 0.85
    assert np.sqrt(np.mean((found - truth) ** 2)) < 0.6 * np.sqrt(np.mean(truth**2))
    assert np.sqrt(np.mean(((found - truth) / error) ** 2)) < 1.5


def test_scans_that_are_where_they_say_show_no_offset(scans: Scans) -> None:
    _, found, _ = told(scan_offsets(scans.plan, scans.offset_by(np.zeros((len(scans.points), 2)))))
    assert np.sqrt(np.mean(found**2)) < 0.001


def test_a_scan_that_is_off_by_two_centimetres_is_remarked_upon(scans: Scans) -> None:
    offsets = np.zeros((len(scans.points), 2))
    offsets[4] = 0.016, -0.012
    found = scan_offsets(scans.plan, scans.offset_by(offsets))
    doubled = [i for i, scan in enumerate(found) if "doubled" in scan.remark]
    assert 4 in doubled
    assert len(doubled) < len(found) / 4  # the others are those of its room


def test_without_positions_or_company_there_is_no_offset_but_a_reason() -> None:
    room = noisy(box_room(0, 0, 5, 4))
    unplaced = scanned([room[::2], room[1::2]], [None, None])
    plan = asbuilt.extract_floor_plan(unplaced)
    assert {scan.remark for scan in scan_offsets(plan, unplaced)} == {"the files do not say where the scanner stood"}
    alone = scanned([room], [(2.0, 2.0, 1.5)])
    assert [scan.remark for scan in scan_offsets(plan, alone)] == ["not enough shared walls"]
    assert [scan.remark for scan in scan_offsets(FloorPlan(), alone)] == ["not enough shared walls"]


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.002, -0.001)])
def test_tilt_shows_in_the_floor_and_in_the_walls(tilt: tuple[float, float]) -> None:
    """A cloud turned as a whole by 2 mm/m; the parts agree to a quarter of a millimetre per metre."""
    points = noisy(np.concatenate([box_room(0, 0, 6, 5), box(1, 1, 2, 1.6, 0.75)]))
    turned = points.copy()
    turned[:, :2] += points[:, 2:] * tilt
    turned[:, 2] -= points[:, :2] @ tilt
    evidence = asbuilt.evidence_from_points(turned)
    plan = asbuilt.extract_floor_plan(evidence)
    (found,) = measure_tilt(plan, evidence)
    assert found.floor == pytest.approx(tilt, abs=2.5e-4)
    assert found.walls == pytest.approx(tilt, abs=2.5e-4)
    assert found.floor_error is not None
    assert max(found.floor_error) < 1e-3
    assert len(found.leans) == 4


def test_one_leaning_wall_is_told_and_does_not_tilt_the_cloud() -> None:
    points = noisy(box_room(0, 0, 6, 5))
    leaning = np.abs(points[:, 0] - 6) < 0.01
    points[leaning, 0] -= 0.004 * points[leaning, 2]  # into the room
    evidence = asbuilt.evidence_from_points(points)
    plan = asbuilt.extract_floor_plan(evidence)
    (found,) = measure_tilt(plan, evidence)
    (face,) = [face for face in plan.wall_faces if min(face.start[0], face.end[0]) > 5.9]
    assert found.leans[face.id][0] == pytest.approx(0.004, abs=3e-4)
    assert found.floor == pytest.approx((0, 0), abs=2.5e-4)


def test_tilt_of_nothing_is_nothing() -> None:
    evidence = asbuilt.evidence_from_points(np.array([[0.0, 0.0, 0.0]]))
    assert measure_tilt(FloorPlan(), evidence) == ()
    (found,) = measure_tilt(FloorPlan((Storey(0, 0.0, 2.5),)), evidence)
    assert found.floor is None
    assert found.walls is None


def test_the_density_picture_is_bounded() -> None:
    """A plain of 120 m has 2400 cells a side; its picture has fewer, over the same ground."""
    x, y = np.meshgrid(np.arange(0, 120, 0.05), np.arange(0, 3, 0.05))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 1.0)])
    evidence = asbuilt.evidence_from_points(points)
    found = density_picture(evidence, Storey(0, 0.0, 2.5))
    assert found is not None
    uri, (x0, y0, x1, y1) = found
    assert len(uri) < 60_000
    assert (x0, y0) == pytest.approx((-1 + 0.6, -1), abs=0.2)  # half a percent is cut off, a metre added
    assert (x1, y1) == pytest.approx((121 - 0.6, 4), abs=0.2)
    assert density_picture(evidence, Storey(0, 5.0, 7.5)) is None


def small_house_of_strangers() -> FloorPlan:
    """The complete plan with names that try to become markup."""
    plan = complete_plan()
    first = plan.storeys[0]
    rooms = (dataclasses.replace(first.rooms[0], number=EVIL, id=EVIL, scans=(EVIL,)), *first.rooms[1:])
    doors = (dataclasses.replace(first.doors[0], id=f'"{EVIL}'),)
    first = dataclasses.replace(first, rooms=rooms, doors=doors)
    inputs = ({"name": EVIL + UNDECODABLE, "size": 1, "checksum": "00", EVIL: EVIL},)
    parameters = {"walls": {"band": 0.03, EVIL: EVIL}}
    return FloorPlan((first, *plan.storeys[1:]), parameters, inputs, EVIL, (EVIL,))


def test_text_stays_text(tmp_path: Path) -> None:
    (written,) = export(small_house_of_strangers(), tmp_path / "plan.html")
    (plain,) = export(complete_plan(), tmp_path / "plain.html")
    page, usual = Page(written), Page(plain)
    assert "img" not in page.tags
    assert page.tags.count("script") == usual.tags.count("script") == 2
    assert any(title == f"Room {EVIL}" for title, _ in json.loads(page.scripts[0]))


@pytest.mark.parametrize("plan", [FloorPlan(), FloorPlan((Storey(0, 0.0, 2.5),)), complete_plan()])
def test_every_plan_has_a_report_and_always_the_same(plan: FloorPlan, tmp_path: Path) -> None:
    """With evidence and without; nothing in it points outside of the file."""
    evidence = asbuilt.evidence_from_points(noisy(box_room(0, 0, 5, 4))) if not plan.wall_faces else None
    first, second = (export(plan, tmp_path / name, evidence)[0] for name in ("a.html", "b.html"))
    assert first.read_bytes() == second.read_bytes()
    targets = Page(first).targets
    assert targets
    assert all(target.startswith(("#", "data:image/png;base64,")) for target in targets)


def test_survey_coordinates_are_drawn_near_the_origin(tmp_path: Path) -> None:
    """Browsers draw with single precision: at 5,400,000 m walls would jump by half a metre."""
    nothing = Storey(2, 118.0, 120.5)
    plan = complete_plan()
    (written,) = export(dataclasses.replace(plan, storeys=(*plan.storeys, nothing)), tmp_path / "plan.html")
    paths = re.findall(r' d="([^"]*)"', written.read_text(encoding="utf-8"))
    assert len(paths) > 100
    assert all(-500 < float(value) < 1500 for path in paths for value in re.findall(r"[-\d.]+", path))


def test_occupancy_alone_gives_a_report_that_says_what_it_lacks(tmp_path: Path) -> None:
    core = _core.Evidence.from_points(box_room(0, 0, 5, 4), voxel=0.05, scan="a", occupancy=True)
    evidence = Evidence(core)
    plan = asbuilt.extract_floor_plan(evidence, asbuilt.Parameters.preset("paper"))
    (written,) = export(plan, tmp_path / "plan.html", evidence)
    text = written.read_text(encoding="utf-8")
    assert text.count("occupancy alone") == 2
    assert 'data-layer="density"><image' in text


def test_the_paper_shows_its_chosen_slices(tmp_path: Path) -> None:
    evidence = asbuilt.evidence_from_points(noisy(box_room(0, 0, 5, 4)))
    plan = asbuilt.extract_floor_plan(evidence, asbuilt.Parameters.preset("paper"))
    (written,) = export(plan, tmp_path / "plan.html", evidence)
    assert written.read_text(encoding="utf-8").count('class="bar chosen"') == 9


# In the browser.


def find(browser: Any, selector: str) -> Any:
    return browser.find_element("css selector", selector)


def click(browser: Any, selector: str) -> None:
    """Point at the middle of an element's box, and click what lies there."""
    from selenium.webdriver import ActionChains

    ActionChains(browser).move_to_element(find(browser, selector)).click().perform()


SHOWN = "figure:not([hidden]) "


@pytest.fixture
def report(tmp_path: Path, browser: Any) -> Any:
    return opened(browser, export(complete_plan(), tmp_path / "plan.html")[0])


def test_it_opens_from_disk_without_errors_and_without_network(browser: Any, tmp_path: Path) -> None:
    evidence = asbuilt.evidence_from_points(noisy(box_room(0, 0, 5, 4)))
    (written,) = export(asbuilt.extract_floor_plan(evidence), tmp_path / "a report #1.html", evidence)
    opened(browser, written)
    assert browser.get_log("browser") == []
    assert requested(browser) == []
    width = browser.execute_script("return document.querySelector('.plan image').getBoundingClientRect().width")
    assert width > 100


def test_strangers_names_run_nothing(browser: Any, tmp_path: Path) -> None:
    opened(browser, export(small_house_of_strangers(), tmp_path / "plan.html")[0])
    click(browser, SHOWN + ".room .shape")
    assert find(browser, "#figures h3").text.startswith("Room </script>")
    assert browser.title.startswith("</script>")
    assert browser.get_log("browser") == []


def test_layers_can_be_switched(report: Any) -> None:
    for layer in ("walls", "faces", "doors", "dimensions"):
        group = find(report, f"{SHOWN}[data-layer={layer}]")
        assert group.is_displayed()
        find(report, f"[data-toggle={layer}]").click()
        assert not group.is_displayed()
        find(report, f"[data-toggle={layer}]").click()
        assert group.is_displayed()


def test_pointing_and_clicking_shows_figures(report: Any) -> None:
    click(report, SHOWN + ".wallface .shape")
    assert find(report, "#figures h3").text == "Wall face S0-F1"
    text = find(report, "#figures dl").text
    assert "Residual (rms)\n3.0 mm" in text
    assert "LOA at 95 %\nLOA40" in text
    assert "Confidence\n0.95" in text
    assert find(report, "#tip").is_displayed()
    click(report, SHOWN + ".door .shape")
    assert "Clear width\n0.900 m" in find(report, "#figures dl").text


def test_storeys_schedules_and_keys_lead_to_elements(report: Any) -> None:
    find(report, "button[data-storey='1']").click()
    assert "Storey 1" in find(report, SHOWN + "figcaption").text
    click(report, "#schedules tbody tr:first-child button")
    assert "Storey 0" in find(report, SHOWN + "figcaption").text
    assert find(report, "#figures h3").text == "Room 001"
    svg = find(report, SHOWN + "svg")
    svg.send_keys("n")
    assert find(report, "#figures h3").text == "Room 002"
    whole = svg.get_dom_attribute("viewBox")
    svg.send_keys("+")
    near = svg.get_dom_attribute("viewBox")
    assert float(near.split()[2]) < float(whole.split()[2])
    svg.send_keys("0")
    assert [float(value) for value in svg.get_dom_attribute("viewBox").split()] == pytest.approx(
        [float(value) for value in whole.split()], abs=0.01
    )


def test_walls_are_coloured_by_what_was_chosen(report: Any) -> None:
    colour = "return getComputedStyle(document.querySelector('.wallface .shape')).stroke"
    plain = report.execute_script(colour)
    seen = []
    for measure in ("loa", "confidence", "seen"):
        find(report, f"#colour option[value={measure}]").click()
        seen.append(report.execute_script(colour))
        assert find(report, f".of-{measure}").is_displayed()
    assert plain not in seen
    assert seen[0] != seen[1]  # LOA40 is the second band, 0.95 the first


def test_dragging_moves_and_rolling_zooms(report: Any) -> None:
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.actions.wheel_input import ScrollOrigin

    svg = find(report, SHOWN + "svg")
    before = [float(value) for value in svg.get_dom_attribute("viewBox").split()]
    ActionChains(report).move_to_element(svg).click_and_hold().move_by_offset(80, 30).release().perform()
    moved = [float(value) for value in svg.get_dom_attribute("viewBox").split()]
    assert moved[0] < before[0] - 10
    assert moved[1] < before[1] - 5
    assert moved[2:] == pytest.approx(before[2:], abs=0.01)
    ActionChains(report).scroll_from_origin(ScrollOrigin.from_element(svg), 0, -100).perform()
    assert float(svg.get_dom_attribute("viewBox").split()[2]) < before[2]
    assert report.get_log("browser") == []
