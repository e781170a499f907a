"""Any file at all is a plan or an error of one line."""

from __future__ import annotations

import copy
import dataclasses
import json
import re

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from asbuilt import FloorPlan, InputError, load_plan
from asbuilt.evaluate import read_drawing
from asbuilt.plan import plan_from_geojson
from plans import complete_plan

ANY_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=5,
)
WHOLE = complete_plan().to_geojson()
BOUNDED = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def places(value, path=()):
    """The path to each value within JSON."""
    yield path
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from places(inner, (*path, key))


PLACES = list(places(WHOLE))[1:]


def read(content: str | bytes, tmp_path) -> FloorPlan | None:
    """The plan; None where the file was refused, in one line that names it."""
    path = tmp_path / "plan.geojson"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    try:
        plan = load_plan(path)
    except InputError as refused:
        told = str(refused)
    else:
        # what was taken for a plan is one: it can be worked with, and written again
        assert plan_from_geojson(json.loads(json.dumps(plan.to_geojson(), allow_nan=False))) == plan
        return plan
    assert told.startswith(f"{path}: ")
    assert "\n" not in told
    assert len(told) < len(str(path)) + 300
    return None


@given(ANY_JSON)
@BOUNDED
def test_any_json(tmp_path, value):
    read(json.dumps(value), tmp_path)


@given(st.binary(max_size=60))
@BOUNDED
def test_any_bytes(tmp_path, content):
    read(content, tmp_path)


@given(st.sampled_from(PLACES), ANY_JSON)
@BOUNDED
def test_a_plan_with_one_value_changed(tmp_path, place, value):
    changed = copy.deepcopy(WHOLE)
    *way, last = place
    inner = changed
    for key in way:
        inner = inner[key]
    inner[last] = value
    read(json.dumps(changed), tmp_path)


@given(st.sampled_from(PLACES))
@BOUNDED
def test_a_plan_with_one_value_missing(tmp_path, place):
    changed = copy.deepcopy(WHOLE)
    *way, last = place
    inner = changed
    for key in way:
        inner = inner[key]
    del inner[last]
    read(json.dumps(changed), tmp_path)


@given(st.integers(0, len(json.dumps(WHOLE)) - 1))
@settings(BOUNDED, max_examples=20)
def test_a_plan_cut_short(tmp_path, end):
    assert read(json.dumps(WHOLE)[:end], tmp_path) is None


@pytest.mark.parametrize(
    ("kind", "name", "value"),
    [("wall", "thickness", "thick"), ("wall", "thickness", float("nan")), ("door", "state", "ajar"),
     ("room", "scans", [1]), ("column", "centre", [1.0]), ("storey", "floor", None), ("storey", "floor", True),
     ("wall", "voxels", 1.5),
     ("wall", "thickness", 10**400),
     ("wall", "outline", [[0, 0], [1, 1]]), ("wall", "outline", [[0, 0], [1, 1], [1, 0], [0, 1]])],
)  # fmt: skip
def test_what_no_plan_of_ours_says_is_refused(kind, name, value, tmp_path):
    changed = copy.deepcopy(WHOLE)
    next(f["properties"] for f in changed["features"] if f["properties"]["kind"] == kind)[name] = value
    path = tmp_path / "plan.geojson"
    path.write_text(json.dumps(changed))
    with pytest.raises(InputError, match=r"expected a plan that asbuilt wrote as \.geojson, .* in feature \d+;"):
        load_plan(path)


def test_a_file_of_bytes_is_not_recited(tmp_path):
    assert read(b"LASF" + bytes(range(256)) * 1000, tmp_path) is None
    assert read(json.dumps({**WHOLE, "features": ["long" * 1000]}), tmp_path) is None


def test_deep_nesting_and_empty_rings_are_refused(tmp_path):
    assert read("[" * 100_000 + "]" * 100_000, tmp_path) is None
    changed = copy.deepcopy(WHOLE)
    room = next(f for f in changed["features"] if f["properties"]["kind"] == "room")
    room["geometry"]["coordinates"] = [[]]
    assert read(json.dumps(changed), tmp_path) is None


def test_numbers_that_are_whole_and_members_that_are_new_are_taken(tmp_path):
    changed = copy.deepcopy(WHOLE)
    wall = next(f for f in changed["features"] if f["properties"]["kind"] == "wall")
    wall["properties"] |= {"thickness": 1, "of_a_later_version": {"x": 1}}
    plan = read(json.dumps(changed), tmp_path)
    assert plan.storeys[0].walls[0] == dataclasses.replace(complete_plan().storeys[0].walls[0], thickness=1)


@pytest.mark.parametrize(
    ("content", "found"),
    [
        ("", "an empty file"),
        ("[1]", "JSON without features"),
        ('{"type": "FeatureCollection"}', "JSON without features"),
        ('{"features": [{"properties": {"kind": "wall"}}]}', "nothing called 'geometry' in feature 1"),
        ('{"features": [{"properties": null, "geometry": null}]}', "a value of another kind in feature 1"),
        ('{"features": [1', "no JSON from line 1, column 16 on"),
        (b"\xff\xfe{", "bytes that are no text in UTF-8"),
        ("[" * 100_000, "lists within lists that do not end"),
        (f'{{"a": {"1" * 5000}}}', "a number that is too large"),
    ],
    ids=lambda part: repr(part[:20]),
)
def test_a_broken_file_is_told_in_the_words_of_who_has_it(content, found, tmp_path):
    path = tmp_path / "plan.geojson"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError) as told:
        load_plan(path)
    assert str(told.value) == (
        f"{path}: expected a plan that asbuilt wrote as .geojson, found {found}; asbuilt plan writes one anew"
    )
    with pytest.raises(InputError) as scored:
        read_drawing(path)
    assert not re.search(r"Error|codec|object|Expecting|NoneType", str(scored.value))
