"""From points to a plan: the same bytes from the same points, and the same plan wherever the building stands."""

from __future__ import annotations

import json
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

import asbuilt
from asbuilt import FloorPlan, ParameterError, Parameters, evidence_from_points, extract_floor_plan
from asbuilt.evaluate import evaluate
from asbuilt.evaluate.result import pool
from rooms import box, box_room, evidence, level, lying_on, noisy, segments, turned, wall, without, write_las

UTM = np.array([512_345.0, 5_403_210.0, 431.0])


def flat() -> np.ndarray:
    """Two furnished rooms with a doorway between them."""
    door = ((4.9, 1.0, 0.02), (5.4, 1.9, 2.05))
    rooms = [without(box_room(0, 0, 5, 4), *door), without(box_room(5.24, 0, 9, 4), *door)]
    frame = [wall((5, y), (5.24, y), 0, 2.05) for y in (1.0, 1.9)] + [level(5, 1, 5.24, 1.9, z) for z in (0, 2.05)]
    return noisy(np.concatenate([*rooms, *frame, box(1, 1.5, 2.4, 2.3, 0.75), box(7, 2.5, 8, 3.4, 0.5)]))


FLAT = flat()
#: The truth of `flat`, as lines (x1, y1, x2, y2) that are each covered from end to end.
WALLS = [
    (0, 0, 5, 0),
    (5, 0, 5, 1),
    (5, 1.9, 5, 4),
    (5, 4, 0, 4),
    (0, 4, 0, 0),
    (5.24, 0, 9, 0),
    (9, 0, 9, 4),
    (9, 4, 5.24, 4),
    (5.24, 4, 5.24, 1.9),
    (5.24, 1, 5.24, 0),
]


def as_bytes(plan: FloorPlan) -> bytes:
    return json.dumps(plan.to_geojson()).encode()


def agrees(found: np.ndarray, truth: list[tuple[float, ...]], aside: float = 0.003, ends: float = 0.006) -> bool:
    """Whether each wall of the truth is one face, and no face is left over."""
    for x1, y1, x2, y2 in truth:
        pieces = lying_on(found, (x1, y1), (x2, y2), aside)
        length = np.hypot(x2 - x1, y2 - y1)
        pieces = pieces[np.minimum(pieces[:, 1], length) - np.maximum(pieces[:, 0], 0) > 0.05]
        if len(pieces) != 1 or np.abs(pieces[0] - (0, length)).max() > ends:
            return False
    return len(found) == len(truth)


@pytest.mark.parametrize("preset", ["default", "paper"])
def test_same_bytes_for_any_threads_and_order_of_files(preset: str, tmp_path: Path) -> None:
    files = [write_las(tmp_path / f"{i}.las", FLAT[i::3]) for i in range(3)]
    parameters = Parameters.preset(preset)
    expected = as_bytes(extract_floor_plan(files, parameters, threads=1))
    for order, threads in zip(list(permutations(files))[1:4], (1, 2, 5), strict=True):
        assert as_bytes(extract_floor_plan(order, parameters, threads=threads)) == expected


def test_the_order_of_points_does_not_matter() -> None:
    shuffled = np.random.default_rng(0).permutation(FLAT)
    assert as_bytes(extract_floor_plan(evidence_from_points(FLAT))) == as_bytes(
        extract_floor_plan(evidence_from_points(shuffled))
    )


def test_a_known_flat() -> None:
    plan = extract_floor_plan(evidence_from_points(FLAT))
    assert agrees(segments(plan), WALLS)
    assert plan.notes == ()
    (storey,) = plan.storeys
    assert storey.floor == pytest.approx(0, abs=0.005)
    # each face has its room on its left
    for face in storey.wall_faces:
        (x1, y1), (x2, y2) = face.start, face.end
        middle = np.array([(x1 + x2) / 2 - (y2 - y1) / face.length / 2, (y1 + y2) / 2 + (x2 - x1) / face.length / 2])
        assert 0 < middle[1] < 4
        assert 0 < middle[0] < 5 or 5.24 < middle[0] < 9


@pytest.mark.parametrize("degrees", [17, 45, 90, 133])
def test_turning_the_cloud_turns_the_plan(degrees: float) -> None:
    found = segments(extract_floor_plan(evidence_from_points(turned(FLAT, degrees)))).reshape(-1, 2)
    back = turned(np.column_stack([found, np.zeros(len(found))]), -degrees)[:, :2]
    assert agrees(back.reshape(-1, 4), WALLS)


@pytest.mark.parametrize(
    "by", [(0.025, 0.025, 0.025), (0.013, -0.031, 0.007), UTM, UTM + 0.678], ids=["half a voxel", "mm", "UTM", "UTM mm"]
)
def test_moving_the_cloud_moves_the_plan(by: np.ndarray) -> None:
    plan = extract_floor_plan(evidence_from_points(FLAT + by))
    assert agrees(segments(plan) - np.tile(np.asarray(by)[:2], 2), WALLS)
    assert plan.storeys[0].floor == pytest.approx(by[2], abs=0.005)


def test_moving_by_whole_voxels_changes_nothing() -> None:
    here, there = (segments(extract_floor_plan(evidence_from_points(FLAT + by))) for by in (0, UTM))
    there -= np.tile(UTM[:2], 2)
    # faces that score alike may change places
    apart = np.abs(there[:, None] - here[None]).max(axis=2)
    assert sorted(apart.argmin(axis=1)) == list(range(len(here)))
    assert apart.min(axis=1).max() < 1e-4


@pytest.mark.parametrize("factor", [0.97, 1.0005, 1.04])
def test_scaling_the_cloud_scales_the_plan(factor: float) -> None:
    found = segments(extract_floor_plan(evidence_from_points(FLAT * factor)))
    assert agrees(found / factor, WALLS)


