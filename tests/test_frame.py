"""A cloud that lies on its side or counts in feet or millimetres is told from one that stands and counts in metres."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import asbuilt
import buildings
from asbuilt import InputError, evidence_from_points, extract_floor_plan
from asbuilt.frame import check_upright, doubt_extent, doubt_head, doubt_unit, find_upward
from asbuilt.plan import Door, Storey, Window
from asbuilt.read import UP_AXES
from buildings import Scanner
from rooms import box, box_room, level, noisy, wall, without, write_las

Array = NDArray[np.float64]

#: From z up to another axis up, as files have it: z of the building becomes that axis of the cloud.
LYING = {
    "y": np.array([(1, 0, 0), (0, 0, -1), (0, 1, 0)]),
    "-y": np.array([(1, 0, 0), (0, 0, 1), (0, -1, 0)]),
    "x": np.array([(0, 1, 0), (0, 0, 1), (1, 0, 0)]),
}


def flat(furnished: bool = True) -> Array:
    """Six rooms, tables in them if they are furnished, and doorways between."""
    parted = ((0.0, 3.5), (4.1, 5.0), (8.2, 2.5))
    corners = [(x, *y) for x, cut in parted for y in ((0.0, cut), (cut + 0.1, 8.0))]
    rooms = [box_room(x, low, x + 4, high) for x, low, high in corners]
    points = np.concatenate([*rooms, *(box(x + 1, y + 1, x + 2.2, y + 1.8, 0.75) for x, y, _ in corners if furnished)])
    for x in (3.9, 8.0):
        for y in (1.0, 5.6):
            points = without(points, (x, y, 0.01), (x + 0.3, y + 0.9, 2.05))
            frame = [wall((x + 0.1, side), (x + 0.2, side), 0, 2.05) for side in (y, y + 0.9)]
            points = np.concatenate([points, *frame, level(x + 0.1, y, x + 0.2, y + 0.9, 2.05)])
    return noisy(points)


FLAT = flat()[::3]


@pytest.mark.parametrize("axis", LYING)
def test_a_building_on_its_side_is_refused_with_the_axis_that_is_up(axis: str) -> None:
    lying = evidence_from_points(FLAT @ LYING[axis])
    upward = find_upward(lying)
    assert upward is not None
    assert (upward.axis, upward.certain) == (axis, True)
    with pytest.raises(InputError, match=rf"face {axis[-1]}.*--up {axis} .*--up z"):
        check_upright(lying)
    assert any(note.startswith("up: ") for note in extract_floor_plan(lying).notes)


@pytest.mark.parametrize("said", ["z", "-z", "x", "-x"])
def test_advice_names_the_axis_of_the_files_whatever_was_said_first(said: str, tmp_path: Path) -> None:
    scan = write_las(tmp_path / "lying.las", FLAT @ LYING["-y"])
    upward = find_upward(asbuilt.gather_evidence(asbuilt.read(scan, up=said)))
    assert (upward.axis, upward.instead) == ("-y", said)
    assert find_upward(asbuilt.gather_evidence(asbuilt.read(scan, up=upward.axis))) is None


def test_a_building_on_its_head_is_told_by_doors_that_hang_from_the_ceiling() -> None:
    def said(*doors: Door, up: str = "z", sill: float = 0.6, ceiling: float = 2.65) -> str | None:
        windows = [Window((0, 0), (width, 0), sill=sill, head=2.65) for width in (0.9, 1.8)]
        nothing = evidence_from_points(np.zeros((0, 3)))
        storey = Storey(0, 0.0, ceiling, windows=tuple(windows), doors=doors)
        return doubt_head(replace(nothing, axes=UP_AXES[up]), [storey])

    assert said().endswith("--up -z")
    assert said(up="-y").endswith("--up y")
    assert said(Door((0, 0), (0.9, 0), head=2.05)) is None
    assert said(sill=1.2) is None
    assert said(ceiling=3.0) is None


def test_no_building_that_stands_is_doubted() -> None:
    for seed in (0, 1, 3):
        made = buildings.generate(seed, scanner=Scanner(step_deg=2.5))
        evidence = evidence_from_points(made.points)
        assert find_upward(evidence) is None, made.name
        assert find_upward(evidence_from_points(made.points @ LYING["y"])).certain, made.name


@pytest.mark.parametrize(
    "points",
    [
        pytest.param(box_room(0, 0, 5, 4), id="single room"),
        pytest.param(box_room(0, 0, 40, 25, 0, 12), id="industrial hall"),
        pytest.param(box_room(0, 0, 2.5, 2.5, 0, 15), id="shaft"),
        pytest.param(np.concatenate([wall((0, 0), (30, 0), 0, 12), level(0, -8, 30, 0, 0)]), id="facade"),
        pytest.param(box_room(0, 0, 25, 2.2, 0, 2.8), id="corridor"),
        pytest.param(without(box_room(0, 0, 60, 3, 0, 12), (-1, -1, 11.9), (61, 4, 13)), id="lane"),
        pytest.param(np.zeros((0, 3)), id="nothing"),
    ],
)
def test_what_else_stands_is_never_refused(points: Array) -> None:
    check_upright(evidence_from_points(points))


def test_strays_far_away_hide_no_floor() -> None:
    strays = np.random.default_rng(0).uniform(-2000, 2000, (500, 3))
    lying = evidence_from_points(np.concatenate([FLAT @ LYING["y"], strays]))
    assert find_upward(lying).certain
    assert find_upward(evidence_from_points(np.concatenate([FLAT, strays]))) is None


@pytest.mark.parametrize(
    ("unit", "factor", "every"), [("ft", 1 / 0.3048, 1), ("mm", 1000.0, 20), ("in", 1 / 0.0254, 20)]
)
def test_a_cloud_in_another_unit_is_told_with_the_option_that_reads_it(unit: str, factor: float, every: int) -> None:
    plan = extract_floor_plan(evidence_from_points(flat(furnished=False)[::every] * factor))
    (note,) = (note for note in plan.notes if note.startswith("unit: "))
    assert f"--unit {unit}" in note


def test_heights_of_rooms_and_doors_are_looked_at_together() -> None:
    def storey(height: float, *heads: float) -> Storey:
        return Storey(0, 0.0, height, doors=tuple(Door((0, 0), (1, 0), head=head) for head in heads))

    assert doubt_unit([]) is None
    assert doubt_unit([storey(2.6, 2.05)]) is None
    assert doubt_unit([storey(5.9)]) is None
    assert doubt_unit([storey(12.0, 2.1, 2.1, 4.5)]) is None  # a hall: doors, and a gate
    assert doubt_unit([storey(2.6, 2.05), storey(8.0)]) is None  # a house with a high hall
    assert "--unit ft" in doubt_unit([storey(8.5, 6.8, 6.9), storey(1.6)])
    assert "--unit ft" in doubt_unit([storey(8.5)])
    assert "--unit dm" in doubt_unit([storey(26.0, 20.5)])


def test_the_height_of_a_cloud_without_storeys() -> None:
    def said(height: float) -> str | None:
        return doubt_extent(evidence_from_points(np.array([[0, 0, z] for z in np.linspace(0, height, 2000)])))

    assert said(12.0) is None
    assert "--unit mm" in said(2600.0)
    assert "--unit in" in said(120.0)
    assert "larger unit" in said(0.01)
    assert doubt_extent(evidence_from_points(np.zeros((0, 3)))) is None


def test_plan_refuses_what_lies_unless_told_which_axis_is_up(run, tmp_path: Path) -> None:
    scan = write_las(tmp_path / "lying.las", FLAT @ LYING["y"])
    code, out, err = run("plan", scan, "-o", tmp_path / "plan.geojson")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "--up y" in err
    assert not (tmp_path / "plan.geojson").exists()
    assert run("plan", scan, "-o", tmp_path / "plan.geojson", "--up", "y")[:1] == (0,)
    assert len(asbuilt.load_plan(tmp_path / "plan.geojson").storeys[0].rooms) == 6
    code, _, err = run("plan", scan, "-o", tmp_path / "again.geojson", "--up", "z")
    assert code in (0, 1)
    assert "asbuilt: note: up: " in err
    assert "asbuilt: note: up: " in run("info", scan)[2]
