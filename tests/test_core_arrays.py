"""The core reads arrays row by row, however they lie in memory."""

from __future__ import annotations

import numpy as np

from asbuilt import _core


def test_arrays_that_lie_column_by_column() -> None:
    random = np.random.default_rng(3)
    cells = random.integers(-20, 20, (60, 3)).astype(np.int32)
    points, filled = random.random((60, 3)), random.random((9, 5)) < 0.4
    for ask in (
        lambda order: _core.in_company(order(cells), 1, 2),
        lambda order: _core.patches_of(order(filled)),
        lambda order: _core.means_along(order(points), np.array([0, 25, 60]), 3),
    ):
        np.testing.assert_array_equal(ask(np.array), ask(np.asfortranarray))
