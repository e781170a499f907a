"""The USIBD Level of Accuracy: the bands in which the faces' errors fall at 95 % confidence (not in the paper).

LOA10 is above 5 cm, LOA20 up to 5 cm, LOA30 up to 15 mm, LOA40 up to 5 mm, LOA50 up to 1 mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from asbuilt.evaluate.drawing import Floats
from asbuilt.evaluate.measures import length_within, ratio
from asbuilt.plan import LOA_BANDS, loa_band

#: Share of the errors that must lie within a band's limit.
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Offsets:
    """Stretches of associated length with the signed distance to the truth's line at both ends, shape (n,) each, m."""

    length: Floats
    start: Floats
    end: Floats

    @classmethod
    def join(cls, parts: Sequence[Offsets]) -> Offsets:
        """All stretches of several storeys in one; empty arrays for none."""
        if not parts:
            return cls(np.zeros(0), np.zeros(0), np.zeros(0))
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("length", "start", "end")))

    def length_within(self, limit: float) -> float:
        """Length on which the distance, taken pointwise, is at most `limit`, m."""
        return float(length_within(self.length, self.start, self.end, limit).sum())

    def percentile(self, share: float = CONFIDENCE) -> float | None:
        """The distance within which `share` of the length lies, taken pointwise, m; None without length."""
        total = float(self.length.sum())
        if total <= 0:
            return None
        low, high = 0.0, float(np.abs(np.concatenate([self.start, self.end])).max())
        # the length within a distance grows with it, so halving finds it; to a hundredth of a micrometre
        while high - low > 1e-8:
            middle = (low + high) / 2
            if self.length_within(middle) >= share * total:
                high = middle
            else:
                low = middle
        return high

    def to_json(self) -> dict[str, Any]:
        """Distance at 95 % (m), the plan's band, and the share of the length in each band; None where undefined."""
        total = float(self.length.sum())
        distance = self.percentile()
        within = {band: self.length_within(limit) for band, limit in LOA_BANDS.items() if np.isfinite(limit)}
        within["LOA10"] = total
        bands, before = {}, 0.0
        for band, length in within.items():
            bands[band] = ratio(max(length - before, 0.0), total)
            before = length
        return {
            "distance_95": distance,
            "band": None if distance is None else loa_band(distance),
            "bands": bands,
        }
