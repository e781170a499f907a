"""What must not matter much: a cloud and its truth, turned, moved, thinned, made worse."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from buildings import Building


def _map_truth(truth: dict[str, Any], plan: Callable[[np.ndarray], np.ndarray], lift: Callable[[float], float]) -> dict:
    """The truth with `plan` applied to all x, y (n, 2) and `lift` to the storeys' floors."""
    truth = copy.deepcopy(truth)

    def moved(line: Any) -> list[float]:
        return plan(np.reshape(line, (-1, 2))).ravel().tolist()

    for storey in truth["storeys"]:
        storey["floor"] = lift(storey["floor"])
        for wall in storey["walls"]:
            wall["p"] = moved(wall["p"])
        storey["jambs"] = [moved(jamb) for jamb in storey["jambs"]]
        for opening in (*storey["doors"], *storey["windows"]):
            opening["line"] = moved(opening["line"])
        for room in storey["rooms"]:
            room["polygon"] = plan(np.array(room["polygon"])).tolist()
        storey["outline"] = plan(np.array(storey["outline"])).tolist()
    return truth


def turn(building: Building, angle: float) -> Building:
    """Turned about z by an angle (radians)."""
    cos, sin = np.cos(angle), np.sin(angle)
    matrix = np.array([[cos, -sin], [sin, cos]])

    def plan(points: np.ndarray) -> np.ndarray:
        return points @ matrix.T

    def all_of(points: np.ndarray) -> np.ndarray:
        return np.column_stack([plan(points[:, :2]), points[:, 2]])

    truth = _map_truth(building.truth, plan, lambda z: z)
    for entry in truth["scans"]:
        entry["position"] = all_of(np.array([entry["position"]]))[0].tolist()
    return replace(building, points=all_of(building.points), positions=all_of(building.positions), truth=truth)
