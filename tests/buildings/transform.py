"""What must not matter much: a scanned building turned, moved, thinned, made worse. Each gives a new `Building`."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon, contains_xy

from buildings.truth import mark_observed

Array = NDArray[np.float64]
Plan = Callable[[Array], Array]


@dataclass(frozen=True)
class Building:
    """A scanned building: points (n, 3), index of the scan of each, scanner positions (s, 3), and the truth."""

    name: str
    points: Array
    scans: NDArray[np.int32]
    positions: Array
    truth: dict[str, Any]


def load_case(folder: Path) -> Building:
    """A case (`scans.laz`, `truth.json`) as a building."""
    import laspy

    cloud = laspy.read(folder / "scans.laz")
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    positions = np.array([entry["position"] for entry in truth.get("scans", ())]).reshape(-1, 3)
    scans = np.asarray(cloud.point_source_id, dtype=np.int32)
    return Building(folder.name, np.asarray(cloud.xyz, dtype=np.float64), scans, positions, truth)


def moved(building: Building, plan: Plan, lift: Callable[[Any], Any], stretch: float = 1.0) -> Building:
    """`plan` applied to all x, y (n, 2) and `lift` to all heights; `stretch` is what this does to lengths."""

    def all_of(points: Array) -> Array:
        return np.column_stack([plan(points[:, :2]), lift(points[:, 2])])

    truth = copy.deepcopy(building.truth)
    for entry in truth.get("scans", ()):
        entry["position"] = all_of(np.array([entry["position"]]))[0].tolist()
    for storey in truth["storeys"]:
        storey["floor"] = float(lift(storey["floor"]))
        _move_storey(storey, plan, stretch)
    return replace(building, points=all_of(building.points), positions=all_of(building.positions), truth=truth)


def _move_storey(storey: dict[str, Any], plan: Plan, stretch: float = 1.0) -> None:
    def line(values: Any) -> list[float]:
        return plan(np.reshape(values, (-1, 2)).astype(float)).ravel().tolist()

    storey["height"] *= stretch
    for wall in storey["walls"]:
        wall["p"] = line(wall["p"])
    storey["jambs"] = [line(jamb) for jamb in storey.get("jambs", ())]
    for opening in (*storey.get("doors", ()), *storey.get("windows", ())):
        opening["line"] = line(opening["line"])
        opening["width"] *= stretch
    for room in storey.get("rooms", ()):
        room["polygon"] = np.reshape(line(room["polygon"]), (-1, 2)).tolist()
        room["area"] *= stretch**2
    for part in (*storey.get("columns", ()), *storey.get("stairs", ())):
        part["polygon"] = np.reshape(line(part["polygon"]), (-1, 2)).tolist()
    for stair in storey.get("stairs", ()):
        stair["up"] = line(stair["up"])
    if storey.get("outline"):
        storey["outline"] = np.reshape(line(storey["outline"]), (-1, 2)).tolist()


def turn(building: Building, angle: float) -> Building:
    """Turned about z by an angle (radians)."""
    cos, sin = np.cos(angle), np.sin(angle)
    matrix = np.array([[cos, sin], [-sin, cos]])
    return moved(building, lambda points: points @ matrix, lambda z: z)


def to_utm(building: Building) -> Building:
    """Survey coordinates: hundreds and thousands of kilometres from the origin."""
    return shift(building, 512_345.678, 5_403_210.987, 431.25)


def shift(building: Building, x: float = 0.025, y: float = 0.025, z: float = 0.025) -> Building:
    """Moved; by half a voxel of 5 cm each way unless said otherwise."""
    return moved(building, lambda points: points + np.array([x, y]), lambda height: height + z)


def scale(building: Building, factor: float = 1.0005) -> Building:
    """Scaled, as by a total station with a wrong prism constant."""
    return moved(building, lambda points: points * factor, lambda z: z * factor, factor)


def tilt(building: Building, degrees: float = 0.5) -> Building:
    """The points leaned about the middle of the lowest storey; the truth is the cut at half height of each storey."""
    truth = copy.deepcopy(building.truth)
    angle = np.radians(degrees)
    middle = [storey["floor"] + storey["height"] / 2 for storey in truth["storeys"]]
    centre = np.append(np.median(building.points[:, :2], axis=0), middle[0])
    matrix = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    for storey, height in zip(truth["storeys"], middle, strict=True):
        lean = np.array([0.0, -(height - centre[2]) * np.sin(angle)])

        def plan(points: Array, lean: Array = lean) -> Array:
            return (points - centre[:2]) * (1, np.cos(angle)) + centre[:2] + lean

        _move_storey(storey, plan)
    points, positions = ((part - centre) @ matrix.T + centre for part in (building.points, building.positions))
    for entry, position in zip(truth.get("scans", ()), positions, strict=True):
        entry["position"] = position.tolist()
    return replace(building, points=points, positions=positions, truth=truth)


def thin(building: Building, share: float = 0.1, seed: int = 1) -> Building:
    """A random share of the points."""
    return _kept(building, np.random.default_rng(seed).random(len(building.points)) < share)


def add_noise(building: Building, sigma: float = 0.01, seed: int = 2) -> Building:
    """Normal noise on every coordinate, m."""
    noise = np.random.default_rng(seed).normal(0, sigma, building.points.shape)
    return replace(building, points=building.points + noise)


def without_ceilings(building: Building, margin: float = 0.15) -> Building:
    """Without the points within `margin` of each room's ceiling, or above it up to the storey's height."""
    points = building.points
    gone = np.zeros(len(points), dtype=bool)
    for storey in building.truth["storeys"]:
        for room in storey["rooms"]:
            if room["ceiling"] is None:
                continue
            low, high = storey["floor"] + room["ceiling"] - margin, storey["floor"] + storey["height"] + 0.1
            # the faces' own points lie a few millimetres outside of the ring
            ring = Polygon(room["polygon"]).buffer(0.05)
            x0, y0, x1, y1 = ring.bounds
            x, y, z = points.T
            near = np.flatnonzero((z > low) & (z < high) & (x > x0) & (x < x1) & (y > y0) & (y < y1) & ~gone)
            gone[near[contains_xy(ring, points[near, 0], points[near, 1])]] = True
    return _kept(building, ~gone)


def add_strays(building: Building, share: float = 0.002, reach: float = 1000.0, seed: int = 3) -> Building:
    """Stray points up to a kilometre away, every which way."""
    rng = np.random.default_rng(seed)
    count = round(share * len(building.points))
    strays = building.points.mean(axis=0) + rng.uniform(-reach, reach, (count, 3))
    scans = rng.choice(building.scans, count)
    return replace(
        building, points=np.concatenate([building.points, strays]), scans=np.concatenate([building.scans, scans])
    )


def add_storey(building: Building, angle: float = 0.6) -> Building:
    """The building again on top of itself, turned a little: a second storey with other walls."""
    storeys = building.truth["storeys"]
    rise = storeys[-1]["floor"] + storeys[-1]["height"] + 0.35 - storeys[0]["floor"]
    middle = np.median(building.points[:, :2], axis=0)
    upper = moved(building, lambda points: points - middle, lambda z: z + rise)
    upper = moved(turn(upper, angle), lambda points: points + middle, lambda z: z)
    first = int(building.scans.max()) + 1
    # an upper storey has no garden: what was seen through its windows at ground level is left out
    ground = upper.points[:, 2] > upper.truth["storeys"][0]["floor"] - 0.1
    upper = _kept(upper, ground)
    below = _kept(building, building.points[:, 2] < storeys[0]["floor"] + rise - 0.12)
    entries = [
        {**entry, "id": entry["id"] + first, "storey": entry["storey"] + len(storeys)}
        for entry in upper.truth.get("scans", ())
    ]
    truth = {
        **building.truth,
        "scans": [*building.truth.get("scans", ()), *entries],
        "storeys": [*storeys, *upper.truth["storeys"]],
    }
    return Building(
        building.name,
        np.concatenate([below.points, upper.points]),
        np.concatenate([below.scans, upper.scans + first]),
        np.concatenate([building.positions, upper.positions]),
        truth,
    )


def one_scan_per_room(building: Building) -> Building:
    """The first scan of each room alone, and the truth marked again by what it still shows."""
    rooms: dict[Any, int] = {}
    entries = building.truth["scans"]
    told = any("room" in entry for entry in entries)
    for entry in entries:
        if told and "room" not in entry:
            continue  # a scan from outside
        room = entry["room"] if told else entry["id"] // 5  # a truth that does not say the room: one scan in five
        rooms.setdefault((entry["storey"], room), entry["id"])
    kept = _kept(building, np.isin(building.scans, list(rooms.values())))
    truth = copy.deepcopy(building.truth)
    mark_observed(kept.points, truth)
    return replace(kept, truth=truth)


def _kept(building: Building, keep: NDArray[np.bool_]) -> Building:
    return replace(building, points=building.points[keep], scans=building.scans[keep])


#: The changes under which F may fall by 0.02 and E_D rise by half; with one scan per room F by 0.05, whatever E_D does.
TRANSFORMS: dict[str, Callable[[Building], Building]] = {
    "turned by 17 degrees": lambda building: turn(building, np.radians(17.0)),
    "turned by 45 degrees": lambda building: turn(building, np.radians(45.0)),
    "in UTM": to_utm,
    "a tenth of the points": thin,
    "10 mm more noise": add_noise,
    "without ceilings": without_ceilings,
    "strays to 1 km": add_strays,
    "a second storey": add_storey,
    "half a voxel": shift,
    "tilted by 0.5 degrees": tilt,
    "scaled by 1.0005": scale,
    "one scan per room": one_scan_per_room,
}
#: Buildings that are small enough for tests.
SMALL = ("flat", "small_house", "niedriha", "fzk_haus", "flat-0", "oldtown-4")