def test_units_and_up(tmp_path: Path) -> None:
    as_text = tmp_path / "cloud.xyz"
    # y up, millimetres
    np.savetxt(as_text, 1000 * FLAT[::2, [0, 2, 1]] * (1, 1, -1), fmt="%.1f")
    plan = extract_floor_plan(asbuilt.read(as_text, unit="mm", up="y"))
    assert agrees(segments(plan), WALLS)


def test_storeys_keep_their_indices() -> None:
    cloud = evidence(*(box_room(0, 0, width, 4, z, z + 2.6) for width, z in ((5, -2.9), (6, 0), (7, 2.9))))
    every = extract_floor_plan(cloud)
    assert [storey.index for storey in every] == [0, 1, 2]
    for index in range(3):
        (alone,) = extract_floor_plan(cloud, storey=index).storeys
        assert alone == every.storeys[index]
        assert {face.id.split("-")[0] for face in alone.wall_faces} == {f"S{index}"}
    with pytest.raises(ParameterError, match="storey 3: expected 0 to 2"):
        extract_floor_plan(cloud, storey=3)


@pytest.mark.parametrize("preset", ["default", "paper"])
def test_an_empty_result_names_the_stage(preset: str) -> None:
    parameters = Parameters.preset(preset)
    lone = extract_floor_plan(evidence(wall((0, 0), (5, 0))), parameters)
    assert lone.storeys == ()
    assert lone.notes[0].startswith("storeys: ")
    nothing = extract_floor_plan(evidence_from_points(np.zeros((0, 3))), parameters, storey=0)
    assert nothing.notes[0].startswith("storeys: ")
    assert nothing.wall_faces == ()


def test_lines_may_come_up_empty() -> None:
    strict = Parameters.preset("paper").replace(lines={"sigmas": 1000.0})
    plan = extract_floor_plan(evidence_from_points(FLAT), strict)
    assert len(plan.storeys) == 1
    assert plan.notes == ("lines: no line found on storey 0; its ground-plane histogram has no dense cells",)


@pytest.mark.parametrize(
    ("stage", "change"),
    [
        ("lines", {"sigmas": float("nan")}),
        ("lines", {"max_lines": 0}),
        ("lines", {"statistics_over": "some"}),
        ("evidence", {"voxel": float("inf")}),
        ("cross_sections", {"band": (1.0, float("nan"))}),
        ("refine", {"merge_gap": -0.1}),
        ("walls", {"bridge": float("nan")}),
        ("storeys", {"min_area_share": 2.0}),
    ],
)
def test_parameters_out_of_range_are_refused(stage: str, change: dict[str, object]) -> None:
    (name,) = change
    with pytest.raises(ParameterError, match=rf"^{stage}\.{name} = "):
        Parameters().replace(**{stage: change})


@pytest.mark.parametrize(
    ("preset", "stage", "change"),
    [
        ("default", "lines", {"max_lines": 3}),
        ("default", "cross_sections", {"select": "all"}),
        ("default", "storeys", {"slab": 0.0}),
        ("paper", "walls", {"bridge": 3.0}),
        ("paper", "cross_sections", {"band": (0.5, 1.0)}),  # without select
    ],
)
def test_parameters_that_nothing_would_read_are_refused(preset: str, stage: str, change: dict[str, object]) -> None:
    (name,) = change
    with pytest.raises(ParameterError, match=rf"^{stage}\.{name} = "):
        Parameters.preset(preset).replace(**{stage: change})


def test_parameters_of_another_method_come_with_it() -> None:
    changed = Parameters().replace(method="paper", lines={"max_lines": 3})
    assert (changed.method, changed.lines.max_lines) == ("paper", 3)


def test_what_was_not_measured_is_null() -> None:
    evidence = evidence_from_points(FLAT)
    written = [
        feature["properties"]
        for parameters in (Parameters(), Parameters.preset("paper").replace(lines={"sigmas": 0.0}))
        for feature in extract_floor_plan(evidence, parameters).to_geojson()["features"]
    ]
    kinds = {"room": ("seen", "rms"), "door": ("rms",)}
    assert kinds.keys() <= {properties["kind"] for properties in written}
    for properties in written:
        assert all(properties[name] is None for name in kinds.get(properties["kind"], ()))
    confidences = [properties["confidence"] for properties in written if properties["kind"] == "wall_face"]
    assert confidences[0] > 0.5
    assert confidences[-1] is None  # the paper tells none


def test_parameters_are_written_whole() -> None:
    parameters = Parameters().replace(walls={"bridge": 3.0})
    plan = extract_floor_plan(evidence_from_points(FLAT), parameters, crs="EPSG:25832")
    written = plan.to_geojson()
    assert written["asbuilt"]["parameters"] == parameters.as_dict()
    assert written["crs"]["properties"]["name"] == "urn:ogc:def:crs:EPSG::25832"


def test_the_example(example: Path) -> None:
    plan = extract_floor_plan(example / "scans.laz")
    assert plan.notes == ()  # nothing is doubtful
    walls = evaluate(plan, json.loads((example / "truth.json").read_text())).scores.walls["observed"]
    assert walls.f >= 0.90
    assert walls.distance_error <= 0.008


@pytest.mark.slow
@pytest.mark.parametrize("case", ["skewed", "rotunda", "school"])
def test_the_papers_method_reaches_the_papers_figure(case: str, cases: Path) -> None:
    plan = extract_floor_plan(cases / case / "scans.laz", Parameters.preset("paper"))
    truth = json.loads((cases / case / "truth.json").read_text())
    assert pool([evaluate(plan, truth).scores]).walls["all"].f >= 0.66
