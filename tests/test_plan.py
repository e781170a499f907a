from __future__ import annotations

import json
import math

import pytest

from asbuilt.plan import Column, Element, plan_from_geojson
from plans import complete_plan


def test_everything_comes_back_from_geojson() -> None:
    plan = complete_plan()
    assert plan_from_geojson(json.loads(json.dumps(plan.to_geojson()))) == plan


def test_features_carry_what_can_be_worked_out() -> None:
    features = complete_plan().to_geojson()["features"]
    room = next(f["properties"] for f in features if f["properties"]["kind"] == "room")
    assert room["area"] == pytest.approx(3.95 * 5.0)
    assert room["perimeter"] == pytest.approx(2 * (3.95 + 5.0))
    assert room["height"] == pytest.approx(2.5)
    door = next(f["properties"] for f in features if f["properties"]["kind"] == "door")
    assert door["width"] == pytest.approx(0.9)
    assert door["loa"] == "LOA40"  # 1.96 times 2 mm


def test_no_level_of_accuracy_without_a_sigma() -> None:
    assert Element().loa is None


@pytest.mark.parametrize("shape", ["square", "round"])
def test_a_column_stands_about_its_centre(shape: str) -> None:
    column = Column((3.0, 4.0), 0.4, 0.4, shape, 0.3)
    reach = max(math.dist(column.centre, corner) for corner in column.ring)
    assert reach == pytest.approx(0.2 if shape == "round" else 0.2 * 2**0.5)
