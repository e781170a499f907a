"""The truth of a building in the form of the cases' `truth.json`, and how much of each face the points show."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from shapely import LineString, Point, Polygon

from buildings.model import Storey, edges
from buildings.scene import spans

Array = NDArray[np.float64]
PIECE = 0.1  # m of a face that is observed or not as a whole
NEAR = 0.03  # m from the face to its points
ENOUGH = 3  # points


def storey_truth(storey: Storey) -> dict[str, Any]:
    """A storey as `truth.json` has it, `observed` not yet known."""
    walls = []
    for side, polygon in [("exterior", storey.footprint), *(("interior", room.polygon) for room in storey.rooms)]:
        for edge in edges(polygon):
            walls += [{"p": p, "side": side, "observed": 0.0} for p in _faces(edge, storey)]
    openings = storey.openings
    return {
        "floor": storey.floor,
        "height": storey.height,
        "walls": walls,
        "jambs": [[*a, *b] for o in openings if o.is_doorway for a, b in o.jambs],
        "doors": [
            {"line": [*o.line[0], *o.line[1]], "width": o.width, "closed": o.closed} for o in openings if o.is_doorway
        ],
        "windows": [
            {"line": [*o.line[0], *o.line[1]], "width": o.width, "sill": o.sill, "head": o.head}
            for o in openings
            if not o.is_doorway
        ],
        "rooms": [
            {
                "kind": room.kind,
                "area": float(room.polygon.area),
                "ceiling": room.ceiling,
                "polygon": np.asarray(room.polygon.exterior.coords).tolist(),
            }
            for room in storey.rooms
        ],
        "outline": np.asarray(storey.footprint.exterior.coords).tolist(),
        # Beyond the cases' form: rings of what stands free from floor to ceiling.
        "columns": [
            {"polygon": np.asarray(ring.exterior.coords).tolist(), "round": is_round}
            for ring, is_round in storey.columns
        ],
        "stairs": [],
    }


def flight_truth(above: Storey) -> list[dict[str, Any]]:
    """The flight that leads up to a storey, as its storey below has it; `up` runs along its middle."""
    if above.stairwell is None:
        return []
    x0, y0, x1, y1 = above.stairwell.bounds
    ring = np.asarray(above.stairwell.exterior.coords).tolist()
    return [{"polygon": ring, "up": [x0, (y0 + y1) / 2, x1, (y0 + y1) / 2]}]


def _faces(edge: Array, storey: Storey) -> list[list[float]]:
    """The faces along an edge: doorways interrupt them, windows do not, be they as low as the floor."""
    faces: list[list[float]] = []
    joined = False
    for a, b, opening in spans(edge, storey.openings):
        if opening is not None and opening.is_doorway:
            joined = False
        elif joined:
            faces[-1][2:] = [float(b[0]), float(b[1])]
        else:
            faces.append([float(a[0]), float(a[1]), float(b[0]), float(b[1])])
            joined = True
    # where a doorway ends at the end of a chord nothing but a crumb is left of it
    return [face for face in faces if np.hypot(face[2] - face[0], face[3] - face[1]) > 0.002]


def mark_observed(points: Array, truth: dict[str, Any]) -> None:
    """Set `observed` of each face: the share of its 10 cm pieces with three points or more within 3 cm.

    Points near the floor and near the ceiling of the face's room do not count: they show the floor or the ceiling.
    """
    for storey in truth["storeys"]:
        low, high = storey["floor"] + 0.4, storey["floor"] + storey["height"] - 0.06
        here = points[(points[:, 2] > low) & (points[:, 2] < high)]
        grid = _Grid(here)
        rooms = [(Polygon(room["polygon"]).boundary, room["ceiling"]) for room in storey["rooms"]]
        for wall in storey["walls"]:
            face = np.array(wall["p"])
            middle = Point((face[:2] + face[2:]) / 2)
            top = next((c for ring, c in rooms if c is not None and ring.distance(middle) < 0.002), None)
            near = grid.near(face)
            if wall["side"] == "interior" and top is not None:
                near = near[near[:, 2] < storey["floor"] + top - 0.06]
            wall["observed"] = _share(near, face)


def _share(points: Array, face: Array) -> float:
    step = face[2:] - face[:2]
    length = float(np.hypot(*step))
    along = (points[:, :2] - face[:2]) @ step / length
    across = np.abs((points[:, 0] - face[0]) * step[1] - (points[:, 1] - face[1]) * step[0]) / length
    close = along[(across <= NEAR) & (along >= 0) & (along < length)]
    pieces = max(1, round(length / PIECE))
    counts = np.bincount(np.minimum((close / length * pieces).astype(int), pieces - 1), minlength=pieces)
    return float((counts >= ENOUGH).mean())


class _Grid:
    """Points sorted into cells of the plan, so that a face looks at those near it alone."""

    cell = 0.5

    def __init__(self, points: Array) -> None:
        index = np.floor(points[:, :2] / self.cell).astype(np.int64)
        self.low = index.min(axis=0, initial=0)
        index -= self.low
        self.width = int(index[:, 1].max(initial=0)) + 3
        key = index[:, 0] * self.width + index[:, 1]
        order = np.argsort(key, kind="stable")
        self.points, self.key = points[order], key[order]

    def near(self, face: Array) -> Array:
        """Points in all cells within 3 cm of the face."""
        line = LineString([face[:2], face[2:]])
        count = int(line.length / 0.1) + 2
        at = np.linspace(face[:2], face[2:], count)
        cells = {
            (int(x), int(y))
            for shift in np.array([[-NEAR, -NEAR], [-NEAR, NEAR], [NEAR, -NEAR], [NEAR, NEAR]])
            for x, y in np.floor((at + shift) / self.cell).astype(np.int64) - self.low
        }
        keys = np.array(sorted(x * self.width + y for x, y in cells if x >= 0 and 0 <= y < self.width), dtype=np.int64)
        starts, ends = np.searchsorted(self.key, keys), np.searchsorted(self.key, keys, side="right")
        parts = [self.points[a:b] for a, b in zip(starts, ends, strict=True)]
        return np.concatenate(parts) if parts else self.points[:0]
