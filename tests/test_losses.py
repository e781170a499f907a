"""The experiment on losses names the cause of each by its rules, on plans of one room that are wrong in a known way."""

import importlib
import sys
from pathlib import Path

import pytest

from asbuilt.plan import FloorPlan, Storey, WallFace

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "experiments"))

losses = importlib.import_module("12_losses")

SIDES = [((0, 0), (6, 0)), ((6, 0), (6, 4)), ((6, 4), (0, 4)), ((0, 4), (0, 0))]
SCREEN = [((1, 2), (4, 2)), ((4, 2.05), (1, 2.05))]


def truth(*more, scans=1, doors=()):
    """A room of 6 by 4 m, more faces within it, and a scan in it."""
    walls = [{"p": [*a, *b], "side": "interior", "observed": 1.0} for a, b in (*SIDES, *more)]
    corners = [[x, y] for (x, y), _ in SIDES]
    room = {"polygon": [*corners, corners[0]], "kind": "office", "area": 24.0, "ceiling": 3.0}
    storey = {"floor": 0.0, "height": 3.0, "walls": walls, "jambs": [], "doors": list(doors), "windows": []}
    standing = [{"id": 0, "position": [3, 2, 1.5], "storey": 0, "room": 0 if scans else 1, "points": 1}]
    return {"scans": standing, "storeys": [{**storey, "rooms": [room], "outline": [*corners, corners[0]]}]}


def lost(faces, known):
    """Length, m, by cause and whether it was missed."""
    drawn = tuple(WallFace(a, b, id=f"S0-F{i}") for i, (a, b) in enumerate(faces))
    found = losses.losses_of(FloorPlan((Storey(0, 0.0, 3.0, wall_faces=drawn),)), known)
    return {(loss.missed, loss.cause): pytest.approx(loss.length, abs=0.01) for loss in found}


def test_a_perfect_plan_loses_nothing():
    assert lost(SIDES, truth()) == {}


def test_a_side_that_was_seen_and_one_of_a_room_without_scan():
    assert lost(SIDES[1:], truth()) == {(True, "seen and not drawn"): 6.0}
    assert lost(SIDES[1:], truth(scans=0)) == {(True, "room not scanned"): 6.0}


def test_a_short_end_is_a_corner_and_a_short_face_a_return():
    assert lost([((0.3, 0), (6, 0)), *SIDES[1:]], truth()) == {(True, "corner short"): 0.3}
    assert lost([((-0.3, 0), (6, 0)), *SIDES[1:]], truth()) == {(False, "corner long"): 0.3}
    assert lost(SIDES, truth(((2, 1), (2.4, 1)))) == {(True, "short return"): 0.4}


def test_a_screen_of_which_one_face_is_drawn_or_none():
    assert lost([*SIDES, SCREEN[0]], truth(*SCREEN)) == {(True, "thin wall merged"): 3.0}
    assert lost(SIDES, truth(*SCREEN)) == {(True, "partition not drawn"): 3.0}


def test_false_faces_by_where_they_stand():
    inside, outside = ((2, 2), (3, 2)), ((8, 0), (8, 2))
    assert lost([*SIDES, inside, outside], truth()) == {(False, "clutter taken for wall"): 1.0, (False, "ghost"): 2.0}
    door = {"line": [2, 2, 3, 2], "width": 1.0, "closed": False}
    assert lost([*SIDES, inside], truth(doors=[door])) == {(False, "lintel"): 1.0}


def test_losses_beside_each_other_are_one_place_and_the_longest_comes_first():
    found = losses.losses_of(FloorPlan((Storey(0, 0.0, 3.0, wall_faces=()),)), truth(*SCREEN))
    first, second = losses.places(found)
    assert [len(first), len(second)] == [4, 2]
    assert losses.causes(second) == "partition not drawn (missed, 6.00 m)"
