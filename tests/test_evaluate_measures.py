"""The measures: hand-worked examples to 1e-9, and the properties that hold for any plan."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asbuilt.evaluate import associate, measure_walls

EXACT = 1e-9
seeds = st.integers(0, 2**32 - 1)


def score(detected, truth, in_use=None, curves=None, **limits):
    detected = np.array(detected, dtype=float).reshape(-1, 4)
    truth = np.array(truth, dtype=float).reshape(-1, 4)
    return measure_walls(associate(detected, truth, **limits), detected, truth, in_use, curves)


def figures(totals, without=()):
    names = (
        "precision",
        "recall",
        "f",
        "distance_error",
        "orientation_error_deg",
        "over_segmentation",
        "overlap",
        "within_15mm",
    )
    return {name: getattr(totals, name) for name in names if name not in without}


def exactly(value):
    return pytest.approx(value, abs=EXACT, rel=0)


# --- hand-worked examples ---------------------------------------------------------------------------------------


def test_overhang():
    totals = score([[-1, 0.1, 3, 0.1]], [[0, 0, 4, 0]])
    assert totals.precision == exactly(0.75)
    assert totals.recall == exactly(0.75)
    assert totals.f == exactly(0.75)
    assert totals.distance_error == exactly(0.1)
    assert totals.orientation_error_deg == exactly(0)
    assert totals.over_segmentation == exactly(0)
    assert totals.overlap == exactly(0)
    assert totals.within_15mm == exactly(0)


def test_one_detection_over_two_faces():
    totals = score([[0, 0.05, 5, 0.05]], [[0, 0, 2, 0], [2, 0.2, 5, 0.2]])
    assert (totals.precision, totals.recall) == (exactly(1), exactly(1))
    assert totals.distance_error == exactly((2 * 0.05 + 3 * 0.15) / 5)
    assert totals.over_segmentation == exactly(0)


def test_overlap():
    totals = score([[0, 0.01, 6, 0.01], [4, -0.02, 10, -0.02]], [[0, 0, 10, 0]])
    assert (totals.precision, totals.recall) == (exactly(1), exactly(1))
    assert totals.distance_error == exactly(0.015)
    assert totals.overlap == exactly(2 / 12)
    assert totals.over_segmentation == exactly(1)
    assert totals.within_15mm == exactly(0.5)


def test_truth_covered_three_times_counts_once_for_recall_and_once_for_overlap():
    totals = score([[0, 0.01, 4, 0.01]] * 3, [[0, 0, 8, 0]])
    assert totals.recall == exactly(0.5)
    assert totals.overlap == exactly(4 / 12)
    assert totals.over_segmentation == exactly(2)


def test_two_parallel_faces_ten_centimetres_apart():
    truth = [[0, 0, 5, 0], [5, 0.1, 0, 0.1]]
    both = score([[0, 0.03, 5, 0.03], [0, 0.08, 5, 0.08]], truth)
    assert (both.precision, both.recall) == (exactly(1), exactly(1))
    assert both.distance_error == exactly(0.025)
    merged = score([[0, 0.05, 5, 0.05]], truth)
    assert (merged.precision, merged.recall) == (exactly(1), exactly(0.5))
    assert merged.f == exactly(2 / 3)


def test_crossing_segment():
    totals = score([[1, -0.1, 3, 0.2]], [[0, 0, 4, 0]])
    assert totals.precision == exactly(1)
    assert totals.recall == exactly(0.5)
    assert totals.distance_error == exactly(1 / 12)
    assert totals.orientation_error_deg == exactly(math.degrees(math.atan2(0.3, 2)))
    assert totals.within_15mm == exactly(0.1)  # 3 cm of the 30 that it climbs
    assert totals.detected_length == exactly(math.hypot(2, 0.3))


def test_orientation_is_weighted_by_length():
    totals = score([[0, 0, 3, 0.03], [4, 0, 5, 0.02]], [[0, 0, 8, 0]])
    lengths = math.hypot(3, 0.03), math.hypot(1, 0.02)
    angles = math.degrees(math.atan(0.01)), math.degrees(math.atan(0.02))
    expected = (lengths[0] * angles[0] + lengths[1] * angles[1]) / sum(lengths)
    assert totals.orientation_error_deg == exactly(expected)


def test_what_associates_with_ignored_truth_counts_neither_way():
    truth = [[0, 0, 4, 0], [0, 1, 4, 1]]
    detected = [[0, 0, 2, 0], [0, 1, 3, 1], [-2, 1, 1, 1]]
    totals = score(detected, truth, in_use=[True, False])
    assert totals.detected_length == exactly(4)  # 2 on the face in use, 2 that overhang the ignored one
    assert totals.precision == exactly(0.5)
    assert totals.recall == exactly(0.5)
    assert totals.overlap == exactly(0)
    assert (totals.detected_ends, totals.truth_ends) == (2, 2)


def test_a_plan_of_ignored_faces_alone_has_no_precision():
    totals = score([[0, 1, 3, 1]], [[0, 0, 4, 0], [0, 1, 4, 1]], in_use=[True, False])
    assert totals.precision is None
    assert (totals.recall, totals.f) == (0, 0)


def test_an_ignored_face_still_attracts():
    truth = [[0, 0.2, 4, 0.2], [0, 0, 4, 0]]
    totals = score([[0, 0.05, 4, 0.05]], truth, in_use=[True, False])
    assert totals.detected_length == 0
    assert totals.recall == exactly(0)


@pytest.mark.parametrize(("cut", "expected"), [(4.03, 0.0), (4.05, 0.5), (4.06, 0.5)])
def test_corner_millimetres_are_no_pair(cut, expected):
    totals = score([[0, 0, cut, 0], [cut, 0, 8, 0]], [[0, 0, 4, 0], [4, 0, 8, 0]])
    assert totals.over_segmentation == exactly(expected)


@pytest.mark.parametrize(("cut", "expected"), [(0.025, 0.0), (0.035, 0.5)])
def test_or_half_of_a_short_face(cut, expected):
    # the 6 cm face needs 3 cm: 2.5 cm of the first detection are no pair, 3.5 cm are; the rest of it is the second's
    truth = [[-4, 0, 0, 0], [0, 0, 0.06, 0]]
    totals = score([[-4, 0, cut, 0], [0, 0.01, 0.06, 0.01]], truth)
    assert totals.over_segmentation == exactly(expected)


def test_pair_sums_its_parts():
    # 3 cm of one detection on the first face, hidden by a closer one, and 3 cm more: together a pair
    truth = [[0, 0.1, 0.5, 0.1], [0.03, 0, 0.47, 0]]
    totals = score([[0, 0.02, 0.5, 0.02]], truth)
    assert (totals.pairs, totals.paired_truth) == (2, 2)


def test_nothing_detected():
    totals = score([], [[0, 0, 4, 0]])
    assert totals.precision is None
    assert (totals.recall, totals.f) == (0, 0)
    for name in ("distance_error", "orientation_error_deg", "over_segmentation", "overlap", "within_15mm"):
        assert getattr(totals, name) is None
    assert totals.end_points()["5cm"] == {"precision": None, "recall": 0.0, "f": 0.0}


def test_nothing_true():
    totals = score([[0, 0, 4, 0]], [])
    assert totals.precision == 0
    assert (totals.recall, totals.f) == (None, None)


def test_overhang_below_a_millimetre_stays_in_the_detected_length():
    assert score([[0, 0, 4.0005, 0]], [[0, 0, 4, 0]]).precision == exactly(4 / 4.0005)


def chords(radius, count, turn_deg=7.5):
    angle = np.radians(turn_deg) * np.arange(count + 1)
    points = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.hstack([points[:-1], points[1:]])


@pytest.mark.parametrize("flip", [False, True])
def test_a_curved_wall_is_one_segment_and_has_no_orientation_error(flip):
    truth, detected = chords(6.0, 6), chords(6.02, 6)
    if flip:  # the chords of a truth need not all run the same way
        truth[::2] = truth[::2][:, [2, 3, 0, 1]]
    one = score(detected, truth, curves=np.zeros(6, dtype=int))
    assert (one.pairs, one.paired_truth) == (1, 1)
    assert one.over_segmentation == exactly(0)
    assert one.orientation_error_deg is None
    assert one.recall > 0.99
    six = score(detected, truth)
    assert six.over_segmentation == exactly(5)


def test_beside_a_curved_wall_straight_ones_keep_their_orientation_error():
    truth = np.vstack([chords(6.0, 6), [[20, 0, 24, 0]]])
    detected = np.vstack([chords(6.0, 6, 7.4), [[20, 0, 24, 0.04]]])
    totals = score(detected, truth, curves=np.array([0] * 6 + [-1]))
    assert totals.orientation_error_deg == exactly(math.degrees(math.atan(0.01)))


@pytest.mark.parametrize(
    ("segments", "why"),
    [
        (chords(6.0, 2), "two chords are not three"),
        (chords(6.0, 4, 15.5), "too sharp a turn"),
        (chords(600.0, 4, 0.15), "hardly a turn"),
        (chords(6.0, 4) + np.array([[0.0], [0.002], [0.0], [0.002]]), "not joined"),
    ],
)
def test_what_is_no_curved_wall(segments, why):
    totals = score(segments, segments)
    assert totals.orientation_error_deg == exactly(0), why
    assert totals.paired_truth == len(segments), why


def test_a_change_of_sense_ends_a_curved_wall():
    there = chords(6.0, 4)
    back = 2 * there[-1, 2:] - there.reshape(-1, 2)[::-1]  # turned about the end: the bend goes on in the other sense
    totals = score(np.vstack([there, back.reshape(-1, 4)]), np.vstack([there, back.reshape(-1, 4)]))
    assert totals.paired_truth == 2
    assert totals.pairs == 8


def test_end_points_are_assigned_for_the_least_sum_of_squares():
    totals = score([[0, 0, 3.93, 0]], [[0.04, 0, 4, 0]])
    assert totals.matched_ends == (1, 2, 2)
    assert totals.end_points()["5cm"] == {"precision": 0.5, "recall": 0.5, "f": 0.5}
    # the coincident ends stay apart: 50² + 100² is less than 0² + 150²
    far = score([[-50, 0, 0, 0]], [[0, 0, 100, 0]])
    assert far.matched_ends == (0, 0, 0)


def test_end_points_among_many_agree_with_the_dense_assignment(monkeypatch):
    rng = np.random.default_rng(3)
    start = np.stack(np.meshgrid(np.arange(10.0), np.arange(10.0)), axis=-1).reshape(-1, 2) * 3
    truth = np.hstack([start, start + np.array([1.5, 0])])
    detected = truth + rng.normal(0, 0.04, truth.shape)
    dense = score(detected, truth).matched_ends
    monkeypatch.setattr("asbuilt.evaluate.end_points.MAX_DENSE_PAIRS", 0)
    assert score(detected, truth).matched_ends == dense


def test_totals_are_pooled_by_adding():
    first, second = score([[0, 0, 1, 0]], [[0, 0, 1, 0]]), score([[0, 5, 9, 5]], [[0, 0, 9, 0]])
    pooled = first + second
    assert pooled.precision == exactly(0.1)
    assert pooled.recall == exactly(0.1)


def test_json_has_no_value_where_there_is_none():
    report = score([], [[0, 0, 4, 0]]).to_json()
    assert report["precision"] is None
    assert report["recall"] == 0
    assert report["totals"]["truth_length"] == 4


# --- properties ---------------------------------------------------------------------------------------------------


def random_plan(rng, count=25):
    start = rng.uniform(0, 12, (count, 2))
    angle = rng.uniform(0, 2 * np.pi, count)
    step = rng.uniform(0.3, 5, count)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    truth = np.hstack([start, start + step])
    return truth + rng.normal(0, 0.03, truth.shape), truth


def parallel_faces(rng, count=12):
    """Parallel faces a metre apart in any direction, and detections along a stretch of each, up to 20 cm beside it."""
    direction = rng.uniform(0, np.pi)
    along, across = np.array([np.cos(direction), np.sin(direction)]), np.array([-np.sin(direction), np.cos(direction)])
    begin, length = rng.uniform(-5, 5, count), rng.uniform(1, 8, count)
    row = np.arange(count)[:, None] * across
    truth = np.hstack([row + begin[:, None] * along, row + (begin + length)[:, None] * along])
    share = np.sort(rng.uniform(-0.2, 1.2, (count, 2)), axis=1)
    share[:, 1] += 0.1
    offset = rng.uniform(0, 0.2, count)[:, None] * across
    span = begin[:, None] + share * length[:, None]
    detected = np.hstack([row + offset + span[:, :1] * along, row + offset + span[:, 1:] * along])
    return detected, truth, along, across


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_a_plan_against_itself_is_perfect(seed):
    rng = np.random.default_rng(seed)
    perfect = {"precision": 1, "recall": 1, "f": 1, "distance_error": 0, "orientation_error_deg": 0}
    perfect |= {"over_segmentation": 0, "overlap": 0, "within_15mm": 1}
    for truth in (parallel_faces(rng)[1], random_plan(rng)[1]):
        totals = score(truth, truth)
        assert figures(totals) == pytest.approx(perfect, abs=EXACT)
        assert totals.matched_ends == (2 * len(truth),) * 3


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_rotating_and_moving_both_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    detected, truth = random_plan(rng)
    angle, shift = rng.uniform(0, 2 * np.pi), rng.uniform(-1000, 1000, 2)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    moved = [((array.reshape(-1, 2) @ turn) + shift).reshape(-1, 4) for array in (detected, truth)]
    assert figures(score(*moved)) == pytest.approx(figures(score(detected, truth)), abs=1e-8)
    assert score(*moved).matched_ends == score(detected, truth).matched_ends


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_order_and_direction_do_not_matter(seed):
    rng = np.random.default_rng(seed)
    detected, truth = random_plan(rng)
    shuffled = []
    for array in (detected, truth):
        array = rng.permutation(array)
        back = rng.random(len(array)) < 0.5
        array[back] = array[back][:, [2, 3, 0, 1]]
        shuffled.append(array)
    assert figures(score(*shuffled)) == pytest.approx(figures(score(detected, truth)), abs=EXACT)


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_splitting_changes_over_segmentation_only(seed):
    rng = np.random.default_rng(seed)
    detected, truth, along, _ = parallel_faces(rng)
    # a piece shorter than the least overlap would have rules of its own, so cut well inside both
    low = np.maximum((detected[:, :2] * along).sum(axis=1), (truth[:, :2] * along).sum(axis=1))
    high = np.minimum((detected[:, 2:] * along).sum(axis=1), (truth[:, 2:] * along).sum(axis=1))
    length = np.hypot(*(detected[:, 2:] - detected[:, :2]).T)
    inside = (low + high) / 2 - (detected[:, :2] * along).sum(axis=1)
    can = high - low > 0.15
    cut = detected[:, :2] + (inside / length)[:, None] * (detected[:, 2:] - detected[:, :2])
    pieces = np.vstack(
        [detected[~can], np.hstack([detected[can, :2], cut[can]]), np.hstack([cut[can], detected[can, 2:]])]
    )
    whole, split = score(detected, truth), score(pieces, truth)
    unchanged = ("over_segmentation",)
    assert figures(split, unchanged) == pytest.approx(figures(whole, unchanged), abs=EXACT)
    assert split.pairs == whole.pairs + can.sum()


@settings(max_examples=30, deadline=None)
@given(seeds, st.floats(0, 0.29))
def test_a_perpendicular_shift_changes_the_distance_error_by_as_much(seed, shift):
    # faces stand a metre apart and detections up to 20 cm beside them: shifted they stay within half of that
    detected, truth, _, across = parallel_faces(np.random.default_rng(seed))
    shifted = detected + np.tile(shift * across, 2)
    before, after = (score(lines, truth, max_distance=0.5) for lines in (detected, shifted))
    assert after.distance_error == pytest.approx(before.distance_error + shift, abs=EXACT)
    unchanged = ("distance_error", "within_15mm")
    assert figures(after, unchanged) == pytest.approx(figures(before, unchanged), abs=EXACT)


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_swapping_plan_and_truth_swaps_precision_and_recall(seed):
    detected, truth, _, _ = parallel_faces(np.random.default_rng(seed))
    there, back = score(detected, truth), score(truth, detected)
    assert back.precision == pytest.approx(there.recall, abs=EXACT)
    assert back.recall == pytest.approx(there.precision, abs=EXACT)
    assert back.f == pytest.approx(there.f, abs=EXACT)
    assert back.distance_error == pytest.approx(there.distance_error, abs=EXACT)
