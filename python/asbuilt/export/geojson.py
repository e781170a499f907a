"""The native plan file. What it holds is said in `asbuilt.plan`; here it only becomes text."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asbuilt.plan import FloorPlan

if TYPE_CHECKING:
    from asbuilt.evidence import Evidence


def write(plan: FloorPlan, path: Path, evidence: Evidence | None = None) -> None:
    """Write `plan` as GeoJSON: one line a feature, so that two plans can be compared line by line."""
    collection = plan.to_geojson()
    features = ",\n".join(_json(feature) for feature in collection.pop("features"))
    head = _json(collection, indent=1).removesuffix("\n}")
    path.write_text(f'{head},\n "features": [\n{features}\n ]\n}}\n', encoding="utf-8")


def _json(value: Any, indent: int | None = None) -> str:
    return json.dumps(value, indent=indent, ensure_ascii=False, allow_nan=False, default=_plain)


def _plain(value: Any) -> Any:
    """Numbers that NumPy computed, as Python's own."""
    if hasattr(value, "item"):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no place in a plan file")
